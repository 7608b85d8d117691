"""Peak memory of isohf under several values of --memory: conversions by their options, and every command that reads."""

import hashlib
import re

# Conversions: archive, options.
KINDS = {"bilinear": ["--filter", "bilinear"], "bspline3": ["--filter", "bspline3"],
         "with seeds": ["--filter", "bilinear", "--shadow-seeds"], "--lossless": ["--filter", "bilinear", "--lossless"],
         "--fill": ["--filter", "bilinear", "--nodata", "900", "--fill"]}
# What is read: the archive of a kind above, and how; OUT is written, or nothing.
READERS = {"export": ("bilinear", ["export", "IN", "OUT.npy"]),
           "export to a GeoTIFF": ("bilinear", ["export", "IN", "OUT.tif"]),
           "export, --lossless": ("--lossless", ["export", "IN", "OUT.npy"]),
           "export --method barycentric": ("bilinear", ["export", "IN", "OUT.npy", "--method", "barycentric"]),
           "export to .r16": ("bilinear", ["export", "IN", "OUT.r16", "--method", "hex"]),
           "export in 8 tiles": ("bilinear", ["export", "IN", "OUT.r32", "--tile-size", "TILE"]),
           "diff": ("bilinear", ["diff", "IN", "seeds"]),
           "diff --surface": ("bilinear", ["diff", "IN", "bspline3", "--surface"]),
           "diff --raster": ("bilinear", ["diff", "IN", "bspline3", "--raster", "OUT.npy"]),
           "verify": ("bilinear", ["verify", "IN"]),
           "verify, with seeds": ("with seeds", ["verify", "IN"]),
           "verify, --lossless": ("--lossless", ["verify", "IN"]),
           "verify --against": ("bilinear", ["verify", "IN", "--against", "SOURCE"]),
           "shade": ("bilinear", ["shade", "IN", "OUT.png"]),
           "shade, every sample": ("bilinear", ["shade", "IN", "OUT.tif", "--size", "FULL"]),
           "shade --sun 200,15": ("bilinear", ["shade", "IN", "OUT.tif", "--size", "FULL", "--sun", "200,15"]),
           "shade --sun 350,15": ("bilinear", ["shade", "IN", "OUT.tif", "--size", "FULL", "--sun", "350,15"]),
           "shade, OpenEXR": ("bilinear", ["shade", "IN", "OUT.exr", "--size", "FULL", "--sun", "90,15"]),
           "shade --kind hillshade": ("bilinear", ["shade", "IN", "OUT.tif", "--size", "FULL", "--kind", "hillshade"]),
           "shade --kind shadow-mask": ("bilinear", ["shade", "IN", "OUT.png", "--size", "FULL", "--kind", "shadow-mask"]),
           "sample, 1,000,000 places": ("bilinear", ["sample", "IN"]),
           "info": ("bilinear", ["info", "IN"]),
           "extract": ("bilinear", ["extract", "IN", "-o", "OUT.isohf", "--tiles", "0:9,0:1"]),
           "extract --overview 1": ("bilinear", ["extract", "IN", "-o", "OUT.isohf", "--overview", "1"])}
WITHOUT_LIMIT = {"info", "diff", "diff --surface", "diff --raster", "sample, 1,000,000 places", "extract", "extract --overview 1"}  # which hold as little whatever the width
DIFFER = 3  # what diff and verify end with where there is something to tell


def digest_of(path):
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while part := file.read(1 << 24):
            digest.update(part)
    return digest.hexdigest()


def places(bench, size):
    """A file of places over the ground."""
    path = bench.work / "memory_places.txt"
    width, height = (int(side) for side in size.split("x"))
    count = 10000 if bench.options.smoke else 1000000
    with open(path, "w") as file:
        for i in range(count):
            file.write(f"{i * 0.618033988749895 % 1.0 * width:.17g} {i * 0.754877666246693 % 1.0 * height:.17g}\n")
    return path


