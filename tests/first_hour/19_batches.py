"""Someone runs isohf by the hundred: pipes that close, folders that cannot be written to, tiles of the sea, a forgotten
--resume, and strangers for merge and diff."""
import json
import os
import random
import shutil
import signal
import subprocess

from first_hour import BIN, CASES, FOLDER, TESTDATA, check, isohf, refuses, write_asc

COAST = TESTDATA / "coast_512x384_int16.tif"
PEAKS = TESTDATA / "peaks_256x256_uint16.png"
isohf("convert", COAST, "coast.isohf", "-q")
isohf("convert", PEAKS, "peaks.isohf", "-q")


# 1. A reader that has gone: no message, and the end by SIGPIPE that cat and gdalinfo have (141 in a shell).
def into_closed_pipe(program, *arguments):
    reading, writing = os.pipe()
    os.close(reading)
    process = subprocess.run([str(BIN / program), *map(str, arguments)], cwd=FOLDER, stdout=writing, stderr=subprocess.PIPE,
                             text=True, timeout=60, check=False)
    os.close(writing)
    return process


rasters = FOLDER / "rasters"
rasters.mkdir()
for number in range(40):
    shutil.copy(COAST, rasters / f"t{number:02}.tif")
for program, arguments in (("isohf", ["formats"]), ("isohf", ["plan"]), ("isohf", ["--help"]), ("isohf", ["--version"]),
                           ("isohf", ["info", "coast.isohf", "--tiles"]), ("isohf", ["info", COAST]),
                           ("isohf", ["verify", "coast.isohf"]), ("isohf", ["verify", "coast.isohf", "--json"]),
                           ("isohf", ["diff", "coast.isohf", "peaks.isohf"]), ("isohf", ["export", "coast.isohf", "p.tif"]),
                           ("isohf", ["convert", "rasters", "--out-dir", "piped", "--json"]),
                           ("isohf-view", ["--help"]), ("isohf-experiment", ["--help"])):
    if not (BIN / program).exists():
        continue
    ended = into_closed_pipe(program, *arguments)
    check(ended.returncode == -signal.SIGPIPE and ended.stderr == "",
          f"{program} {arguments} into a closed pipe: {ended.returncode}, '{ended.stderr}'")
check(not list(FOLDER.rglob("*.part*")), "a part file after a closed pipe")
shell = subprocess.run(["bash", "-c", f"set -o pipefail; '{BIN}/isohf' info coast.isohf --tiles --json | head -c 1"], cwd=FOLDER,
                       capture_output=True, text=True, timeout=60, check=False)
check(shell.returncode in (0, 141) and shell.stderr == "", f"in a shell: {shell.returncode} {shell.stderr}")

# 2. A folder that cannot be made or written to is one line, however many files there are, and nothing was begun.
(FOLDER / "file").write_text("")
result = refuses("convert", "rasters", "--out-dir", "file/new", "--keep-going", words=["file/new", "Not a directory"])
check(result.out == "", result.out)
locked = FOLDER / "locked"
locked.mkdir()
locked.chmod(0o555)
FOLDER.chmod(0o755)
command = [str(BIN / "isohf"), "convert", "rasters", "--out-dir", "locked", "--keep-going"]
try:
    user = {"user": 65534} if os.geteuid() == 0 else {}
    process = subprocess.run(command, cwd=FOLDER, capture_output=True, text=True, timeout=60, check=False, **user)
    check(process.returncode == 1 and process.stdout == "" and len(process.stderr.splitlines()) == 1 and "locked" in process.stderr,
          f"{process.returncode}\n{process.stdout}{process.stderr}")
except PermissionError:
    pass  # another user cannot run the program
# Each failure is printed once.
(rasters / "bad.asc").write_text("ncols 2\nnrows 2\ncellsize 1\n1 2 three 4\n")
result = isohf("convert", "rasters", "--out-dir", "made", "--keep-going", code=1)
check((result.out + result.err).count("bad.asc") == 1, result.out + result.err)
check(result.out.splitlines()[-1].startswith("files        41: 40 converted, 1 failed in "), result.out)
(rasters / "bad.asc").unlink()

# 3. A file of nodata alone does not stop the others and is no failure.
sea = CASES / "all_void_among_tiles"
if not sea.exists():
    sea = FOLDER / "sea"
    sea.mkdir()
    for name, height in (("a", 5.0), ("b_sea", None), ("c", 7.0)):
        write_asc(f"sea/{name}.asc", 80, 60, lambda column, row, z=height: z)
result = isohf("convert", sea, "--out-dir", "tiles", "--json")
lines = [json.loads(line) for line in result.out.splitlines()]
check([line.get("status") for line in lines] == ["converted", "nodata", "converted", None], result.out)
summary = lines[-1]["summary"]
check((summary["converted"], summary["nodata"], summary["failed"], summary["not_done"]) == (2, 1, 0, 0), result.out)
check(result.err.count("\n") == 1 and "b_sea" in result.err, result.err)
check(sorted(path.name for path in (FOLDER / "tiles").iterdir()) == ["a.isohf", "c.isohf"], "archives of the tiles")
result = isohf("convert", sea, "--out-dir", "tiles", "--resume")
check(result.out.splitlines()[-1].startswith("files        3: 0 converted, 2 complete before, 1 of nodata alone in "), result.out)
check(isohf("convert", *(path for path in sorted(sea.iterdir()) if "sea" in path.name), "-o", "sea.isohf", code=1).out == "", "alone")

