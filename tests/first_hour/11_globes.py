"""A source that goes all the way round is joined: both ends of a turn are one place, wherever its columns begin."""
import math

from first_hour import FOLDER, check, isohf, near, real, refuses, sample, write_tiff

COLUMNS, ROWS, STEP = 72, 36, 5.0


def ground(longitude, latitude):
    """Smooth all the way round, and steep at 0 and at 180 degrees."""
    return 2000.0 * math.sin(math.radians(longitude)) * math.cos(math.radians(latitude)) + 500.0


def globe(name, west, point=False, repeated=False, step=STEP, rows=ROWS, **more):
    """Areas from the North pole on, or posts; `west` is that of the first sample's side, or the first post."""
    half = 0.0 if point else step / 2.0
    columns = round(360.0 / step) + (1 if repeated else 0)
    height = lambda column, row: ground(west + half + column * step, 90.0 - step / 2.0 - row * step)
    return write_tiff(name, columns, rows, height, kind="f", west=west, north=90.0 - (step / 2.0 if point else 0.0),
                      spacing=step, point=point, **more)


def ends_meet(archive, what, tolerance=40.0):
    """Elevations at places that are one, and the truth."""
    at = {longitude: sample(archive, [(longitude, 10.0)], "--in", "lonlat")[0] for longitude in (0, 360, -180, 180, 540)}
    check(at[0] == at[360] and at[-180] == at[180] == at[540], f"{what}: one place has two elevations: {at}")
    near(at[0], ground(0.0, 10.0), tolerance, f"{what}, longitude 0")
    near(at[180], ground(180.0, 10.0), tolerance, f"{what}, longitude 180")


GLOBES = {
    "from 0, areas": dict(west=0.0),
    "from -180, areas": dict(west=-180.0),
    "from 0, posts": dict(west=0.0, point=True),
    "from -180, posts": dict(west=-180.0, point=True),
    "from 0, posts, the first column again": dict(west=0.0, point=True, repeated=True),
    "from -182.5, areas, the first column again": dict(west=-182.5, repeated=True),
    "from 20, areas": dict(west=20.0),
}
for number, (what, layout) in enumerate(GLOBES.items()):
    name = f"globe{number}"
    globe(name + ".tif", epsg=4326, **layout)
    for more in ((), ("--to-crs", "none"), ("--filter", "bspline3", "--shadow-seeds")):
        made = isohf("convert", name + ".tif", name + ".isohf", "--overwrite", *more)
        check("the East edge" in made.out and made.err == "", f"{what} {more}: {made.out}{made.err}")
        ends_meet(name + ".isohf", f"{what} {more}")
    isohf("verify", name + ".isohf", "--against", name + ".tif", "-q")
    check("the East edge" in isohf("plan", name + ".tif").out, f"{what}: plan does not say that it is joined")
    check("the East edge" in isohf("info", name + ".isohf").out, f"{what}: info does not say that it is joined")
    same = isohf("convert", name + ".tif", name + ".isohf", "--resume", "--filter", "bspline3", "--shadow-seeds")
    check("complete already" in same.out, f"{what}: {same.out}")
    refuses("convert", name + ".tif", name + ".isohf", "--resume", "--filter", "bspline3", "--shadow-seeds",
            "--no-wrap", words=["wraps_x"], code=2)

    # Demanded, it is the same archive; refused, the ends are two.
    isohf("convert", name + ".tif", name + ".isohf", "--overwrite", "-q")
    isohf("convert", name + ".tif", "demanded.isohf", "--overwrite", "-q", "--wrap-x")
    check((FOLDER / (name + ".isohf")).read_bytes() == (FOLDER / "demanded.isohf").read_bytes(), f"{what}: --wrap-x")
    opened = isohf("convert", name + ".tif", "open.isohf", "--overwrite", "--no-wrap")
    check("the East edge" not in opened.out, f"{what}: --no-wrap joins")
    isohf("verify", "open.isohf", "--against", name + ".tif", "-q")

# What comes out of a joined archive.
isohf("shade", "globe1.isohf", "globe1.png", "-q")
isohf("export", "globe1.isohf", "back.npy", "-q", "--method", "barycentric")
isohf("convert", "globe1.tif", "kept.isohf", "--lossless", "-q")
isohf("export", "kept.isohf", "kept.tif", "-q")
isohf("verify", "kept.isohf", "--against", "kept.tif", "-q")
globe("again.tif", west=-180.0, point=True, repeated=True, epsg=4326)
isohf("convert", "again.tif", "again.isohf", "--lossless", "-q")
check(isohf("info", "again.isohf", "--json").json()["metadata"]["source"]["width"] == COLUMNS + 1,
      "--lossless loses the column that repeats the first one")
