#!/usr/bin/env python3
"""Elevations in the tiles of web maps: PMTiles and folders, PNG and WebP; GDAL writes the pictures and reads what isohf makes of them (a test tool here).

usage: tiles.py BIN_DIR
       tiles.py --small FOLDER

Ends with 77 where GDAL's Python package is missing (Debian: python3-gdal). --small writes the files of
tests/formats/data/.
"""
import gzip
import json
import pathlib
import struct
import sys

from against_gdal import Program, check, run_parts

import numpy
from osgeo import gdal

gdal.SetConfigOption("GDAL_PAM_ENABLED", "NO")
HALF_MAP = 20037508.342789244


def codes(zoom, column, row, side):
    """Codes of a tile, 24 bits: slopes that tell every place from its neighbours, of elevations that the ground has."""
    x, y = numpy.meshgrid(column * side + numpy.arange(side), row * side + numpy.arange(side))
    return (100000 + zoom * 1000 + (x * 7 + y * 13) % 20000).astype(numpy.int64)


def packed(values, encoding):
    """Red, green and blue, and the elevations that they are."""
    if encoding == "terrarium":
        values = values + (32768 << 8) - 90000
        heights = values / 256.0 - 32768.0
    else:
        heights = values * 0.1 - 10000.0
    return numpy.stack([values >> 16 & 255, values >> 8 & 255, values & 255]).astype(numpy.uint8), heights


def picture(bands, driver="PNG", options=()):
    raster = gdal.GetDriverByName("MEM").Create("", bands.shape[2], bands.shape[1], len(bands), gdal.GDT_Byte)
    for i, band in enumerate(bands):
        raster.GetRasterBand(i + 1).WriteArray(band)
    if len(bands) in (2, 4):
        raster.GetRasterBand(len(bands)).SetColorInterpretation(gdal.GCI_AlphaBand)
    gdal.GetDriverByName(driver).CreateCopy("/vsimem/picture", raster, options=list(options))
    file = gdal.VSIFOpenL("/vsimem/picture", "rb")
    size = gdal.VSIStatL("/vsimem/picture").size
    found = bytes(gdal.VSIFReadL(1, size, file))
    gdal.VSIFCloseL(file)
    return found


def webp(bands):
    return picture(bands, "WEBP", ["LOSSLESS=YES"])


def tiles_of(places, encoding, side=256, draw=picture):
    return {place: draw(packed(codes(*place, side), encoding)[0]) for place in places}


# PMTiles, version 3
def tile_number(zoom, x, y):
    number = (4 ** zoom - 1) // 3
    side = 1 << zoom >> 1
    while side:
        right, low = int(bool(x & side)), int(bool(y & side))
        number += side * side * ((3 * right) ^ low)
        if not low:
            if right:
                x, y = side - 1 - x, side - 1 - y
            x, y = y, x
        side >>= 1
    return number


def varint(value):
    out = bytearray()
    while value >= 128:
        out.append(value & 127 | 128)
        value >>= 7
    return bytes(out) + bytes([value])


def directory(entries, packing):
    """entries  (number, offset, length, run)"""
    out = varint(len(entries))
    out += b"".join(varint(e[0] - (entries[i - 1][0] if i else 0)) for i, e in enumerate(entries))
    out += b"".join(varint(e[3]) for e in entries) + b"".join(varint(e[2]) for e in entries)
    for i, e in enumerate(entries):
        follows = i and e[1] == entries[i - 1][1] + entries[i - 1][2]
        out += varint(0 if follows else e[1] + 1)
    return gzip.compress(out, mtime=0) if packing == 2 else out


def pmtiles(tiles, kind=2, packing=2, leaf=None, metadata=None):
    """tiles by (zoom, column, row); equal ones that follow each other are stored once."""
    data, entries, places = b"", [], {}
    for number, stored in sorted((tile_number(*place), stored) for place, stored in tiles.items()):
        if stored not in places:
            places[stored] = len(data)
            data += stored
        last = entries[-1] if entries else None
        if last and last[1] == places[stored] and last[0] + last[3] == number:
            entries[-1] = (*last[:3], last[3] + 1)
        else:
            entries.append((number, places[stored], len(stored), 1))
    leaves, root = b"", entries
    if leaf:
        root = []
        for at in range(0, len(entries), leaf):
            part = directory(entries[at:at + leaf], packing)
            root.append((entries[at][0], len(leaves), len(part), 0))
            leaves += part
    root = directory(root, packing)
    text = json.dumps(metadata or {}).encode()
    text = gzip.compress(text, mtime=0) if packing == 2 else text
    at = 127
    offsets = []
    for part in (root, text, leaves, data):
        offsets += [at, len(part)]
        at += len(part)
    zooms = [place[0] for place in tiles]
    header = b"PMTiles\x03" + struct.pack("<8Q", *offsets) + struct.pack("<3Q", len(tiles), len(entries), len(places))
    header += bytes([1, packing, 1, kind, min(zooms), max(zooms)]) + bytes(25)
    assert len(header) == 127
    return header + root + text + leaves + data


