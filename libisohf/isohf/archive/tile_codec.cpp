#include "isohf/archive/tile_codec.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>

#include "isohf/archive/content_hash.h"
#include "isohf/archive/context_model.h"
#include "isohf/archive/deflate.h"
#include "isohf/archive/pair_coding.h"
#include "isohf/archive/tile_payload.h"
#include "isohf/archive/void_mask.h"
#include "isohf/base/assert.h"
#include "isohf/base/vectorised.h"

namespace isohf {
namespace {

/// Room for `count` values that are written before they are read: a vector would set them to zero first.
template <typename T>
class Scratch {
 public:
  explicit Scratch(std::size_t count) : values_(std::make_unique_for_overwrite<T[]>(count)) {}
  [[nodiscard]] T* data() { return values_.get(); }
  [[nodiscard]] const T* data() const { return values_.get(); }

 private:
  std::unique_ptr<T[]> values_;
};

/// The void mask, as 0 and 1; empty where nothing is void.
struct Voids {
  std::vector<std::uint8_t> is_void;
  std::int64_t count = 0;
};

template <typename Sample, typename IsVoid>
Voids find_voids(std::span<const Sample> samples, std::int64_t count, const IsVoid& is_void) {
  Voids voids;
  voids.count = count;
  if (voids.count == 0) return voids;
  voids.is_void.resize(samples.size());
  std::transform(samples.begin(), samples.end(), voids.is_void.begin(),
                 [&](Sample sample) { return static_cast<std::uint8_t>(is_void(sample) ? 1 : 0); });
  return voids;
}

/// Puts the samples of a tile into lattice order, voids filled. `sample_at(i)` is the sample with storage index i.
template <typename Wide, typename SampleAt>
void load(Lattice<Wide>& lattice, const Voids& voids, Wide base, const SampleAt& sample_at) {
  const int columns = lattice.columns();
  lattice.fill_rows_above(base);
  for (int r = 0; r < lattice.rows(); ++r) {
    Wide* const own = lattice.row(r);
    const auto row_start = static_cast<std::size_t>(r) * static_cast<std::size_t>(columns);
    const auto index = [&](int column) { return row_start + static_cast<std::size_t>(column); };
    const int first = Lattice<Wide>::first(r);
    const int last = lattice.last(r);
    for (int place = first; place <= last; ++place) own[place] = sample_at(index(place));
    if (r % 2 == 0) {
      own[first] = sample_at(index(0));
      own[last] = sample_at(index(columns - 1));
      for (int side = 0; side < 2; ++side) lattice.slid(r, side) = sample_at(index(column_of_slid(columns, side)));
    }
    if (!voids.is_void.empty()) {
      lattice.open_row(r);
      const Wide* const north = lattice.row(r - 1) + r % 2;
      for (int place = first; place <= last; ++place) {
        if (voids.is_void[index(column_of_place(columns, r, place))] != 0) own[place] = void_fill(own, north, place);
      }
    }
    lattice.close_row(r);
  }
}

/// A residual modulo 2^16 or 2^32, folded.
std::uint32_t fold(std::int32_t difference) {
  return zigzag(static_cast<std::int16_t>(difference)) & 0xffffU;
}
std::uint32_t fold(std::int64_t difference) {
  return zigzag(static_cast<std::int32_t>(difference));
}

ISOHF_VECTORISED(void, fold_row,
                 (const std::int32_t* own, const std::int32_t* predictions, int count, std::uint32_t* __restrict out),
                 (own, predictions, count, out)) {
  for (int i = 0; i < count; ++i) out[i] = fold(own[i] - predictions[i]);
}
void fold_row(const std::int64_t* own, const std::int64_t* predictions, int count, std::uint32_t* out) {
  for (int i = 0; i < count; ++i) out[i] = fold(own[i] - predictions[i]);
}

/// Activities of `count` places from `first` on.
ISOHF_VECTORISED(void, find_activities,
                 (const std::uint32_t* north, const std::uint32_t* own, int first, int count,
                  std::uint32_t* __restrict out),
                 (north, own, first, count, out)) {
  for (int i = 0; i < count; ++i) {
    out[i] = activity_from_above(north, first + i) + activity_from_west(own, first + i);
  }
}

/// A tile's residuals in coding order, voids left out.
struct Residuals {
  Scratch<std::uint32_t> folded;
  Scratch<std::uint32_t> activities;
  std::size_t count = 0;

