#!/usr/bin/env python3
"""Reads an isohf archive by archive_format.md, with nothing but Python's standard library: checks every member, the content
hash, coarse planes, shadow seeds and textures and, where it was made with --lossless, brings back the source's samples. usage: reader.py ARCHIVE [SAMPLES]: prints the
hashes; SAMPLES: writes the source's samples there, little-endian, row by row."""

import hashlib
import json
import math
import re
import struct
import sys
import zlib


class Refused(Exception):
    pass


def require(holds, what):
    if not holds:
        raise Refused(what)


# ---- Tile payload, section 5 ----------------------------------------------------------------------------------------

FIXED = {0: [4096], 1: [4096, -4096], 2: [4750, -1050, -1180, 370, -1230, 350, -1230, -290, 50, 660]}


def leb128(data, at):
    """A number and where it ends."""
    value = shift = 0
    while True:
        require(at < len(data) and shift < 35, "a number that does not end")
        value |= (data[at] & 127) << shift
        at, shift = at + 1, shift + 7
        if data[at - 1] < 128:
            require(data[at - 1] > 0 or shift == 7, "a number of too many bytes")
            return value, at


def void_mask(data, samples):
    mask, at, of = [], 0, 0
    while at < len(data):
        is_first, (run, at) = at == 0, leb128(data, at)
        require((run > 0 or is_first) and run <= samples - len(mask), "a run of the void mask is empty or too long")
        mask += [of] * run
        of = 1 - of
    require(len(mask) == samples and 0 < sum(mask) < samples, "a void mask of another size, without a void or of voids alone")
    return mask


