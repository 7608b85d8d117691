"""A game developer cuts a heightmap again: other tiles of the same name neither stay in the folder nor are joined."""
import shutil

from first_hour import FOLDER, TESTDATA, check, isohf, near, refuses, sample, write_asc

PEAKS = TESTDATA / "peaks_256x256_uint16.png"
KINDS = ("raw", "png", "exr", "flt", "asc", "tif", "npy")
OLD = ("--tile-size", 65, "--overlap", 1)  # 4 x 4 tiles
NEW = ("--tile-size", 129, "--overlap", 1)  # 2 x 2


def names(folder, extension=""):
    return sorted(path.name for path in folder.iterdir() if path.name.endswith(extension))


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def folder(name):
    (FOLDER / name).mkdir()
    return FOLDER / name


for archive, scale in (("a.isohf", 0.05), ("b.isohf", 0.1)):
    isohf("convert", PEAKS, archive, "--z-scale", scale, "--sample-spacing", 4, "-q")
near(sample("b.isohf", [(700.0, 700.0)])[0], 132.15, 0.01, "the archive")

# 1. The larger cut, then the smaller one: 12 old tiles and all that lies beside them go, whatever the format.
for kind in KINDS:
    there = folder(f"cut_{kind}")
    output = there / f"u.{kind}"
    isohf("export", "a.isohf", output, *OLD, "-q")
    before = names(there)
    check(len(names(there, f".{kind}")) == 16, f"{kind}: {before}")
    text = isohf("export", "b.isohf", output, *NEW, "--overwrite").out
    check("12 of another cut removed" in text, text)
    fresh = folder(f"fresh_{kind}")
    isohf("export", "b.isohf", fresh / f"u.{kind}", *NEW, "-q")
    check(contents(there) == contents(fresh), f"{kind}: {names(there)}, must be {names(fresh)}")
    tiles = [path for path in there.iterdir() if path.suffix == f".{kind}"]
    check(len(tiles) == 4, f"{kind}: {tiles}")
    if kind == "npy":
        continue  # states no place
    isohf("convert", *tiles, "-o", f"joined_{kind}.isohf", "-q")
    near(sample(f"joined_{kind}.isohf", [(700.0, 700.0)])[0], 132.15, 0.15, f"joined {kind} tiles")

# 2. Without --overwrite a tile of another cut is refused, even if no new tile has its name. Nothing is changed.
there = folder("refused")
isohf("export", "a.isohf", there / "u.raw", *OLD, "-q")
for path in list(there.iterdir()):
    if path.name.startswith(("u_x0", "u_x1")):
        path.unlink()
before = contents(there)
refuses("export", "b.isohf", there / "u.raw", *NEW, words=["u_x2_y0.raw", "another cut than 2 x 2", "--overwrite"], code=2)
check(contents(there) == before, "a refused export changed files")

# 3. Only what export writes is removed: the same stem, numbers and format, and regular files of that format.
there = folder("others")
isohf("export", "a.isohf", there / "u.png", *OLD, "-q")
kept = ["v_x3_y3.png", "u_x03_y0.png", "u_x3_y-1.png", "u_x3_y3.txt", "u_x3.png", "u.png", "uu_x3_y3.png", "u_x3_y3.r16"]
for name in kept:
    (there / name).write_bytes(b"not ours")
(there / "u_x7_y7.png").write_bytes(b"no picture")
(there / "u_x8_y8.png").mkdir()
(there / "u_x9_y9.png").symlink_to("v_x3_y3.png")
isohf("export", "b.isohf", there / "u.png", *NEW, "--overwrite", "-q")
for name in kept + ["u_x7_y7.png", "u_x8_y8.png", "u_x9_y9.png"]:
    check((there / name).exists(), f"{name} was removed")
check(not (there / "u_x3_y3.png").exists() and not (there / "u_x3_y3.png.json").exists(), "an old tile stayed")

# 4. An export that fails leaves the old tiles as they were: no tile is replaced before the last one is complete.
there = folder("failed")
isohf("export", "a.isohf", there / "u.raw", *OLD, "-q")
before = contents(there)
write_asc("cliff.asc", 257, 257, lambda column, row: 70000.0 if row > 250 else 5.0, spacing=4.0)
isohf("convert", "cliff.asc", "cliff.isohf", "-q")
for cut in (OLD, NEW):
    failed = isohf("export", "cliff.isohf", there / "u.raw", *cut, "--raw-scale", 1, "--overwrite", code=2)
    check("does not hold" in failed.err, failed.err)
    check(contents(there) == before, f"{cut}: the export that failed changed {names(there)}")

# 5. What belongs together is still joined: shared and wide overlaps, a last column and row that are smaller, other
# numbers, coordinates as numbers, tiles of two names over each other, and neighbours of other sizes.
def hill(x, y):
    return 100.0 + 3.0 * x + 2.0 * y


def cut(name, first, columns, rows):
    return write_asc(name, columns, rows, lambda column, row: hill(first[0] + column, first[1] + row), west=first[0] * 10.0,
                     south=-(first[1] + rows) * 10.0, spacing=10.0)


def joins(what, files):
    isohf("convert", *files, "-o", "legal.isohf", "--overwrite", "-q")
    found = sample("legal.isohf", [(205.0, 155.0), (455.0, 405.0)])
    for got, (x, y) in zip(found, ((20, 15), (45, 40))):
        near(got, hill(x, y), 0.6, what)


def steps(step, size):
    return [(i, j, (i * step, j * step), min(size, 60 - i * step), min(size, 60 - j * step)) for i in range(60) for j in range(60)
            if i * step < 60 and j * step < 60]


for step, size in ((20, 21), (20, 36), (25, 25), (17, 20), (12, 40)):
    joins(f"tiles of {size} every {step}", [cut(f"s{step}_x{i}_y{j}.asc", at, w, h) for i, j, at, w, h in steps(step, size)])
joins("coordinates as numbers", [cut(f"k_x{5000 + 200 * i}_y{48000 - 200 * j}.asc", at, w, h) for i, j, at, w, h in steps(20, 22)])
joins("numbers in no order", [cut(f"n_x{(7 * i + 3 * j) % 11}_y{(5 * j + i) % 13}.asc", at, w, h) for i, j, at, w, h in steps(20, 21)])
joins("two names", [cut(f"p_x{i}_y{j}.asc", at, w, h) for i, j, at, w, h in steps(20, 21)] +
      [cut(f"q_x{i}_y{j}.asc", at, w, h) for i, j, at, w, h in steps(30, 31)])
joins("trimmed tiles", [cut(f"t_x{i}_y{j}.asc", (at[0], at[1] + (i + j) % 2), w, h - (i + j) % 2) for i, j, at, w, h in steps(20, 23)])
for overlap in (0, 1, 16):
    there = folder(f"whole_{overlap}")
    isohf("export", "b.isohf", there / "u.raw", "--tile-size", 65, "--overlap", overlap, "-q")
    isohf("convert", *there.glob("u_x*_y*.raw"), "-o", f"whole_{overlap}.isohf", "-q")
    near(sample(f"whole_{overlap}.isohf", [(700.0, 700.0)])[0], 132.15, 0.2, f"tiles with an overlap of {overlap}")
