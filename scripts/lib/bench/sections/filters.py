"""The same conversion with every filter, against bilinear."""

FILTERS = ["bilinear", "limited-cubic", "nearest", "catmull-rom", "bspline2", "bspline3", "bspline5", "lanczos3", "lanczos6"]


def measure(bench):
    source = bench.input()
    rounds = bench.options.rounds
    found = bench.in_turn({name: [bench.isohf, "convert", source, "-o", bench.work / f"{name}.isohf", "--filter", name,
                                 "--overwrite", "--quiet"] for name in FILTERS}, rounds)
    for name in FILTERS:
        path = bench.work / f"{name}.isohf"
        found[name]["bytes"] = path.stat().st_size
        path.unlink()
    base = found["bilinear"]
    rows = [[name, f"{run['wall_s']:.2f}", f"{run['cpu_s']:.2f}", f"{run['peak_mb']:.0f}",
             f"{run['bytes'] / 1e6:.1f}",
             *(f"{run[key] / base[key]:.2f}" for key in ("wall_s", "cpu_s", "peak_mb", "bytes"))]
            for name, run in found.items()]
    bench.add("filters", ["filter", "wall s", "cpu s", "peak MB", "archive MB", "wall", "cpu", "peak", "archive"], rows,
             f"{source.name}, medians of {rounds} rounds, {bench.machine()}; the last four columns: divided by "
             "bilinear's.")
    bench.results["filters"] = found
