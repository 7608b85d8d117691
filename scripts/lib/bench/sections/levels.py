"""Bytes and speed of every effort on real DEMs, and of decoding what it wrote."""

import json
import pathlib
import statistics

from sections.sizes import DEMS

EFFORTS = {2: "fast", 5: "default", 6: "best"}  # level_of() of metadata.h
DEFAULT = 5
SMOKE = False  # nothing here depends on the input's size


def measure(bench):
    folder = pathlib.Path(bench.options.data)
    dems = [folder / name for name in DEMS if (folder / name).exists()]
    if not dems:
        bench.say(f"levels: skipped: {folder} has none of the DEMs")
        return
    archive = bench.work / "levels.isohf"
    found = []
    for dem in dems:
        bench.run(*bench.convert, dem, "-o", archive, "--overwrite", "--quiet", "--step", "1")
        levels = json.loads(bench.run(bench.root / "build/bench/levels_bench", archive, bench.options.rounds)["out"])
        found.append({row["level"]: row for row in levels})
    archive.unlink()
    rows, results = [], {}
    for level in sorted(found[0]):
        of_level = [dem[level] for dem in found]
        samples = sum(row["samples"] for row in of_level)
        speed = {key: samples / sum(row[f"{key}_s"] for row in of_level) / 1e6 for key in ("encode", "inflate", "decode")}
        everything = samples / sum(row["inflate_s"] + row["decode_s"] for row in of_level) / 1e6
        ratio = statistics.median(dem[level]["bytes"] / dem[DEFAULT]["bytes"] for dem in found)
        results[level] = {"bytes": sum(row["bytes"] for row in of_level), "ratio": ratio, **speed, "all": everything}
        rows.append([f"**{EFFORTS[level]}**" if level == DEFAULT else EFFORTS[level], f"{ratio:.3f}", f"{speed['encode']:.1f}",
                     f"{speed['inflate']:.0f}", f"{speed['decode']:.0f}", f"{everything:.0f}", f"{2 * everything:.0f}"])
    bench.add("levels", ["effort", "bytes", "encode", "inflate", "decode", "both", "MB/s"], rows,
              f"{len(dems)} DEMs at steps of 1 m, tiles of u16 whose samples are not all equal. Bytes: median of each DEM's, "
              "divided by those of the default. Speeds: M samples a second on one core, processor time, "
              "the best of several runs that take turns with the other efforts; decoding, and with inflating, as M samples "
              "and as MB of samples.")
    bench.results["levels"] = results