def measure_limits(bench, name, limits, run):
    """Cells; run(bound) returns what was measured and a digest of what was made, or None where refused."""
    cells, digests, peaks = [], set(), {}
    for limit in limits:
        done = run([] if limit is None else ["--memory", f"{limit}MB"])
        if done is None:
            cells.append("refused")
            continue
        measured, digest = done
        peak = measured["peak_mb"] * 1.048576
        if limit is not None and peak > 1.1 * limit:
            bench.complain(f"{name} --memory {limit}MB took {peak:.0f} MB")
        peaks[limit] = peak
        digests.add(digest)
        cells.append(f"{peak:.0f} MB, {measured['cpu_s']:.1f} s")
    if len(digests) > 1:
        bench.complain(f"{name}: what is made differs with --memory")
    return cells, peaks


def measure_size(bench, size, limit, found, rows):
    source = bench.terrain(size)
    archives = {kind: bench.work / f"memory_{i}.isohf" for i, kind in enumerate(KINDS)}
    output = bench.work / "memory_out"
    width, height = (int(side) for side in size.split("x"))
    words = {"SOURCE": source, "FULL": size, "TILE": f"{width // 8}x{height}", "seeds": archives["with seeds"],
             "bspline3": archives["bspline3"]}
    commands = {f"convert, {kind}": (["convert", source, "-o", archives[kind], *options, "--overwrite", "--quiet"],
                                     archives[kind], None) for kind, options in KINDS.items()}
    for name, (kind, command) in READERS.items():
        command = [str(archives[kind] if w == "IN" else words.get(w, w)).replace("OUT", str(output)) for w in command]
        written = next((w for w in command if w.startswith(str(output))), None)
        if written is not None:
            command += ["--overwrite", "--quiet"]
        commands[name] = (command, written, archives[kind])
    for name, (command, written, archive) in commands.items():
        command = [bench.isohf, *command]
        given = places(bench, size) if name.startswith("sample") else None
        bounded = name not in WITHOUT_LIMIT

        refusal = {}

        def run(bound, command=command, written=written, given=given, name=name):
            measured = bench.run_or_refusal(*command, *bound, given=given, passing=(0, DIFFER))
            if "refused" in measured:
                refusal.update(measured)  # by what comes later, or has a half of it
                return None
            return measured, digest_of(written) if written and "tiles" not in name else measured["out"]

        if bounded:
            refusal.update(bench.run_or_refusal(*command, "--memory", "1MB", given=given, passing=(0, DIFFER)))
        cells, peaks = measure_limits(bench, f"{size} {name}", [None, limit] if bounded else [None], run)
        least = re.search(r"needs at least ([0-9]+) MB", refusal.get("refused", ""))
        if least and "each of the two" in refusal["refused"]:
            least = 2 * int(least.group(1))
        elif least:
            least = int(least.group(1))
        found[f"{size} {name}"] = {"least_mb": least,
                                   "peaks_mb": {str(k): v for k, v in peaks.items()}}
        cells += [""] * (2 - len(cells))
        rows.append([size, name, f"{least} MB" if least else "", cells[0],
                     f"{limit} MB" if bounded else "", cells[1]])
        bench.say(" | ".join(rows[-1]))
        for left in bench.work.glob("memory_out*"):
            left.unlink()
    for archive in archives.values():
        archive.unlink()


def measure(bench):
    # Memory follows the width: two shapes of as many samples, and what each is held to.
    sizes = {"16384x1024": 36} if bench.options.smoke else {"1000000x300": 268, "100000x3000": 64}
    found, rows = {}, []
    try:
        for size, limit in sizes.items():
            measure_size(bench, size, limit, found, rows)
    except KeyboardInterrupt:
        bench.complain("memory: interrupted; the table ends there")
    bench.add("memory", ["samples", "command", "least", "free", "bound", "within it"], rows,
              f"One run each, {bench.machine()}: largest resident set (MB of 1000000 bytes) and processor time; least: "
              "what a refusal states, where there is one. What both runs of a row make is the same, byte for byte.")
    bench.results["memory"] = found