def folder_of(root, tiles, ending):
    for (zoom, column, row), stored in tiles.items():
        path = root / str(zoom) / str(column) / f"{row}.{ending}"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(stored)
    return root


class Tiles(Program):
    def holds(self, source, tiles, zoom, encoding, *options, side=256, missing_is_void=True):
        """Samples, voids and place of all tiles of a level, as GDAL reads what comes back."""
        archive, raster = self.folder / "a.isohf", self.folder / "a.tif"
        for arguments in (("convert", source, "-o", archive, "--overwrite", "--lossless", "--to-crs", "none", "-q",
                           *options), ("export", archive, raster, "--overwrite", "-q")):
            done = self.run(*arguments)
            if done.returncode != 0:
                return check(False, f"isohf {' '.join(map(str, arguments))}: {done.stderr.strip()}")
        places = [place for place in tiles if place[0] == zoom]
        west, north = min(p[1] for p in places), min(p[2] for p in places)
        east, south = max(p[1] for p in places) + 1, max(p[2] for p in places) + 1
        wanted = numpy.full(((south - north) * side, (east - west) * side), numpy.nan)
        for _, column, row in places:
            at = slice((row - north) * side, (row - north + 1) * side), slice((column - west) * side, (column - west + 1) * side)
            wanted[at] = packed(codes(zoom, column, row, side), encoding)[1]
        found = gdal.Open(str(raster))
        band = found.GetRasterBand(1)
        values = band.ReadAsArray().astype(numpy.float64)
        void = band.GetNoDataValue()
        values[values == void] = numpy.nan
        values = values * (band.GetScale() or 1.0) + (band.GetOffset() or 0.0)
        name = f"{pathlib.Path(source).name} {' '.join(map(str, options))}"
        if values.shape != wanted.shape:
            return check(False, f"{name}: {values.shape}, must be {wanted.shape}")
        check(numpy.allclose(values, wanted, rtol=0, atol=1e-9, equal_nan=True), f"{name}: samples differ")
        step = 2 * HALF_MAP / (side << zoom)
        place = (west * side * step - HALF_MAP, step, 0, HALF_MAP - north * side * step, 0, -step)
        check(numpy.allclose(found.GetGeoTransform(), place, rtol=0, atol=0.001 * step), f"{name}: {found.GetGeoTransform()}, must be {place}")
        check(found.GetSpatialRef().GetAuthorityCode("PROJCS") == "3857", f"{name}: another system")


BLOCK = [(9, x, y) for x in range(266, 269) for y in range(180, 183)]
HOLES = [place for place in BLOCK if place not in ((9, 266, 180), (9, 267, 181))] + [(8, 133, 90), (8, 134, 90)]


