"""A 16384x8192 int16 GeoTIFF to an archive, against gdal_translate and gdalwarp."""

from harness import GDAL_OPTIONS

DEFLATED = "isohf convert, deflated input"


def deflated_copy(bench, source):
    """The same raster as DEMs are mostly handed out; in the file cache, as it has just been written."""
    path = bench.work / "convert_deflated.tif"
    bench.run("gdal_translate", "-q", "-co", "TILED=YES", "-co", "COMPRESS=DEFLATE", "-co", "PREDICTOR=2", "-co",
              "NUM_THREADS=2", source, path)
    return path


def cost_of_inflating(found):
    """How much of inflating the input ran while the other cores had work of their own."""
    plain, packed = found["isohf convert"], found[DEFLATED]
    wall, cpu = packed["wall_s"] - plain["wall_s"], packed["cpu_s"] - plain["cpu_s"]
    if cpu <= 0:
        return "Inflating the input cost less than these runs differ."
    return (f"Deflated input (tiles of 256 x 256, PREDICTOR=2) cost {cpu:.2f} s more of processor time and {wall:.2f} s more "
            f"of wall time: {100 * min(max(1 - wall / cpu, 0), 1):.0f} % of inflating was overlapped with other work.")


def measure(bench):
    source = bench.input()
    # As many samples as the lattice has, on a raster that shares none with the input: GDAL has to interpolate.
    size = ["1907", "1099"] if bench.options.smoke else ["15247", "8803"]
    rounds = bench.options.rounds
    archive, step1 = bench.work / "iso.isohf", bench.work / "iso1.isohf"
    translated, warped = bench.work / "translate.tif", bench.work / "warp.tif"
    deflated, archive2 = deflated_copy(bench, source), bench.work / "iso2.isohf"
    jobs = {
        "isohf convert": [*bench.convert, source, "-o", archive, "--overwrite", "--quiet"],
        DEFLATED: [*bench.convert, deflated, "-o", archive2, "--overwrite", "--quiet"],
        "isohf convert --step 1": [*bench.convert, source, "-o", step1, "--overwrite", "--quiet", "--step",
                                   "1"],
        "gdal_translate": ["gdal_translate", *GDAL_OPTIONS, "-outsize", *size, source, translated],
        "gdalwarp -multi": ["gdalwarp", "-multi", "-overwrite", *GDAL_OPTIONS, "-ts", *size, source, warped],
    }
    found = bench.in_turn(jobs, rounds)
    for name, path in zip(jobs, (archive, archive2, step1, translated, warped)):
        samples = int(size[0]) * int(size[1])
        if path.suffix == ".isohf":
            samples = bench.info(path)["lattice_samples"]
        found[name] |= {"bytes": path.stat().st_size, "samples": samples}
    starts = sorted(bench.run(bench.isohf, "info", archive)["wall_s"] for _ in range(50))
    us = found["isohf convert"]
    rows = [[name, f"{run['wall_s']:.2f}", f"{run['cpu_s']:.2f}", bench.busy(run), f"{run['peak_mb']:.0f}",
             f"{run['bytes'] / 1e6:.1f}", f"{8 * run['bytes'] / run['samples']:.2f}",
             f"{run['wall_s'] / us['wall_s']:.2f}", f"{run['cpu_s'] / us['cpu_s']:.2f}",
             f"{run['peak_mb'] / us['peak_mb']:.2f}"] for name, run in found.items()]
    bench.add("convert", ["program", "wall s", "cpu s", "cores busy", "peak MB", "MB", "bits a sample", "wall ×", "cpu ×", "peak ×"],
             rows, f"{source.name}, medians of {rounds} rounds, {bench.machine()}; ×: divided by isohf convert's. The "
             f"other programs write whole metres, as `--step 1` does. {cost_of_inflating(found)} `isohf info`: {1000 * starts[25]:.1f} ms, median "
             "of 50 starts.")
    bench.results["convert"] = found
    for path in (archive, archive2, deflated, step1, translated, warped):
        path.unlink()