  explicit Residuals(std::size_t most) : folded(most), activities(most) {}
  void add(std::uint32_t residual, std::uint32_t activity) {
    folded.data()[count] = residual;
    activities.data()[count++] = activity;
  }
  /// Drops those of `added` last ones that are void.
  template <typename IsVoid>
  void drop_voids(std::size_t added, const IsVoid& is_void) {
    const std::size_t start = count;
    for (std::size_t i = 0; i < added; ++i) {
      if (!is_void(static_cast<int>(i))) add(folded.data()[start + i], activities.data()[start + i]);
    }
  }
};

template <typename Wide>
Residuals find_residuals(Lattice<Wide>& lattice, const Voids& voids, const PayloadHeader& header) {
  const int columns = lattice.columns();
  Residuals residuals(static_cast<std::size_t>(columns) * static_cast<std::size_t>(lattice.rows()));
  std::vector<Wide> predictions(static_cast<std::size_t>(columns));
  ResidualRows rows(columns);
  for (int r = 0; r < lattice.rows(); ++r) {
    const int first = Lattice<Wide>::first(r);
    const int last = lattice.last(r);
    const int count = last + 1 - first;
    const std::uint8_t* const void_row =
        voids.is_void.empty() ? nullptr : voids.is_void.data() + static_cast<std::ptrdiff_t>(r) * columns;
    const auto is_void_place = [&](int i) { return void_row[column_of_place(columns, r, first + i)] != 0; };
    lattice.open_row(r);
    rows.open_row(first, r % 2);
    predict_row<Wide>(lattice, r, weights_of_row(header.weights, r), header.low, header.high, predictions);
    std::uint32_t* const folded = residuals.folded.data() + residuals.count;
    std::uint32_t* const current = rows.current();
    fold_row(lattice.row(r) + first, predictions.data() + first, count, folded);
    for (int i = 0; i < count; ++i) current[first + i] = std::min(folded[i], kFoldedLimit);
    for (int i = 0; void_row != nullptr && i < count; ++i) {
      if (is_void_place(i)) current[first + i] = 0;
    }
    find_activities(rows.above() + r % 2, current, first, count, residuals.activities.data() + residuals.count);
    if (void_row == nullptr) {
      residuals.count += static_cast<std::size_t>(count);
    } else {
      residuals.drop_voids(static_cast<std::size_t>(count), is_void_place);
    }
    for (int side = 0; r % 2 == 0 && side < 2; ++side) {
      if (void_row != nullptr && void_row[column_of_slid(columns, side)] != 0) continue;
      const int at = side == 0 ? 1 : columns - 3;
      residuals.add(fold(lattice.slid(r, side) - lattice.slid_prediction(r, side)),
                    activity_of_slid(current[at], current[at + 1]));
    }
    lattice.close_row(r);
    rows.close_row(first, last);
  }
  return residuals;
}

/// A tile's residuals as they are stored: symbols by context, paired where that pays, and the extra bits in coding
/// order.
struct Streams {
  std::vector<std::vector<std::byte>> symbols;
  std::vector<std::byte> extra;
};

/// Symbols of residuals below 2^24: a float's exponent and upper three bits of mantissa are octave and eighth.
ISOHF_VECTORISED(void, find_small_symbols,
                 (const std::uint32_t* __restrict folded, std::size_t count, std::uint8_t* __restrict symbols),
                 (folded, count, symbols)) {
  constexpr std::int32_t kFirst = (127 + 4) * 8 - static_cast<std::int32_t>(kFirstSplitSymbol);
  for (std::size_t i = 0; i < count; ++i) {
    const auto residual = static_cast<std::int32_t>(folded[i]);
    const std::int32_t split = (std::bit_cast<std::int32_t>(static_cast<float>(residual)) >> 20) - kFirst;
    symbols[i] = static_cast<std::uint8_t>(residual < static_cast<std::int32_t>(kFirstSplitSymbol) ? residual : split);
  }
}

void find_symbols(const Residuals& residuals, CodeType type, std::uint8_t* symbols) {
  const std::uint32_t* const folded = residuals.folded.data();
  if (type != CodeType::kF32) return find_small_symbols(folded, residuals.count, symbols);
  for (std::size_t i = 0; i < residuals.count; ++i) symbols[i] = static_cast<std::uint8_t>(symbol_of(folded[i]));
}

ISOHF_VECTORISED(void, find_levels,
                 (const std::uint32_t* __restrict activities, std::size_t count, unsigned shift,
                  std::uint16_t* __restrict levels),
                 (activities, count, shift, levels)) {
  for (std::size_t i = 0; i < count; ++i) levels[i] = static_cast<std::uint16_t>(activity_level(activities[i], shift));
}

/// Bits one after the other, the lowest of a byte first.
class BitPacker {
 public:
  /// `most_bytes` is the most that will come.
  explicit BitPacker(std::size_t most_bytes) : room_(most_bytes + 8), to_(room_.data()) {}

