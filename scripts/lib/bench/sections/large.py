"""65536x32768 (4 GB, needs 12 GB of disk) against 16384x8192: time a sample, memory, the first picture of the whole."""

import os
import subprocess


def bytes_read(command):
    """What a program read of files, as Linux counts it."""
    program = subprocess.Popen([*map(str, command)], stdout=subprocess.DEVNULL)
    os.waitid(os.P_PID, program.pid, os.WEXITED | os.WNOWAIT)
    with open(f"/proc/{program.pid}/io", encoding="ascii") as counts:
        read = int(counts.readline().split()[1])
    program.wait()
    return read


def measure(bench):
    sizes = ["2048x1024", "8192x4096"] if bench.options.smoke else ["16384x8192", "65536x32768"]
    found, rows = {}, []
    for size in sizes:
        source, archive = bench.warm(bench.terrain(size)), bench.work / "large.isohf"
        run = bench.run(*bench.convert, source, "-o", archive, "--overwrite", "--quiet")
        samples = bench.info(archive)["lattice_samples"]
        found[size] = {**run, "samples": samples, "bytes": archive.stat().st_size}
        del found[size]["out"]
    bytes_of_last = bench.warm(archive).stat().st_size
    picture = bench.work / "whole.png"
    looks = {"isohf shade --size 1024": [bench.isohf, "shade", archive, "-o", picture, "--size", "1024", "--overwrite", "--quiet"],
             "isohf view --screenshot, 1280x720": [bench.isohf, "view", archive, "--screenshot", picture, "--memory", "512M",
                                                   "--overwrite", "--quiet"]}
    wholes = []
    for name, run in bench.in_turn(looks, 5).items():
        read = bytes_read(looks[name])
        wholes.append([name, f"{run['cpu_s']:.2f}", f"{run['wall_s']:.2f}", f"{run['peak_mb']:.0f}", f"{read / 1e6:.1f}",
                       f"{100 * read / bytes_of_last:.2f} %"])
    archive.unlink()
    picture.unlink()
    first = found[sizes[0]]
    for size, run in found.items():
        rows.append([size, f"{run['wall_s']:.1f}", f"{run['cpu_s']:.1f}", f"{run['peak_mb']:.0f}",
                     f"{1e9 * run['cpu_s'] / run['samples']:.1f}",
                     f"{run['cpu_s'] / run['samples'] / (first['cpu_s'] / first['samples']):.2f}",
                     f"{run['wall_s'] / run['samples'] / (first['wall_s'] / first['samples']):.2f}"])
    bench.add("large", ["samples", "wall s", "cpu s", "peak MB", "cpu ns a sample", "cpu ×", "wall ×"], rows,
             f"One run each, {bench.machine()}; ×: a sample's time divided by that of {sizes[0]}. Both inputs were "
             "read once before; what memory does not cache of the larger is read from the disk.")
    bench.results["large"] = found
    bench.add("whole", ["first picture of the whole", "cpu s", "wall s", "peak MB", "MB read", "of the archive's bytes"], wholes,
              f"{sizes[-1]} samples, an archive of {bytes_of_last / 1e6:.0f} MB; medians of 5 rounds in turn, {bench.machine()}, warm, "
              "no GPU. Read: all files, the programs' own libraries too.")
