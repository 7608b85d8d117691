"""Peak memory of isohf convert under several values of --memory, for filters, shadow seeds and residuals."""

import hashlib
import json

KINDS = {"bilinear": ["--filter", "bilinear"], "bspline5": ["--filter", "bspline5"],
         "with seeds": ["--filter", "bilinear", "--shadow-seeds"], "--lossless": ["--filter", "bilinear", "--lossless"]}
LIMITS_MB = [None, 512, 256, 128, 64, 32]


def measure(bench):
    # Memory follows the width: the larger input is as wide as the one of `large`, and lower.
    sizes = ["16384x1024"] if bench.options.small else ["16384x8192", "65536x4096"]
    limits = [None, 128, 32] if bench.options.small else LIMITS_MB
    found, rows = {}, []
    archive = bench.work / "memory.isohf"
    for size in sizes:
        source = bench.terrain(size)
        for kind, options in KINDS.items():
            convert = [bench.isohf, "convert", source, "-o", archive, *options]
            least = json.loads(bench.run(*convert, "--dry-run", "--json")["out"])["least_memory_bytes"] / 1e6
            cells, digests, peaks = [], set(), {}
            for limit in limits:
                if limit is not None and limit < least:
                    cells.append("refused")
                    continue
                bound = [] if limit is None else ["--memory", f"{limit}MB"]
                run = bench.run(*convert, "--overwrite", "--quiet", *bound)
                peak = run["peak_mb"] * 1.048576
                if limit is not None and peak > 1.1 * limit:
                    bench.fail(f"{size} {kind} --memory {limit}MB took {peak:.0f} MB")
                peaks[limit] = peak
                digests.add(hashlib.sha256(archive.read_bytes()).hexdigest())
                cells.append(f"{peak:.0f} MB, {run['cpu_s']:.1f} s")
                archive.unlink()
            if len(digests) != 1:
                bench.fail(f"{size} {kind}: the archives differ with --memory")
            found[f"{size} {kind}"] = {"least_mb": least, "peaks_mb": {str(k): v for k, v in peaks.items()}}
            rows.append([size, kind, f"{least:.0f} MB", *cells])
    bench.add("memory", ["samples", "kind", "least"] + ["free" if x is None else f"{x} MB" for x in limits], rows,
              f"One run each, {bench.machine()}: largest resident set (MB of 1000000 bytes) and processor time; least: what "
              "`--dry-run` states. The archives of a row are the same, byte for byte.")
    bench.results["memory"] = found
