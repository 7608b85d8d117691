#!/usr/bin/env python3
"""Runs the transcripts of tests/cli/golden and compares what the programs say with what stands there.

  golden.py BIN_DIR [--update] [FILE...]

A transcript is what a person would see who types its commands one after another into a folder with the rasters of
testdata/ (coast.tif, voids.tif, ridges.exr, peaks.png):

  # a remark
  $ a line for bash; `isohf` and `isohf-view` are those of BIN_DIR
  |   standard output
  2>  standard error
  =>  exit code, where it is not 0

What changes from run to run or machine to machine is masked: <s> seconds, <version>, <size> of what was compressed.
--update writes what the programs say into the files; git shows the difference.
"""
import difflib
import os
import pathlib
import re
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
TESTDATA = HERE.parent.parent / "testdata"
RASTERS = {"coast.tif": "coast_512x384_int16.tif", "voids.tif": "voids_200x150_int16.tif",
           "ridges.exr": "ridges_161x161_float.exr", "peaks.png": "peaks_256x256_uint16.png"}
MASKS = [(r"\b\d+(\.\d+)? (ms|s)\b", "<s>"),
         (r"\b(isohf|isohf-view|libtiff|libpng|OpenEXR|OpenImageIO|zlib|PROJ) \d+(\.\d+)+", r"\1 <version>"),
         (r"[0-9.]+ million samples a second, [0-9.]+ MB of memory", "<rate>"),
         (r"\b\d+(\.\d+)? (bytes|kB|MB|GB)\b(?! as raw| take| of)", "<size>"),
         (r"[0-9.]+ bits a source sample: [0-9.]+ times", "<ratio>"),
         (r'("(archive_)?bytes"): \d+', r"\1: <size>"),
         (r"[0-9.]+ % of the tiles'", "<share> of the tiles'")]


def prefixed(prefix, text):
    return "".join(f"{prefix}{line}".rstrip() + "\n" for line in text.splitlines())


def run(command, folder, environment):
    result = subprocess.run(["bash", "-c", command], cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                            capture_output=True, timeout=120, check=False)
    said = []
    for prefix, stream in (("|   ", result.stdout), ("2>  ", result.stderr)):
        text = stream.decode("utf-8", "replace")
        for pattern, mask in MASKS:
            text = re.sub(pattern, mask, text, flags=re.MULTILINE)
        said.append(prefixed(prefix, text))
    return "".join(said) + (f"=>  {result.returncode}\n" if result.returncode else "")


def transcript(path, bin_dir):
    """The file as it would read now."""
    environment = {"PATH": f"{bin_dir}:{os.environ['PATH']}", "HOME": "/nonexistent", "LC_ALL": "C.UTF-8"}
    environment.update({k: v for k, v in os.environ.items() if k.startswith(("ASAN_", "UBSAN_", "LSAN_"))})
    now = []
    with tempfile.TemporaryDirectory(prefix="golden") as folder:
        for name, source in RASTERS.items():
            (pathlib.Path(folder) / name).write_bytes((TESTDATA / source).read_bytes())
        for line in path.read_text(encoding="utf-8").splitlines():
            if line.startswith("$ "):
                now.append(line + "\n" + run(line[2:], folder, environment))
            elif not line or line.startswith("#"):
                now.append(line + "\n")
    return "".join(now)


def main():
    arguments = [a for a in sys.argv[1:] if a != "--update"]
    if not arguments or any(a.startswith("-") for a in arguments):
        print(__doc__, file=sys.stderr)
        return 2
    bin_dir = pathlib.Path(arguments[0]).resolve()
    files = [pathlib.Path(a) for a in arguments[1:]] or sorted((HERE / "golden").glob("*.txt"))
    differs = False
    for path in files:
        then, now = path.read_text(encoding="utf-8"), transcript(path, bin_dir)
        if then == now:
            continue
        differs = True
        sys.stdout.writelines(difflib.unified_diff(then.splitlines(True), now.splitlines(True), f"{path} (expected)",
                                                   f"{path} (now)"))
        if "--update" in sys.argv:
            path.write_text(now, encoding="utf-8")
    if differs and "--update" not in sys.argv:
        print("golden: the programs say something else; scripts/test --golden writes it down", file=sys.stderr)
    return 1 if differs and "--update" not in sys.argv else 0


if __name__ == "__main__":
    sys.exit(main())
