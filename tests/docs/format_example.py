"""The worked example of docs/archive_format.md: converts three by three elevations, takes the archive apart by that page,
and prints it as Markdown. usage: format_example.py ISOHF PAGE [--write]: compares the example with the page's, from its
last heading on, and the archive with the one in testdata/conformance; with --write puts it on the page."""

import hashlib
import json
import pathlib
import struct
import subprocess
import sys
import tempfile
import zlib

sys.dont_write_bytecode = True
sys.path.append(str(pathlib.Path(__file__).parent.parent.parent / "docs"))
import reader  # noqa: E402

GRID = "ncols 3\nnrows 3\nxllcorner 500000\nyllcorner 4000000\ncellsize 10\n10 11 12\n11 13 15\n12 15 20\n"
ARGUMENTS = ["--shape", "5x5", "--levels", "1", "--spacing", "30"]
HEADING = "## 14 A worked example\n"


def hex_lines(data, start, count=None):
    """Lines of 16 bytes with their offsets."""
    lines = []
    for at in range(0, len(data) if count is None else count, 16):
        lines.append(f"    {start + at:5}  " + " ".join(f"{byte:02x}" for byte in data[at : at + 16]))
    return "\n".join(lines) + "\n"


def table(data, at, fields):
    """A row for each field (struct format, what) from `at` on; the values, and where the fields end."""
    rows, values = ["| at | bytes | value | field |", "|---|---|---|---|"], []
    for kind, what in fields:
        size = struct.calcsize("<" + kind)
        value = struct.unpack_from("<" + kind, data, at)[0]
        values.append(value)
        if isinstance(value, bytes):
            shown = f"`{value.decode()}`"
        elif what.startswith(("CRC", "signature")):
            shown = f"0x{value:08X}"
        else:
            shown = str(value)
        rows.append(f"| {at} | `{data[at:at + size].hex(' ')}` | {shown} | {what} |")
        at += size
    return "\n".join(rows) + "\n", values, at


def local_header(data, at):
    name_bytes = struct.unpack_from("<H", data, at + 26)[0]
    return table(data, at, [("I", "signature"), ("H", "version needed"), ("H", "flags"), ("H", "method"), ("H", "time"),
                            ("H", "date"), ("I", "CRC-32 of the inflated bytes"), ("I", "compressed size"),
                            ("I", "inflated size"), ("H", "length of the name"), ("H", "length of the extra field"),
                            (f"{name_bytes}s", "name")])


