"""A small raster becomes one tile, not sixty of nine vertices a side."""
from first_hour import check, isohf, write_asc, write_tiff


def hills(column, row):
    return 100 + (column * 7 + row * 13) % 40


def plan(raster, *options):
    report = isohf("plan", raster, "--json", *options).json()
    return report["grid"]["tiles"], report["shape"]


# Up to the usual tile's 208 columns of cells; samples on posts and areas, wide and high.
for columns, rows in ((2, 2), (10, 10), (50, 40), (40, 50), (60, 40), (100, 100), (190, 30), (30, 190), (190, 190)):
    for point in (False, True):
        raster = write_tiff("small.tif", columns, rows, hills, west=500000.0, north=5000000.0, spacing=30.0, epsg=32632,
                            point=point)
        tiles, shape = plan(raster)
        check(tiles == 1, f"{columns}x{rows} samples, point {point}: {tiles} tiles, must be one")
        check(shape["columns"] <= 212 + 48 and shape["levels"] >= (2 if columns >= 40 else 1), f"{columns}x{rows}: {shape}")

# A density or a spacing can make a raster small; a larger one keeps its many tiles.
write_asc("medium.asc", 300, 300, hills, spacing=10.0)
check(plan("medium.asc", "--density", "0.4")[0] == 1, "300x300 samples at 0.4 vertices for each are not one tile")
check(plan("medium.asc", "--spacing", "30")[0] == 1, "100x100 vertices are not one tile")
check(plan(write_asc("large.asc", 700, 400, hills))[0] > 1, "700x400 samples are one tile")

# The one tile holds every sample, and gives them back in place.
posts = write_tiff("posts.tif", 50, 40, hills, west=0.0, north=400.0, spacing=10.0, epsg=32632, point=True)
isohf("convert", posts, "posts.isohf", "--lossless")
report = isohf("verify", "posts.isohf", "--against", posts, "--json").json()
check(report["checks"]["tiles_checked"] == 1, f"{report['checks']}")
check(report["against"]["samples_compared"] == 2000, f"{report['against']}")
isohf("export", "posts.isohf", "back.tif")
check(isohf("info", "back.tif", "--json").json()["width"] == 50, "the raster is not 50 columns wide again")
