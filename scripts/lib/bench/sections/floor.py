"""isohf convert against reading its input and compressing its residuals with libdeflate, nothing else."""

import json
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
    convert = [bench.isohf, "convert", source, "-o", archive, "--overwrite", "--quiet"]
    bench.run(*convert)
    tile_bytes = write_payloads(archive, payloads)
    jobs = {"isohf convert": convert,
            "floor": [bench.root / "build/bench/floor", source, payloads, tile_bytes, bench.cores()]}
    runs = {name: [] for name in jobs}
    for _ in range(bench.options.rounds):
        for name, command in jobs.items():
            runs[name].append(bench.run(*command))
    # Of each kind the run in the middle: the parts of one floor belong together.
    middle = len(runs["floor"]) // 2
    floors = [json.loads(run["out"]) for run in runs["floor"]]
    floor = sorted(floors, key=lambda run: run["read_s"] + run["deflate_s"])[middle]
    us = sorted(runs["isohf convert"], key=lambda run: run["wall_s"])[middle]
    total = floor["read_s"] + floor["deflate_s"]
    rows = [["read the input", f"{floor['read_s']:.2f}", ""],
            [f"libdeflate, level {floor['level']}, {floor['payload_bytes'] / 1e6:.0f} to {floor['bytes'] / 1e6:.1f} MB",
             f"{floor['deflate_s']:.2f}", ""],
            ["floor: both", f"{total:.2f}", "1.00"],
            [f"isohf convert, {tile_bytes / 1e6:.1f} MB", f"{us['wall_s']:.2f}", f"{us['wall_s'] / total:.2f}"]]
    bench.add("floor", ["", "wall s", "/ floor"], rows,
              f"{source.name}, medians of {bench.options.rounds} rounds, {bench.machine()}, all of them in use "
              f"({bench.busy(us)} of them busy in isohf convert). The level is the one whose bytes come nearest to the "
              "tiles' own.")
    bench.results["floor"] = {**floor, "convert_wall_s": us["wall_s"], "ratio": us["wall_s"] / total}
    archive.unlink()
    payloads.unlink()