def describe(data):
    end64 = struct.unpack("<IQHHIIQQQQ", data[-98:-42])
    directory_bytes, directory = end64[8], end64[9]
    _, header, media_at = local_header(data, 0)
    tile_start = media_at + header[7]
    tile_text, tile_header, tile_at = local_header(data, tile_start)
    deflated = data[tile_at : tile_at + tile_header[7]]
    payload = zlib.decompress(deflated, wbits=-15)
    assert zlib.crc32(payload) == tile_header[6] and len(payload) == tile_header[8]
    _, index_header, index = local_header(data, tile_at + len(deflated))
    record_text, record, root = table(data, index + 33, [
        ("Q", "offset of the tile's data"), ("I", "compressed size"), ("I", "payload size"), ("I", "CRC-32 of the payload"),
        ("I", "smallest code"), ("I", "largest code"), ("I", "flags: the record is there")])
    assert record[0] == tile_at and data[index + 32] == 1
    root_text, _, description = table(data, root, [
        ("Q", "offset of the page in `index.bin`"), ("Q", "offset of its digests"), ("Q", "sum of the compressed sizes"),
        ("I", "stored places"), ("I", "CRC-32 of the page"), ("I", "CRC-32 of its digests"), ("I", "smallest code"),
        ("I", "largest code"), ("I", "flags")])
    description_text, _, footer_at = table(data, description, [
        ("I", "size of the description"), ("I", "flags: has digests"), ("Q", "columns"), ("Q", "rows"), ("Q", "stored places"),
        ("Q", "sum of their compressed sizes"), ("Q", "offset of the root"), ("I", "CRC-32 of the root"),
        ("I", "places of a page"), ("I", "smallest code"), ("I", "largest code"), ("I", "flags"), ("I", "length of the name"),
        ("Q", "zero"), ("25s", "name")])
    footer_text, footer, footer_end = table(data, footer_at, [
        ("8s", "magic"), ("I", "version"), ("I", "tables"), ("Q", "size of `index.bin`"), ("Q", "offset of its data"),
        ("Q", "members before it"), ("Q", "of these, in tables"), ("I", "size of all descriptions"),
        ("I", "CRC-32 of all descriptions"), ("I", "zero"), ("I", "CRC-32 of the 60 bytes before")])
    assert footer[3] == index_header[7] == footer_end - index
    _, json_header, json_at = local_header(data, footer_end)
    json_end = json_at + json_header[7]
    assert json_end == directory
    fields = [("B", "version of the codec"), ("B", "sample type: u16"), ("B", "flags"), ("B", "dropped bits"),
              ("i", "low"), ("i", "high"), ("I", "size of the void mask"), ("i", "base"), ("I", "size of the extra bits"),
              ("B", "context energy shift a"), ("B", "contexts K"), ("H", "contexts in pairs"), ("B", "always 1"), ("B", "weights T")]
    payload_text, values, at = table(payload, 0, fields)
    extra_bytes, contexts, weights = values[8], values[10], values[13]
    shown = struct.unpack_from(f"<{weights}h", payload, at)
    at += 2 * weights
    thresholds = struct.unpack_from(f"<{contexts - 1}H", payload, at)
    at += 2 * (contexts - 1)
    counts = struct.unpack_from(f"<{contexts}I", payload, at)
    at += 4 * contexts
    symbols, extra = payload[at : len(payload) - extra_bytes], payload[len(payload) - extra_bytes :]
    codes, _ = reader.decode(payload, 5, 5, 0)
    metadata = json.loads(data[json_at:json_end])
    shape, tiles, extent, samples = (metadata[name] for name in ("tile_shape", "tiles", "extent", "samples"))
    digest = data[index : index + 32]
    hashed = struct.pack("<IIIQQddBdd", shape["columns"], shape["rows"], shape["levels"], tiles["columns"], tiles["rows"],
                         extent["x"], extent["z"], 0, samples["offset"], samples["scale"])
    assert hashlib.sha256(bytes(8) + digest + hashed).hexdigest() == metadata["content_sha256"]
    offset, scale = metadata["samples"]["offset"], metadata["samples"]["scale"]
    return f"""
Nine elevations, `tiny.asc`:

{"".join("    " + line + chr(10) for line in GRID.splitlines())}
make one tile of 5×5 samples with `isohf convert tiny.asc -o tiny.isohf {" ".join(ARGUMENTS)}`. The archive has {len(data)}
bytes, those of `testdata/conformance/good/tiny.isohf`; `tests/docs/format_example.py` took it apart for this section, and a test
holds all three against each other. It begins with the media type's local header of {media_at} bytes and `{data[media_at:tile_start].decode()}`.

**The tile's local header**:

{tile_text}
**The tile's data**, {len(deflated)} bytes of raw Deflate:

{hex_lines(deflated, tile_at)}
**The payload** that they inflate to, {len(payload)} bytes (here counted from the payload's start):

{payload_text}
Then the weights {", ".join(map(str, shown))}; the thresholds: {", ".join(map(str, thresholds)) or "none"}; the symbols of each
context: {", ".join(map(str, counts))}. The bytes from {at} on are the symbols, `{symbols.hex(" ")}`{", stored in pairs" if values[11] else ""},
and the extra bits, `{extra.hex(" ") or "none"}`. They say, row by row,

{"".join("    " + " ".join(f"{code:5}" for code in codes[at:at + 5]) + chr(10) for at in range(0, 25, 5))}
With the metadata's `samples.offset` {offset} and `samples.scale` {scale} the vertex in the middle, code {codes[12]}, has the elevation
{offset + scale * codes[12]:.4f}.

**The index**, whose local header of {30 + len("index.bin")} bytes goes before it, begins with the tile's digest, the SHA-256 of its
25 codes,

{hex_lines(data[index:index + 32], index)}
Its only page is the byte `01` at byte {index + 32}, place 0 is stored, and the record:

{record_text}
Its root has one entry:

{root_text}
The description of its only table:

{description_text}
and the footer:

{footer_text}
**The metadata**, whose local header of {30 + len("isohf.json")} bytes goes before them, are the {json_header[7]} bytes of JSON up to byte {json_end},
where the directory of {end64[6]} entries in {directory_bytes} bytes begins.

**The content hash** is the SHA-256 of the tile's flat index, eight bytes of 0, of its digest and of these {len(hashed)} bytes, `{metadata["content_sha256"]}`:

{hex_lines(hashed, 32)}
**The end records**, the last 98 bytes:

{hex_lines(data[-98:], len(data) - 98)}"""


def main(isohf, page, write):
    with tempfile.TemporaryDirectory() as folder:
        (pathlib.Path(folder) / "tiny.asc").write_text(GRID)
        subprocess.run([isohf, "convert", "tiny.asc", "-o", "tiny.isohf", "-q", *ARGUMENTS], cwd=folder, check=True,
                       stderr=subprocess.DEVNULL)
        data = (pathlib.Path(folder) / "tiny.isohf").read_bytes()
    kept = pathlib.Path(page).parent.parent / "testdata" / "conformance" / "good" / "tiny.isohf"
    if data != kept.read_bytes():
        sys.exit(f"{kept} is another archive than the example's; testdata/make_conformance makes it anew")
    made = describe(data)
    text = pathlib.Path(page).read_text()
    head, found = text.split(HEADING) if HEADING in text else (text + "\n", "")
    if write:
        pathlib.Path(page).write_text(head + HEADING + made)
    elif found != made:
        for number, (is_, wanted) in enumerate(zip(found.splitlines(), made.splitlines()), 1):
            if is_ != wanted:
                print(f"line {number} of the example is\n{is_}\nand must be\n{wanted}")
                break
        sys.exit(f"{page}: its example is another archive; {pathlib.Path(__file__).name} ISOHF PAGE --write puts it right")


main(sys.argv[1], sys.argv[2], "--write" in sys.argv)
