"""Called by scripts/bench: ROOT [SECTION...] [options].

A section is a file of sections/: its first line says what it measures, measure(bench) does so and calls bench.add(). docs/performance.md has a
place for its table.
"""

import argparse
import importlib
import json
import pathlib
import sys

from harness import Bench

FIRST = ["convert", "peers", "sizes", "large", "memory"]


def section_names():
    """FIRST, then the others by the alphabet."""
    names = [path.stem for path in (pathlib.Path(__file__).parent / "sections").glob("*.py")]
    return sorted(names, key=lambda name: (FIRST.index(name) if name in FIRST else len(FIRST), name))


def find_sections():
    """Modules by name."""
    return {name: importlib.import_module(f"sections.{name}") for name in section_names()}


def parse(arguments):
    """What is wanted; ends with code 2 on a wrong option. Imports nothing that a bare system lacks."""
    root = pathlib.Path(arguments[0])
    parser = argparse.ArgumentParser(prog="scripts/bench")
    parser.add_argument("root")
    parser.add_argument("sections", nargs="*", metavar="SECTION")
    parser.add_argument("--rounds", type=int, default=None)
    parser.add_argument("--smoke", action="store_true")
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--data", default=str(root / "../shared/data"))
    parser.add_argument("--input")
    options = parser.parse_args(arguments)
    for section in options.sections:
        if section not in section_names():
            parser.error(f"{section}: no section; there are {', '.join(section_names())}")
    if options.rounds is None:
        options.rounds = 1 if options.smoke else 5
    if options.rounds < 1:
        parser.error("--rounds: at least 1")
    return options


def main():
    if sys.argv[1] == "--parse":
        parse(sys.argv[2:])
        return
    sections = find_sections()
    if sys.argv[1] == "--list":
        for name, module in sections.items():
            print(f"    {name + ':':<10} {module.__doc__.strip().splitlines()[0]}")
        return
    options = parse(sys.argv[1:])
    chosen = options.sections or (list(sections) if options.smoke else ["convert"])
    bench = Bench(options)
    if options.write:
        bench.has_places(chosen)
    for section in chosen:
        sections[section].measure(bench)
    if options.json:
        print(json.dumps(bench.results, indent=2))
    else:
        print("\n\n".join(bench.tables.values()))
    if options.write:
        bench.write()
    if bench.complaints:
        bench.fail("; ".join(bench.complaints))


if __name__ == "__main__":
    main()
