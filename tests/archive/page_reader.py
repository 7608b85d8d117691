"""Reads an isohf archive by docs/archive_format.md alone, with nothing but Python's standard library, and compares the
content hash that it finds with the one in the metadata. usage: page_reader.py FILE"""

import hashlib
import json
import struct
import sys
import zlib

KINDS = {"u16": 0, "u8": 1, "f32": 2}
FIXED = {0: [4096], 1: [4096, -4096], 2: [4750, -1050, -1180, 370, -1230, 350, -1230, -290, 50, 660]}
BLOCK = 16


def void_mask(data, samples):
    mask, run, shift, of = [], 0, 0, 0
    for byte in data:
        run |= (byte & 127) << shift
        shift += 7
        if byte < 128:
            mask += [of] * run
            run, shift, of = 0, 0, 1 - of
    assert len(mask) == samples
    return mask


class Bits:
    def __init__(self, data):
        self.number, self.at = int.from_bytes(data, "little"), 0

    def take(self, count):
        value = self.number >> self.at & (1 << count) - 1
        self.at += count
        return value


def unpair(payload, at, count):
    """The symbols of a context that are stored in pairs, and where they end."""
    symbols = []
    while len(symbols) < count:
        assert payload[at] <= 225
        if payload[at] < 225:
            symbols += divmod(payload[at], 15)
            at += 1
        else:
            symbols += payload[at + 1 : at + 3]
            at += 3
    assert len(symbols) == count or symbols.pop() == 0
    return symbols, at