isohf("convert", "globe1.tif", "exact.isohf", "--max-error", "0.5", "-q")
ends_meet("exact.isohf", "--max-error 0.5", 0.6)
check(isohf("info", "exact.isohf", "--json").json()["metadata"]["wraps_x"], "--max-error opens the globe")

# Shards are parts of the joined globe.
for number in (1, 2):
    isohf("convert", "globe1.tif", f"part{number}.isohf", "--shard", f"{number}/2", "--z-range=-1600:2600", "--shape", "1000", "-q")
isohf("merge", "part1.isohf", "part2.isohf", "-o", "merged.isohf", "-q")
isohf("convert", "globe1.tif", "whole.isohf", "--z-range=-1600:2600", "--shape", "1000", "-q")
check((FOLDER / "merged.isohf").read_bytes() == (FOLDER / "whole.isohf").read_bytes(), "shards of a globe")
ends_meet("merged.isohf", "two shards")

# Two halves that go round together, and a part of the globe, which does not.
for name, west in (("west.tif", -180.0), ("east.tif", 0.0)):
    write_tiff(name, COLUMNS // 2, ROWS, lambda c, r, west=west: ground(west + 2.5 + c * STEP, 87.5 - r * STEP), kind="f",
               west=west, north=90.0, spacing=STEP, epsg=4326)
isohf("convert", "west.tif", "east.tif", "halves.isohf", "-q")
ends_meet("halves.isohf", "two halves")
isohf("verify", "halves.isohf", "--against", "west.tif", "--against", "east.tif", "-q")
part = isohf("convert", "globe1.tif", "part.isohf", "--bbox", "-90,-60,90,60")
check("the East edge" not in part.out, "a part is joined")
refuses("convert", "globe1.tif", "part.isohf", "--bbox", "-90,-60,90,60", "--wrap-x", "--overwrite",
        words=["columns all the way round", "180"], code=2)
belt = isohf("convert", "globe1.tif", "belt.isohf", "--bbox", "-180,-60,180,60")
check("the East edge" in belt.out, "a belt all the way round is not joined")
ends_meet("belt.isohf", "a belt")
cap = isohf("convert", "globe1.tif", "cap.isohf", "--bbox", "-180,60,180,90")
check("polar-stereographic" in cap.out and "the East edge" not in cap.out, "a cap is joined")
refuses("convert", "globe1.tif", "both.isohf", "--wrap-x", "--no-wrap", words=["--wrap-x", "--no-wrap"], code=2)

# Other bodies, and metres of a cylindrical map.
MARS = 'GEOGCS["Mars",DATUM["D_Mars",SPHEROID["Mars",3396190,0]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]]'
turn = 2.0 * math.pi * 3396190.0
step = turn / COLUMNS
write_tiff("mars.tif", COLUMNS, ROWS, lambda c, r: ground(-177.5 + c * STEP, 87.5 - r * STEP), kind="f",
           west=-turn / 2.0, north=turn / 4.0, spacing=step)
(FOLDER / "mars.prj").write_text(f'PROJCS["Mars cylindrical",{MARS},PROJECTION["Equirectangular"],'
                                 'PARAMETER["standard_parallel_1",0],PARAMETER["central_meridian",0],'
                                 'PARAMETER["false_easting",0],PARAMETER["false_northing",0],UNIT["metre",1]]')
made = isohf("convert", "mars.tif", "mars.isohf")
check("the East edge" in made.out, f"a cylindrical map of Mars is open: {made.out}{made.err}")
ends_meet("mars.isohf", "a cylindrical map of Mars")
isohf("verify", "mars.isohf", "--against", "mars.tif", "-q")

mola = real("megt90n000cb.lbl")
if mola:
    isohf("convert", mola, "mola.isohf", "-q")
    at = sample("mola.isohf", [(0, 0), (360, 0), (-360, 0)], "--in", "lonlat")
    check(len(set(at)) == 1, f"MOLA at longitude 0: {at}")
    near(at[0], -1338.0, 20.0, "MOLA at longitude 0")
    isohf("convert", mola, "mola2.isohf", "-q", "--filter", "bilinear")
    near(sample("mola2.isohf", [(360, 0)], "--in", "lonlat")[0], -1338.0, 3.0, "MOLA at longitude 360, bilinear")
etopo = real("ETOPO1_1deg.tif")
if etopo:
    made = isohf("convert", etopo, "etopo.isohf")
    check("the East edge" in made.out, f"ETOPO1 is open: {made.out}")
    at = sample("etopo.isohf", [(-180, 10), (180, 10), (540, 10)], "--in", "lonlat")
    check(len(set(at)) == 1, f"ETOPO1 at longitude 180: {at}")
