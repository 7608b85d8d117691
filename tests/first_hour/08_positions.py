"""A tile whose name does not state its position: lengths as at the equator, with a warning; nothing `asked for`."""
from first_hour import check, isohf, near, sample, write_hgt


def slope(column, row):
    return column + 2 * row


def summary(name, *options):
    isohf("convert", name, "a.isohf", "--overwrite", "-q", *options)
    return isohf("info", "a.isohf").out


# The position stands at the beginning of the name, or between other characters than letters and digits.
for name, longitude, latitude in (("N44E006.hgt", 6, 44), ("srtm_N44E006.hgt", 6, 44), ("dem-s35e145_v3.hgt", 145, -35),
                                  ("1arc.n10w020.hgt", -20, 10)):
    isohf("convert", write_hgt(name, height=slope), "a.isohf", "--overwrite", "-q")
    height, = sample("a.isohf", [(longitude + 0.25, latitude + 0.5)], "--in", "lonlat")
    near(height, 300 + 2 * 600, 1.0, f"{name} in its middle")

# Without one there is a warning of the position and one of the lengths, also with -q, and no projection was asked for.
for name in ("unnamed.hgt", "xN44E006.hgt", "aN44E006b.hgt", "x_N44E006_N45E007.hgt"):
    write_hgt(name, height=slope)
    result = isohf("convert", name, "a.isohf", "--overwrite")
    said = [line for line in result.err.splitlines() if "warning" in line]
    check(any("its position is unknown" in line for line in said), f"{name}: {result.err}")
    check(any("41 %" in line and "equator" in line for line in said), f"{name}: {result.err}")
    check("asked for" not in result.out, f"{name}: {result.out}")
    check("does not state its position" in result.out and "any amount" in result.out, f"{name}: {result.out}")
    isohf("convert", name, "b.isohf", "--strict", code=1)

# What is asked for is called so, and only that.
write_hgt("N44E006.hgt", height=slope)
check("asked for" in summary("N44E006.hgt", "--to-crs", "equirectangular"), "--to-crs is not said to be asked for")
check("asked for" not in summary("N44E006.hgt"), "the default projection is said to be asked for")
