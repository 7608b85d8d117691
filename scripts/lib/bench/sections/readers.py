"""Every reader against GDAL, oiiotool or numpy for the same file: all samples read, and a figure of them."""

import subprocess

from harness import Bench
from reader_inputs import make_inputs

# Debian's, not one that happens to be first in the path: python3-numpy belongs to it.
PYTHON = "/usr/bin/python3"
NUMPY = "import sys, numpy; a = numpy.load(sys.argv[1])"
# What a peer is asked for: a figure of all samples, or a copy of them in memory. The quicker one counts.
PEERS = {
    "GDAL": {"gdalinfo -checksum": lambda path: ["gdalinfo", "-checksum", path],
             "gdal_translate -of MEM": lambda path: ["gdal_translate", "-q", "-of", "MEM", path, "copy"]},
    "oiiotool": {"oiiotool --stats": lambda path: ["oiiotool", "--stats", path],
                 "oiiotool --crop": lambda path: ["oiiotool", path, "--crop", "1x1+0+0", "-o", path.with_name("pixel.tif")]},
    "numpy": {"numpy.load": lambda path: [PYTHON, "-c", NUMPY, path],
              "numpy.load, mean": lambda path: [PYTHON, "-c", NUMPY + "; print(a.min(), a.max(), a.mean())", path]},
}


def peers_at_hand(bench: Bench):
    """PEERS, less those that are not installed."""
    at_hand = dict(PEERS)
    if subprocess.run([PYTHON, "-c", "import numpy"], capture_output=True, check=False).returncode != 0:
        bench.say("readers: .npy without a peer: numpy is not installed (Debian package python3-numpy)")
        del at_hand["numpy"]
    return at_hand


def row_of(name, item, found):
    us = found["isohf"]
    theirs = [run for what, run in found.items() if what != "isohf"]
    row = [name, f"{item.samples[0]} x {item.samples[1]}", f"{item.path.stat().st_size / 1e6:.0f}",
           f"{us['wall_s']:.3f}", f"{us['cpu_s']:.2f}", f"{us['peak_mb']:.0f}"]
    if not theirs:
        return [*row, "no peer", *["-"] * 4]
    wall, cpu = (min(run[key] for run in theirs) for key in ("wall_s", "cpu_s"))
    return [*row, item.peer, f"{wall:.3f}", f"{cpu:.2f}", f"{wall / us['wall_s']:.2f}", f"{cpu / max(us['cpu_s'], 0.01):.2f}"]


def measure(bench):
    rounds = bench.options.rounds
    peers = peers_at_hand(bench)
    rows, results = [], {}
    for name, item in make_inputs(bench).items():
        jobs = {"isohf": [bench.isohf, "info", "--stats", "--quiet", *item.options, item.path]}
        jobs |= {what: command(item.peer_path or item.path) for what, command in peers.get(item.peer, {}).items()}
        for command in jobs.values():
            bench.run(*command)  # into the file cache
        results[name] = bench.in_turn(jobs, rounds)
        rows.append(row_of(name, item, results[name]))
    bench.add("readers", ["format", "samples", "MB", "isohf wall s", "cpu s", "peak MB", "peer", "wall s", "cpu s", "wall ×", "cpu ×"],
              rows, f"Medians of {rounds} rounds, {bench.machine()}, start of the program included; ×: the peer's divided by "
              "isohf's, more than 1 is quicker than the peer. isohf: `isohf info --stats` (range, mean and voids of all "
              "samples); the peer reads the same file, the quicker of two ways: GDAL's `gdalinfo -checksum` and "
              "`gdal_translate -of MEM`, `oiiotool --stats` and `oiiotool --crop 1x1+0+0` for OpenEXR, which Debian's GDAL "
              "does not read, and numpy's `load` alone and with `min`, `max` and `mean`. GDAL reads raw samples through a VRT, "
              "gzip through /vsigzip/ and zip through /vsizip/.")
    bench.results["readers"] = results
