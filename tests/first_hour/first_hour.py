"""What the scripts of this folder share: the programs, a directory of their own, rasters, and checks of figures.

Each script is the first hour of one kind of user with one thing that once went wrong: commands as a person types them,
and the figures that must come out. It needs nothing but Python's standard library.

  NN_name.py BIN_DIR

Real rasters are those of ../shared/data beside the checkout; without them a script checks what it makes itself.
"""
import array
import atexit
import json
import math
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile
import zlib

BIN = pathlib.Path(sys.argv[1]).resolve()
ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
TESTDATA = ROOT / "testdata"
DATA = ROOT.parent / "shared" / "data"
CASES = ROOT.parent / "shared" / "cases"
FOLDER = pathlib.Path(tempfile.mkdtemp(prefix="isohf-first-hour-"))
atexit.register(shutil.rmtree, FOLDER, ignore_errors=True)


class Result:
    """How a command ended: exit code, standard output, standard error."""

    def __init__(self, command, process):
        self.command = command
        self.code = process.returncode
        self.out = process.stdout
        self.err = process.stderr

    def json(self):
        return json.loads(self.out)

    def numbers(self):
        """The numbers of each line of standard output; words such as `outside` are NaN."""
        def number(word):
            try:
                return float(word)
            except ValueError:
                return math.nan
        return [[number(word) for word in line.split()] for line in self.out.splitlines()]


def check(condition, message):
    if not condition:
        sys.exit(f"{pathlib.Path(sys.argv[0]).name}: {message}")


def near(found, expected, tolerance, what):
    check(abs(found - expected) <= tolerance, f"{what}: found {found}, must be {expected} to within {tolerance}")


def isohf(*arguments, code=0, stdin="", limit_kb=None, environment=None, timeout=300):
    """Runs isohf in FOLDER; it must end with `code` (None: any). `limit_kb` bounds its address space (ulimit -v)."""
    command = [str(BIN / "isohf"), *map(str, arguments)]
    shown = "isohf " + " ".join(map(str, arguments))
    if limit_kb is not None:
        command = ["bash", "-c", f'ulimit -v {limit_kb}; exec "$@"', "bash", *command]
    process = subprocess.run(command, cwd=FOLDER, input=stdin, capture_output=True, text=True, timeout=timeout,
                             env={**os.environ, **(environment or {})}, check=False)
    result = Result(shown, process)
    check(code is None or result.code == code, f"$ {shown}\n{result.out}{result.err}exit code {result.code}, must be {code}")
    return result


def refuses(*arguments, words, code=1, **more):
    """The command ends with `code` and one line of error that has all `words`."""
    result = isohf(*arguments, code=code, **more)
    errors = [line for line in result.err.splitlines() if "warning" not in line]
    check(len(errors) == 1, f"$ {result.command}\n{result.err}says {len(errors)} lines of error, must be one")
    for word in words:
        check(word in errors[0], f"$ {result.command}\n{result.err}lacks '{word}'")
    return result


def real(name):
    """A file of ../shared/data, or None where that folder is absent."""
    path = DATA / name
    return path if path.exists() else None


def write_hgt(name, side=1201, height=lambda column, row: 0):
    """An SRTM tile, whose place is its name."""
    samples = array.array("h", (round(height(column, row)) for row in range(side) for column in range(side)))
    samples.byteswap()
    (FOLDER / name).write_bytes(samples.tobytes())
    return FOLDER / name


def write_asc(name, columns, rows, height, west=0.0, south=0.0, spacing=1.0, nodata=-9999):
    """An ESRI ASCII grid of areas; `height(column, row)` gives elevations from the North-West, None for nodata."""
    lines = [f"ncols {columns}", f"nrows {rows}", f"xllcorner {west!r}", f"yllcorner {south!r}",
             f"cellsize {spacing!r}", f"NODATA_value {nodata}"]
    for row in range(rows):
        values = (height(column, row) for column in range(columns))
        lines.append(" ".join(repr(nodata if value is None else value) for value in values))
    (FOLDER / name).write_text("\n".join(lines) + "\n")
    return FOLDER / name


def write_tiff(name, columns, rows, height, kind="h", west=None, north=0.0, spacing=1.0, epsg=None, point=False,
               nodata=None, metadata=None):
    """A GeoTIFF of one band. `kind` is a type code of Python's struct; `west` and `north` are the corner of the first
    area, or the first point; `epsg` is a code of degrees (4xxx) or of a map; `metadata` is the text of GDAL's tag."""
    data = struct.pack(f"<{columns * rows}{kind}", *(height(x, y) for y in range(rows) for x in range(columns)))
    size = struct.calcsize(kind)
    sample_format = 3 if kind in "fd" else 2 if kind.islower() else 1
    tags = [(256, "L", [columns]), (257, "L", [rows]), (258, "H", [8 * size]), (259, "H", [1]), (262, "H", [1]),
            (273, "L", [8]), (277, "H", [1]), (278, "L", [rows]), (279, "L", [len(data)]), (339, "H", [sample_format])]
    if west is not None:
        tags += [(33550, "d", [spacing, spacing, 0.0]), (33922, "d", [0.0, 0.0, 0.0, west, north, 0.0])]
    keys = []
    if epsg is not None:
        degrees = 4000 <= epsg < 5000
        keys = [(1024, 2 if degrees else 1), (2048 if degrees else 3072, epsg)]
    if point or keys:
        keys = sorted(keys + [(1025, 2 if point else 1)])
        tags.append((34735, "H", [1, 1, 0, len(keys)] + [part for key, value in keys for part in (key, 0, 1, value)]))
    if metadata is not None:
        tags.append((42112, "s", metadata.encode() + b"\0"))
    if nodata is not None:
        tags.append((42113, "s", str(nodata).encode() + b"\0"))
    start = 8 + len(data) + len(data) % 2
    apart = start + 2 + 12 * len(tags) + 4
    entries, tail = b"", b""
    for tag, code, values in tags:
        body = values if code == "s" else struct.pack(f"<{len(values)}{code}", *values)
        kinds = {"s": 2, "H": 3, "L": 4, "d": 12}
        count = len(values)
        if len(body) <= 4:
            field = body.ljust(4, b"\0")
        else:
            field = struct.pack("<L", apart + len(tail))
            tail += body + b"\0" * (len(body) % 2)
        entries += struct.pack("<HHL", tag, kinds[code], count) + field
    head = struct.pack("<2sHL", b"II", 42, start)
    (FOLDER / name).write_bytes(head + data + b"\0" * (len(data) % 2) + struct.pack("<H", len(tags)) + entries +
                                struct.pack("<L", 0) + tail)
    return FOLDER / name


