#!/usr/bin/env python3
"""check_obj.py MESH.obj: fails unless the mesh has no crack, which is an edge inside its rectangle with one triangle."""
import collections
import sys

positions, edges = [], collections.Counter()
for line in open(sys.argv[1]):
    kind, *words = line.split()
    if kind == "v":
        positions.append(tuple(float(word) for word in words))
    if kind == "f":
        corners = [positions[int(word.split("//")[0]) - 1] for word in words]
        for start, end in zip(corners, corners[1:] + corners[:1]):
            edges[start, end] += 1

corners = [[of(position[axis] for position in positions) for of in (min, max)] for axis in (0, 2)]


def is_border(start, end):
    return any(start[axis] == end[axis] == side for axis, sides in zip((0, 2), corners) for side in sides)


open_edges = {edge for edge, count in edges.items() if edges[edge[1], edge[0]] != count}
cracks = [edge for edge in open_edges if not is_border(*edge)]
if not edges or not any(is_border(*edge) for edge in open_edges):
    sys.exit("the mesh has no border")
if cracks:
    sys.exit(f"{len(cracks)} edges have one triangle, {cracks[0]} for one")
print(f"no crack among {len(edges)} edges")
