"""Runs docs/reader.py over fresh archives of every kind. usage: reader_test.py ISOHF SOURCE_FOLDER"""

import pathlib
import subprocess
import sys
import tempfile

isohf, root = sys.argv[1], pathlib.Path(sys.argv[2])
data = root / "testdata"
VOIDS, RIDGES = data / "voids_200x150_int16.tif", data / "ridges_161x161_float.exr"


def globe(folder):
    """48x24 samples all round the globe, some of them void."""
    lines = ["ncols 48", "nrows 24", "xllcorner -180", "yllcorner -90", "cellsize 7.5", "NODATA_value -9999"]
    for row in range(24):
        heights = [str((column * 37 + row * 91) % 113 + 10 * row) for column in range(48)]
        if 5 < row < 9:
            heights[44:] = ["-9999"] * 4
        lines.append(" ".join(heights))
    path = folder / "globe.asc"
    path.write_text("\n".join(lines) + "\n")
    path.with_suffix(".prj").write_text('GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,298.257223563]],'
                                        'PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]]')
    return path


def cases(folder):
    yield VOIDS, []
    yield VOIDS, ["--type", "u8", "--filter", "bilinear", "--shape", "20x19"]
    yield VOIDS, ["--type", "f32", "--shape", "20x19"]
    yield VOIDS, ["--to-crs", "local", "--type", "f32"]
    yield VOIDS, ["--to-crs", "utm", "--max-error", "7"]
    yield RIDGES, ["--density", "0.4"]
    yield RIDGES, ["--type", "f32", "--filter", "bspline3"]
    yield globe(folder), ["--wrap-x", "--shape", "12x11", "--levels", "2"]


def read(archive, samples=None):
    command = [sys.executable, root / "docs" / "reader.py", archive] + ([samples] if samples else [])
    return subprocess.run(command, capture_output=True, text=True, check=False)


failures = 0
for arguments, expected in ([], "usage: reader.py ARCHIVE [SAMPLES]"), (["/no/archive"], "/no/archive"):
    said = subprocess.run([sys.executable, root / "docs" / "reader.py"] + arguments, capture_output=True, text=True, check=False)
    if said.returncode == 0 or expected not in said.stderr or said.stderr.count("\n") != 1:
        print(arguments, said.stdout, said.stderr)
        failures += 1
with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    for source, options in cases(folder):
        archive = folder / "a.isohf"
        subprocess.run([isohf, "convert", source, "-o", archive, "--lossless", "--overwrite", "--quiet"] + options, check=True)
        found = read(archive, folder / "samples")
        if found.returncode != 0 or "samples" not in found.stdout:
            print(source.name, options, found.stdout, found.stderr)
            failures += 1
sys.exit(failures != 0)
