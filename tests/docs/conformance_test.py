"""Runs isohf and docs/reader.py over testdata/conformance: both must find the hashes of all good archives and refuse all others
in a line. usage: conformance_test.py ISOHF SOURCE_FOLDER"""

import json
import pathlib
import re
import subprocess
import sys

isohf, root = sys.argv[1], pathlib.Path(sys.argv[2])
folder = root / "testdata" / "conformance"
manifest = json.loads((folder / "manifest.json").read_text())
failures = []


def run(*command):
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=100)
    if "Traceback" in done.stderr or done.returncode < 0:
        failures.append("%s: crashes\n%s" % (command[-1], done.stderr))
    return done


def findings(verified):
    """What verify finds but that there is no index, as where another tool packed the archive: those named repacked-…"""
    return [line for line in verified.stdout.splitlines() if line.startswith("ISOHF-") and not line.startswith("ISOHF-0002 ")]


for name, hashes in manifest["good"].items():
    path = folder / "good" / (name + ".isohf")
    verified, read = run(isohf, "verify", path), run(sys.executable, root / "docs" / "reader.py", path)
    if findings(verified) or name.startswith("repacked") != (verified.returncode != 0):
        failures.append("%s: verify: %s%s" % (name, verified.stdout, verified.stderr))
    wanted = ["content " + hashes["content_sha256"]]
    wanted += ["samples " + hashes["samples_sha256"]] if "samples_sha256" in hashes else []
    if read.stdout.splitlines() != wanted:
        failures.append("%s: reader.py: %s%s" % (name, read.stdout, read.stderr))
for name in manifest["refuse"]:
    path = folder / "refuse" / (name + ".isohf")
    verified = run(isohf, "verify", path)
    if verified.returncode == 0 or not (findings(verified) or verified.stderr):
        failures.append("%s: isohf verify passes it: %s" % (name, verified.stdout))
    if run(sys.executable, root / "docs" / "reader.py", path).returncode == 0:
        failures.append("%s: reader.py reads it" % name)
# Section 11 of the page names each of these beside its fault, alone or as `BEGINNING…`.
faults = (root / "docs" / "archive_format.md").read_text().partition("\n## 11 ")[2].partition("\n## 12 ")[0]
named = re.findall(r"`([a-z0-9]+(?:-[a-z0-9]+)*-?…?)`", faults)
for name in manifest["refuse"]:
    if not any(name == told or told.endswith("-…") and name.startswith(told[:-1]) for told in named):
        failures.append("%s: the page does not name it" % name)
assert len(manifest["good"]) >= 74 and len(manifest["refuse"]) >= 85
print("\n".join(failures))
sys.exit(bool(failures))