# 4. A forgotten --resume keeps what the interrupted run has done: interrupted at once, the next run can still have it.
(FOLDER / "N10E010.hgt").write_bytes(random.Random(1).randbytes(2 * 3601 * 3601))
CONVERT = ["convert", "N10E010.hgt", "noise.isohf", "--z-range", "-33000:33000", "--effort", "fast", "-j", "1"]


def convert_noise(*more, interrupt_at=None):
    """Returns the first and the last share of the tiles that the run reported; a SIGINT follows `interrupt_at`."""
    process = subprocess.Popen([str(BIN / "isohf"), *CONVERT, "--progress", "json", *more], cwd=FOLDER, text=True,
                               stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    shares, is_sent = [], False
    for line in process.stderr:
        event = json.loads(line)
        if event.get("progress") == "tiles":
            shares.append(event["done"] / event["total"])
            if interrupt_at is not None and shares[-1] >= interrupt_at and not is_sent:
                process.send_signal(signal.SIGINT)
                is_sent = True
    code = process.wait()
    check(code == (130 if is_sent else 0), f"after {shares[-1:]} of the tiles: exit code {code}")
    return shares[0], shares[-1]


_, done = convert_noise(interrupt_at=0.4)
kept = (FOLDER / "noise.isohf.part").stat().st_size
check(kept > 2_000_000, f"{kept} bytes of the interrupted run")
_, again = convert_noise(interrupt_at=0.01)
check(again < done, f"the second run went as far: {again}")
sizes = [path.stat().st_size for path in FOLDER.glob("noise.isohf.part*") if not path.name.endswith("journal")]
check(max(sizes) >= kept, f"{kept} bytes were kept, now there are {sizes}")
first, last = convert_noise("--resume")
check(first >= 0.9 * done and last == 1.0, f"went on from {first}, {done} were done")
check(sorted(path.name for path in FOLDER.glob("noise.isohf*")) == ["noise.isohf"], "what is left beside the archive")
check(isohf("verify", "noise.isohf", "-q").code == 0, "the resumed archive")

# 5. Archives that have nothing in common: the reason, and how many members differ.
result = isohf("diff", "coast.isohf", "peaks.isohf", code=3)
check(len(result.out.splitlines()) == 2 and "peaks.isohf has " in result.out and " tiles of " in result.out, result.out)
members = isohf("diff", "coast.isohf", "peaks.isohf", "--json", code=3).json()["metadata"]
check(len(members) > 20 and f" {len(members)} members differ" in result.out, result.out)
isohf("convert", write_asc("here.asc", 90, 80, lambda x, y: x + y, west=0.0), "here.isohf", "-q")
isohf("convert", write_asc("there.asc", 90, 80, lambda x, y: x + y, west=5000.0), "there.isohf", "-q")
lines = isohf("diff", "here.isohf", "there.isohf", code=3).out.splitlines()
check(len(lines) == 2 and any("other ground" in line for line in lines), f"{lines}")

# 6. merge: what to do with what are no shards of one conversion; and it writes to -o alone.
JOINS = "merge joins the shards of one conversion; convert the rasters together instead"
refuses("merge", "coast.isohf", "peaks.isohf", "-o", "both.isohf", words=["coast.isohf", "peaks.isohf", "not a shard", JOINS], code=2)
refuses("merge", COAST, PEAKS, "-o", "both.isohf", words=["coast_512", JOINS])
for number in (1, 2):
    isohf("convert", COAST, "-o", f"s{number}.isohf", "--shard", f"{number}/2", "--z-range", "-1000:5000", "--shape", 3000, "-q")
isohf("convert", PEAKS, "-o", "alien.isohf", "--shard", "2/2", "--z-range", "-1000:70000", "--shape", 3000, "-q")
refuses("merge", "s1.isohf", "alien.isohf", "-o", "both.isohf", words=["alien.isohf: is a shard of another conversion", JOINS], code=2)
before = (FOLDER / "s2.isohf").read_bytes()
refuses("merge", "s1.isohf", "s2.isohf", words=["no OUTPUT given"], code=2)
refuses("merge", "s1.isohf", "s2.isohf", "--overwrite", words=["no OUTPUT given"], code=2)
refuses("merge", "s1.isohf", "s2.isohf", "-o", "s2.isohf", "--overwrite", words=["s2.isohf"], code=2)
check((FOLDER / "s2.isohf").read_bytes() == before, "merge wrote over its last shard")
isohf("merge", "s1.isohf", "s2.isohf", "-o", "whole.isohf", "-q")
