"""Hillshades: isohf shade beside gdaldem, processor time and the order of pixels; shadows from several sides."""

from collections import Counter


def spearman(one, other):
    """How two rasters of bytes rank their pixels, 0 apart: 1 is alike."""
    pairs = Counter((a, b) for a, b in zip(one, other) if a and b)
    count = sum(pairs.values())

    def ranks(side):
        values = Counter()
        for pair, times in pairs.items():
            values[pair[side]] += times
        found, below = {}, 0
        for value in sorted(values):
            found[value] = below + values[value] / 2 - count / 2
            below += values[value]
        return found

    first, second = ranks(0), ranks(1)
    total = lambda f: sum(times * f(first[a], second[b]) for (a, b), times in pairs.items())
    return total(lambda x, y: x * y) / (total(lambda x, _: x * x) * total(lambda _, y: y * y)) ** 0.5


def measure(bench):
    if not bench.has("shade", "gdaldem", "gdal-bin"):
        return
    side = 1024 if bench.options.small else 8192
    source = bench.warm(bench.terrain(f"{side}x{side}"))
    archive = bench.work / "shade.isohf"
    bench.run(bench.isohf, "convert", source, "-o", archive, "--overwrite", "--quiet")
    bench.warm(archive)
    theirs, ours = bench.work / "theirs.tif", bench.work / "ours.tif"
    shade = [bench.isohf, "shade", archive, "-o", ours, "--size", f"{side}x{side}", "--overwrite", "--quiet"]
    bare, packed, png = "gdaldem hillshade", "gdaldem hillshade -co COMPRESS=DEFLATE", "gdaldem hillshade -of PNG"
    gdaldem = ["gdaldem", "hillshade", source]
    jobs = {bare: [*gdaldem, theirs, "-q"],
            "isohf shade --hillshade --uncompressed": [*shade, "--hillshade", "--uncompressed"],
            packed: [*gdaldem, bench.work / "packed.tif", "-q", "-co", "COMPRESS=DEFLATE"],
            "isohf shade --hillshade": [*shade, "--hillshade"],
            png: [*gdaldem, bench.work / "theirs.png", "-q", "-of", "PNG"],
            "isohf shade --hillshade, PNG": [bench.work / "ours.png" if word is ours else word for word in shade]
            + ["--hillshade"],
            "isohf shade --no-shadow --uncompressed": [*shade, "--no-shadow", "--uncompressed"]}
    # Whose file is of the same kind.
    peers = {"isohf shade --hillshade": packed, "isohf shade --hillshade, PNG": png, packed: packed, png: png}
    for azimuth in (270, 315, 200, 100):
        jobs[f"isohf shade --azimuth {azimuth} --uncompressed"] = [*shade, "--azimuth", azimuth, "--uncompressed"]
    found = bench.in_turn(jobs, bench.options.rounds)
    bench.run(*jobs["isohf shade --hillshade --uncompressed"])
    # Some millions of pixels say as much as all.
    samples = []
    for path in (theirs, ours):
        plain = bench.work / "plain.bin"
        bench.run("gdal_translate", "-q", "-of", "ENVI", path, plain)
        samples.append(plain.read_bytes()[::1 if bench.options.small else 23])
    like = spearman(*samples)
    rows = []
    for name, run in found.items():
        peer = found[peers.get(name, bare)]["cpu_s"]
        rows.append([name, f"{run['cpu_s']:.2f}", f"{run['cpu_s'] / max(peer, 1e-9):.1f}", f"{run['wall_s']:.2f}",
                     f"{run['peak_mb']:.0f}"])
    for path in [archive, *bench.work.glob("theirs.*"), *bench.work.glob("ours.*"), *bench.work.glob("plain.*"),
                 *bench.work.glob("packed.*")]:
        path.unlink(missing_ok=True)
    bench.add("shade", ["program", "cpu s", "÷ gdaldem", "wall s", "peak MB"], rows,
              f"{source.name}, {side} x {side} int16, uncompressed for GDAL and in its memory whole; each divided by gdaldem's "
              f"of the same kind of file, pictures by its plain one; medians of {bench.options.rounds} rounds, "
              f"{bench.machine()}, warm. Spearman's rank correlation of the two hillshades, "
              f"315 and 45 degrees: {like:.4f}.")
    bench.results["shade"] = {"spearman": like, **found}
