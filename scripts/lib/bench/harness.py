"""What every section of scripts/bench uses: runs programs, makes inputs, keeps tables."""

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


class Bench:
    def __init__(self, options):
        self.options = options
        self.root = pathlib.Path(options.root)
        self.isohf = str(self.root / "build/bin/isohf")
        self.convert = [self.isohf, "convert", "--filter", "bilinear"]  # as GDAL_OPTIONS resample
        self.work = self.root / "build/bench"
        self.work.mkdir(parents=True, exist_ok=True)
        self.results = {}
        self.tables = {}
        self.complaints = []

    def say(self, text):
        print(f"bench: {text}", file=sys.stderr)

    def fail(self, why):
        sys.exit(f"bench: {why}")

    def complain(self, why):
        """Goes on, and ends with 1."""
        self.complaints.append(why)
        self.say(why)

    def run(self, *command):
        """Runs once: wall and processor seconds, peak memory in MB, standard output."""
        done = self.run_or_refusal(*command)
        if "refused" in done:
            self.fail(done["refused"])
        return done

    def run_or_refusal(self, *command, given=None, passing=(0,)):
        """The same, or {"refused": why} where the program says how much memory it needs. given: its standard input."""
        with open(given or os.devnull, "rb") as stdin, open(self.work / "time.txt", "w+b") as figures:
            start = time.monotonic()
            result = subprocess.run(["/usr/bin/time", "-f", "%U %S %M", "-o", figures.name, *map(str, command)],
                                    capture_output=True, stdin=stdin, check=False)
            wall = time.monotonic() - start
            result.stderr = result.stderr.decode(errors="replace")
            if result.returncode not in passing:
                if " needs at least " in result.stderr:
                    return {"refused": result.stderr.strip()}
                self.fail(f"{' '.join(map(str, command))}: {result.stderr.strip()}")
            user, system, peak = figures.read().split()[-3:]
        return {"wall_s": wall, "cpu_s": float(user) + float(system), "peak_mb": float(peak) / 1024,
                "out": result.stdout.decode(errors="replace")}

    def cores(self):
        return len(os.sched_getaffinity(0))

    def busy(self, run):
        """Share of all cores' time that a run used, in percent, as text."""
        return f"{100 * run['cpu_s'] / (run['wall_s'] * self.cores()):.0f} %"

    def has(self, section, program, package):
        """Whether a peer is installed; says so where it is not."""
        if shutil.which(program) is not None:
            return True
        self.say(f"{section}: without {program}: it is not installed (Debian package {package})")
        return False

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
        return self.warm(pathlib.Path(self.options.input) if self.options.input else self.terrain(
            "2048x1024" if self.options.smoke else "16384x8192"))

    @staticmethod
    def warm(path):
        """The file in the file cache, and nothing on its way to the disk any more."""
        os.sync()
        with open(path, "rb") as file:
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
        return f"{self.cores()} cores"

    def has_places(self, sections):
        """Fails where docs/performance.md has no place for a section's table, before anything is measured."""
        text = (self.root / "docs/performance.md").read_text()
        for section in sections:
            if f"<!-- {section} -->" not in text or f"<!-- end of {section} -->" not in text:
                self.fail(f"docs/performance.md has no place for the table of {section}: <!-- {section} -->")

    def write(self):
        page = self.root / "docs/performance.md"
        text = page.read_text()
        for section, table in self.tables.items():
            begin, end = f"<!-- {section} -->", f"<!-- end of {section} -->"
            if begin not in text or end not in text:
                self.fail(f"{page}: no place for the table: {begin}")
            text = text[:text.index(begin) + len(begin)] + "\n\n" + table + "\n\n" + text[text.index(end):]
        page.write_text(text)
