#!/usr/bin/env python3
"""Paints what a satellite might see of a terrain: sea, beaches, fields, woods, rock and snow, by height and slope.

    isohf restore dem.isohf heights.r16 --clamp-range && scripts/lib/paint_photo.py heights.r16 photo.png [PIXELS_PER_SAMPLE]

HEIGHTS.r16 has the .json beside it that isohf writes; heights count relative to its range, the lowest value is the sea.
The picture of docs/viewer.md was made with it. Nothing is shaded: the viewer has lights of its own. Only Python's own
library is used.
"""
import array
import json
import struct
import sys
import zlib


def read_heights(path):
    with open(path + ".json", encoding="utf-8") as text:
        width = json.load(text)["width"]
    samples = array.array("H")
    with open(path, "rb") as raw:
        samples.frombytes(raw.read())
    if sys.byteorder == "big":
        samples.byteswap()
    return [samples[at : at + width].tolist() for at in range(0, len(samples), width)]


def png_chunk(kind, body):
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def hashed(x, y, seed):
    h = (x * 374761393 + y * 668265263 + seed * 2147483647) & 0xFFFFFFFF
    h = ((h ^ (h >> 13)) * 1274126177) & 0xFFFFFFFF
    return ((h ^ (h >> 16)) & 0xFFFF) / 65535.0


class Noise:
    """Value noise of several octaves, row by row."""

    def __init__(self, scale, octaves, seed):
        self.layers = [(scale / 2**k, 0.5 ** (k + 1), seed + k) for k in range(octaves)]

    def row(self, y, width):
        total = [0.0] * width
        for scale, weight, seed in self.layers:
            v = y / scale
            j = int(v)
            t = v - j
            t = t * t * (3 - 2 * t)
            count = int(width / scale) + 2
            line = [hashed(i, j, seed) * (1 - t) + hashed(i, j + 1, seed) * t for i in range(count)]
            for x in range(width):
                u = x / scale
                i = int(u)
                s = u - i
                s = s * s * (3 - 2 * s)
                total[x] += weight * (line[i] + (line[i + 1] - line[i]) * s)
        return total


def mix(a, b, t):
    t = 0.0 if t < 0 else 1.0 if t > 1 else t
    return (a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t, a[2] + (b[2] - a[2]) * t)


SEA_DEEP, SEA_SHALLOW, SAND = (18, 46, 74), (44, 96, 110), (196, 182, 142)
MEADOW, WOODS, ROCK, SCREE, SNOW = (118, 130, 72), (44, 66, 40), (112, 104, 96), (146, 134, 116), (240, 242, 246)
FIELDS = [(136, 146, 74), (168, 154, 88), (104, 128, 62), (190, 172, 110), (122, 108, 70), (88, 116, 58)]


def ground(h, slope, broad, fine, field):
    colour = mix(MEADOW, WOODS, (broad - 0.42) * 9 + (0.30 - abs(h - 0.30)) * 2)
    if slope < 0.035 and 0.015 < h < 0.22 and broad < 0.52:
        colour = mix(colour, field, (0.52 - broad) * 14)
    colour = mix(colour, SCREE, (h - 0.52 + (broad - 0.5) * 0.35) * 7)
    colour = mix(colour, ROCK, (slope - 0.16 + (fine - 0.5) * 0.16) * 9)
    colour = mix(colour, SNOW, (h - 0.70 + (fine - 0.5) * 0.22 - slope * 0.5) * 11)
    return mix(SAND, colour, (h - 0.004 - fine * 0.008) * 160)


def paint(rows, scale, out):
    low, high = min(map(min, rows)), max(map(max, rows))
    width, height = len(rows[0]) * scale, len(rows) * scale
    broad, fine, patch = Noise(40 * scale, 5, 1), Noise(5 * scale, 4, 20), Noise(9 * scale, 2, 40)
    packer = zlib.compressobj()
    packed = b""

    def heights(y):
        v = min(max((y + 0.5) / scale - 0.5, 0.0), len(rows) - 1.001)
        j = int(v)
        t = v - j
        line = [(a + (b - a) * t - low) / (high - low) for a, b in zip(rows[j], rows[j + 1])]
        values = []
        for x in range(width):
            u = min(max((x + 0.5) / scale - 0.5, 0.0), len(line) - 1.001)
            i = int(u)
            values.append(line[i] + (line[i + 1] - line[i]) * (u - i))
        return values

    here, below = heights(0), heights(1)
    for y in range(height):
        b, f, p = broad.row(y, width), fine.row(y, width), patch.row(y, width)
        pixels = bytearray()
        for x in range(width):
            h = here[x]
            slope = scale * 6.0 * (abs(here[min(x + 1, width - 1)] - h) + abs(below[x] - h))
            if h < 0.0025:
                colour = mix(SEA_DEEP, SEA_SHALLOW, (f[x] - 0.45) * 0.5 + 0.25 * b[x])
            else:
                # Fields are patches between warped straight lines.
                i, j = int((x + 60 * p[x]) / (9 * scale)), int((y + 60 * b[x]) / (6 * scale))
                colour = ground(h, slope, b[x], f[x], FIELDS[int(hashed(i, j, 7) * 5.99)])
            grain = 0.82 + 0.36 * f[x]
            pixels += bytes(min(255, max(0, int(c * grain))) for c in colour)
        packed += packer.compress(b"\0" + pixels)  # filter 0: none
        here, below = below, heights(min(y + 2, height - 1))
    out.write(b"\x89PNG\r\n\x1a\n" + png_chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)))
    out.write(png_chunk(b"IDAT", packed + packer.flush()) + png_chunk(b"IEND", b""))


if __name__ == "__main__":
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    with open(sys.argv[2], "wb") as result:
        paint(read_heights(sys.argv[1]), int(sys.argv[3]) if len(sys.argv) == 4 else 4, result)
