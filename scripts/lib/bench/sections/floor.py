"""isohf convert against reading its input and compressing its residuals with libdeflate, nothing else."""

import json
import statistics
import struct
import zipfile


def write_payloads(archive, path):
    """What the tiles' members inflate to, each behind its length; returns their compressed bytes."""
    compressed = 0
    with zipfile.ZipFile(archive) as file, open(path, "wb") as out:
        for member in file.infolist():
            if member.filename.startswith("tiles/"):
                payload = file.read(member)
                out.write(struct.pack("<I", len(payload)) + payload)
                compressed += member.compress_size
    return compressed


def measure(bench):
    source = bench.input()
    archive, payloads = bench.work / "floor.isohf", bench.work / "floor.payloads"
    convert = [*bench.convert, source, "-o", archive, "--overwrite", "--quiet"]
    bench.run(*convert)
    tile_bytes = write_payloads(archive, payloads)
    jobs = {"isohf convert": convert,
            "floor": [bench.root / "build/bench/floor", source, payloads, tile_bytes, bench.cores()]}
    runs = {name: [] for name in jobs}
    for _ in range(bench.options.rounds):
        for name, command in jobs.items():
            runs[name].append(bench.run(*command))
    floors = [json.loads(run["out"]) for run in runs["floor"]]
    read_s = statistics.median(floor["read_s"] for floor in floors)
    us = sorted(runs["isohf convert"], key=lambda run: run["wall_s"])[len(floors) // 2]
    nearest = floors[0]["nearest"]
    rows = [["isohf convert", f"{tile_bytes / 1e6:.1f}", "", f"{us['wall_s']:.2f}", ""]]
    ratios = {}
    for i, level in enumerate(floors[0]["levels"]):
        deflate_s = statistics.median(floor["levels"][i]["deflate_s"] for floor in floors)
        total = read_s + deflate_s
        ratios[level["level"]] = us["wall_s"] / total
        name = f"read, libdeflate level {level['level']}" + (" (nearest in size)" if level["level"] == nearest else "")
        rows.append([name, f"{level['bytes'] / 1e6:.1f}", f"{deflate_s:.2f}", f"{total:.2f}", f"{us['wall_s'] / total:.2f}"])
    bench.add("floor", ["", "MB", "deflate s", "wall s", "isohf convert / floor"], rows,
              f"{source.name}, medians of {bench.options.rounds} rounds, {bench.machine()}, all of them in use "
              f"({bench.busy(us)} of them busy in isohf convert). Reading takes {read_s:.2f} s; the tiles inflate to "
              f"{floors[0]['payload_bytes'] / 1e6:.0f} MB.")
    bench.results["floor"] = {"read_s": read_s, "nearest": nearest, "convert_wall_s": us["wall_s"], "ratios": ratios}
    archive.unlink()
    payloads.unlink()
