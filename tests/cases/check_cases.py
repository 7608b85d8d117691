#!/usr/bin/env python3
"""Runs isohf on a folder of cases, each with a NAME.expected.txt that says what is right, and holds the two together.

    check_cases.py BIN CASES [NAME...]

An expected file begins with a line of the command, and has a paragraph "Right: ...". That gives numbers (least, greatest,
mean, N voids, W x H), which the samples must have as an archive keeps them and gives them back; it may allow a refusal
("refused", "a line that says"), or a warning ("a loss", "a warning"), which --strict makes an error. Exit code: 0 if all
cases are right, else 1.
"""

import json
import pathlib
import re
import subprocess
import sys
import tempfile

NUMBER = r"(-?\d+(?:\.\d+)?(?:e[+-]?\d+)?)"


class Expected:
    """What an expected file says."""

    def __init__(self, path):
        text = path.read_text(encoding="utf-8")
        self.command = text.splitlines()[0]
        rest = text.split("\n", 1)[1]
        at = rest.find("Right")
        end = rest.find("Today", at)
        self.right = rest[at:end if end > 0 else len(rest)]
        # Some give their numbers before that paragraph, or behind it; not those of today.
        said = rest[:end if end > 0 else len(rest)] + rest[end:].partition("\n")[2] * (end > 0)
        self.numbers = [tuple(float(n) for n in found)
                        for found in re.findall(rf"least {NUMBER}, greatest {NUMBER}, mean {NUMBER}", said)]
        voids = re.findall(r"(\d+) (?:voids|samples are transparent)", rest)
        self.voids = int(voids[0]) if voids and "void" in self.right else None
        shape = re.search(r"(\d+) x (\d+)", self.right)
        self.shape = (int(shape[1]), int(shape[2])) if shape else None
        self.may_refuse = "refused" in self.right or "a line that" in self.right
        self.may_warn = bool(re.search(r"or (?:a|the|that) (?:warning|loss)|at the least a warning|only with a warning"
                                       r"|Right: (?:a|the) warning", self.right))

        self.must_warn = bool(re.search(r"Right: (?:a|the) warning of kind loss", self.right))

    def options(self):
        words = self.command.split(", ")[0].replace(" (no options)", "").split()
        options = []
        for name in ("--encoding", "--z-scale", "--z-offset", "--channel"):
            if name in words:
                options += [name, words[words.index(name) + 1]]
        return options + (["--recursive"] if "--recursive" in words else [])


class Runner:
    def __init__(self, program, folder):
        self.program = program
        self.folder = pathlib.Path(folder)

    def run(self, *words):
        return subprocess.run([self.program, *map(str, words)], capture_output=True, text=True, timeout=120,
                              cwd=self.folder, check=False)

    def kept(self, case, options):
        """What an archive gives back of a case: exit code, messages, size, statistics."""
        made = self.run("convert", case, "a.isohf", "--overwrite", "--lossless", *options)
        if made.returncode != 0:
            return made, None
        back = self.run("export", "a.isohf", "back.tif", "--overwrite", "-q")
        if back.returncode != 0:
            return made, None
        return made, json.loads(self.run("info", "back.tif", "--stats", "--json").stdout)


def is_near(found, wanted):
    return abs(found - wanted) <= 2e-5 * max(abs(wanted), 1.0) + 5e-4


def numbers_fit(expected, info):
    found = info["statistics"]
    if expected.shape and (info["width"], info["height"]) != expected.shape:
        return f"{info['width']} x {info['height']} samples"
    if expected.voids is not None and found["voids"] != expected.voids:
        return f"{found['voids']} voids"
    mine = (found["min"], found["max"], found["mean"])
    if expected.numbers and not any(all(map(is_near, mine, each)) for each in expected.numbers):
        return f"least {mine[0]:g}, greatest {mine[1]:g}, mean {mine[2]:g}"
    return ""


def one_line(result):
    lines = [line for line in result.stderr.splitlines() if not line.startswith("isohf: note")]
    return len(lines) >= 1 and len(result.stderr) < 2000


def check_reading(runner, case, expected):
    """(is right, how it went) of a case that is a matter of reading."""
    options = expected.options()
    result, info = runner.kept(case, options)
    if result.returncode != 0:
        line = result.stderr.strip().splitlines()[-1] if result.stderr.strip() else "(no message)"
        # What is asked for by an option is to be read.
        may_refuse = expected.may_refuse and not (options and expected.numbers)
        return may_refuse and one_line(result), f"refused: {line}"
    strict = runner.run("convert", case, "strict.isohf", "--overwrite", "--strict", *options)
    is_loss = strict.returncode != 0
    warned = result.stderr.strip().splitlines()
    if info is None:
        return False, "does not come back"
    wrong = numbers_fit(expected, info)
    is_stated = expected.numbers or expected.voids is not None or expected.shape
    if is_stated and not wrong and (is_loss or not expected.must_warn):
        return True, "as expected" + (f", with: {warned[0]}" if warned else "")
    if is_loss and expected.may_warn:
        return True, f"warned: {warned[0] if warned else strict.stderr.strip()}"
    return False, wrong or "neither refused nor warned of"


