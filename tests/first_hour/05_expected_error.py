"""The error that `convert` and `plan` expect is the one that `verify --against` measures, whatever the steps are."""
import math
import random

from first_hour import FOLDER, TESTDATA, check, isohf, real, write_asc, write_hgt, write_tiff

FACTOR = 1.3


def expect(source, *options, planned=True, factor=FACTOR):
    """Both estimates are printed, and within `factor` of what is measured."""
    made = isohf("convert", source, "e.isohf", "--overwrite", "--json", *options).json()["expected_error"]
    found = isohf("verify", "e.isohf", "--against", source, "--json").json()["against"]["rms"]
    estimates = [("convert", made)]
    if planned:
        plan = isohf("plan", source, "p.isohf", "--json", *options).json()["expected_error"]
        estimates.append(("plan", plan))
    for command, estimate in estimates:
        what = f"{command} {source} {' '.join(options)}"
        check(estimate is not None, f"{what}: no expected error")
        rms = estimate["rms"]
        check(found / factor <= rms <= found * factor or rms == found,
              f"{what}: {rms} is expected, {found} is measured")
    return found


def hills(column, row):
    return 900.0 + 700.0 * math.sin(column / 61.0) * math.cos(row / 47.0) + 40.0 * math.sin(column / 5.0 + row / 7.0)


def main():
    random.seed(35)
    coast = TESTDATA / "coast_512x384_int16.tif"
    voids = TESTDATA / "voids_200x150_int16.tif"
    ridges = TESTDATA / "ridges_161x161_float.exr"
    peaks = TESTDATA / "peaks_256x256_uint16.png"

    # Every type, with the step that isohf finds: of u8 it is most of the error.
    for source in (coast, voids, ridges, peaks):
        for kind in ("u16", "u8", "f32"):
            expect(source, "--type", kind)
    check(expect(coast, "--type", "u8") > 1.2 * expect(coast, "--type", "u16"), "u8 rounds a coast no more than u16")
    # A step or a bound of one's own, a range, and what goes with the samples.
    for options in (("--step", "20"), ("--step", "finest"), ("--max-rounding", "8"), ("--step", "1", "--max-rounding", "8"),
                    ("--z-range", "0:1500", "--clamp-range"), ("--z-range", "50:120", "--clamp-range", "--type", "u8"),
                    ("--lossless",), ("--fill",), ("--density", "0.3"), ("--filter", "bspline3"),
                    ("--to-crs", "utm:33N"), ("--memory", "100M")):
        expect(coast, *options)
    expect(voids, "--fill")
    # Detail in one corner: a small raster is looked at as a whole.
    corner = write_tiff("corner.tif", 700, 500, lambda c, r: random.uniform(0.0, 90.0) if c + r < 40 else 0.0, kind="f")
    expect(corner, factor=1.01)
    # One wild sample takes all codes, and the error with it.
    wild = write_tiff("wild.tif", 300, 200, lambda c, r: 1e20 if (c, r) == (137, 101) else hills(c, r), kind="f")
    check(expect(wild) > 100.0, "one sample of 1e20 takes no code from the others")
    # More than a million samples, of which some are looked at; in degrees, and of two files. With --fill, too.
    write_hgt("N44E006.hgt", height=hills)
    for options in ((), ("--type", "u8"), ("--fill",), ("--type", "u8", "--fill"), ("--lossless",)):
        expect(FOLDER / "N44E006.hgt", *options)
    # Where there is none the line says why.
    write_asc("apart.asc", 40, 30, lambda c, r: 5.0 if (c % 9, r % 9) == (4, 4) else None)
    text = isohf("convert", "apart.asc", "apart.isohf", "--filter", "nearest").out
    check("an estimate" in text or "not estimated: " in text, text)

    names = ["srtm_bigtujunga30m_utm11.tif", "mt_fuji_90m.tif", "N49E001.hgt", "WAC_GLD100_10km_cropped.cub",
             "t3d_terrain2.exr", "terrabrush_heightmap.exr", "asf_GrayRampsDiagonal.exr", "hugo_site.asc",
             "derived/gale.npy", "derived/mola_4ppd_u16.png", "ETOPO1_1deg.tif", "float_nan.tif"]
    for name in names:
        source = real(name)
        for options in ((), ("--type", "u8")) if source else ():
            expect(source, *options, planned=False)


main()