def decode(payload, columns, rows, kind):
    """The integers of a tile in row order, None where void, and the number of dropped bits."""
    version, found_kind, flags, dropped, low, high, mask_bytes = struct.unpack_from("<BBBBiiI", payload)
    assert (version, found_kind) == (1, kind)
    at = 16
    if not flags & 2:
        base, extra_bytes, shift, contexts, paired, predictors, n = struct.unpack_from("<iIBBHBB", payload, 16)
        at = 30
        weights = []
        for _ in range(predictors):
            weights.append(list(struct.unpack_from("<%dh" % n, payload, at)))
            at += 2 * n
        thresholds = struct.unpack_from("<%dH" % (contexts - 1), payload, at)
        at += 2 * (contexts - 1)
        counts = struct.unpack_from("<%dI" % contexts, payload, at)
        at += 4 * contexts
    mask = void_mask(payload[at : at + mask_bytes], columns * rows) if flags & 1 else [0] * (columns * rows)
    at += mask_bytes
    if flags & 2:
        assert at == len(payload)
        return [None if void else low for void in mask], dropped
    across, down = -(-columns // BLOCK), -(-rows // BLOCK)
    block_map = bytes(across * down)
    if predictors > 1:
        block_map = payload[at : at + across * down]
        at += across * down
    symbols = []
    for k, count in enumerate(counts):
        if paired >> k & 1:
            found, at = unpair(payload, at, count)
        else:
            found, at = payload[at : at + count], at + count
        symbols.append(found)
    extra = Bits(payload[at : at + extra_bytes])
    assert at + extra_bytes == len(payload)
    modulus = 1 << (32 if kind == 2 else 16)

    def unzigzagged(symbol):
        if symbol < 16:
            return symbol
        bits = (symbol - 16) // 8 + 1
        return ((8 + (symbol & 7)) << bits) + extra.take(bits)

    streams = [iter([unzigzagged(symbol) for symbol in found]) for found in symbols]
    assert (extra.at + 7) // 8 == extra_bytes

    def residual(energy):
        return next(streams[sum(threshold <= energy for threshold in thresholds)])

    def restore(halves, zigzagged):
        difference = zigzagged // 2 if zigzagged % 2 == 0 else -(zigzagged + 1) // 2
        prediction = (halves + 1) >> 1
        value = (prediction + difference if halves % 2 else prediction - difference) % modulus
        if kind == 2 and value >= modulus // 2:
            value -= modulus
        assert low <= value <= high
        return value

    # Dictionaries by place, margins included.
    places = range(-3, columns + 3)
    above = [dict.fromkeys(places, base) for _ in range(3)]  # rows r-1, r-2, r-3
    rough = [dict.fromkeys(places, 0) for _ in range(2)]  # magnitudes of rows r-1, r-2
    out = [None] * (columns * rows)
    for r in range(rows):
        s = r % 2
        first, last = (0, columns - 1) if s else (1, columns - 2)
        column = {p: p for p in range(first, last + 1)}
        if not s:
            column[1], column[columns - 2] = 0, columns - 1
        v, g = {}, {}
        v[first - 1] = v[first - 2] = above[0][first + s]
        for p in range(first, last + 1):
            ne = above[0][p + s]
            if mask[r * columns + column[p]]:
                v[p], g[p] = (v[p - 1] + ne) >> 1, 0
                continue
            near, far, farther = above
            n, f = rough
            w = FIXED.get(r) or weights[block_map[r // BLOCK * across + p // BLOCK]]
            neighbours = [v[p - 1], near[p + s - 1], v[p - 2], near[p + s + 1], near[p + s - 2], far[p], far[p + 1],
                          far[p - 1], far[p + 2], far[p - 2], farther[p + s], farther[p + s - 1], farther[p + s + 1],
                          farther[p + s - 2], near[p + s + 2], near[p + s - 3], far[p + 3], far[p - 3]]
            total = sum(a * (b - ne) for a, b in zip(w, neighbours))
            halves = min(max((4096 * ne + total) >> 11, 2 * low), 2 * high - 1)
            zigzagged = residual(4 * (n[p + s] + n[p + s - 1] + f[p]) + 3 * n[p + s + 1]
                              + 2 * (n[p + s + 2] + n[p + s - 2] + f[p + 1] + f[p - 1])
                              + n[p + s - 3] + f[p + 2] + f[p - 2])
            v[p] = restore(halves, zigzagged)
            g[p] = min(zigzagged >> shift, 157)
            out[r * columns + column[p]] = v[p]
        for c, p in (() if s else ((1, 1), (columns - 2, columns - 3))):
            if not mask[r * columns + c]:
                out[r * columns + c] = restore(2 * ((v[p] + v[p + 1]) >> 1), residual(13 * (g[p] + g[p + 1])))
        for row in (v, g):
            row.update({p: row[first] for p in places if p < first})
            row.update({p: row[last] for p in places if p > last})
        above, rough = [v] + above[:2], [g, rough[0]]
    assert all(next(stream, None) is None for stream in streams)
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
    """The same of codec version 2."""
    _, found_kind, flags, low, high, base = struct.unpack_from("<BBBHHH", payload)
    assert found_kind == kind and flags < 16
    at = 9

    def number():
        nonlocal at
        value, shift = 0, 0
        while True:
            at += 1
            value |= (payload[at - 1] & 127) << shift
            shift += 7
            if payload[at - 1] < 128:
                return value

    weights = FIXED[2]
    if flags & 2:
        n = 18 if flags & 4 else 12
        weights = struct.unpack_from("<%dh" % n, payload, at)
        at += 2 * n
    mask = [0] * (columns * rows)
    if flags & 1:
        size = number()
        mask = void_mask(payload[at : at + size], columns * rows)
        at += size
    states = list(struct.unpack_from("<%dI" % (8 if flags & 8 else 1), payload, at))
    at += 4 * len(states)
    size = number()
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
            state = state << 16 | next(words)
        states[i % len(states)] = state
        model.count(context, symbol)
        if symbol < 15:
            bits = max(0, (k - 15) // 2)
            zigzagged = symbol << bits | extra.take(bits)
        else:
            bits = extra.take(5)
            zigzagged = (1 << bits | extra.take(bits)) - 1
        difference = zigzagged // 2 if zigzagged % 2 == 0 else -(zigzagged + 1) // 2
        value = (code - difference if above else code + difference) % 65536
        assert low <= value <= high
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
                    neighbours = [v[p - 1], near[p + s - 1], v[p - 2], near[p + s + 1], near[p + s - 2], far[p],
                                  far[p + 1], far[p - 1], far[p + 2], far[p - 2], farther[p + s], farther[p + s - 1],
                                  farther[p + s + 1], farther[p + s - 2], near[p + s + 2], near[p + s - 3], far[p + 3],
                                  far[p - 3]] if len(w) > 12 else [v[p - 1], near[p + s - 1], v[p - 2], near[p + s + 1],
                                  near[p + s - 2], far[p], far[p + 1], far[p - 1], far[p + 2], far[p - 2],
                                  farther[p + s], farther[p + s - 1]]
                    total = 4096 * ne + sum(a * (b - ne) for a, b in zip(w, neighbours))
                    eighths = min(max(total >> 9, 8 * low), 8 * high)
                    energy = (4 * (n[p + s] + n[p + s - 1] + f[p]) + 3 * n[p + s + 1]
                              + 2 * (n[p + s + 2] + n[p + s - 2] + f[p + 1] + f[p - 1])
                              + n[p + s - 3] + f[p + 2] + f[p - 2] + 6 * d[p - 1] + 3 * d[p - 2])
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
    assert next(words, None) is None and set(states) == {65536}
    assert (extra.at + 7) // 8 == len(payload) - at - 2 * size
    return out, 0


def pack(values, dropped, kind):
    if kind < 2:
        void = (65535, 255)[kind]
        return struct.pack("<%d%s" % (len(values), "HB"[kind]), *(void if v is None else v for v in values))
    bits = [0x7FC00000 if v is None else (v << dropped if v >= 0 else (-v - 1) << dropped | 1 << 31) for v in values]
    return struct.pack("<%dI" % len(bits), *bits)


def main(path):
    with open(path, "rb") as file:
        data = file.read()
    end64 = struct.unpack("<IQHHIIQQQQ", data[-98:-42])
    directory, behind = end64[9], end64[9] + end64[8]
    assert data[30:63] == b"mimetypeapplication/vnd.isohf+zip"

    def own_member(behind, name):
        """One of the last two members, by its directory entry, which ends there."""
        for extra in (0, 12, 20, 28):
            at = behind - 46 - len(name) - extra
            fields = struct.unpack_from("<I6H3I5H2I", data, at)
            if fields[0] == 0x02014B50 and data[at + 46 : at + 46 + len(name)] == name and fields[11] == extra:
                start = fields[16] + 30 + len(name)
                content = data[start : start + fields[8]]
                assert zlib.crc32(content) == fields[7]
                return content, start, at
        raise AssertionError(name)

    text, _, at = own_member(behind, b"isohf.json")
    index, index_at, _ = own_member(at, b"index.bin")
    metadata = json.loads(text)
    assert metadata["version"] == 2 and not metadata.get("requires")
    shape, tiles, samples = metadata["tile_shape"], metadata["tiles"], metadata["samples"]
    kind, columns, rows = KINDS[samples["type"]], shape["columns"], shape["rows"]
    count = tiles["columns"] * tiles["rows"]
    magic, version, tables, size, stands, _, _, descriptions, crc = struct.unpack_from("<8sII4QII", index, len(index) - 64)
    assert (magic, version, size, stands) == (b"ISOHFIDX", 2, len(index), index_at)
    at = len(index) - 64 - descriptions
    assert zlib.crc32(index[at : at + descriptions]) == crc
    for _ in range(tables):
        size, flags, across, down, of_table, _, root_at, root_crc, per_page = struct.unpack_from("<II5QII", index, at)
        name_bytes = struct.unpack_from("<I", index, at + 68)[0]
        if index[at + 80 : at + 80 + name_bytes] == b"tiles/{row}/{column}.tile":
            break
        at += size
    assert (flags, across, down, of_table) == (1, tiles["columns"], tiles["rows"], tiles["stored"])
    pages = -(-count // per_page)
    assert zlib.crc32(index[root_at : root_at + 48 * pages]) == root_crc
    records = {}
    for page in range(pages):
        page_at, digests_at, _, present, page_crc, digests_crc = struct.unpack_from("<QQQIII", index, root_at + 48 * page)
        if not present:
            continue
        bits = -(-min(per_page, count - page * per_page) // 8)
        content = index[page_at : page_at + bits + 32 * present]
        digests = index[digests_at : digests_at + 32 * present]
        assert zlib.crc32(content) == page_crc and zlib.crc32(digests) == digests_crc
        there = [i for i in range(8 * bits) if content[i // 8] >> i % 8 & 1]
        for rank, i in enumerate(there):
            record = content[bits + 32 * rank : bits + 32 * rank + 32]
            records[page * per_page + i] = record, digests[32 * rank : 32 * rank + 32]
    everything = hashlib.sha256()
    stored = 0
    for tile in range(count):
        values, dropped = [None] * (columns * rows), 0
        if tile in records:
            offset, compressed, inflated, crc, _, _, flags = struct.unpack("<QIIIIII", records[tile][0])
            assert flags & 1
            payload = zlib.decompress(data[offset : offset + compressed], wbits=-15)
            assert len(payload) == inflated and zlib.crc32(payload) == crc
            values, dropped = (decode if payload[0] == 1 else decode_adaptive)(payload, columns, rows, kind)
            stored += 1
        digest = hashlib.sha256(pack(values, dropped, kind)).digest()
        assert tile not in records or records[tile][1] == digest
        everything.update(digest)
    everything.update(struct.pack("<IIIQQddBdd", columns, rows, shape["levels"], tiles["columns"], tiles["rows"],
                                  metadata["extent"]["x"], metadata["extent"]["z"], kind, samples["offset"],
                                  samples["scale"]))
    assert stored == tiles["stored"]
    assert everything.hexdigest() == metadata["content_sha256"], "another content hash"


if __name__ == "__main__":
    main(sys.argv[1])
