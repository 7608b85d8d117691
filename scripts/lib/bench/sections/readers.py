"""Every reader against GDAL's for the same file: all samples read, and a figure of them."""

import struct

from harness import Bench

# What GDAL is asked for: a sum over all samples, or a copy of them in memory. The quicker one counts.
GDAL = {"gdalinfo -checksum": lambda path: ["gdalinfo", "-checksum", path],
        "gdal_translate -of MEM": lambda path: ["gdal_translate", "-q", "-of", "MEM", path, "copy"]}
DEGREE = ["-a_srs", "EPSG:4326", "-a_ullr"]
PDS3 = """PDS_VERSION_ID = PDS3\r
RECORD_TYPE = FIXED_LENGTH\r
RECORD_BYTES = {row_bytes}\r
FILE_RECORDS = {records}\r
LABEL_RECORDS = 1\r
^IMAGE = 2\r
OBJECT = IMAGE\r
 LINES = {side}\r
 LINE_SAMPLES = {side}\r
 SAMPLE_TYPE = MSB_INTEGER\r
 SAMPLE_BITS = 16\r
END_OBJECT = IMAGE\r
END\r
"""


def write_pds3(path, hgt, side):
    """The same big-endian samples behind a label."""
    label = PDS3.format(row_bytes=2 * side, records=side + 1, side=side).encode()
    path.write_bytes(label.ljust(2 * side) + hgt.read_bytes())


def make_inputs(bench: Bench, side):
    """One terrain in every format, as GDAL writes it where it does; names and paths."""
    land = bench.terrain(f"{side}x{side}")
    folder = bench.work / f"readers_{side}"
    folder.mkdir(exist_ok=True)
    half = 0.5 / (side - 1)
    posts = [*DEGREE, 6 - half, 46 + half, 7 + half, 45 - half]
    fractions = ["-ot", "Float32", "-scale", "0", "1000", "0", "313.7"]
    made = {
        "ESRI ASCII grid, whole numbers": ("whole.asc", ["-of", "AAIGrid"]),
        "ESRI ASCII grid, fractions": ("fractions.asc", ["-of", "AAIGrid", "-co", "DECIMAL_PRECISION=3", *fractions]),
        "USGS DEM": ("land.dem", ["-of", "USGSDEM", *DEGREE, 6, 46, 7, 45]),
        "GridFloat": ("floats.flt", ["-of", "EHdr", *fractions]),
        "EHdr .bil": ("land.bil", ["-of", "EHdr"]),
        "DTED": ("n45_e006.dt2" if side == 3601 else "n45_e006.dt1", ["-of", "DTED", *posts]),
        "SRTM HGT": ("N45E006.hgt", ["-of", "SRTMHGT", *posts]),
        "ISIS3 cube": ("land.cub", ["-of", "ISIS3"]),
        "PNG, 16 bits": ("land.png", ["-of", "PNG", "-ot", "UInt16"]),
        "GeoTIFF, tiles, Deflate": ("tiles.tif", ["-co", "TILED=YES", "-co", "COMPRESS=DEFLATE", "-co", "PREDICTOR=2"]),
        "GeoTIFF, strips, Deflate, floats": ("deflated.tif", ["-co", "COMPRESS=DEFLATE", "-co", "PREDICTOR=3", *fractions]),
        "GeoTIFF, strips, plain": ("plain.tif", []),
    }
    paths = {}
    for name, (file, options) in made.items():
        paths[name] = folder / file
        if not paths[name].exists():
            bench.run("gdal_translate", "-q", *options, land, paths[name])
        paths[name].with_name(file + ".aux.xml").unlink(missing_ok=True)
    paths["PDS3"] = folder / "land.img"
    write_pds3(paths["PDS3"], paths["SRTM HGT"], side)
    return paths


def measure(bench):
    side = 1201 if bench.options.small else 3601
    rounds = bench.options.rounds
    rows, results = [], {}
    for name, path in make_inputs(bench, side).items():
        jobs = {"isohf": [bench.isohf, "info", "--stats", "--quiet", path]}
        jobs |= {what: command(path) for what, command in GDAL.items()}
        for command in jobs.values():
            bench.run(*command)  # into the file cache
        found = bench.in_turn(jobs, rounds)
        results[name] = found
        us = found["isohf"]
        wall, cpu = (min(found[what][key] for what in GDAL) for key in ("wall_s", "cpu_s"))
        megabytes = path.stat().st_size / 1e6
        rows.append([name, f"{megabytes:.0f}", f"{us['wall_s']:.3f}", f"{us['cpu_s']:.2f}", f"{us['peak_mb']:.0f}",
                     f"{wall:.3f}", f"{cpu:.2f}", f"{wall / us['wall_s']:.2f}", f"{cpu / max(us['cpu_s'], 0.01):.2f}"])
    bench.add("readers", ["format", "MB", "isohf wall s", "cpu s", "peak MB", "GDAL wall s", "cpu s", "wall ×", "cpu ×"],
              rows, f"{side} x {side} samples, medians of {rounds} rounds, {bench.machine()}, start of the program included; "
              "×: GDAL's divided by isohf's, more than 1 is quicker than GDAL. isohf: `isohf info --stats` (range, mean "
              "and voids of all samples); GDAL: the quicker of `gdalinfo -checksum` and `gdal_translate -of MEM`.")
    bench.results["readers"] = results
