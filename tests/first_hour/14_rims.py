"""Valid samples beside voids keep their elevations, and voids stay voids a lattice step further in."""
import math

from first_hour import FOLDER, TESTDATA, check, isohf, near, real, sample, write_asc, write_tiff


def kept(source, *options, lost=0):
    """The archive's accuracy; it verifies, and so many samples have no surface."""
    made = isohf("convert", source, "k.isohf", "--overwrite", "--json", *options).json()
    found = isohf("verify", "k.isohf", "--against", source, "--json").json()["against"]
    what = f"{source} {' '.join(options)}"
    check(found["samples_lost"] == lost, f"{what}: {found['samples_lost']} samples have no surface, must be {lost}")
    check(found["invented_inside"] == 0, f"{what}: a void away from borders has a surface")
    check(made["expected_error"]["lost"] == lost, f"{what}: {made['expected_error']} expects other losses")
    return found


def coast(column, row):
    height = 40.0 * math.sin(column / 31.0 + 2.0 * math.sin(row / 47.0)) + 25.0 * math.cos(row / 19.0 + column / 53.0)
    height += 6.0 * math.sin(column / 5.0) * math.cos(row / 6.0)
    return round(height, 2) if height > 0.0 else None


def main():
    # A coast, islands, single samples and single voids; any lattice, filter, type, map and use of memory.
    write_asc("coast.asc", 240, 180, coast, west=500000.0, south=5000000.0, spacing=10.0)
    for options in ((), ("--type", "u8"), ("--type", "f32"), ("--filter", "bilinear"), ("--filter", "nearest"),
                    ("--filter", "bspline3"), ("--density", "0.3"), ("--density", "0.1"), ("--density", "2"),
                    ("--shape", "44x67"), ("--fit",), ("--lossless",)):
        kept("coast.asc", *options)
    kept(TESTDATA / "voids_200x150_int16.tif")
    degrees = write_tiff("degrees.tif", 240, 180, lambda c, r: -9999.0 if coast(c, r) is None else coast(c, r), kind="f",
                         west=10.0, north=46.0, spacing=0.01, epsg=4326, nodata=-9999)
    for options in ((), ("--to-crs", "utm:32N"), ("--to-crs", "lambert-conformal")):
        kept(degrees, *options)
    # The rim is as near to the samples as the rest: of a slope it is part.
    hole = lambda c, r: math.hypot(c - 40.0, r - 30.0) < 12.0 or (c, r) in ((70, 20), (75, 40), (76, 40), (90, 10))
    slope = lambda c, r: None if hole(c, r) or c > 110 else 3.0 * c - 2.0 * r
    write_asc("slope.asc", 120, 60, slope, spacing=10.0)
    check(kept("slope.asc", "--type", "f32")["max"] < 1.5, "the rim of a slope is not on it")
    # The hole is one, to two steps of the lattice from its rim; beside it there is a surface.
    isohf("convert", "slope.asc", "slope.isohf")
    cells = [(c, r) for r in range(60) for c in range(120)]
    heights = sample("slope.isohf", [(10.0 * (c + 0.5), 10.0 * (r + 0.5)) for c, r in cells])
    for (c, r), height in zip(cells, heights):
        if slope(c, r) is not None:
            near(height, slope(c, r), 1.5, f"slope at sample {c} {r}")
        elif math.hypot(c - 40.0, r - 30.0) < 9.5 or c > 113:
            check(math.isnan(height), f"the void at sample {c} {r} has elevation {height}")
    # Bytes are the same by any number of threads, in little memory, and of shards.
    isohf("convert", "coast.asc", "a.isohf", "--shape", "44x67", "--z-range", "0:80", "--clamp-range")
    bytes_ = (FOLDER / "a.isohf").read_bytes()
    for options in (("-j", "1"), ("-j", "3", "--memory", "40M")):
        isohf("convert", "coast.asc", "b.isohf", "--overwrite", "--shape", "44x67", "--z-range", "0:80", "--clamp-range",
              *options)
        check((FOLDER / "b.isohf").read_bytes() == bytes_, f"{' '.join(options)}: other bytes")
    parts = [f"part{k}.isohf" for k in (1, 2, 3)]
    for k, part in enumerate(parts, 1):
        isohf("convert", "coast.asc", part, "--shape", "44x67", "--z-range", "0:80", "--clamp-range", "--shard", f"{k}/3")
    isohf("merge", *parts, "-o", "m.isohf")
    check((FOLDER / "m.isohf").read_bytes() == bytes_, "shards: other bytes")
    # On a lattice much coarser than the samples some have none: `convert` reports them.
    text = isohf("convert", "coast.asc", "v.isohf", "--density", "0.001").out
    check("next to nodata have no surface" in text, text)

    for name in ("hugo_site.asc", "west_bijou_gully.asc", "N49E001.hgt", "mt_fuji_90m.tif", "N2000000E3000000.TIF"):
        if real(name):
            kept(real(name))


main()
