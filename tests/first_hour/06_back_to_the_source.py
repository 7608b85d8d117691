"""`export` without options returns to its source: grid, size, reference system and sample type, whatever the archive
was projected to. Samples farther apart than the source's are means of areas, not points."""
import array
import math

from first_hour import FOLDER, check, isohf, near, read_npy, real, refuses, write_hgt, write_tiff


def placed(raster):
    """What a raster says of its grid."""
    info = isohf("info", raster, "--json").json()
    found = {key: info[key] for key in ("width", "height", "sample_type", "unit", "registration")}
    return found | {"epsg": info["crs"]["epsg"], "body": info["body"]["name"], "numbers": [
        info["origin"]["x"], info["origin"]["y"], info["spacing"]["x"], info["spacing"]["y"]]}


def returns(source, name, *options, like=None):
    """Converts and exports without options; the grid must be the source's, or that of `like`. Elevations of both."""
    isohf("convert", source, "-o", "a.isohf", "--overwrite", "-q", *options)
    kind = isohf("info", "a.isohf", "--json").json()["metadata"]["projection"]["kind"]
    check(kind != "equirectangular", f"{name}: is not projected")
    isohf("export", "a.isohf", "back.tif", "--overwrite", "-q")
    found, expected = placed("back.tif"), placed(like or source)
    for here, there in zip(found.pop("numbers"), expected.pop("numbers")):
        near(here, there, 1e-12 * max(abs(there), 1.0), f"{name}: place")
    check(found == expected, f"{name}: is {found}, must be {expected}")


def samples_of(archive, *options):
    isohf("export", archive, "samples.npy", "--overwrite", "-q", *options)
    return read_npy("samples.npy")


def rms(found, expected):
    pairs = [(a, b) for a, b in zip(found, expected) if not math.isnan(a)]
    return math.sqrt(sum((a - b) ** 2 for a, b in pairs) / len(pairs))


def hills(column, row):
    return 900.0 + 500.0 * math.sin(column / 19.0) * math.cos(row / 17.0) + 90.0 * math.sin((column + 2.0 * row) / 23.0)


def whole(column, row):
    return round(hills(column, row))


def hgt_numbers(path):
    numbers = array.array("h", path.read_bytes())
    numbers.byteswap()
    return numbers


# A tile of SRTM with a hole, in and out as .hgt.
def holed(column, row):
    return -32768 if 500 <= column < 520 and 700 <= row < 730 else hills(column, row)


source = write_hgt("N44E006.hgt", height=holed)
numbers = hgt_numbers(source)
(FOLDER / "out").mkdir()
returns(source, "utm", "--to-crs", "utm")
measured = isohf("verify", "a.isohf", "--against", source, "--json").json()["against"]
isohf("export", "a.isohf", "out/N44E006.hgt", "-q")
back = hgt_numbers(FOLDER / "out" / "N44E006.hgt")
check(len(back) == len(numbers), f"utm: {len(back)} samples")
both = [(a, b) for a, b in zip(back, numbers) if -32768 not in (a, b)]
# Rounding to whole metres adds 0.29 at most to what is measured, in squares.
error = rms(*zip(*both))
check(error <= math.hypot(measured["rms"], 0.29) + 0.01, f"utm: rms {error}, verify measures {measured['rms']}")
# The surface reaches less than a step of the lattice into nodata, and no valid sample loses it.
lost = sum(1 for a, b in zip(back, numbers) if a == -32768 and b != -32768)
check(lost == 0, f"utm: {lost} samples are lost")
holes = sum(1 for a in back if a == -32768)
check(600 - 100 <= holes <= 600, f"utm: {holes} of 600 nodata come back")

# Every kind, both registrations, types of all kinds, and systems of the source that are none of degrees.
for kind, point, code in (("lambert-conformal", False, "f"), ("local", True, "h"), ("polar-stereographic", False, "H"),
                          ("transverse-mercator:3", True, "B"), ("utm:31N", False, "d"), ("EPSG:3035", False, "i")):
    def ground(column, row):
        return hills(column, row) / (8.0 if code == "B" else 1.0)
    tiff = write_tiff("g.tif", 150, 90, ground if code in "fd" else lambda x, y: round(ground(x, y)), code, west=2.0,
                      north=50.0, spacing=0.02, epsg=4326, point=point)
    returns(tiff, kind, "--to-crs", kind)
    columns, rows, found = samples_of("a.isohf")
    check((columns, rows) == (150, 90), f"{kind}: {columns}x{rows}")
    near(rms(found, [ground(x, y) for y in range(90) for x in range(150)]), 0.0, 1.5, f"{kind}: rms")
    check(not any(math.isnan(z) for z in found), f"{kind}: has voids")
metres = write_tiff("m.tif", 120, 100, whole, west=400000.0, north=5400000.0, spacing=250.0, epsg=32631)
for system in ("EPSG:2154", "local", "EPSG:32632"):
    returns(metres, system, "--to-crs", system)
    near(rms(samples_of("a.isohf")[2], [hills(x, y) for y in range(100) for x in range(120)]), 0.0, 1.5, system)
    like = samples_of("a.isohf", "--like", metres)[2]
    check(like == samples_of("a.isohf")[2], f"{system}: --like the source differs")
