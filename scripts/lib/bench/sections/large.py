"""65536x32768 (4 GB, needs 12 GB of disk) against 16384x8192: time a sample, memory."""


def measure(bench):
    sizes = ["2048x1024", "8192x4096"] if bench.options.small else ["16384x8192", "65536x32768"]
    found, rows = {}, []
    for size in sizes:
        source, archive = bench.warm(bench.terrain(size)), bench.work / "large.isohf"
        run = bench.run(*bench.convert, source, "-o", archive, "--overwrite", "--quiet")
        samples = bench.info(archive)["lattice_samples"]
        found[size] = {**run, "samples": samples, "bytes": archive.stat().st_size}
        del found[size]["out"]
        archive.unlink()
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
