#!/usr/bin/env python3
"""Writes what a script found into the table of docs/reliability.md, in the row of that name, with command, commit and day.

usage: scripts/lib/reliability.py NAME FOUND COMMAND"""

import datetime
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
PAGE = ROOT / "docs" / "reliability.md"


def write(name, found, command):
    git = ["git", "-C", str(ROOT)]
    commit = subprocess.run(git + ["rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=True).stdout.strip()
    if subprocess.run(git + ["diff", "--quiet", "HEAD"]).returncode:
        commit += " and changes"
    row = f"| {name} | {found} | `{command}` | {commit}, {datetime.date.today()} |"
    lines = PAGE.read_text().split("\n")
    places = [i for i, line in enumerate(lines) if line.startswith(f"| {name} |")]
    if not places:
        sys.exit(f"reliability: {PAGE} has no row '{name}'")
    lines[places[0]] = row
    PAGE.write_text("\n".join(lines))


if __name__ == "__main__":
    if len(sys.argv) != 4:
        print(__doc__)
        sys.exit(0 if sys.argv[1:] in (["-h"], ["--help"]) else 2)
    write(*sys.argv[1:])