  void put(std::uint32_t bits, unsigned count) {
    bits_ |= std::uint64_t{bits} << bit_count_;
    bit_count_ += count;
    if (bit_count_ < 32) return;
    std::memcpy(to_, &bits_, 4);
    to_ += 4;
    bits_ >>= 32U;
    bit_count_ -= 32;
  }
  [[nodiscard]] std::vector<std::byte> finish() {
    std::memcpy(to_, &bits_, 8);
    return {room_.data(), to_ + (bit_count_ + 7) / 8};
  }

 private:
  Scratch<std::byte> room_;
  std::byte* to_;
  std::uint64_t bits_ = 0;
  unsigned bit_count_ = 0;
};

/// The extra bits of two neighbouring residuals of codes, together no more than 24, and how many these are.
ISOHF_VECTORISED(void, join_extra_bits,
                 (const std::uint32_t* __restrict folded, std::size_t pairs, std::uint32_t* __restrict bits,
                  std::uint32_t* __restrict counts),
                 (folded, pairs, bits, counts)) {
  constexpr std::int32_t kFirstOctave = 127 + 4;
  for (std::size_t i = 0; i < pairs; ++i) {
    const auto extra = [&](std::uint32_t value, std::uint32_t& count) {
      const std::int32_t exponent =
          std::bit_cast<std::int32_t>(static_cast<float>(static_cast<std::int32_t>(value))) >> 23;
      const std::int32_t octave = exponent - kFirstOctave + 1;
      count = static_cast<std::uint32_t>(octave < 0 ? 0 : octave);
      return value & ((1U << count) - 1);
    };
    std::uint32_t first_count = 0;
    std::uint32_t second_count = 0;
    const std::uint32_t first = extra(folded[2 * i], first_count);
    const std::uint32_t second = extra(folded[2 * i + 1], second_count);
    bits[i] = first | second << first_count;
    counts[i] = first_count + second_count;
  }
}

/// The bits of the residuals that their symbols leave out.
std::vector<std::byte> pack_extra_bits(const Residuals& residuals, CodeType type) {
  const std::uint32_t* const folded = residuals.folded.data();
  BitPacker packer(residuals.count * 4);
  std::size_t packed = 0;
  if (type != CodeType::kF32) {
    const std::size_t pairs = residuals.count / 2;
    Scratch<std::uint32_t> bits(pairs);
    Scratch<std::uint32_t> counts(pairs);
    join_extra_bits(folded, pairs, bits.data(), counts.data());
    for (std::size_t i = 0; i < pairs; ++i) packer.put(bits.data()[i], counts.data()[i]);
    packed = 2 * pairs;
  }
  for (; packed < residuals.count; ++packed) {
    const unsigned count = extra_bits_of_symbol(symbol_of(folded[packed]));
    packer.put(folded[packed] & ((1U << count) - 1), count);
  }
  return packer.finish();
}

/// Each context's symbols, in order. The last half is sorted from its end, beside the first: one alone would wait for
/// its own pointers.
std::vector<std::vector<std::byte>> sort_symbols(const std::uint8_t* symbols, const std::uint16_t* levels,
                                                 std::size_t count, std::span<const std::uint16_t> thresholds,
                                                 std::span<const std::uint32_t> histogram) {
  const auto table = context_table(thresholds);
  std::array<std::size_t, kMaxContexts> counts{};
  for (std::size_t level = 0; level < histogram.size(); ++level) counts[table[level]] += histogram[level];
  std::vector<std::vector<std::byte>> sorted;
  std::array<std::byte*, kMaxContexts> to{};
  std::array<std::byte*, kMaxContexts> to_end{};
  for (std::size_t i = 0; i <= thresholds.size(); ++i) {
    sorted.emplace_back(counts[i]);
    to[i] = sorted[i].data();
    to_end[i] = sorted[i].data() + counts[i];
  }
  for (std::size_t i = 0; i < count / 2; ++i) {
    const std::size_t from_end = count - 1 - i;
    *to[table[levels[i]]]++ = static_cast<std::byte>(symbols[i]);
    *--to_end[table[levels[from_end]]] = static_cast<std::byte>(symbols[from_end]);
  }
  if (count % 2 != 0) *to[table[levels[count / 2]]] = static_cast<std::byte>(symbols[count / 2]);
  return sorted;
}

/// Cuts the residuals into contexts, as many as pay.
Streams make_streams(const Residuals& residuals, PayloadHeader& header) {
  const std::size_t count = residuals.count;
  Scratch<std::uint8_t> symbols(count);
  Scratch<std::uint16_t> levels(count);
  find_symbols(residuals, header.type, symbols.data());
  header.activity_shift = choose_activity_shift({residuals.activities.data(), count});
  find_levels(residuals.activities.data(), count, header.activity_shift, levels.data());
  const std::vector<std::uint32_t> histogram = count_levels({levels.data(), count});
  header.thresholds = choose_thresholds({symbols.data(), count}, {levels.data(), count}, histogram);
  Streams streams{sort_symbols(symbols.data(), levels.data(), count, header.thresholds, histogram),
                  pack_extra_bits(residuals, header.type)};
  for (std::size_t i = 0; i < streams.symbols.size(); ++i) {
    std::vector<std::byte>& stream = streams.symbols[i];
    header.symbol_counts.push_back(static_cast<std::uint32_t>(stream.size()));
    if (!pairs_pay(stream)) continue;
    std::vector<std::byte> pairs = pair_symbols(stream);
    if (pairs.size() > stream.size()) continue;  // max_payload_bytes holds for either
    stream = std::move(pairs);
    header.paired = static_cast<std::uint16_t>(header.paired | 1U << i);
  }
  return streams;
}

/// Completes payload and Deflate stream; a block for each part.
void assemble(PayloadHeader& header, std::span<const std::byte> mask, const Streams& streams, EncodedTile& tile) {
  header.mask_bytes = static_cast<std::uint32_t>(mask.size());
  header.extra_bytes = static_cast<std::uint32_t>(streams.extra.size());
  std::vector<std::byte> bytes;
  write_payload_header(header, bytes);
  DeflateWriter writer(tile.deflated);
  const auto add = [&](std::span<const std::byte> part) {
    writer.add(part);
    tile.payload_crc32 = crc32(part, tile.payload_crc32);
    tile.payload_bytes += static_cast<std::uint32_t>(part.size());
  };
  add(bytes);
  add(mask);
  for (const auto& symbols : streams.symbols) add(symbols);
  add(streams.extra);
  writer.finish();
}

template <typename Wide, typename SampleAt>
void encode_samples(const TileShape& shape, PayloadHeader header, const Voids& voids, const SampleAt& sample_at,
                    EncodedTile& tile) {
  std::vector<std::byte> mask;
  if (!voids.is_void.empty()) mask = pack_void_mask(voids.is_void);
  header.has_voids = !mask.empty();
  header.is_constant = header.low == header.high;
  Streams streams;
  if (!header.is_constant) {
    Lattice<Wide> lattice(shape);
    load<Wide>(lattice, voids, header.base, sample_at);
    header.weights = fit_weights<Wide>(lattice, header.low, header.high);
    streams = make_streams(find_residuals(lattice, voids, header), header);
  }
  assemble(header, mask, streams, tile);
}

/// Smallest and largest code, and how many are void; `low` is the void code where all are.
struct CodeRange {
  std::int32_t low = 0xffff;
  std::int32_t high = 0;
  std::int32_t voids = 0;
};

ISOHF_VECTORISED(CodeRange, range_of_codes, (const std::uint16_t* codes, std::size_t count, std::int32_t void_code),
                 (codes, count, void_code)) {
  std::int32_t low = 0xffff;
  std::int32_t high = 0;
  std::int32_t voids = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t code = codes[i];
    const std::int32_t valid = code == void_code ? 0 : code;
    low = code < low ? code : low;
    high = valid > high ? valid : high;
    voids += code == void_code ? 1 : 0;
  }
  return {low, high, voids};
}

EncodedTile encode_codes(const TileShape& shape, const TileCodes& tile) {
  const std::span<const std::uint16_t> codes = tile.codes;
  const Quantisation quantisation{tile.type, 0.0, 1.0};
  const auto void_code = static_cast<std::uint16_t>(quantisation.void_code());
  EncodedTile encoded;
  encoded.content_digest = tile_content_digest(tile);
  const auto is_void = [&](std::uint16_t code) { return code == void_code; };
  const CodeRange range = range_of_codes(codes.data(), codes.size(), void_code);
  const Voids voids = find_voids(codes, range.voids, is_void);
  encoded.has_voids = voids.count != 0;
  encoded.is_empty = voids.count == shape.stored_vertex_count();
  if (encoded.is_empty) return encoded;

  PayloadHeader header;
  header.type = tile.type;
  header.base = *std::find_if_not(codes.begin(), codes.end(), is_void);
  header.low = range.low;
  header.high = range.high;
  ISOHF_ASSERT(header.high <= static_cast<std::int32_t>(quantisation.max_code()));
  encoded.code_min = static_cast<std::uint32_t>(header.low);
  encoded.code_max = static_cast<std::uint32_t>(header.high);
  encode_samples<std::int32_t>(
      shape, header, voids, [&](std::size_t i) { return std::int32_t{codes[i]}; }, encoded);
  return encoded;
}

EncodedTile encode_floats(const TileShape& shape, const TileCodes& tile) {
  const std::span<const float> heights = tile.heights;
  std::uint32_t used_bits = 0;
  for (const float height : heights) {
    if (!std::isnan(height)) used_bits |= std::bit_cast<std::uint32_t>(height) & 0x7fffffffU;
  }
  EncodedTile encoded;
  encoded.content_digest = tile_content_digest(tile);
  const auto is_void = [](float height) { return std::isnan(height); };
  const Voids voids = find_voids(heights, std::count_if(heights.begin(), heights.end(), is_void), is_void);
  encoded.has_voids = voids.count != 0;
  encoded.is_empty = voids.count == shape.stored_vertex_count();
  if (encoded.is_empty) return encoded;

  PayloadHeader header;
  header.type = CodeType::kF32;
  header.dropped_bits = used_bits == 0 ? 0 : static_cast<std::uint8_t>(std::countr_zero(used_bits));
  const auto ordered = [&](float height) { return ordered_from_float(height, header.dropped_bits); };
  header.base = ordered(*std::find_if_not(heights.begin(), heights.end(), is_void));
  header.low = header.high = header.base;
  for (const float height : heights) {
    if (is_void(height)) continue;
    header.low = std::min(header.low, ordered(height));
    header.high = std::max(header.high, ordered(height));
  }
  encoded.code_min = std::bit_cast<std::uint32_t>(float_from_ordered(header.low, header.dropped_bits));
  encoded.code_max = std::bit_cast<std::uint32_t>(float_from_ordered(header.high, header.dropped_bits));
  encode_samples<std::int64_t>(
      shape, header, voids, [&](std::size_t i) { return std::int64_t{ordered(heights[i])}; }, encoded);
  return encoded;
}

}  // namespace

TileCodes void_tile(const TileShape& shape, const Quantisation& quantisation) {
  TileCodes tile;
  tile.type = quantisation.type;
  const auto samples = static_cast<std::size_t>(shape.stored_vertex_count());
  if (tile.type == CodeType::kF32) {
    tile.heights.assign(samples, std::numeric_limits<float>::quiet_NaN());
  } else {
    tile.codes.assign(samples, static_cast<std::uint16_t>(quantisation.void_code()));
  }
  return tile;
}

EncodedTile encode_tile(const TileShape& shape, const TileCodes& tile) {
  const auto samples = static_cast<std::size_t>(shape.stored_vertex_count());
  const bool is_float = tile.type == CodeType::kF32;
  ISOHF_ASSERT(tile.codes.size() == (is_float ? 0 : samples) && tile.heights.size() == (is_float ? samples : 0));
  try {
    return is_float ? encode_floats(shape, tile) : encode_codes(shape, tile);
  } catch (const std::bad_alloc&) {
    throw Error(ErrorCode::kOutOfMemory, "no memory to code a tile of " + std::to_string(samples) + " samples");
  }
}

}  // namespace isohf