# A cap that goes all the way round, which becomes a polar map by itself, and the planet's own.
cap = write_tiff("cap.tif", 360, 30, whole, west=-180.0, north=90.0, spacing=1.0, epsg=4326)
returns(cap, "a polar cap")
check(not any(z == -32768 for z in samples_of("a.isohf")[2]), "a polar cap: has voids")
mars = real("megt90n000cb.lbl")
if mars:
    isohf("convert", mars, "-o", "box.isohf", "--bbox", "0,60,360,90", "--to-crs", "equirectangular", "-q")
    isohf("export", "box.isohf", "box.tif", "-q")
    returns(mars, "Mars", "--bbox", "0,60,360,90", like="box.tif")

# Options speak of the source's coordinates; the archive's own map is there for whoever wants it.
tiff = write_tiff("g.tif", 150, 90, whole, west=2.0, north=50.0, spacing=0.02, epsg=4326)
isohf("convert", tiff, "-o", "a.isohf", "--to-crs", "lambert-conformal", "--overwrite", "-q")
all_columns, _, everything = samples_of("a.isohf")
columns, rows, part = samples_of("a.isohf", "--bbox", "2.4,48.8,3,49.4")
check((columns, rows) == (30, 30), f"--bbox: {columns}x{rows}, must be 30x30")
check(part == [everything[(30 + y) * all_columns + 20 + x] for y in range(30) for x in range(30)], "--bbox: differs")
half = isohf("export", "a.isohf", "half.tif", "--size", "75x45", "--json").json()
near(half["first_sample"]["x"], 2.02, 1e-9, "--size: first longitude")
near(half["spacing"]["z"], 0.04, 1e-12, "--size: spacing in degrees")
tiles = isohf("export", "a.isohf", "tile.tif", "--tile-size", "50x45", "--json").json()
check(tiles["files"] == 6, f"--tile-size: {tiles['files']} files")
near(placed("tile_x2_y1.tif")["numbers"][0], 2.0 + 0.02 * 100.5, 1e-9, "the last tile's longitude")
near(placed("tile_x2_y1.tif")["numbers"][1], 50.0 - 0.02 * 45.5, 1e-9, "the last tile's latitude")
own = isohf("export", "a.isohf", "own.tif", "--to-crs", "none", "--json").json()
check(own["method"] == "hex" and placed("own.tif")["unit"] == "metre", "--to-crs none: is not the archive's map")
refuses("export", "a.isohf", "no.tif", "--method", "hex", words=["--method barycentric", "--to-crs none"], code=2)
isohf("extract", "a.isohf", "-o", "part.isohf", "--bbox", "2.4,48.8,3,49.4")
isohf("export", "part.isohf", "part.tif", "--type", "f64", "-q")
isohf("export", "a.isohf", "like.tif", "--like", "part.tif", "--type", "f64", "-q")
found = placed("part.tif")
near((found["numbers"][0] - 2.01) / 0.02 % 1.0 % 0.999999, 0.0, 1e-6, "an extract's samples lie on the source's grid")

# Coarser rasters are means: here every second sample of a raster of stripes would be all high or all low.
def stripes(column, row):
    return 1000 + 200 * (column % 2) + 0 * row


area = write_tiff("stripes.tif", 240, 240, stripes, west=500000.0, north=5000000.0, spacing=30.0, epsg=32632)
isohf("convert", area, "-o", "s.isohf", "-q")
for size, method in (("120x120", "average"), ("24x240", "average"), ("160x160", "average"), ("240x240", "hex"),
                     ("180x180", "hex"), ("480x480", "hex")):
    said = isohf("export", "s.isohf", "s.npy", "--size", size, "--overwrite", "--json").json()
    check(said["method"] == method, f"--size {size}: by {said['method']}, must be by {method}")
    if size in ("120x120", "24x240"):
        near(rms(read_npy("s.npy")[2], [1100.0] * 1000000), 0.0, 12.0, f"--size {size}: mean of the stripes")
points = samples_of("s.isohf", "--size", "120x120", "--method", "hex")[2]
check(max(points) - min(points) < 220, "--method hex takes points")
flat = write_tiff("hills.tif", 600, 600, lambda x, y: round(900 + 60 * math.sin(x / 2.3) + 60 * math.cos(y / 1.9)),
                  west=0.0, north=0.0, spacing=10.0, epsg=32632)
isohf("convert", flat, "-o", "h.isohf", "-q")
said = isohf("export", "h.isohf", "h.npy", "--size", "2x2", "--json").json()
check(said["method"] == "plane", f"300 samples apart: by {said['method']}, must be by plane")
# Points of waves of 60 are off by 60 and more.
exact = samples_of("h.isohf", "--size", "2x2", "--method", "average")[2]
near(rms(read_npy("h.npy")[2], exact), 0.0, 3.0, "means on a plane")

# A globe whose last column is its first one again has all its columns back, joined or left open.
globe = write_tiff("globe.tif", 73, 37, lambda x, y: round(900 + 500 * math.sin(math.radians(5 * x)) * math.cos(y / 6.0)),
                   west=-180.0, north=90.0, spacing=5.0, epsg=4326, point=True)
for options in ((), ("--no-wrap",), ("--lossless",)):
    isohf("convert", globe, "-o", "globe.isohf", "--overwrite", "-q", *options)
    isohf("export", "globe.isohf", "round.tif", "--overwrite", "-q")
    check(placed("round.tif") == placed(globe), f"a globe {options}: {placed('round.tif')}, must be {placed(globe)}")
    report = isohf("verify", "globe.isohf", "--against", globe, "--json").json()
    check(report["passed"], f"a globe {options}: {report}")
_, _, heights = samples_of("globe.isohf")
check(heights[0:73 * 37:73] == heights[72:73 * 37:73], "the last column is not the first one again")
