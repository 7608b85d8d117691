"""No command takes more than a quarter of the machine's memory unless --memory allows it: it refuses in one line, with
the figure and what takes less. `ulimit -v` stands for a machine of another size."""
import re
import time

from first_hour import FOLDER, check, isohf, near, read_npy, refuses, write_asc, write_hgt

LARGE_KB = 4_000_000
SMALL_KB = 300_000
TWO = ("-j", "2")  # more threads need more memory


def size_of(text):
    """Bytes of "80.8 GB" or "70MB"."""
    number, unit = re.fullmatch(r"([0-9.]+) ?([MG])B", text).groups()
    return float(number) * {"M": 1e6, "G": 1e9}[unit]


def written(name):
    return [path.name for path in FOLDER.iterdir() if path.name.startswith(name)]


# Two tiles of SRTM 173 degrees apart. Lambert's parallels are arcs: a row of tiles lies on thousands of rows.
FAR = ("N10E179.hgt", "N44E006.hgt")
for name in FAR:
    write_hgt(name, height=lambda column, row: (column + row) % 7)
began = time.monotonic()
refused = refuses("convert", *TWO, *FAR, "far.isohf", limit_kb=LARGE_KB, timeout=60,
                  words=["mosaic of 2 files: ", "80.8 GB", "a quarter of this machine's", "1.02 GB", "--memory 81GB",
                         "--to-crs equirectangular", "one conversion for each input"])
check(time.monotonic() - began < 20.0, "the refusal takes longer than 20 seconds")
check(written("far") == [], "a refused conversion leaves files behind")
refuses("convert", *TWO, *FAR, "far.isohf", "--memory", "2GB", words=["--memory allows 2000 MB"])
planned = isohf("plan", *TWO, *FAR, "--json", limit_kb=LARGE_KB)
check("convert would refuse: mosaic of 2 files: this conversion needs 80.8 GB" in planned.err, planned.err)
near(planned.json()["memory_bound_bytes"], LARGE_KB * 1024 / 4, 1.0, "the bound that plan states")
near(planned.json()["least_memory_bytes"], 80.8e9, 0.1e9, "the memory that plan states")
near(isohf("plan", *TWO, *FAR, "--memory", "81GB", "--json").json()["memory_bound_bytes"], 81e9, 0.0,
     "the bound that is given to plan")
check(isohf("plan", *TWO, *FAR, "--strict", code=1, limit_kb=LARGE_KB).out == "", "--strict prints")

# A wide ground, 60 by 25 degrees, in 8000 x 3300 samples: each remedy works and is what it was said to be.
for name, west, south in (("west.asc", -125.0, 25.0), ("east.asc", -65.75, 49.0)):
    write_asc(name, 100, 100, lambda column, row: 100 + column - row, west=west, south=south, spacing=0.0075)
    prj = 'GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],' \
          'UNIT["degree",0.0174532925199433],AUTHORITY["EPSG","4326"]]'
    (FOLDER / name).with_suffix(".prj").write_text(prj)
WIDE = ("west.asc", "east.asc")
refused = refuses("convert", *TWO, *WIDE, "wide.isohf", limit_kb=SMALL_KB,
                  words=["a quarter of this machine's, 76.8 MB"])
needed, allowed, flat = re.search(r"needs ([0-9.]+ .B) of .* --memory ([0-9.]+.B) allows .* takes ([0-9.]+ .B)",
                                  refused.err).groups()
check(size_of(needed) <= size_of(allowed) <= 1.1 * size_of(needed), refused.err)
isohf("convert", *TWO, *WIDE, "wide.isohf", "--memory", allowed, "-q")
made = isohf("convert", *TWO, *WIDE, "flat.isohf", "--to-crs", "equirectangular", "--json", limit_kb=SMALL_KB).json()
check(made["peak_memory_bytes"] < 1.1 * size_of(flat), f"{made['peak_memory_bytes']} bytes, not {flat}")
check(size_of(flat) < 76.8e6, f"the remedy takes {flat}")
for part in WIDE:
    isohf("convert", *TWO, part, part + ".isohf", "-q", limit_kb=SMALL_KB)
isohf("convert", *TWO, *WIDE, "part.isohf", "--bbox", "-125,25,-124,26", "-q", limit_kb=SMALL_KB)

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
