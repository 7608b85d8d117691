"""10,000 small GeoTIFFs as one surface, against gdalbuildvrt with gdal_translate and gdalwarp: time, memory, handles."""

import json
import os
import pathlib
import struct
import subprocess
import time
import zlib

from harness import GDAL_OPTIONS


def write_tile(path, side, samples, x0, y0):
    """One deflated strip of int16, 30 m areas of EPSG 32632."""
    strip = zlib.compress(samples, 1)
    doubles = struct.pack("<3d6d", 30.0, 30.0, 0.0, 0.0, 0.0, 0.0, x0, y0, 0.0)
    keys = struct.pack("<16H", 1, 1, 0, 3, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, 32632)
    count = 14
    tables = 8 + 2 + 12 * count + 4
    short, long, double = 3, 4, 12
    entries = [(256, long, 1, side), (257, long, 1, side), (258, short, 1, 16), (259, short, 1, 8), (262, short, 1, 1),
               (273, long, 1, tables + len(doubles) + len(keys)), (277, short, 1, 1), (278, long, 1, side),
               (279, long, 1, len(strip)), (284, short, 1, 1), (339, short, 1, 2), (33550, double, 3, tables),
               (33922, double, 6, tables + 24), (34735, short, 16, tables + len(doubles))]
    head = b"II*\0" + struct.pack("<IH", 8, count)
    directory = b"".join(struct.pack("<HHII", *entry) for entry in entries) + struct.pack("<I", 0)
    path.write_bytes(head + directory + doubles + keys + strip)


def make_tiles(bench, across, side):
    """The tiles and, as one GeoTIFF, the whole."""
    size = across * side
    folder = bench.work / f"tiles_{across}x{side}"
    whole = bench.work / f"tiles_{across}x{side}.tif"
    if not whole.exists():
        land = bench.terrain(f"{size}x{size}")
        raw = bench.work / "tiles.raw"
        bench.run("gdal_translate", "-q", "-of", "ENVI", "-ot", "Int16", land, raw)
        folder.mkdir(exist_ok=True)
        with open(raw, "rb") as file:
            for row in range(across):
                band = memoryview(file.read(2 * size * side))
                for column in range(across):
                    samples = b"".join(band[2 * (r * size + column * side):2 * (r * size + (column + 1) * side)]
                                       for r in range(side))
                    write_tile(folder / f"t{row:03}_{column:03}.tif", side, samples, 500000.0 + 30.0 * side * column,
                               6000000.0 - 30.0 * side * row)
        part = whole.with_suffix(".part.tif")
        bench.run("gdal_translate", "-q", "-a_srs", "EPSG:32632", "-a_ullr", "500000", "6000000", 500000 + 30 * size,
                  6000000 - 30 * size, raw, part)
        part.rename(whole)
        for path in (raw, pathlib.Path(f"{raw}.aux.xml"), raw.with_suffix(".hdr")):
            path.unlink(missing_ok=True)
    for path in (*folder.iterdir(), whole):  # into the file cache
        path.read_bytes()
    return folder, whole


def most_handles(command):
    """The most open files that one of the command's processes is seen with."""
    most = 0
    process = subprocess.Popen([str(word) for word in command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while process.poll() is None:
        try:
            children = pathlib.Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
            for pid in [str(process.pid), *children]:
                most = max(most, len(os.listdir(f"/proc/{pid}/fd")))
        except OSError:
            pass  # just ended
        time.sleep(0.005)
    return most


def measure(bench):
    across, side = (20, 64) if bench.options.small else (100, 128)
    folder, whole = make_tiles(bench, across, side)
    listed = bench.work / "tiles.txt"
    listed.write_text("".join(f"{path}\n" for path in sorted(folder.iterdir())))
    archive, vrt, out = bench.work / "mosaic.isohf", bench.work / "mosaic.vrt", bench.work / "mosaic.tif"
    single = bench.work / "whole.isohf"
    # As many samples as the lattice has, on a raster that shares none with the tiles.
    samples = json.loads(bench.run(bench.isohf, "plan", whole, "--json")["out"])["lattice_samples"]
    target = f"{round(samples**0.5)} {round(samples**0.5)}"
    build = f"gdalbuildvrt -q -overwrite -input_file_list {listed} {vrt}"
    options = " ".join(GDAL_OPTIONS)
    commands = {
        "isohf convert TILES/": [*bench.convert, folder, "-o", archive, "--overwrite", "--quiet"],
        "isohf convert WHOLE": [*bench.convert, whole, "-o", single, "--overwrite", "--quiet"],
        "gdalbuildvrt, gdal_translate": ["sh", "-c", f"{build} && gdal_translate {options} -outsize "
                                         f"{target} {vrt} {out}"],
        "gdalbuildvrt, gdalwarp -multi": ["sh", "-c", f"{build} && gdalwarp -multi -overwrite {options} -ts "
                                          f"{target} {vrt} {out}"],
    }
    found = bench.in_turn(commands, bench.options.rounds)
    for name, command in commands.items():
        found[name]["handles"] = most_handles(command)
    hashes = [bench.info(path)["metadata"]["content_sha256"] for path in (archive, single)]
    if hashes[0] != hashes[1]:
        bench.fail("the tiles' archive is not that of the whole")
    us = found["isohf convert TILES/"]
    rows = [[name, f"{run['wall_s']:.2f}", f"{run['cpu_s']:.2f}", f"{run['peak_mb']:.0f}", str(run["handles"]),
             f"{run['wall_s'] / us['wall_s']:.2f}", f"{run['cpu_s'] / us['cpu_s']:.2f}",
             f"{run['peak_mb'] / us['peak_mb']:.2f}"] for name, run in found.items()]
    bench.add("mosaic", ["program", "wall s", "cpu s", "peak MB", "handles", "wall ×", "cpu ×", "peak ×"], rows,
              f"{across * across} deflated GeoTIFFs of {side}x{side} int16, medians of {bench.options.rounds} rounds, "
              f"{bench.machine()}; ×: divided by those of isohf convert TILES/. Peak: of the largest process. Handles: the "
              "most open files seen, every 5 ms in a run of its own. Both of isohf's archives have one content hash.")
    bench.results["mosaic"] = found
    for path in (archive, single, vrt, out):
        path.unlink()
