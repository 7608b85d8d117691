"""One sun over a large archive: the shadows of all its ground, by where the sun stands."""


def measure(bench):
    side = (2048, 1024) if bench.options.small else (16384, 8192)
    source = bench.warm(bench.terrain("{}x{}".format(*side)))
    archive, mask = bench.work / "suns.isohf", bench.work / "mask.tif"
    bench.run(bench.isohf, "convert", source, "-o", archive, "--overwrite", "--quiet")
    bench.warm(archive)
    jobs = {}
    for share in (1, 32):
        size = f"{side[0] // share}x{side[1] // share}"
        for azimuth in (270, 300, 350, 200):
            jobs[f"{azimuth} | {size}"] = [bench.isohf, "shade", archive, "-o", mask, "--shadow-mask", "--azimuth", azimuth,
                                           "--altitude", "20", "--size", size, "--uncompressed", "--overwrite", "--quiet"]
    found = bench.in_turn(jobs, bench.options.rounds)
    rows = [[*name.split(" | "), f"{run['cpu_s']:.2f}", f"{run['wall_s']:.2f}", f"{run['peak_mb']:.0f}"]
            for name, run in found.items()]
    hours = {}
    for name, run in found.items():
        hours.setdefault(name.split(" | ")[1], []).append(run["cpu_s"])
    # Half of the year's hours have sun.
    year = "; ".join(f"{size}: {4380 * sum(times) / len(times) / 3600:.1f} hours" for size, times in hours.items())
    for path in (archive, mask):
        path.unlink(missing_ok=True)
    bench.add("suns", ["azimuth", "picture", "cpu s", "wall s", "peak MB"], rows,
              f"{source.name}, {side[0]} x {side[1]} samples, `isohf shade --shadow-mask --altitude 20 --uncompressed`; medians "
              f"of {bench.options.rounds} rounds, {bench.machine()}, warm. A year's 4,380 hours of sun at the mean of these "
              f"azimuths, processor time: {year}.")
    bench.results["suns"] = found
