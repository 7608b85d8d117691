"""Peak memory of isohf under several values of --memory: conversions by their options, and every command that reads."""

import hashlib
import json
import re

KINDS = {"bilinear": ["--filter", "bilinear"], "bspline5": ["--filter", "bspline5"],
         "with seeds": ["--filter", "bilinear", "--shadow-seeds"], "--lossless": ["--filter", "bilinear", "--lossless"]}
LIMITS_MB = [None, 512, 256, 128, 64, 32]
# What is read: the archive of a kind above, and how; OUT is written, or nothing.
READERS = {"restore": ("bilinear", ["restore", "IN", "OUT.npy"]),
           "restore, --lossless": ("--lossless", ["restore", "IN", "OUT.npy"]),
           "export --method barycentric": ("bilinear", ["export", "IN", "OUT.npy", "--method", "barycentric"]),
           "diff --raster": ("bilinear", ["diff", "IN", "IN", "--raster", "OUT.npy"]),
           "verify": ("bilinear", ["verify", "IN"]),
           "verify, with seeds": ("with seeds", ["verify", "IN"]),
           "verify, --lossless": ("--lossless", ["verify", "IN"]),
           "verify --against": ("bilinear", ["verify", "IN", "--against", "SOURCE"]),
           "info": ("bilinear", ["info", "IN"]),
           "extract": ("bilinear", ["extract", "IN", "-o", "OUT.isohf", "--tiles", "0:9,0:1"])}
WITHOUT_LIMIT = {"info", "extract"}  # which hold as little whatever the width


def digest_of(path):
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while part := file.read(1 << 24):
            digest.update(part)
    return digest.hexdigest()


def measure_limits(bench, name, limits, run, least):
    """A row of cells; run(bound) returns what was measured and a digest of what was made, or None where refused."""
    cells, digests, peaks = [], set(), {}
    for limit in limits:
        if limit is not None and least is not None and limit < least:
            cells.append("refused")
            continue
        done = run([] if limit is None else ["--memory", f"{limit}MB"])
        if done is None:
            cells.append("refused")
            continue
        measured, digest = done
        peak = measured["peak_mb"] * 1.048576
        if limit is not None and peak > 1.1 * limit:
            bench.fail(f"{name} --memory {limit}MB took {peak:.0f} MB")
        peaks[limit] = peak
        digests.add(digest)
        cells.append(f"{peak:.0f} MB, {measured['cpu_s']:.1f} s")
    if len(digests) != 1:
        bench.fail(f"{name}: what is made differs with --memory")
    return cells, peaks


def measure(bench):
    # Memory follows the width: each input is wider than the one before, and lower.
    sizes = ["16384x1024"] if bench.options.small else ["16384x8192", "65536x4096", "1000000x300"]
    limits = [None, 128, 32] if bench.options.small else LIMITS_MB
    found, rows = {}, []
    for size in sizes:
        source = bench.terrain(size)
        archives = {}
        for kind, options in KINDS.items():
            archive = bench.work / f"memory_{len(archives)}.isohf"
            convert = [bench.isohf, "convert", source, "-o", archive, *options]
            least = json.loads(bench.run(*convert, "--dry-run", "--json")["out"])["least_memory_bytes"] / 1e6

            def run(bound, convert=convert, archive=archive):
                return bench.run(*convert, "--overwrite", "--quiet", *bound), digest_of(archive)

            cells, peaks = measure_limits(bench, f"{size} {kind}", limits, run, least)
            archives[kind] = archive
            found[f"{size} {kind}"] = {"least_mb": least, "peaks_mb": {str(k): v for k, v in peaks.items()}}
            rows.append([size, f"convert, {kind}", f"{least:.0f} MB", *cells])
        for name, (kind, words) in READERS.items():
            command = [bench.isohf] + [str(archives[kind]) if w == "IN" else str(source) if w == "SOURCE" else
                                       w.replace("OUT", str(bench.work / "memory_out")) for w in words]
            output = next((w for w in command if "memory_out" in w), None)

            command += [] if output is None else ["--overwrite", "--quiet"]

            def run(bound, command=command, output=output):
                measured = bench.run_or_refusal(*command, *bound)
                if "refused" in measured:
                    return None
                return measured, digest_of(output) if output else measured["out"]

            refusal = bench.run_or_refusal(*command, "--memory", "1MB") if name not in WITHOUT_LIMIT else {}
            least = float(re.search(r"needs at least ([0-9]+) MB", refusal["refused"]).group(1)) if refusal else None
            cells, peaks = measure_limits(bench, f"{size} {name}", limits if refusal else [None], run, None)
            found[f"{size} {name}"] = {"least_mb": least, "peaks_mb": {str(k): v for k, v in peaks.items()}}
            cells += [""] * (len(limits) - len(cells))
            rows.append([size, name, f"{least:.0f} MB" if refusal else "", *cells])
        for archive in archives.values():
            archive.unlink()
        for left in bench.work.glob("memory_out*"):
            left.unlink()
    bench.add("memory", ["samples", "command", "least"] + ["free" if x is None else f"{x} MB" for x in limits], rows,
              f"One run each, {bench.machine()}: largest resident set (MB of 1000000 bytes) and processor time; least: what "
              "`--dry-run` or a refusal states. What the runs of a row make is the same, byte for byte.")
    bench.results["memory"] = found