class Bits:
    def __init__(self, data):
        self.number, self.at, self.bytes = int.from_bytes(data, "little"), 0, len(data)

    def take(self, count):
        value = self.number >> self.at & (1 << count) - 1
        self.at += count
        return value

    def number_of(self, symbol, limit):
        """What a symbol and its extra bits say."""
        require(symbol < limit, "a symbol above the last")
        x = (symbol - 16) // 8 + 1 if symbol >= 16 else 0
        return symbol if symbol < 16 else ((8 + (symbol & 7)) << x) + self.take(x)

    def check_used_up(self):
        require((self.at + 7) // 8 == self.bytes and self.number >> self.at == 0, "extra bits that run out or are left over")


def symbols_of(payload, at, count, is_paired):
    """The symbols of a context and where they end."""
    require(not is_paired or count <= 2 * len(payload), "more symbols than bytes")
    symbols = list(payload[at : at + count]) if not is_paired else []
    while is_paired and len(symbols) < count:
        require(at < len(payload) and payload[at] <= 225, "no pair of symbols")
        pair = divmod(payload[at], 15) if payload[at] < 225 else payload[at + 1 : at + 3]
        require(len(pair) == 2 and (payload[at] < 225 or max(pair) >= 15), "no pair of symbols")
        symbols += pair
        at += 1 if payload[at] < 225 else 3
    require(len(symbols) >= count and (len(symbols) == count or symbols.pop() == 0), "symbols are missing or left over")
    return symbols, at if is_paired else at + count


def neighbours_of(v, near, far, farther, p, s):
    """W, NW, WW, …, NNWWW, in the order of the weights."""
    return [v[p - 1], near[p + s - 1], v[p - 2], near[p + s + 1], near[p + s - 2], far[p], far[p + 1], far[p - 1],
            far[p + 2], far[p - 2], farther[p + s], farther[p + s - 1], farther[p + s + 1], farther[p + s - 2],
            near[p + s + 2], near[p + s - 3], far[p + 3], far[p - 3]]


def energy_above(n, f, p, s):
    return (4 * (n[p + s] + n[p + s - 1] + f[p]) + 3 * n[p + s + 1] + n[p + s - 3] + f[p + 2] + f[p - 2]
            + 2 * (n[p + s + 2] + n[p + s - 2] + f[p + 1] + f[p - 1]))


def undropped(v, d):
    """An integer of d dropped bits with none dropped."""
    return v if v is None else v << d if v >= 0 else ((v + 1) << d) - 1


def unzigzag(folded):
    return folded // 2 if folded % 2 == 0 else -(folded + 1) // 2


def decode(payload, columns, rows, kind):
    """The integers of a tile in row order, None where void, and the number of dropped bits."""
    require(len(payload) >= 16, "a payload ends early")
    if payload[0] == 2:
        return decode_adaptive(payload, columns, rows, kind)
    version, found_kind, flags, dropped, low, high, mask_bytes = struct.unpack_from("<BBBBiiI", payload)
    require(version == 1 and found_kind == kind and flags < 4 and dropped <= (30 if kind == 2 else 0), "a header's fields")
    ends = (-(1 << 31), (1 << 31) - 1) if kind == 2 else (0, (65534, 254)[kind])
    require(ends[0] <= low <= high <= ends[1] and (low == high) == (flags >> 1) and (mask_bytes > 0) == (flags & 1), "a range")
    at = 16
    if not flags & 2:
        require(len(payload) >= 30, "a payload ends early")
        base, extra_bytes, shift, contexts, paired, predictors, n = struct.unpack_from("<iIBBHBB", payload, 16)
        require(low <= base <= high and shift < 32 and 1 <= contexts <= 16 and paired >> contexts == 0
                and predictors == 1 and n in (12, 18), "a header's fields")
        fields = "<%dh%dH%dI" % (n, contexts - 1, contexts)
        require(len(payload) >= 30 + struct.calcsize(fields), "a payload ends early")
        numbers = struct.unpack_from(fields, payload, 30)
        weights, thresholds, counts = numbers[:n], numbers[n:-contexts], numbers[-contexts:]
        require(sum(map(abs, weights)) < 28672, "weights that are too large")
        require(all(a < b for a, b in zip((0,) + thresholds, thresholds + (4096,))), "thresholds out of order")
        at = 30 + struct.calcsize(fields)
    mask = void_mask(payload[at : at + mask_bytes], columns * rows) if flags & 1 else [0] * (columns * rows)
    at += mask_bytes
    if flags & 2:
        require(at == len(payload), "bytes behind the payload's end")
        return [None if void else low for void in mask], dropped
    symbols = []
    for k, count in enumerate(counts):
        found, at = symbols_of(payload, at, count, paired >> k & 1)
        symbols.append(found)
    require(at + extra_bytes == len(payload), "bytes behind the payload's end")
    extra = Bits(payload[at:])
    streams = [iter([extra.number_of(symbol, 240 if kind == 2 else 112) for symbol in found]) for found in symbols]
    extra.check_used_up()
    modulus = 1 << (32 if kind == 2 else 16)

    def residual(energy):
        folded = next(streams[sum(threshold <= energy for threshold in thresholds)], None)
        require(folded is not None, "a context runs out of symbols")
        return folded

    def restore(halves, folded):
        difference, prediction = unzigzag(folded), (halves + 1) >> 1
        value = (prediction + difference if halves % 2 else prediction - difference) % modulus
        value -= modulus if kind == 2 and value >= modulus // 2 else 0
        require(low <= value <= high, "a sample outside low … high")
        return value

    # Dictionaries by place, margins included.
    places = range(-3, columns + 3)
    above = [dict.fromkeys(places, base) for _ in range(3)]  # rows r-1, r-2, r-3
    rough = [dict.fromkeys(places, 0) for _ in range(2)]
    out = [None] * (columns * rows)
    for r in range(rows):
        s = r % 2
        first, last = (0, columns - 1) if s else (1, columns - 2)
        column = {p: p for p in range(first, last + 1)}
        if not s:
            column[1], column[columns - 2] = 0, columns - 1
        (near, far, farther), (n, f) = above, rough
        v, g = dict.fromkeys((first - 1, first - 2), near[first + s]), {}
        for p in range(first, last + 1):
            ne = near[p + s]
            if mask[r * columns + column[p]]:
                v[p], g[p] = (v[p - 1] + ne) >> 1, 0
                continue
            w = FIXED.get(r) or weights
            total = sum(a * (b - ne) for a, b in zip(w, neighbours_of(v, near, far, farther, p, s)))
            halves = min(max((4096 * ne + total) >> 11, 2 * low), 2 * high - 1)
            folded = residual(energy_above(n, f, p, s))
            out[r * columns + column[p]] = v[p] = restore(halves, folded)
            g[p] = min(folded >> shift, 157)
        for c, p in (() if s else ((1, 1), (columns - 2, columns - 3))):
            if not mask[r * columns + c]:
                out[r * columns + c] = restore(2 * ((v[p] + v[p + 1]) >> 1), residual(13 * (g[p] + g[p + 1])))
        for row in (v, g):
            row.update({p: row[first] for p in places if p < first})
            row.update({p: row[last] for p in places if p > last})
        above, rough = [v] + above[:2], [g, rough[0]]
    require(all(next(stream, None) is None for stream in streams), "a context keeps symbols")
    return out, dropped


def first_table(of_class):
    j = 1 if of_class >= 15 else (17 - of_class) // 2
    weights = [(32768 >> min(31, s * j)) + 1 for s in range(16)]
    return finish([w * 16380 // sum(weights) for w in weights])


def finish(shares):
    """Symbols 1 to 3 and 15 get one slot more, symbol 0 what is left."""
    slots = [0] + [share + (s in (1, 2, 3, 15)) for s, share in enumerate(shares) if s]
    slots[0] = 16384 - sum(slots)
    return slots


def mixed(counts, parent):
    inverse = (2**31 - 2**19) // (sum(counts) + 8)
    return finish([(c * inverse >> 17) + (p * (inverse >> 12) >> 16) for c, p in zip(counts, parent)])


class Model:
    """Slots of symbols by context: (class, quarter, pattern), without the pattern, or (class,) above class 15."""

    def __init__(self):
        self.slots, self.counts, self.waiting, self.bands = {}, {}, {}, 0

    def table(self, context):
        for key in (context, context[:2]):
            if key in self.slots:
                return self.slots[key]
        return first_table(context[0])

    def count(self, context, symbol):
        for key in {context, context[:2]}:
            self.waiting.setdefault(key, [0] * 16)[symbol] += 1

    def end_band(self):
        self.bands += 1
        shift = max(0, self.bands.bit_length() - 3)
        if self.bands >> shift << shift != self.bands:
            return
        for key in sorted(self.waiting, key=len):
            self.counts[key] = [a + b for a, b in zip(self.counts.get(key, [0] * 16), self.waiting[key])]
            parent = self.table(key[:2]) if len(key) == 3 else first_table(key[0])
            self.slots[key] = mixed(self.counts[key], parent)
        self.waiting = {}


def decode_adaptive(payload, columns, rows, kind):
    """The same of codec version 2, section 5.2."""
    _, found_kind, flags, low, high, base = struct.unpack_from("<BBBHHH", payload)
    require(found_kind == kind < 2 and flags < 16 and flags & 6 != 4 and low < high <= (65534, 254)[kind] and low <= base <= high,
            "a header's fields")
    at = 9

    weights = FIXED[2]
    if flags & 2:
        n = 18 if flags & 4 else 12
        weights = struct.unpack_from("<%dh" % n, payload, at)
        require(sum(map(abs, weights)) < 28672, "weights that are too large")
        at += 2 * n
    mask = [0] * (columns * rows)
    if flags & 1:
        size, at = leb128(payload, at)
        mask = void_mask(payload[at : at + size], columns * rows)
        at += size
    states = list(struct.unpack_from("<%dI" % (8 if flags & 8 else 1), payload, at))
    require(min(states) >= 65536, "a state below 65536")
    at += 4 * len(states)
    size, at = leb128(payload, at)
    words = iter(struct.unpack_from("<%dH" % size, payload, at))
    extra = Bits(payload[at + 2 * size :])
    model = Model()
    out = [None] * (columns * rows)

    def take(i, eighths, energy, pattern):
        """The sample that a prediction and the next symbol give, by the rules of row i of the band."""
        code = (eighths + 4) >> 3
        off = eighths - 8 * code
        above, quarter = off >= 0, off if off >= 0 else -1 - off
        if energy == 0:
            k = 0
        else:
            octave = energy.bit_length() - 1
            k = 1 + 2 * octave + (energy >> (octave - 1) & 1 if octave else 0)
        context = (k, quarter, pattern if above else -pattern) if k <= 15 else (k,)
        slots = model.table(context)
        state = states[i % len(states)]
        slot, symbol, start = state % 16384, 0, 0
        while start + slots[symbol] <= slot:
            start += slots[symbol]
            symbol += 1
        state = slots[symbol] * (state >> 14) + slot - start
        if state < 65536:
            word = next(words, None)
            require(word is not None, "too few words")
            state = state << 16 | word
        states[i % len(states)] = state
        model.count(context, symbol)
        if symbol < 15:
            bits = max(0, (k - 15) // 2)
            zigzagged = symbol << bits | extra.take(bits)
        else:
            bits = extra.take(5)
            zigzagged = (1 << bits | extra.take(bits)) - 1
            require(zigzagged < 65536, "a residual that is too large")
        difference = unzigzag(zigzagged)
        value = (code - difference if above else code + difference) % 65536
        require(low <= value <= high, "a sample outside low … high")
        return value

    def compared(a, b):
        return (a > b) - (a < b)

    places = range(-3, columns + 3)
    V = {r: dict.fromkeys(places, base) for r in (-3, -2, -1)}
    D = {r: dict.fromkeys(places, 0) for r in (-2, -1)}
    for top in range(0, rows, 8):
        band = range(top, min(top + 8, rows))
        for t in range(columns + 25):
            for r in band:
                s = r % 2
                p = t - (7 * (r - top) + 1) // 2
                first, last = (0, columns - 1) if s else (1, columns - 2)
                if not first <= p <= last:
                    continue
                if p == first:
                    V[r] = {p - 2: V[r - 1][p + s], p - 1: V[r - 1][p + s]}
                    D[r] = {p - 2: 0, p - 1: 0}
                v, near, far, farther, d, n, f = V[r], V[r - 1], V[r - 2], V[r - 3], D[r], D[r - 1], D[r - 2]
                column = {1: 0, columns - 2: columns - 1}.get(p, p) if not s else p
                ne = near[p + s]
                if mask[r * columns + column]:
                    v[p], d[p] = (v[p - 1] + ne) >> 1, 0
                else:
                    w = FIXED.get(r) or weights
                    total = 4096 * ne + sum(a * (b - ne) for a, b in zip(w, neighbours_of(v, near, far, farther, p, s)))
                    eighths = min(max(total >> 9, 8 * low), 8 * high)
                    energy = energy_above(n, f, p, s) + 6 * d[p - 1] + 3 * d[p - 2]
                    pattern = (27 * compared(v[p - 1], ne) + 9 * compared(near[p + s - 1], ne)
                               + 3 * compared(near[p + s + 1], ne) + compared(near[p + s - 2], ne))
                    v[p] = take(r - top, eighths, energy, pattern)
                    d[p] = min(abs(8 * v[p] - eighths), 65535)
                    out[r * columns + column] = v[p]
                for row in (v, d):
                    if p == first + 1:
                        row.update({q: row[first] for q in places if q < first})
                    if p == last:
                        row.update({q: row[last] for q in places if q > last})
        for r in band[::2]:
            for c, p in (1, 1), (columns - 2, columns - 3):
                if not mask[r * columns + c]:
                    out[r * columns + c] = take(r - top, 4 * (V[r][p] + V[r][p + 1]), 17 * (D[r][p] + D[r][p + 1]), 0)
        model.end_band()
    require(next(words, None) is None, "words are left over")
    require(set(states) == {65536}, "states do not end as they began")
    extra.check_used_up()
    return out, 0


# ---- Residuals, section 7 -------------------------------------------------------------------------------------------

INVERSE = [46566, -21655, 9393, -4048, 1743, -750, 323, -139, 60, -26, 11, -5, 2]
TYPES = {"uint8": "B", "int8": "b", "uint16": "H", "int16": "h", "uint32": "I", "int32": "i", "float16": "e",
         "float32": "f", "float64": "d"}


def nearest(a, b):
    return (2 * a + b) // (2 * b)


def spline_weights(n):
    def u(m):
        a, b, c = (512 - m) ** 5, (1024 - m) ** 5, (1536 - m) ** 5
        return [nearest(total, 120 << 31) for total in (a, b - 6 * a, c - 6 * b + 15 * a)]

    (w0, w1, _), (w5, w4, w3) = u(n), u(512 - n)
    return [w0, w1, 16384 - w0 - w1 - w3 - w4 - w5, w3, w4, w5]


def inverse(s, i):
    return nearest(INVERSE[0] * s(i) + sum(INVERSE[j] * (s(i - j) + s(i + j)) for j in range(1, 13)), 16384)


def mirrored(i, n):
    i %= 2 * (n - 1)
    return min(i, 2 * (n - 1) - i)


def filled(line):
    """A lattice row with its voids filled in; None where all are void."""
    there = [i for i, q in enumerate(line) if q is not None]
    if not there:
        return None
    line = [line[there[0]]] * there[0] + line[there[0] : there[-1] + 1] + [line[there[-1]]] * (len(line) - there[-1] - 1)
    for a, b in zip(there, there[1:]):
        for i in range(a + 1, b):
            line[i] = line[a] + nearest((i - a) * (line[b] - line[a]), b - a)
    return line


class Surface:
    """The vertices of all tiles as integers: tiles[flat index][c + r * C], None where void."""

    def __init__(self, metadata, tiles):
        self.columns, self.rows = metadata["tile_shape"]["columns"], metadata["tile_shape"]["rows"]
        self.across, self.down = metadata["tiles"]["columns"], metadata["tiles"]["rows"]
        self.width, self.height = 512 * (self.columns - 4) * self.across, 512 * (self.rows - 3) * self.down
        self.wraps, self.tiles = metadata["wraps_x"], tiles

    def triangle(self, x, z):
        """P at a place, None where there is none."""
        if not (0 <= x <= self.width and 0 <= z <= self.height):
            return None
        i, j = min(x // (512 * (self.columns - 4)), self.across - 1), min(z // (512 * (self.rows - 3)), self.down - 1)
        x, z = x - 512 * (self.columns - 4) * i, z - 512 * (self.rows - 3) * j
        top = min(z // 512, self.rows - 4) + 1
        below = z - 512 * (top - 1)
        even, odd, e = (top, top + 1, 512 - below) if top % 2 == 0 else (top + 1, top, below)
        k = min(x // 512, self.columns - 5)
        t = 2 * (x - 512 * k)
        if e <= t <= 1024 - e:
            read = [(1024 - e - t, k + 1, odd), (2 * e, k + 2, even), (t - e, k + 2, odd)]
        else:
            a, s = (k, t) if t < e else (k + 1, t - 1024)
            west, east = (2 * (e - s), 2 * s) if a == 0 else (e - s, e + s)
            west, east = (-2 * s, 2 * (e + s)) if a == self.columns - 4 else (west, east)
            read = [(west, a + 1, even), (1024 - 2 * e, a + 1, odd), (east, a + 2, even)]
        tile = self.tiles[j * self.across + i]
        read = [(weight, tile[c + r * self.columns]) for weight, c, r in read if weight]
        return None if any(q is None for _, q in read) else nearest(sum(weight * q for weight, q in read), 1024)

    def lattice_row(self, k):
        j = min(max((k - 1) // (self.rows - 3), 0), self.down - 1)
        r, first = k - j * (self.rows - 3), 2 - k % 2
        rows = [tile[r * self.columns :][: self.columns] for tile in self.tiles[j * self.across : (j + 1) * self.across]]
        line = sum((row[first : first + self.columns - 4] for row in rows), [])
        return line if self.wraps else rows[0][:1] + line + (rows[-1][-3:-1] if k % 2 else rows[-1][-1:])

    def spline(self, xs, zs):
        """P of each sample, row by row, None where there is none."""
        count = (self.rows - 3) * self.down + 3
        taps = [[((x + half) // 512, spline_weights((x + half) % 512)) for x in xs] for half in (256, 512)]
        heights, near = [], []
        for k in range(count):
            line = self.lattice_row(k)
            n = len(line)
            place = (lambda i: (i - 1) % n) if self.wraps else (lambda i: mirrored(i, n))
            near.append([any(line[place(i + t)] is None for t in range(-2, 4)) for i, _ in taps[k % 2]])
            line = filled(line)
            wanted = {place(i + t) for i, _ in taps[k % 2] for t in range(-2, 4)} if line else ()
            s = (lambda i: line[(i % n)]) if self.wraps else (lambda i: line[mirrored(i, n)])
            c = {i: inverse(s, i) for i in wanted}
            heights.append(line and [nearest(sum(w[t] * c[place(i - 2 + t)] for t in range(6)), 16384)
                                     for i, w in taps[k % 2]])
        coefficients = {}
        for z in zs:
            rows = [mirrored(z // 512 - 1 + t, count) for t in range(6)]
            weights = spline_weights(z % 512)
            for k in rows if 0 <= z <= self.height else ():
                if k in coefficients or heights[k] is None:
                    continue
                window = {0: heights[k]}
                for j in range(1, 13):
                    window[-j] = heights[mirrored(k - j, count)] or window[1 - j]
                    window[j] = heights[mirrored(k + j, count)] or window[j - 1]
                coefficients[k] = [inverse(lambda j: window[j][i], 0) for i in range(len(xs))]
            for i, x in enumerate(xs):
                if not (0 <= x <= self.width and 0 <= z <= self.height):
                    yield None
                elif any(near[k][i] for k in rows):
                    yield self.triangle(x, z)
                else:
                    yield nearest(sum(w * coefficients[k][i] for w, k in zip(weights, rows)), 16384)


def cells(samples, step):
    return max(3, -(-(samples - 1) // step))


def node_weights(i, samples, n):
    d = max(samples - 1, 1)
    cell, part = i * n // d, (i * n % d * 16384 + d // 2) // d
    first = min(max(cell - 1, 0), n - 3)
    a, a1, a2, a3 = ((cell - first - m) * 16384 + part for m in range(4))
    v0, v2, v3 = nearest(-a1 * a2 * a3, 6 << 26), nearest(-a * a1 * a3, 2 << 26), nearest(a * a1 * a2, 6 << 26)
    return first, (v0, 65536 - v0 - v2 - v3, v2, v3)


def blend(taps, nodes):
    first, weights = taps
    g = nodes[first : first + 4]
    if None in g:
        return None
    return tuple(g[1][axis] + nearest(sum(w * (node[axis] - g[1][axis]) for w, node in zip(weights, g)), 65536)
                 for axis in (0, 1))


def places(member, width, height):
    """The place of each sample, row by row, None where there is none."""
    step = 32
    while cells(width, step) > (1 << 20) // cells(height, step):
        step *= 2
    across, down = cells(width, step), cells(height, step)
    require(len(member) == 16 * (across + 1) * (down + 1), "residual/nodes has another size")
    numbers, sums, nodes = iter(struct.iter_unpack("<qq", member)), [(0, 0)] * (across + 2), []
    for _ in range(down + 1):
        row, west, corner = [], (0, 0), (0, 0)
        for i in range(across + 1):
            d = next(numbers)
            there = -(1 << 63) not in d
            north = sums[i]
            at = tuple((d[axis] if there else 0) + west[axis] + north[axis] - corner[axis] for axis in (0, 1))
            require(max(map(abs, at)) < 1 << 40, "a node lies too far from the tiles")
            row.append(at if there else None)
            sums[i], west, corner = at, at, north
        nodes.append(row)
    for j in range(height):
        taps = node_weights(j, height, down)
        line = [blend(taps, [row[i] for row in nodes]) for i in range(across + 1)]
        yield from (blend(node_weights(i, width, across), line) for i in range(width))


def key_of_guess(raw, kind):
    """The key of the sample that a prediction becomes; `kind` is the sample type's letter in struct."""
    bits = 8 * struct.calcsize("<" + kind)
    sign = 1 << bits - 1
    if kind not in "efd":
        low, high = (-sign, sign - 1) if kind.islower() else (0, 2 * sign - 1)
        return math.floor(min(max(raw + 0.5, low), high)) % (2 * sign)
    limit = {"e": 65504.0, "f": (2.0 - 2.0**-23) * 2.0**127, "d": sys.float_info.max}[kind]
    raw = min(max(raw, -limit), limit)
    if kind == "e":  # ties away from zero
        step = 2.0 ** (max(math.frexp(raw)[1] - 1, -14) - 10)
        raw = math.copysign(min(math.floor(abs(raw) / step + 0.5) * step, limit), raw)
    code = int.from_bytes(struct.pack("<" + kind, raw), "little")
    return code ^ (2 * sign - 1) if code & sign else code | sign


def planes(member, at, count, size):
    """Numbers whose lowest bytes come first, then the second ones, …"""
    require(at + count * size <= len(member), "a stream ends early")
    return iter([int.from_bytes(member[at + i : at + count * size : count], "little") for i in range(count)])


def restored(member, predicted, record):
    """The raw samples of a residual member as bytes; `predicted` are elevations, None where there is none."""
    kind, width, count = TYPES[record["sample_type"]], record["width"], len(predicted)
    size = struct.calcsize("<" + kind)
    require(len(member) >= 33 and member[0] <= 1, "residuals of another kind")
    counts = struct.unpack_from("<8I", member, 1)
    require(sum(counts) <= count, "more residuals than samples")
    mask = int.from_bytes(member[33 : 33 + (count + 7) // 8], "little") if member[0] else 0
    require(mask >> count == 0, "a mask of kept samples that goes on behind the last")
    at, streams = 33 + ((count + 7) // 8 if member[0] else 0), []
    for n in (count - sum(counts),) + counts:
        streams.append(planes(member, at, n, size))
        at += n * size
    require(at == len(member), "bytes behind the residuals")
    modulus, sign, widths, out = 1 << 8 * size, 1 << 8 * size - 1, [0] * width, bytearray()
    for i, elevation in enumerate(predicted):
        if elevation is None or mask >> i & 1:
            code = next(streams[0], None)
            require(code is not None, "more kept samples than are there")
        else:
            bits, c = widths[max(i % width - 1, 0)] + widths[i % width], i % width
            folded = next(streams[1 + sum(limit < bits for limit in (1, 3, 5, 7, 9, 12, 18))], None)
            require(folded is not None, "a stream ends early")
            widths[c] = folded.bit_length()
            guess = key_of_guess((elevation - record["z_offset"]) / record["z_scale"], kind)
            code = (guess + unzigzag(folded)) % modulus
            code = code if kind not in "efd" else code ^ sign if code & sign else code ^ modulus - 1
        out += code.to_bytes(size, "little")
    require(all(next(stream, None) is None for stream in streams), "residuals or kept samples are left over")
    return bytes(out)


# ---- Shadow seeds and textures, sections 8 and 9 --------------------------------------------------------------------


def shadow_seeds(payload, columns, rows, kind, edges):
    """Of both directions and each row the casters (distance, height); heights as integers."""
    require(struct.unpack_from("<BBBBHH", payload) == (1, 0, kind, 0, rows - 2, 0), "a seed's header")
    counts, at = struct.unpack_from("<5I", payload, 8), 28
    (extra_bytes,), at, symbols = struct.unpack_from("<I", payload, at), at + 4, []
    for count in counts:
        symbols.append(iter(payload[at : at + count]))
        at += count
    extra, across = Bits(payload[at:]), 2 * (columns - 4)
    require(len(payload) == at + extra_bytes, "bytes behind a seed's end")

    def number(stream):
        return extra.number_of(next(symbols[stream], 255), 240)

    def wrapped(value):
        return (value + 2**31) % 2**32 - 2**31

    found = {}
    for direction in (0, 1):
        above = []
        for r in range(1, rows - 1):
            near = [((d + 1) // 2 if r % 2 else d // across * (columns - 3) + (d % across + 1) // 2, h) for d, h in above]
            n, h, p, above = 1, edges[direction][r], 0, []
            for _ in range(len(near) + unzigzag(number(0))):
                while p < len(near) and near[p][0] <= n:
                    p += 1
                base, before = near[p][0] if p < len(near) else n + 1, n
                n = base + unzigzag(number(1))
                require(n > before, "casters out of order")
                if p == len(near) or abs(n - base) > 6:
                    h = wrapped(h + number(4))
                else:
                    h = wrapped(near[p][1] + unzigzag(number(2 if abs(n - base) <= 1 else 3)))
                q, m = divmod(n, columns - 3)
                above.append((2 * n if r % 2 else across * q + (2 * m - 1 if m else 0), h))
                p += p < len(near) and n - base >= -2
            found[direction, 0, r] = above
    require(all(next(stream, None) is None for stream in symbols), "a seed keeps symbols")
    extra.check_used_up()
    return found


def picture(data, kind, size, channels):
    """The rows of a PNG as bytes; of a JPEG none, but its size is looked at."""
    if kind == "jpeg":
        at = 2
        while data[at + 1] not in (0xC0, 0xC1):
            at += 2 + struct.unpack_from(">H", data, at + 2)[0]
        require(struct.unpack_from(">HHB", data, at + 5) == (size, size, channels), "a picture of another size")
        return None
    require(struct.unpack_from(">IIBB", data, 16) == (size, size, 8, {1: 0, 3: 2, 4: 6}[channels]), "a picture of another kind")
    at, packed = 8, b""
    while at < len(data):
        length, name = struct.unpack_from(">I4s", data, at)
        packed += data[at + 8 : at + 8 + length] if name == b"IDAT" else b""
        at += 12 + length
    raw, above, rows = zlib.decompress(packed), bytes(size * channels), []
    for y in range(size):
        method, line, row = raw[y * (size * channels + 1)], raw[y * (size * channels + 1) + 1 :][: size * channels], bytearray()
        for i, byte in enumerate(line):
            a, c = (row[i - channels], above[i - channels]) if i >= channels else (0, 0)
            b = above[i]
            paeth = min((abs(b - c), 0, a), (abs(a - c), 1, b), (abs(a + b - 2 * c), 2, c))[2]
            row.append((byte + (0, a, b, (a + b) // 2, paeth)[method]) % 256)
        rows.append(bytes(row))
        above = row
    return rows


# ---- The archive, sections 1 to 4 and 6 -----------------------------------------------------------------------------

KINDS = {"u16": (0, "H", 65535), "u8": (1, "B", 255), "f32": (2, "I", 0x7FC00000)}


class Archive:
    def __init__(self, path):
        with open(path, "rb") as file:
            self.data = file.read()
        self.read_directory()
        self.metadata = json.loads(self.member("isohf.json"))
        require(self.metadata["format"] == "isohf" and self.metadata["version"] == 1, "another version: not supported")
        require(not self.metadata.get("requires"), "requires what is not known: not supported")
        require(self.metadata.get("heights", "point") == "point", "heights that are not known: not supported")
        require("shard" not in self.metadata, "is a shard: merge it with the others first")
        raw_range = self.metadata["source"]["voids"].get("raw_range") or (0, 0)
        require(float(raw_range[0]) <= float(raw_range[1]), "raw_range is not the smaller number first")
        self.shape, self.grid = self.metadata["tile_shape"], self.metadata["tiles"]
        self.kind, self.letter, self.void = KINDS[self.metadata["samples"]["type"]]
        count, there = self.grid["columns"] * self.grid["rows"], len(self.members)
        vertices = self.shape["columns"] * self.shape["rows"]
        for name in self.members:
            tile = re.fullmatch(r"tiles/(0|[1-9]\d*)/(0|[1-9]\d*)\.tile", name)
            require(not name.startswith("tiles/") or tile and int(tile[1]) < self.grid["rows"] and int(tile[2]) < self.grid["columns"],
                    "no tile's name: " + name)
        digests = self.index() if "index.bin" in self.members else None
        most = 2 ** 22 + 1024 * there if digests is not None else 2 ** 22 // vertices + 64 * there
        require(count <= most, "a grid of more tiles than its members make likely")
        if digests is not None:  # else another tool packed it, and its data are others
            crcs = b"".join(struct.pack("<I", zlib.crc32(self.raw(name))) for name in self.members
                            if name not in ("isohf.json", "index.bin") and self.members[name][1] < self.members.get("index.bin", (0, len(self.data)))[1])
            stated = self.metadata.get("data_crc32")
            require(stated is None or zlib.crc32(crcs) == int(stated, 16), "the members have another CRC")
        self.digests = digests or {}

    def unpack(self, layout, at, data=None):
        data = self.data if data is None else data
        require(0 <= at and at + struct.calcsize("<" + layout) <= len(data), "a record ends behind the end")
        return struct.unpack_from("<" + layout, data, at)

    def zip64_field(self, at, size):
        """The numbers of the ZIP64 field among the extra fields of an entry; other tools add fields of their own."""
        end = at + size
        while at + 4 <= end:
            kind, length = self.unpack("HH", at)
            require(at + 4 + length <= end, "an extra field")
            if kind == 1:
                return list(self.unpack("%dQ" % (length // 8), at + 4))
            at += 4 + length
        require(at == end, "an extra field")
        return []

    def read_directory(self):
        require(self.data[:4] == b"PK\3\4", "no archive")
        ends = [i for i in range(len(self.data) - 22, max(len(self.data) - 65558, -1), -1) if self.data[i : i + 4] == b"PK\5\6"
                and self.unpack("H", i + 20)[0] == len(self.data) - i - 22]  # it ends with its comment
        require(ends, "no end record")
        last, end = ends[0], self.unpack("IHHHHIIH", ends[0])
        end64 = self.unpack("IQHHIIQQQQ", last - 76) if last >= 76 else (0, 0)
        entries, size, at = end[4], end[5], end[6]
        if end64[:2] == (0x06064B50, 44):
            last, entries, size, at = last - 76, *end64[7:]
            require(end64[6] == entries and not any(end64[4:6]) and all(
                a in (b, most) for a, b, most in zip(end[4:7], end64[7:], (0xFFFF, 0xFFFFFFFF, 0xFFFFFFFF))), "the end records")
        require(at + size == last and end[3] == end[4] and not any(end[1:3]), "the end record")
        self.members, end, first = {}, 0, at
        for _ in range(entries):
            (magic, _, _, flags, method, _, _, crc, size, full, name_size, extra, comment, _, _, _,
             offset) = self.unpack("IHHHHHHIIIHHHHHII", at)
            require(magic == 0x02014B50 and not flags & 1 and method in (0, 8), "a directory entry")
            name = self.data[at + 46 : at + 46 + name_size]
            wide = self.zip64_field(at + 46 + name_size, extra)
            if full == 0xFFFFFFFF:
                full, size = wide.pop(0), wide.pop(0)
            offset = wide.pop(0) if offset == 0xFFFFFFFF else offset
            require(offset >= end, "members overlap")
            local = self.unpack("IHHHHHIIIHH", offset)
            start, named = offset + 30 + local[9] + local[10], self.data[offset + 30 : offset + 30 + local[9]]
            require(local[0] == 0x04034B50 and not local[2] & 1 and local[3] == method and named == name and (local[2] & 8 or (
                local[6] == crc and (local[10] or local[7:9] == (size, full)))), "a local header that is not the directory's")
            end, name = start + size, name.decode()
            at += 46 + name_size + extra + comment
            if name[-1:] == "/" and not full:
                continue  # a folder
            require(end <= first and name not in self.members, "a member reaches into the directory, or occurs twice")
            require(not any(part in ("", ".", "..") for part in name.split("/")) and not set(name) & set("\\:\0"), "a name")
            self.members[name] = (method, start, size, full, crc)
        require(at == last, "the directory's entries do not fill it")

    def index(self):
        """Digests of the stored tiles by flat index, out of index.bin, all of which is checked."""
        index, digests = self.member("index.bin"), {}
        magic, version, tables, size, stands, _, _, described, crc, zero, own = self.unpack("8sII4QIIII", len(index) - 64, index)
        require(magic == b"ISOHFIDX" and version == 1 and size == len(index) and not zero
                and zlib.crc32(index[-64:-4]) == own, "the index's footer")
        if stands != self.members["index.bin"][1]:
            return None  # an archiver has moved members
        at = len(index) - 64 - described
        require(at >= 0 and zlib.crc32(index[at:-64]) == crc, "the index's descriptions")
        for _ in range(tables):
            size, flags, columns, rows, stored, total, root, root_crc, n = self.unpack("II5QII", at, index)
            name_size, zero = self.unpack("IQ", at + 68, index)
            name, places, left = index[at + 80 : at + 80 + name_size].decode(), columns * rows, stored
            require(flags < 2 and n and not zero and size >= 80 + name_size, "a table's description")
            pages = -(-places // n)
            require(root + 48 * pages <= len(index) and zlib.crc32(index[root : root + 48 * pages]) == root_crc, "a root")
            for page in range(pages):
                entry = self.unpack("QQQIIIIII", root + 48 * page, index)
                page_at, digests_at, page_bytes, present, page_crc, digest_crc = entry[:6]
                if not present:
                    require(not any(entry), "an entry of no stored place")
                    continue
                count = min(n, places - page * n)
                bits, records = index[page_at : page_at + (count + 7) // 8], page_at + (count + 7) // 8
                there = [i for i in range(8 * len(bits)) if bits[i // 8] >> i % 8 & 1]
                require(zlib.crc32(index[page_at : records + 32 * present]) == page_crc and len(there) == present
                        and there[-1] < count, "a page of the index")
                require(not flags or zlib.crc32(index[digests_at : digests_at + 32 * present]) == digest_crc, "digests")
                for rank, i in enumerate(there):
                    row, column = divmod(page * n + i, columns)
                    member = name.replace("{row}", str(row)).replace("{column}", str(column)).replace("{row:8}", "%08d" % row)
                    offset, size_, full, crc_, _, _, flag = self.unpack("QIIIIII", records + 32 * rank, index)
                    require(member in self.members and self.members[member][1:] == (offset, size_, full, crc_)
                            and flag & 1 and flag < 8, "a record that is not " + member)
                    page_bytes -= size_
                    if name == "tiles/{row}/{column}.tile":
                        digests[page * n + i] = index[digests_at + 32 * rank : digests_at + 32 * rank + 32]
                require(page_bytes == 0, "a page's sum")
                left -= present
            require(left == 0, "a table's stored places")
            at += size
        return digests

    def raw(self, name):
        _, start, size, _, _ = self.members[name]
        return self.data[start : start + size]

    def member(self, name):
        require(name in self.members, name + " is missing")
        method, _, _, full, crc = self.members[name]
        content = self.raw(name)
        if method == 8:
            inflater = zlib.decompressobj(wbits=-15)
            try:
                content = inflater.decompress(content, full + 1)
            except zlib.error as error:
                raise Refused("%s: %s" % (name, error)) from error
            require(inflater.eof and not inflater.unused_data, name + " does not use up its bytes")
        require(len(content) == full and zlib.crc32(content) == crc, name + " has another size or CRC")
        return content

    def read_tiles(self):
        """The integers of all tiles, None where void, and for f32 each tile's dropped bits."""
        samples, self.tiles, self.dropped = self.shape["columns"] * self.shape["rows"], [], []
        for i in range(self.grid["columns"] * self.grid["rows"]):
            name, values, dropped = "tiles/%d/%d.tile" % divmod(i, self.grid["columns"]), [None] * samples, 0
            if name in self.members:
                values, dropped = decode(self.member(name), self.shape["columns"], self.shape["rows"], self.kind)
            self.tiles.append(values)
            self.dropped.append(dropped)
        require(sum(name.startswith("tiles/") for name in self.members) == self.grid["stored"], "another number of tiles")

    def height(self, tile, c, r):
        """A vertex as an integer of section 5 with d = 0, None where void."""
        return undropped(self.tiles[tile][c + r * self.shape["columns"]], self.dropped[tile])

    def check_planes(self):
        """Each tile of each plane against the tiles, by the three rules."""
        columns, rows, across, down = *(self.shape[n] for n in ("columns", "rows")), *(self.grid[n] for n in ("columns", "rows"))
        planes, names = self.metadata.get("planes") or {"stride": 1, "count": 0}, set()
        wide, high = 2 * (columns - 4), rows - 3
        reach = 2 ** max(self.shape["levels"] - 1, planes["stride"].bit_length() - 1)
        for plane in range(1, planes["count"] + 1):
            F = planes["stride"] ** plane
            joined = self.metadata["wraps_x"] and across % F == 0
            for j, i in ((j, i) for j in range(-(-down // F)) for i in range(-(-across // F))):
                expected = []
                for r in range(rows):
                    for c in range(columns):
                        slid = 0 if r % 2 else {0: 2, 1: 1, columns - 2: -1, columns - 1: -2}.get(c, 0)
                        x = 2 * c + r % 2 + slid - 3
                        X, Z = i * wide + x, j * high + r - 1
                        if (not joined and F * (X - 2 * reach) > wide * across) or F * (Z - reach) > high * down:
                            expected.append(None)
                            continue
                        X, Z = F * X, min(max(F * Z, 0), high * down)
                        X += wide * across * ((X < 0) - (X > wide * across)) if joined else 0
                        X = min(max(X, 0), wide * across)
                        a, b = min(X // wide, across - 1), min(Z // high, down - 1)
                        b -= Z == b * high and b > 0 and "tiles/%d/%d.tile" % (b, a) not in self.members
                        expected.append(self.height(b * across + a, (X - a * wide) // 2 + 1, Z - b * high + 1))
                name, found = "planes/%d/%d/%d.tile" % (plane, j, i), [None] * (columns * rows)
                names.add(name)
                below = range(j * F, min((j + 1) * F, down)), range(i * F, min((i + 1) * F, across))
                if not any("tiles/%d/%d.tile" % (b, a) in self.members for b in below[0] for a in below[1]):
                    expected = [None] * (columns * rows)
                if name in self.members:
                    found, d = decode(self.member(name), columns, rows, self.kind)
                    found = [undropped(v, d) for v in found]
                require(found == expected and (name in self.members) == any(v is not None for v in found),
                        name + " is not that of the tiles below")
        require(all(name in names for name in self.members if name.startswith("planes/")), "no plane's tile")

    def check_seeds(self):
        """What seeds say enters each tile against what the tiles before it send."""
        info, columns, rows = self.metadata["shadow_seeds"], self.shape["columns"], self.shape["rows"]
        suns = [info["sun_min_deg"] * (1 - k / 3) + 30 * k for k in range(3)]
        unit = self.metadata["extent"]["x"] / (2 * (columns - 4)) * info["elevation_units_per_world_unit"]
        falls = [math.tan(math.radians(sun)) * unit / (1 if self.kind == 2 else self.metadata["samples"]["scale"]) for sun in suns]

        def number(v):
            if v is None or self.kind < 2:
                return v
            return struct.unpack("<f", struct.pack("<I", v if v >= 0 else (-v - 1) | 1 << 31))[0]

        none, wide, seen = -1 if self.kind < 2 else -0x7F800001, 2 * (columns - 4), 0
        last = lambda r: columns - 3 if r % 2 else columns - 2
        ends = [self.metadata["valid"][n] / self.metadata["extent"][m] * steps + 1e-6 for n, m, steps in (("x1", "x", wide), ("z1", "z", rows - 3))]
        covers = lambda x, j, r: x <= ends[0] and j * (rows - 3) + r - 1 <= ends[1]
        for j, direction in ((j, d) for j in range(self.grid["rows"]) for d in (0, 1)):
            entering = {(k, r): -math.inf for k in range(len(suns)) for r in range(1, rows - 1)}
            order = range(self.grid["columns"])
            for i in order if direction == 0 else reversed(order):
                tile, name = j * self.grid["columns"] + i, "seeds/%d/%d.seed" % (j, i)
                edges = [[none] + [none if (v := self.height(tile, 0 if way == 0 else last(r) + 1, r)) is None else v
                                   for r in range(1, rows - 1)] for way in (0, 1)]
                found = None
                if name in self.members:
                    seen += direction
                    found = shadow_seeds(self.member(name), columns, rows, self.kind, edges)
                for (k, r), s in entering.items():
                    edge = self.height(tile, 1 if direction == 0 else last(r), r)
                    edge = -math.inf if edge is None or not covers((i + direction) * wide, j, r) else number(edge)
                    stated, padding = [edge, -math.inf], edges[direction][r]
                    before = 2 if r % 2 else 1
                    covered = covers(i * wide - before if direction == 0 else (i + 1) * wide + before, j, r)
                    if i != order[0 if direction == 0 else -1] and padding != none and covered:
                        stated += [number(padding) - before * falls[k]]
                    if found:
                        stated += [number(h) - d * falls[k] for d, h in found[direction, 0, r]]
                    slack = 1e-6 * max(1, abs(s) if s > -math.inf else 0)
                    if "tiles/%d/%d.tile" % (j, i) in self.members:
                        require(max(s, edge) == max(stated) or abs(max(s, edge) - max(stated)) <= slack,
                                name + " is not what the tiles of its row send")
                    heights = (self.height(tile, c, r) for c in range(1, last(r) + 1))
                    xs = (min(max(2 * c - 2 - (r % 2 == 0), 0), wide - (r % 2 == 0 and c < last(r))) for c in range(1, last(r) + 1))
                    left = [number(h) - (wide - x if direction == 0 else x) * falls[k] for x, h in zip(xs, heights)
                            if h is not None and covers(i * wide + x, j, r)]
                    entering[k, r] = max([s - wide * falls[k]] + left)
        require(seen == info["members"] == sum(name.startswith("seeds/") for name in self.members), "another number of seeds")

    def check_textures(self):
        """All levels or none of each tile, and texels on common edges."""
        info, borders, count = self.metadata["tile_textures"], {}, 0
        for j, i in ((j, i) for j in range(self.grid["rows"]) for i in range(self.grid["columns"])):
            sizes = [info["size"] >> level for level in range(info["levels"])]
            names = ["textures/%d/%d/%d.%s" % (j, i, size, "jpg" if info["format"] == "jpeg" else "png") for size in sizes]
            there = [name in self.members for name in names]
            require(all(there) or not any(there), "a tile has some of its texture's levels")
            count += sum(there)
            for size, name in zip(sizes, names) if all(there) else ():
                rows, n = picture(self.member(name), info["format"], size, info["channels"]), info["channels"]
                if rows:
                    west, east = (b"".join(row[at : at + n] for row in rows) for at in (0, (size - 1) * n))
                    borders[j, i, size] = (rows[-1], east)
                    require(borders.get((j - 1, i, size), (rows[0], 0))[0] == rows[0]
                            and borders.get((j, i - 1, size), (0, west))[1] == west, name + " has other texels on a common edge")
        require(count == info["members"] == sum(name.startswith("textures/") for name in self.members), "other textures")

    def codes(self, tile):
        """A tile's codes; of f32 the bits."""
        values, d = self.tiles[tile], self.dropped[tile]
        if self.kind == 2:
            values = [v if v is None else v << d if v >= 0 else (-v - 1) << d | 1 << 31 for v in values]
        return [self.void if v is None else v for v in values]

    def content_hash(self):
        everything, samples = hashlib.sha256(), self.metadata["samples"]
        for i in range(len(self.tiles)):
            codes = self.codes(i)
            digest = hashlib.sha256(struct.pack("<%d%s" % (len(codes), self.letter), *codes)).digest()
            require(self.digests.get(i, digest) == digest, "tile %d has another digest" % i)
            if "tiles/%d/%d.tile" % divmod(i, self.grid["columns"]) in self.members:
                everything.update(struct.pack("<Q", i) + digest)
        everything.update(struct.pack("<IIIQQddBdd", self.shape["columns"], self.shape["rows"], self.shape["levels"],
                                      self.grid["columns"], self.grid["rows"], self.metadata["extent"]["x"],
                                      self.metadata["extent"]["z"], self.kind, samples["offset"], samples["scale"]))
        return everything.hexdigest()

    def ground_hash(self):
        m, source, of = self.metadata, self.metadata["source"], self.metadata["source"].get("crs") or {}
        body, datum, on = source.get("body") or {}, source.get("vertical_datum") or {}, self.metadata.get("projection")
        first, step, out = source["first_sample"], source["spacing"], b""

        def text(value):
            raw = (value or "").encode()
            return struct.pack("<I", len(raw)) + raw

        def optional(value):
            return struct.pack("<Bd", value is not None, value or 0.0)

        out += text(m["content_sha256"]) + text(m["units"]["horizontal"]) + text(m["units"]["vertical"])
        out += struct.pack("<BB", bool(m["wraps_x"]), bool(on))
        if on:
            names = ("semi_major_axis_m", "inverse_flattening", "longitude_0", "latitude_0", "parallel_1", "parallel_2",
                     "scale_0", "false_easting", "false_northing")
            out += text(on["kind"]) + struct.pack("<9di2d", *(on[name] for name in names), on.get("utm_zone") or 0,
                                                  on["origin"]["easting"], on["origin"]["northing"])
        else:
            out += struct.pack("<4d", first["x"], first["z"], step["x"], step["z"])
            out += optional(of.get("origin_x")) + optional(of.get("origin_y"))
            out += struct.pack("<2d", of["spacing_x"], of["spacing_y"])
        out += text(of.get("unit")) + struct.pack("<di", of.get("metres_per_unit", 1.0), of.get("epsg") or 0)
        out += text("" if of.get("epsg") else of.get("wkt")) + text(body.get("name"))
        out += optional(body.get("semi_major_axis_m")) + optional(body.get("inverse_flattening"))
        return hashlib.sha256(out + text(datum.get("name")) + struct.pack("<i", datum.get("epsg") or 0)).hexdigest()

    def integers(self, bits):
        """The tiles as section 7 counts them."""
        for i, values in enumerate(self.tiles):
            if self.kind < 2:
                yield [v if v is None else v << bits for v in values]
                continue
            heights = struct.unpack("<%df" % len(values), struct.pack("<%dI" % len(values), *self.codes(i)))
            ends = (-(2.0**30), 2.0**30)
            held = (None if v is None else min(max(h * 2.0**bits + 0.5, ends[0]), ends[1]) for h, v in zip(heights, values))
            yield [h if h is None else math.floor(h) for h in held]

    def predicted(self):
        """The elevations that the surface has at the source's samples, None where it has none."""
        record, source = self.metadata["lossless"], self.metadata["source"]
        width, height, bits = record["width"], record["height"], record["fraction_bits"]
        require(record["prediction"] in ("spline", "triangles"), "prediction %s: not supported" % record["prediction"])
        surface = Surface(self.metadata, list(self.integers(bits)))
        if record["prediction"] == "spline":
            extent, first, step = self.metadata["extent"], source["first_sample"], source["spacing"]
            unit_x, unit_z = extent["x"] / (2.0 * (self.shape["columns"] - 4)), extent["z"] / (self.shape["rows"] - 3)
            xs = [math.floor((first["x"] + i * step["x"]) / unit_x * 256.0 + 0.5) for i in range(width)]
            zs = [math.floor((first["z"] + j * step["z"]) / unit_z * 512.0 + 0.5) for j in range(height)]
            numbers = surface.spline(xs, zs)
        else:
            at = places(self.member("residual/nodes"), width, height)
            numbers = (None if place is None else surface.triangle(*place) for place in at)
        offset, scale, unit = self.metadata["samples"]["offset"], self.metadata["samples"]["scale"], 2.0**-bits
        return [p if p is None else offset + scale * (p * unit) for p in numbers]

    def source_samples(self):
        record, predicted = self.metadata["lossless"], self.predicted()
        found, rows, width, height = b"", record["rows_per_member"], record["width"], record["height"]
        for row in range(0, height, rows):
            found += restored(self.member("residual/%08d" % row), predicted[row * width : (row + rows) * width], record)
        require(hashlib.sha256(found).hexdigest() == record["sha256"], "the samples have another SHA-256")
        return found


def main(path, samples=None):
    archive = Archive(path)
    for name in archive.members:
        archive.member(name)
    archive.read_tiles()
    require(archive.content_hash() == archive.metadata["content_sha256"], "another content hash")
    require(archive.ground_hash() == archive.metadata["ground_sha256"], "another ground hash")
    archive.check_planes()
    if "shadow_seeds" in archive.metadata:
        archive.check_seeds()
    if "tile_textures" in archive.metadata:
        archive.check_textures()
    print("content", archive.metadata["content_sha256"])
    if "lossless" in archive.metadata:
        found = archive.source_samples()
        print("samples", archive.metadata["lossless"]["sha256"])
        if samples:
            with open(samples, "wb") as file:
                file.write(found)


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        print("usage: reader.py ARCHIVE [SAMPLES]", file=sys.stderr)
        sys.exit(2)
    try:
        main(*sys.argv[1:])
    except OSError as error:
        sys.exit(str(error))
    except (Refused, ValueError, LookupError, TypeError, struct.error, OverflowError) as refusal:
        sys.exit("%s: refused: %s" % (sys.argv[1], refusal))