def read_npy(name):
    """Columns, rows, and the samples of a .npy of two dimensions, row by row."""
    content = (FOLDER / name).read_bytes()
    length, = struct.unpack("<H", content[8:10])
    head = content[10:10 + length].decode()
    shape = head[head.index("(") + 1:head.index(")")].split(",")
    rows, columns = int(shape[0]), int(shape[1])
    kind = head[head.index("'descr'"):].split("'")[3]
    codes = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "f4": "f", "f8": "d"}
    order = ">" if kind[0] == ">" else "<"
    return columns, rows, list(struct.unpack(f"{order}{columns * rows}{codes[kind[1:]]}", content[10 + length:]))


def sample(archive, places, *options):
    """The first number (the elevation) that `isohf sample` prints for each (x, y) of `places`; NaN outside and in nodata."""
    lines = "".join(f"{x!r} {y!r}\n" for x, y in places)
    return [numbers[0] for numbers in isohf("sample", archive, *options, stdin=lines).numbers()]


def read_png(name):
    """Columns, rows, channels, and the bytes of a PNG of 8 bits, row by row."""
    content = (FOLDER / name).read_bytes()
    at, packed = 8, b""
    while at < len(content):
        length, kind = struct.unpack(">L4s", content[at:at + 8])
        body = content[at + 8:at + 8 + length]
        if kind == b"IHDR":
            columns, rows, depth, colour = struct.unpack(">LLBB", body[:10])
        if kind == b"IDAT":
            packed += body
        at += 12 + length
    check(depth == 8 and colour in (0, 2, 4, 6), f"{name}: not 8 bits without a palette")
    channels = {0: 1, 2: 3, 4: 2, 6: 4}[colour]
    data, line = zlib.decompress(packed), columns * channels
    above, pixels = bytearray(line), bytearray()
    for start in range(0, rows * (line + 1), line + 1):
        way, here = data[start], bytearray(data[start + 1:start + 1 + line])
        for i in range(line):
            west = here[i - channels] if i >= channels else 0
            corner = above[i - channels] if i >= channels else 0
            p = west + above[i] - corner
            paeth = min((west, above[i], corner), key=lambda value: abs(p - value))
            here[i] = (here[i] + (0, west, above[i], (west + above[i]) // 2, paeth)[way]) & 255
        pixels += here
        above = here
    return columns, rows, channels, pixels


def write_netcdf(name, columns, rows, height, west, north, spacing, units=("degrees_east", "degrees_north"),
                 attributes=(), mapping=()):
    """A netCDF file (classic) of int16 areas with coordinates x and y, `units` being theirs. `attributes` of the
    variable z and `mapping`, those of its grid mapping, are pairs of a name and a text or number."""
    def padded(data):
        return data + b"\0" * (-len(data) % 4)

    def named(text):
        return struct.pack(">L", len(text)) + padded(text.encode())

    def listed(pairs):
        if not pairs:
            return struct.pack(">LL", 0, 0)
        body = struct.pack(">LL", 12, len(pairs))
        for key, value in pairs:
            body += named(key)
            if isinstance(value, str):
                body += struct.pack(">LL", 2, len(value)) + padded(value.encode())
            else:
                body += struct.pack(">LLd", 6, 1, value)
        return body

    xs = struct.pack(f">{columns}d", *(west + (x + 0.5) * spacing for x in range(columns)))
    ys = struct.pack(f">{rows}d", *(north - (y + 0.5) * spacing for y in range(rows)))
    zs = padded(struct.pack(f">{columns * rows}h", *(height(x, y) for y in range(rows) for x in range(columns))))
    more = [("grid_mapping", "map")] if mapping else []
    variables = [("x", [1], [("units", units[0])], 6, xs), ("y", [0], [("units", units[1])], 6, ys),
                 ("z", [0, 1], list(attributes) + more, 3, zs)]
    if mapping:
        variables.append(("map", [], list(mapping), 4, struct.pack(">l", 0)))

    def head(begin):
        text = b"CDF\1" + struct.pack(">LLL", 0, 10, 2) + named("y") + struct.pack(">L", rows)
        text += named("x") + struct.pack(">L", columns) + struct.pack(">LLLL", 0, 0, 11, len(variables))
        for variable, dimensions, pairs, kind, data in variables:
            text += named(variable) + struct.pack(f">L{len(dimensions)}L", len(dimensions), *dimensions)
            text += listed(pairs) + struct.pack(">LLL", kind, len(data), begin)
            begin += len(data)
        return text

    (FOLDER / name).write_bytes(head(len(head(0))) + b"".join(variable[4] for variable in variables))
    return FOLDER / name