def check_void_tiles(runner, case, _expected):
    result = runner.run("convert", case, "--out-dir", "each", "--overwrite", "--json")
    status = [json.loads(line).get("status") for line in result.stdout.splitlines()]
    return result.returncode == 0 and status[:3] == ["converted", "nodata", "converted"], f"{status}, exit {result.returncode}"


def check_place(bounds):
    def check(runner, case, expected):
        result = runner.run("info", case, "--json")
        if result.returncode != 0:
            return expected.may_refuse, f"refused: {result.stderr.strip()}"
        found = json.loads(result.stdout)["bounds"]
        return is_near(found["west"], bounds[0]) and is_near(found["east"], bounds[1]), f"{found}"
    return check


def check_rows_from_south(runner, case, expected):
    is_right, said = check_reading(runner, case, expected)
    found = runner.run("info", "back.tif", "--json")
    north = json.loads(found.stdout)["bounds"]["north"] if found.returncode == 0 else 0.0
    # The outer edge of the first row of samples.
    return is_right and (said.startswith("warned") or abs(north - 5948635.2893) < 400.0), f"{said}; North {north}"


def check_unit(runner, case, _expected):
    runner.run("convert", case, "a.isohf", "--overwrite")
    found = runner.run("info", "a.isohf", "--json", "--tiles").stdout + runner.run("info", case).stdout
    warned = runner.run("convert", case, "b.isohf", "--strict", "--overwrite").returncode != 0
    return warned or "decimetre" in found, "warned of" if warned else "a decimetre" if "decimetre" in found else "neither"


def check_unreal(runner, case, _expected):
    made = runner.run("convert", case, "a.isohf", "--overwrite")
    result = runner.run("export", "a.isohf", "x.r16", "--overwrite", "--raw-scale", "0.0078125", "--raw-offset", "-256")
    named = re.search(r"raw-scale (\S+) --raw-offset (-?[\d.]+)", result.stderr)
    right = bool(named) and is_near(float(named[2]), -32768.0 * float(named[1].rstrip(",;")))
    return made.returncode == 0 and result.returncode != 0 and right, result.stderr.strip()


def check_voids_written(runner, case, _expected):
    runner.run("convert", case, "a.isohf", "--overwrite")
    said = [runner.run("export", "a.isohf", name, "--overwrite").stderr.strip() for name in ("x.r16", "x.png")]
    return all("65535" in each for each in said), " | ".join(said)


def check_label(runner, case, expected):
    """The label and the picture, each by itself."""
    verdicts = [check_reading(runner, case / name, expected) for name in ("ldem_x_jp2.lbl", "ldem_x.jp2")]
    # A .jp2 may be refused with its line.
    is_right = all(right or said.startswith("refused") for right, said in verdicts)
    return is_right, " | ".join(said for _, said in verdicts)


SPECIAL = {
    "all_void_among_tiles": check_void_tiles,
    "degrees_west.nc": check_place((-11.0, -5.0)),
    "tms_numbered_tiles": check_rows_from_south,
    "unit_dm.tif": check_unit,
    "unreal_sea_level.tif": check_unreal,
    "voids_to_png.tif": check_voids_written,
    "pds3_jp2_product": check_label,
}


def main(arguments):
    if len(arguments) < 2:
        sys.exit(__doc__)
    program, cases = str(pathlib.Path(arguments[0], "isohf").resolve()), pathlib.Path(arguments[1]).resolve()
    wanted = arguments[2:]
    failed = 0
    for path in sorted(cases.glob("*.expected.txt")):
        name = path.name.removesuffix(".expected.txt")
        if wanted and name not in wanted:
            continue
        expected = Expected(path)
        case = cases / name
        if name == "vrt_into_zip":
            case = case / "tiles.vrt"
        with tempfile.TemporaryDirectory() as folder:
            is_right, said = SPECIAL.get(name, check_reading)(Runner(program, folder), case, expected)
        failed += not is_right
        print(f"{'right' if is_right else 'WRONG'}  {name}: {said}".replace(str(cases) + "/", ""))
    print(f"{failed} wrong" if failed else "all right")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
