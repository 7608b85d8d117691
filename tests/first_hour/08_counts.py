"""Counts of vertices: each once, never above 100 %, and the same wherever they are printed."""
import re

from first_hour import FOLDER, TESTDATA, check, isohf, real, write_tiff


def counts(source, *options):
    """Clamped and all vertices, which must be the same in the warning, the summary, `info` and JSON."""
    made = isohf("convert", source, "c.isohf", "--overwrite", "--clamp-range", *options)
    warned = re.search(r"(\d+) of (\d+) lattice vertices lay outside", made.err)
    told = re.search(r"([\d ]+) vertices clamped", made.out)
    shown = re.search(r"([\d ]+) vertices clamped", isohf("info", "c.isohf", "-v").out)
    number = lambda text: int(text.replace(" ", ""))
    statistics = isohf("info", "c.isohf", "--json").json()["metadata"]["statistics"]
    clamped, all_ = statistics["clamped"], statistics["vertices"]
    what = f"{source} {' '.join(options)}"
    check(clamped + statistics["voids"] <= all_, f"{what}: {clamped} of {all_} vertices are clamped")
    check((warned is not None) == (clamped > 0) == (told is not None), f"{what}: {made.err}{made.out}")
    if clamped > 0:
        check((int(warned[1]), int(warned[2])) == (clamped, all_), f"{what}: {made.err}, but {clamped} of {all_}")
        check(number(told[1]) == clamped, f"{what}: {told[0]}, but {clamped}")
        check(number(shown[1]) == clamped, f"{what}: {shown[0]}, but {clamped}")
    return clamped, all_, statistics["voids"]


def main():
    coast = TESTDATA / "coast_512x384_int16.tif"
    voids = TESTDATA / "voids_200x150_int16.tif"
    # All lie outside: that is every vertex, whatever the type and the tiles, beyond the border as well.
    for source in (coast, voids):
        for options in (("--type", "u16"), ("--type", "u8"), ("--type", "f32"), ("--shape", "44x67"),
                        ("--fit",), ("--density", "2.3")):
            clamped, all_, void = counts(source, "--z-range", "-1000:-900", *options)
            check(clamped == all_ - void, f"{source} {options}: {clamped} of {all_} with {void} void lie outside")
    # None does.
    check(counts(coast, "--z-range", "-1000:5000")[0] == 0, "some lie outside of -1000 to 5000")
    # Half of a slope does, to a row of vertices.
    slope = write_tiff("slope.tif", 400, 300, lambda c, r: r, kind="f", west=0.0, north=0.0)
    for options in ((), ("--shape", "44x67")):
        clamped, all_, _ = counts(slope, "--z-range", "0:149.5", *options)
        check(abs(clamped / all_ - 0.5) < 0.01, f"slope {options}: {clamped} of {all_}, must be half")
    # The same by any number of threads, and by shards.
    whole = counts(coast, "--z-range", "0:100", "--shape", "44x67")
    for threads in ("1", "3"):
        check(counts(coast, "--z-range", "0:100", "--shape", "44x67", "-j", threads) == whole, f"-j {threads}: differs")
    parts = []
    for k in (1, 2, 3):
        parts.append(f"part{k}.isohf")
        isohf("convert", coast, parts[-1], "--z-range", "0:100", "--clamp-range", "--shape", "44x67", "--shard", f"{k}/3")
    isohf("merge", *parts, "-o", "merged.isohf")
    merged = isohf("info", "merged.isohf", "--json").json()["metadata"]["statistics"]
    check((merged["clamped"], merged["vertices"], merged["voids"]) == whole, f"shards give {merged}, one run {whole}")
    # What is cut out has no more than it has vertices.
    isohf("convert", coast, "all.isohf", "--z-range", "-1000:-900", "--clamp-range", "--shape", "44x67")
    isohf("extract", "all.isohf", "--tiles", "1:2,1:2", "-o", "cut.isohf")
    cut = isohf("info", "cut.isohf", "--json").json()["metadata"]["statistics"]
    check(cut["clamped"] <= cut["vertices"], f"a cut has {cut['clamped']} of {cut['vertices']} vertices clamped")

    alps = real("N44E006.hgt")
    if alps:
        clamped, all_, _ = counts(alps, "--z-range", "0:10")
        check(clamped == all_, f"{clamped} of {all_} vertices of the Alps lie above 10 m")


main()
