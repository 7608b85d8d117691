"""Elevations at random places: isohf sample beside gdallocationinfo."""

import random


def measure(bench):
    side = 1000 if bench.options.smoke else 6000
    counts = [2000, 20000] if bench.options.smoke else [200000, 5000000]
    source = bench.warm(bench.terrain(f"{side}x{side}"))
    archive = bench.work / "sample.isohf"
    bench.run(bench.isohf, "convert", source, "-o", archive, "--overwrite", "--quiet")
    bench.warm(archive)
    jobs = {}
    for count in counts:
        lines = bench.work / f"places_{count}.txt"
        chance = random.Random(12)
        # Samples are posts one world unit apart: a place is the same to both programs.
        places = [(chance.uniform(0, side - 1), chance.uniform(0, side - 1)) for _ in range(count)]
        lines.write_text("".join(f"{x:.3f} {z:.3f}\n" for x, z in places))
        names = {f"isohf sample, {count}": f"{bench.isohf} sample {archive} < {lines}"}
        if count == counts[0]:
            names = {**names, f"isohf sample -j 1, {count}": f"{bench.isohf} sample {archive} -j 1 < {lines}",
                     f"gdallocationinfo -valonly, {count}": f"gdallocationinfo -valonly {source} < {lines}"}
        for name, command in names.items():
            jobs[name] = ["bash", "-c", f"{command} > {bench.work / 'answers'}"]
    found = bench.in_turn(jobs, bench.options.rounds)
    theirs = found[f"gdallocationinfo -valonly, {counts[0]}"]["wall_s"] / counts[0]
    rows = []
    for name, run in found.items():
        count = int(name.rsplit(" ", 1)[1])
        rows.append([name, f"{run['wall_s']:.2f}", f"{run['cpu_s']:.2f}", f"{run['peak_mb']:.0f}",
                     f"{1e-6 * count / run['wall_s']:.2f}", f"{run['wall_s'] / count / theirs:.2f}"])
    for path in bench.work.glob("places_*"):
        path.unlink()
    bench.add("sample", ["program, places", "wall s", "cpu s", "peak MB", "million places a second", "time a place ×"], rows,
              f"{source.name}, {side} x {side} int16, uncompressed for GDAL, {archive.stat().st_size / 1e6:.0f} MB as an archive; "
              f"the same random places for both; medians of {bench.options.rounds} rounds, {bench.machine()}, warm. The last "
              "column: divided by gdallocationinfo's, which gives the nearest sample; isohf gives the surface there and its "
              "normal.")
    bench.results["sample"] = found
    archive.unlink()
