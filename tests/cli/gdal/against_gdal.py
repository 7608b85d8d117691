"""What tests that hold the program against GDAL share: the program, what failed, one folder for each part.

Ends with 77 where GDAL's Python package is missing (Debian: python3-gdal).
"""
import pathlib
import subprocess
import sys
import tempfile

try:
    import numpy  # noqa: F401 (looked for on behalf of those that import this)
    from osgeo import gdal, osr
except ImportError:
    print("GDAL's Python package or numpy is missing")
    sys.exit(77)

gdal.UseExceptions()
osr.UseExceptions()
failures = []


def check(holds, what):
    if not holds:
        failures.append(what)
        print("FAILED " + what)


class Program:
    def __init__(self, folder, bin_dir):
        self.folder = folder
        self.bin = bin_dir

    def run(self, *arguments):
        return subprocess.run([f"{self.bin}/isohf", *map(str, arguments)], capture_output=True, text=True, check=False)

    def must(self, *arguments):
        result = self.run(*arguments)
        check(result.returncode == 0, f"isohf {' '.join(map(str, arguments))}: {result.stderr.strip()}")
        return result

    def refuses(self, said, *arguments):
        result = self.run(*arguments)
        lines = result.stderr.strip().splitlines()
        check(result.returncode in (1, 2) and len(lines) == 1 and said in lines[0],
              f"isohf {' '.join(map(str, arguments))}: must say '{said}' in one line, said: {result.stderr.strip()}")


def run_parts(parts, usage, program=Program):
    """Calls each part with the program and a folder of its own; the code that the process ends with."""
    if len(sys.argv) != 2:
        print(usage, file=sys.stderr)
        return 2
    bin_dir = pathlib.Path(sys.argv[1]).resolve()
    for part in parts:
        with tempfile.TemporaryDirectory(prefix="against-gdal") as folder:
            part(program(pathlib.Path(folder), bin_dir), pathlib.Path(folder))
    print(f"{len(failures)} failures")
    return 1 if failures else 0
