"""An extracted part has every sample of the source on its tiles, edges and corners included: rows and columns that lie
on a tile's edge by a last bit have elevations in the parts on both sides, those of the whole archive."""
import itertools
import math

from first_hour import check, isohf, near, read_npy, real, sample, write_hgt, write_tiff


def hills(column, row):
    return round(900.0 + 400.0 * math.sin(column / 11.0) * math.cos(row / 13.0) + 3.0 * column)


def exported(archive, *options):
    said = isohf("export", archive, "e.npy", "--overwrite", "--json", "--type", "f64", *options).json()
    return said, read_npy("e.npy")[2]


def cuts_hold(source, name, cuts, *options):
    """Each cut of tiles has all samples that the whole has on them, on the triangles to the rounding of places, by
    splines without voids. Returns how many samples lie on an edge of tiles."""
    isohf("convert", source, "-o", "whole.isohf", "--overwrite", "-q", *options)
    metadata = isohf("info", "whole.isohf", "--json").json()["metadata"]
    extent = [metadata["extent"]["x"], metadata["extent"]["z"]]
    tiles = [metadata["tiles"]["columns"], metadata["tiles"]["rows"]]
    whole, all_heights = exported("whole.isohf", "--method", "barycentric")
    width = whole["width"]
    places = [(whole["first_sample"][axis], whole["spacing"][axis], whole[count])
              for axis, count in (("x", "width"), ("z", "height"))]
    on_edges = 0
    for cut in cuts:
        first = [min(cut[0], tiles[0] - 1), min(cut[1], tiles[1] - 1)]
        end = [min(cut[2], tiles[0]), min(cut[3], tiles[1])]
        isohf("extract", "whole.isohf", "-o", "part.isohf", "--overwrite", "-q", "--tiles",
              f"{first[0]}:{end[0]},{first[1]}:{end[1]}")
        inside = []
        for axis in (0, 1):
            start, spacing, count = places[axis]
            low, high = first[axis] * extent[axis], end[axis] * extent[axis]
            some = [i for i in range(count) if low - 1e-9 * spacing <= start + i * spacing <= high + 1e-9 * spacing]
            on_edges += sum(1 for i in some if min(start + i * spacing - low, high - start - i * spacing) < 1e-6)
            inside.append(some)
        part, heights = exported("part.isohf", "--method", "barycentric")
        check((part["width"], part["height"]) == (len(inside[0]), len(inside[1])),
              f"{name} {cut}: {part['width']}x{part['height']}, must be {len(inside[0])}x{len(inside[1])}")
        expected = [all_heights[row * width + column] for row in inside[1] for column in inside[0]]
        for found, there in zip(heights, expected):
            check(math.isnan(found) == math.isnan(there) and not abs(found - there) > 1e-8,
                  f"{name} {cut}: {found}, {there}")
        splines = isohf("export", "part.isohf", "e.npy", "--overwrite", "--json").json()
        check(splines["voids"] == sum(map(math.isnan, expected)), f"{name} {cut}: {splines['voids']} voids")
        # The corners, as `sample` finds them in both.
        corners = [(x * extent[0], z * extent[1]) for x in (first[0], end[0]) for z in (first[1], end[1])]
        shifted = [(x - first[0] * extent[0], z - first[1] * extent[1]) for x, z in corners]
        for found, there in zip(sample("part.isohf", shifted), sample("whole.isohf", corners)):
            if not (math.isnan(found) and math.isnan(there)):
                near(found, there, 1e-5, f"{name} {cut}: at a corner")
    return on_edges


every = [(c, r, c + w, r + h) for c, r in itertools.product(range(3), range(4)) for w, h in ((1, 1), (2, 3))]
some = every[::5]
# Posts of degrees, whose tiles end on them; posts and areas of a map, offsets that are no binary fractions.
tile = write_tiff("degrees.tif", 241, 241, hills, west=6.0, north=45.0, spacing=1.0 / 240.0, epsg=4326, point=True)
check(cuts_hold(tile, "posts in degrees", every, "--shape", "44x67", "--fit") > 10, "no post lies on an edge of tiles")
posts = write_tiff("posts.tif", 161, 111, hills, west=300000.1, north=5100000.7, spacing=30.1, epsg=32632, point=True)
check(cuts_hold(posts, "posts in metres", some, "--shape", "44x67", "--fit") > 10, "no post lies on an edge of tiles")
areas = write_tiff("areas.tif", 210, 150, hills, west=300000.1, north=5100000.7, spacing=29.7, epsg=32632)
cuts_hold(areas, "areas in metres", some, "--shape", "44x67", "--fit")
globe = write_tiff("globe.tif", 240, 120, hills, west=-180.0, north=90.0, spacing=1.5, epsg=4326)
cuts_hold(globe, "a joined globe", some, "--wrap-x", "--shape", "44x67", "--fit")

# Two tiles of SRTM, as they were found: the whole top row, and what is sampled there.
names = [write_hgt(f"N44E00{n}.hgt", height=lambda column, row: 800 + column // 8 + row // 9) for n in (6, 7)]
for sources in (names, [real("N44E006.hgt"), real("N44E007.hgt")]):
    if sources[0] is None:
        continue
    isohf("convert", *sources, "-o", "a.isohf", "--overwrite", "-q", "--fit")
    isohf("extract", "a.isohf", "-o", "e.isohf", "--overwrite", "-q", "--bbox", "6.5,44.2,6.8,44.4")
    said = isohf("export", "e.isohf", "e.tif", "--overwrite", "--json").json()
    check((said["width"], said["voids"], said["sample_type"]) == (533, 0, "int16"), f"an extract: {said}")
    edge = [(6.5 + 0.01 * i, 44.5) for i in range(25)]
    found, expected = sample("e.isohf", edge, "--in", "lonlat"), sample("a.isohf", edge, "--in", "lonlat")
    check(found == expected, f"samples of an extract's top edge are {found}, must be {expected}")

# A part of a projected archive gives the source's own samples on it.
isohf("convert", tile, "-o", "utm.isohf", "--to-crs", "utm", "--shape", "44x67", "-q")
isohf("extract", "utm.isohf", "-o", "part.isohf", "--overwrite", "-q", "--bbox", "6.3,44.4,6.5,44.7")
isohf("export", "part.isohf", "part.tif", "--type", "f64", "-q")
isohf("export", "part.isohf", "part.npy", "--type", "f64", "-q")
isohf("export", "utm.isohf", "like.npy", "--type", "f64", "-q", "--like", "part.tif")
isohf("export", "utm.isohf", "utm.tif", "-q")
part, all_of_it = (isohf("info", name, "--json").json() for name in ("part.tif", "utm.tif"))
for axis in "xy":
    steps = (part["origin"][axis] - all_of_it["origin"][axis]) * 240.0
    near(steps, round(steps), 1e-6, "an extract of a projected archive lies on the source's grid")
columns, rows, found = read_npy("part.npy")
check(columns < 241 and rows < 241, f"an extract of a projected archive has {columns}x{rows} samples")
inside = [(a, b) for a, b in zip(found, read_npy("like.npy")[2]) if not math.isnan(a)]
check(len(inside) > 0.8 * len(found), f"{len(inside)} of {len(found)} samples have elevations")
near(max(abs(a - b) for a, b in inside), 0.0, 1e-4, "an extract of a projected archive")