def read(isohf, folder):
    for encoding in ("terrarium", "mapbox"):
        for places in (BLOCK, HOLES):
            plain, small = tiles_of(places, encoding), tiles_of(places, encoding, 256, webp)
            for packing in (1, 2):
                for leaf in (None, 1, 4):
                    path = folder / f"a{packing}{leaf}.pmtiles"
                    path.write_bytes(pmtiles(plain, 2, packing, leaf, {"encoding": encoding}))
                    isohf.holds(path, plain, 9, encoding)
            (folder / "w.pmtiles").write_bytes(pmtiles(small, 4))
            isohf.holds(folder / "w.pmtiles", small, 9, encoding, "--encoding", encoding)
    plain = tiles_of(HOLES, "mapbox")
    path = folder / "z.pmtiles"
    path.write_bytes(pmtiles(plain))
    isohf.holds(path, plain, 8, "mapbox", "--part", "8", "--encoding", "mapbox")
    for part in ("7", "10", "x", "-1", "99999999999", "8 "):
        isohf.refuses("has no zoom level", "convert", path, "-o", folder / "n.isohf", "--part", part)
    isohf.refuses("has no channels but packed", "convert", path, "-o", folder / "n.isohf", "--channel", "R")
    large = tiles_of(BLOCK, "mapbox", 512)
    sea = {place: picture(packed(numpy.full((64, 64), 100000), "mapbox")[0]) for place in BLOCK}
    (folder / "sea.pmtiles").write_bytes(pmtiles(sea))
    isohf.refuses("--encoding", "convert", folder / "sea.pmtiles", "-o", folder / "n.isohf")
    (folder / "s.pmtiles").write_bytes(pmtiles(sea, metadata={"encoding": "mapbox"}))
    check(isohf.run("convert", folder / "s.pmtiles", "-o", folder / "s.isohf", "-q").returncode == 0, "s.pmtiles: its encoding is not taken")
    (folder / "l.pmtiles").write_bytes(pmtiles(large))
    isohf.holds(folder / "l.pmtiles", large, 9, "mapbox", "--encoding", "mapbox", side=512)
    runs = {place: sea[BLOCK[0]] for place in [(6, x, y) for x in range(64) for y in range(64)]}
    (folder / "runs.pmtiles").write_bytes(pmtiles(runs))
    said = json.loads(isohf.run("info", folder / "runs.pmtiles", "--encoding", "mapbox", "--json").stdout)
    check("4096" in json.dumps(said), f"64 x 64 tiles in one run: {said}")


def folders(isohf, folder):
    for ending, draw in (("png", picture), ("webp", webp)):
        tiles = tiles_of(BLOCK, "terrarium", 256, draw)
        isohf.holds(folder_of(folder / ending, tiles, ending), tiles, 9, "terrarium", "--recursive", "--encoding", "terrarium")
    rim = tiles_of(BLOCK[:1], "mapbox", 258)
    folder_of(folder / "rim", rim, "png")
    said = isohf.run("info", folder / "rim/9/266/180.png", "--encoding", "mapbox").stderr
    check("rim of its neighbours'" in said, f"a tile with a rim: {said}")


def refused(isohf, folder):
    def says(said, name, stored):
        (folder / name).write_bytes(stored)
        isohf.refuses(said, "convert", folder / name, "-o", folder / "n.isohf", "--encoding", "mapbox")

    tiles = tiles_of(BLOCK, "mapbox")
    good = pmtiles(tiles)
    jpeg = {BLOCK[0]: picture(packed(codes(*BLOCK[0], 256), "mapbox")[0], "JPEG")}
    lossy = {BLOCK[0]: picture(packed(codes(*BLOCK[0], 256), "mapbox")[0], "WEBP")}
    outlines = {BLOCK[0]: gzip.compress(b"outlines")}
    says("JPEG pictures, which do not keep", "j.pmtiles", pmtiles(jpeg, 3))
    says("a JPEG picture, which does not keep", "k.pmtiles", pmtiles(jpeg, 2))
    says("lossy WebP", "l.pmtiles", pmtiles(lossy, 4))
    says("lossy WebP", "l.webp", lossy[BLOCK[0]])
    says("vectors (MVT)", "v.pmtiles", pmtiles(outlines, 1))
    says("packed outlines", "v2.pmtiles", pmtiles(outlines, 0))
    says("must be 3", "two.pmtiles", good[:7] + b"\x02" + good[8:])
    says("Brotli", "b.pmtiles", good[:97] + b"\x03" + good[98:])
    says("", "cut.pmtiles", good[:len(good) - 100])
    says("", "short.pmtiles", good[:100])
    says("258 x 258", "rim.pmtiles", pmtiles(tiles_of(BLOCK, "mapbox", 258)))
    mixed = {**tiles, BLOCK[4]: tiles_of([BLOCK[4]], "mapbox", 128)[BLOCK[4]]}
    says("256 each way", "mixed.pmtiles", pmtiles(mixed))


def write_small(folder):
    """What tests damage: two tiles of 8 x 8 and a hole."""
    places = [(3, 4, 2), (3, 5, 3)]
    tiles = tiles_of(places, "mapbox", 8)
    (folder / "small.pmtiles").write_bytes(pmtiles(tiles, metadata={"encoding": "mapbox"}, leaf=1))
    (folder / "small.webp").write_bytes(webp(packed(codes(*places[0], 8), "mapbox")[0]))


def main():
    if len(sys.argv) == 3 and sys.argv[1] == "--small":
        write_small(pathlib.Path(sys.argv[2]))
        return 0
    return run_parts((read, folders, refused), __doc__, Tiles)


if __name__ == "__main__":
    sys.exit(main())
