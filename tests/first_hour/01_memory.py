"""No command takes more than a quarter of the machine's memory unless --memory allows it. A map that bends the rows of
a source needs no more than one that does not. `ulimit -v` stands for a machine of another size."""
import re

from first_hour import FOLDER, check, isohf, near, read_npy, refuses, write_asc, write_hgt

LARGE_KB = 4_000_000
SMALL_KB = 300_000
TWO = ("-j", "2")  # more threads need more memory


def written(name):
    return [path.name for path in FOLDER.iterdir() if path.name.startswith(name)]


# Two tiles of SRTM 173 degrees apart. Lambert's parallels are arcs: a row of tiles lies on thousands of rows, and on almost
# nothing but the gap between the two files.
FAR = ("N10E179.hgt", "N44E006.hgt")
for name in FAR:
    write_hgt(name, height=lambda column, row: (column + row) % 7)
planned = isohf("plan", *TWO, *FAR, "--json", limit_kb=LARGE_KB)
near(planned.json()["memory_bound_bytes"], LARGE_KB * 1024 / 4, 1.0, "the bound that plan states")
check(planned.json()["estimated_memory_bytes"] <= LARGE_KB * 1024 / 4, "plan needs more than the bound")
made = isohf("convert", *TWO, *FAR, "far.isohf", "--json", limit_kb=LARGE_KB).json()
check(made["peak_memory_bytes"] < 300e6, f"{made['peak_memory_bytes']} bytes for two files far apart")
check(made["tiles_written"] - made["tiles_void"] < 200, "tiles in the gap hold elevations")
isohf("verify", *TWO, "far.isohf", "-q")

# A wide ground, 60 by 25 degrees, in 8000 x 3300 samples, on a small machine: the same bytes in less memory.
for name, west, south in (("west.asc", -125.0, 25.0), ("east.asc", -65.75, 49.0)):
    write_asc(name, 100, 100, lambda column, row: 100 + column - row, west=west, south=south, spacing=0.0075)
    prj = 'GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],' \
          'UNIT["degree",0.0174532925199433],AUTHORITY["EPSG","4326"]]'
    (FOLDER / name).with_suffix(".prj").write_text(prj)
WIDE = ("west.asc", "east.asc")
isohf("convert", *TWO, *WIDE, "wide.isohf", "-q")
made = isohf("convert", *TWO, *WIDE, "small.isohf", "--json", limit_kb=SMALL_KB).json()
check(made["peak_memory_bytes"] < 1.1 * SMALL_KB * 1024 / 4, f"{made['peak_memory_bytes']} bytes on a small machine")
check((FOLDER / "wide.isohf").read_bytes() == (FOLDER / "small.isohf").read_bytes(), "a small machine's bytes differ")

# What no way of working fits into is refused, with the figure.
refused = refuses("convert", *TWO, *WIDE, "tiny.isohf", "--memory", "9MB", words=["--memory allows 9 MB"])
allowed = re.search(r"needs at least ([0-9]+ MB)", refused.err).group(1)
check(written("tiny") == [], "a refused conversion leaves files behind")
isohf("convert", *TWO, *WIDE, "least.isohf", "--memory", allowed.replace(" ", ""), "-q")
check((FOLDER / "wide.isohf").read_bytes() == (FOLDER / "least.isohf").read_bytes(), "the least memory's bytes differ")

# What fits by working more frugally is not refused, and is the same.
(FOLDER / "rows.raw").write_bytes(b"".join((c * 37 % 311).to_bytes(2, "little") for c in range(60000)) * 200)
RAW = ("--raw", "60000x200:u16le")
isohf("convert", *TWO, "rows.raw", "wide60.isohf", *RAW, "--lossless", "-q")
isohf("convert", *TWO, "rows.raw", "tight60.isohf", *RAW, "--lossless", "-q", limit_kb=280_000)
check((FOLDER / "wide60.isohf").read_bytes() == (FOLDER / "tight60.isohf").read_bytes(),
      "a tight machine's bytes differ")
isohf("export", *TWO, "wide60.isohf", "loose.npy", "-q")
isohf("export", *TWO, "wide60.isohf", "tight.npy", "-q", limit_kb=280_000)
check(read_npy("loose.npy") == read_npy("tight.npy"), "export differs on a tight machine")
isohf("verify", *TWO, "wide60.isohf", "--against", "rows.raw", "-q", limit_kb=400_000)
