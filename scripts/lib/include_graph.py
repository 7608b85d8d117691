"""Checks the structure that the sources' own includes draw: no cycle of modules, no room with too many doors.

usage: include_graph.py ROOT_FOLDER...   (from the top of the tree)
A module is a header and the source of its name. A room is a folder; its doors are the files and folders in it."""
import collections
import os
import re
import sys

MOST_DOORS = 24
INCLUDE = re.compile(r'^ *# *include *"([^"]+)"', re.M)


def sources(folders):
    for folder in folders:
        for path, _, names in sorted(os.walk(folder)):
            yield from (os.path.join(path, name) for name in sorted(names) if name.endswith((".h", ".cpp")))


def resolve(name, file, known):
    """The file that an include in quotes names: beside the including file, or below one of the roots."""
    roots = [os.path.dirname(file), "", "libisohf", "libisohf/include", "apps/common"]
    roots += ["/".join(file.split("/")[:2])] if file.startswith("apps/") else []
    return next((path for path in (os.path.normpath(os.path.join(root, name)) for root in roots) if path in known), None)


def cycles(graph):
    """Strongly connected components of more than one module (Tarjan)."""
    index, low, stack, found = {}, {}, [], []

    def visit(module):
        index[module] = low[module] = len(index)
        stack.append(module)
        for other in sorted(graph[module]):
            if other not in index:
                visit(other)
                low[module] = min(low[module], low[other])
            elif other in stack:
                low[module] = min(low[module], index[other])
        if low[module] == index[module]:
            component = stack[stack.index(module):]
            del stack[-len(component):]
            if len(component) > 1:
                found.append(sorted(component))

    sys.setrecursionlimit(10000)
    for module in sorted(graph):
        if module not in index:
            visit(module)
    return found


def main(folders):
    files = set(sources(folders))
    graph = collections.defaultdict(set)
    for file in sorted(files):
        module = os.path.splitext(file)[0]
        graph[module]
        with open(file, encoding="utf-8") as opened:
            for name in INCLUDE.findall(opened.read()):
                other = resolve(name, file, files)
                if other and os.path.splitext(other)[0] != module:
                    graph[module].add(os.path.splitext(other)[0])
    for component in cycles(graph):
        print("include cycle: " + ", ".join(component))
    for folder in folders:
        for path, rooms, names in os.walk(folder):
            doors = len(rooms) + len([name for name in names if not name.startswith(".")])
            if doors > MOST_DOORS:
                print(f"{path}: {doors} files and folders, {MOST_DOORS} are the most")


main(sys.argv[1:])
