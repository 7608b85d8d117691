"""Called by scripts/bench: ROOT [SECTION...] [options], as its head says."""

import argparse
import json
import os
import pathlib
import shutil
import statistics
import subprocess
import sys
import time

GDAL_OPTIONS = ["-q", "-r", "bilinear", "-co", "TILED=YES", "-co", "COMPRESS=DEFLATE", "-co", "PREDICTOR=2",
                "-co", "NUM_THREADS=2"]
FILTERS = ["bilinear", "nearest", "catmull-rom", "bspline2", "bspline3", "bspline5", "lanczos3", "lanczos6"]
# Rasters of whole metres without voids: what other compressors can be given as it is.
DEMS = ["srtm_bigtujunga30m_utm11.tif", "N44E006.hgt", "N44E007.hgt", "N41E002.hgt", "N00E010_utm32.tif", "S35E145.tif"]


class Bench:
    def __init__(self, options):
        self.options = options
        self.root = pathlib.Path(options.root)
        self.isohf = str(self.root / "build/bin/isohf")
        self.work = self.root / "build/bench"
        self.work.mkdir(parents=True, exist_ok=True)
        self.results = {}
        self.tables = {}

    def fail(self, why):
        sys.exit(f"bench: {why}")

    def run(self, *command):
        """Runs once: wall and processor seconds, peak memory in MB, standard output."""
        with open(self.work / "time.txt", "w+b") as figures:
            start = time.monotonic()
            result = subprocess.run(["/usr/bin/time", "-f", "%U %S %M", "-o", figures.name, *map(str, command)],
                                    capture_output=True, text=True, check=False)
            wall = time.monotonic() - start
            if result.returncode != 0:
                self.fail(f"{' '.join(map(str, command))}: {result.stderr.strip()}")
            user, system, peak = figures.read().split()[-3:]
        return {"wall_s": wall, "cpu_s": float(user) + float(system), "peak_mb": float(peak) / 1024,
                "out": result.stdout}

    def in_turn(self, jobs, rounds):
        """Runs every job once, then every one again; medians by name."""
        runs = {name: [] for name in jobs}
        for _ in range(rounds):
            for name, command in jobs.items():
                runs[name].append(self.run(*command))
        return {name: {key: statistics.median(run[key] for run in done) for key in ("wall_s", "cpu_s", "peak_mb")}
                for name, done in runs.items()}

    def terrain(self, size):
        path = self.work / f"land_{size}.tif"
        if not path.exists():
            part = path.with_suffix(".part.tif")
            self.run(self.root / "build/bin/make_terrain", "--size", size, "--uncompressed", "--quiet", "-o", part)
            part.rename(path)
        return path

    def input(self):
        path = pathlib.Path(self.options.input) if self.options.input else self.terrain(
            "2048x1024" if self.options.small else "16384x8192")
        with open(path, "rb") as file:  # into the file cache
            while file.read(1 << 24):
                pass
        return path

    def info(self, archive):
        return json.loads(self.run(self.isohf, "info", archive, "--json")["out"])

    def add(self, section, header, rows, note):
        lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
        lines += ["| " + " | ".join(row) + " |" for row in rows]
        self.tables[section] = "\n".join([*lines, "", note])

    def machine(self):
        return f"{len(os.sched_getaffinity(0))} cores"

    def convert(self):
        source = self.input()
        # As many samples as the lattice has, on a raster that shares none with the input: GDAL has to interpolate.
        size = ["1907", "1099"] if self.options.small else ["15247", "8803"]
        rounds = self.options.rounds
        archive, step1 = self.work / "iso.isohf", self.work / "iso1.isohf"
        translated, warped = self.work / "translate.tif", self.work / "warp.tif"
        jobs = {
            "isohf convert": [self.isohf, "convert", source, "-o", archive, "--overwrite", "--quiet"],
            "isohf convert --step 1": [self.isohf, "convert", source, "-o", step1, "--overwrite", "--quiet", "--step",
                                       "1"],
            "gdal_translate": ["gdal_translate", *GDAL_OPTIONS, "-outsize", *size, source, translated],
            "gdalwarp -multi": ["gdalwarp", "-multi", "-overwrite", *GDAL_OPTIONS, "-ts", *size, source, warped],
        }
        found = self.in_turn(jobs, rounds)
        for name, path in zip(jobs, (archive, step1, translated, warped)):
            samples = int(size[0]) * int(size[1])
            if path.suffix == ".isohf":
                samples = self.info(path)["lattice_samples"]
            found[name] |= {"bytes": path.stat().st_size, "samples": samples}
        starts = sorted(self.run(self.isohf, "info", archive)["wall_s"] for _ in range(50))
        us = found["isohf convert"]
        rows = [[name, f"{run['wall_s']:.2f}", f"{run['cpu_s']:.2f}", f"{run['peak_mb']:.0f}",
                 f"{run['bytes'] / 1e6:.1f}", f"{8 * run['bytes'] / run['samples']:.2f}",
                 f"{run['wall_s'] / us['wall_s']:.2f}", f"{run['cpu_s'] / us['cpu_s']:.2f}",
                 f"{run['peak_mb'] / us['peak_mb']:.2f}"] for name, run in found.items()]
        self.add("convert", ["program", "wall s", "cpu s", "peak MB", "MB", "bits a sample", "wall ×", "cpu ×", "peak ×"],
                 rows, f"{source.name}, medians of {rounds} rounds, {self.machine()}; ×: divided by isohf convert's. The "
                 f"other programs write whole metres, as `--step 1` does. `isohf info`: {1000 * starts[25]:.1f} ms, median "
                 "of 50 starts.")
        self.results["convert"] = found
        for path in (archive, step1, translated, warped):
            path.unlink()

    def filters(self):
        source = self.input()
        rounds = self.options.rounds
        found = self.in_turn({name: [self.isohf, "convert", source, "-o", self.work / f"{name}.isohf", "--filter", name,
                                     "--overwrite", "--quiet"] for name in FILTERS}, rounds)
        for name in FILTERS:
            path = self.work / f"{name}.isohf"
            found[name]["bytes"] = path.stat().st_size
            path.unlink()
        base = found["bilinear"]
        rows = [[name, f"{run['wall_s']:.2f}", f"{run['cpu_s']:.2f}", f"{run['peak_mb']:.0f}",
                 f"{run['bytes'] / 1e6:.1f}",
                 *(f"{run[key] / base[key]:.2f}" for key in ("wall_s", "cpu_s", "peak_mb", "bytes"))]
                for name, run in found.items()]
        self.add("filters", ["filter", "wall s", "cpu s", "peak MB", "archive MB", "wall", "cpu", "peak", "archive"], rows,
                 f"{source.name}, medians of {rounds} rounds, {self.machine()}; the last four columns: divided by "
                 "bilinear's.")
        self.results["filters"] = found

    def sizes(self):
        folder = pathlib.Path(self.options.data)
        dems = [folder / name for name in DEMS if (folder / name).exists()]
        if self.options.small:
            dems = dems[:1]
        if not dems:
            print(f"bench: sizes: skipped: {folder} has none of the DEMs", file=sys.stderr)
            return
        has_jxl = shutil.which("cjxl") is not None
        if not has_jxl:
            print("bench: sizes: without JPEG XL: cjxl is not installed", file=sys.stderr)
        rows, found = [], {}
        for dem in dems:
            archive, cog = self.work / "size.isohf", self.work / "size.tif"
            us = self.run(self.isohf, "convert", dem, "-o", archive, "--overwrite", "--quiet", "--step", "1", "-j", "1")
            info = self.info(archive)
            tile_bytes = info["tile_bytes"]
            source = info["metadata"]["source"]
            source_samples = source["width"] * source["height"]
            self.run("gdal_translate", "-q", "-of", "COG", "-co", "COMPRESS=DEFLATE", "-co", "PREDICTOR=2", "-co",
                     "OVERVIEWS=NONE", dem, cog)
            row = {"bits": 8 * tile_bytes / info["lattice_samples"], "cog_bits": 8 * cog.stat().st_size / source_samples,
                   "tile_bytes": tile_bytes, "convert_cpu_s": us["cpu_s"]}
            if has_jxl:
                pgm, jxl = self.work / "size.pgm", self.work / "size.jxl"
                self.run(self.root / "build/bench/lattice_to_pgm", archive, pgm)
                for effort in ("7", "9"):
                    run = self.run("cjxl", pgm, jxl, "-d", "0", "-e", effort, "--num_threads=0", "--quiet")
                    row |= {f"jxl{effort}_bytes": jxl.stat().st_size, f"jxl{effort}_cpu_s": run["cpu_s"]}
                pgm.unlink()
                jxl.unlink()
            archive.unlink()
            cog.unlink()
            found[dem.name] = row
            cells = [dem.name, f"{row['bits']:.2f}", f"{row['cog_bits']:.2f}", f"{row['bits'] / row['cog_bits']:.2f}"]
            for effort in ("7", "9") if has_jxl else ():
                cells += [f"{tile_bytes / row[f'jxl{effort}_bytes']:.2f}",
                          f"{row[f'jxl{effort}_cpu_s'] / row['convert_cpu_s']:.0f}"]
            rows.append(cells)
        header = ["DEM, steps of 1 m", "isohf, bits a sample", "COG, bits a sample", "isohf / COG"]
        if has_jxl:
            header += ["bytes / JPEG XL -e 7", "its cpu ×", "bytes / JPEG XL -e 9", "its cpu ×"]
            medians = [f"{statistics.median(float(row[i]) for row in rows):.2f}" for i in range(3, 8)]
            medians[2], medians[4] = f"{float(medians[2]):.0f}", f"{float(medians[4]):.0f}"
        else:
            medians = [f"{statistics.median(float(row[3]) for row in rows):.2f}"]
        rows.append(["median", "", "", *medians])
        self.add("sizes", header, rows,
                 "Elevations alone, equal density. isohf's tiles are counted with their padding; JPEG XL gets the same "
                 "vertices as one picture, each once, without padding. COG: DEFLATE, predictor 2, no overviews, of the ortho "
                 "source itself. Processor time against the whole of `isohf convert`, one thread.")
        self.results["sizes"] = found

    def large(self):
        sizes = ["2048x1024", "8192x4096"] if self.options.small else ["16384x8192", "65536x32768"]
        found, rows = {}, []
        for size in sizes:
            source, archive = self.terrain(size), self.work / "large.isohf"
            run = self.run(self.isohf, "convert", source, "-o", archive, "--overwrite", "--quiet")
            samples = self.info(archive)["lattice_samples"]
            found[size] = {**run, "samples": samples, "bytes": archive.stat().st_size}
            del found[size]["out"]
            archive.unlink()
        first = found[sizes[0]]
        for size, run in found.items():
            rows.append([size, f"{run['wall_s']:.1f}", f"{run['cpu_s']:.1f}", f"{run['peak_mb']:.0f}",
                         f"{1e9 * run['cpu_s'] / run['samples']:.1f}",
                         f"{run['cpu_s'] / run['samples'] / (first['cpu_s'] / first['samples']):.2f}",
                         f"{run['wall_s'] / run['samples'] / (first['wall_s'] / first['samples']):.2f}"])
        self.add("large", ["samples", "wall s", "cpu s", "peak MB", "cpu ns a sample", "cpu ×", "wall ×"], rows,
                 f"One run each, {self.machine()}; ×: a sample's time divided by that of {sizes[0]}. The larger input is "
                 "read from the disk where memory does not cache it.")
        self.results["large"] = found

    def write(self):
        page = self.root / "docs/performance.md"
        text = page.read_text()
        for section, table in self.tables.items():
            begin, end = f"<!-- {section} -->", f"<!-- end of {section} -->"
            if begin not in text or end not in text:
                self.fail(f"{page}: no place for the table: {begin}")
            text = text[:text.index(begin) + len(begin)] + "\n\n" + table + "\n\n" + text[text.index(end):]
        page.write_text(text)


def main():
    root = pathlib.Path(sys.argv[1])
    parser = argparse.ArgumentParser(prog="scripts/bench")
    parser.add_argument("root")
    parser.add_argument("sections", nargs="*", metavar="SECTION")
    parser.add_argument("--rounds", type=int, default=None)
    parser.add_argument("--small", action="store_true")
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--data", default=str(root / "../shared/data"))
    parser.add_argument("--input")
    options = parser.parse_args()
    known = ("convert", "filters", "sizes", "large")
    for section in options.sections:
        if section not in known:
            parser.error(f"{section}: no section; there are {', '.join(known)}")
    if options.rounds is None:
        options.rounds = 2 if options.small else 5
    if options.rounds < 1:
        parser.error("--rounds: at least 1")
    bench = Bench(options)
    for section in options.sections or ["convert"]:
        getattr(bench, section)()
    if options.json:
        print(json.dumps(bench.results, indent=2))
    else:
        print("\n\n".join(bench.tables.values()))
    if options.write:
        bench.write()


if __name__ == "__main__":
    main()
