#include "isohf/archive/tile_codec.h"

#include <algorithm>
#include <cmath>

#include "isohf/archive/content_hash.h"
#include "isohf/archive/context_model.h"
#include "isohf/archive/deflate.h"
#include "isohf/archive/tile_payload.h"
#include "isohf/archive/vectorised.h"
#include "isohf/archive/void_mask.h"
#include "isohf/base/assert.h"

namespace isohf {
namespace {

/// The void mask, as 0 and 1; empty where nothing is void.
struct Voids {
  std::vector<std::uint8_t> is_void;
  std::int64_t count = 0;
};

template <typename Sample, typename IsVoid>
Voids find_voids(std::span<const Sample> samples, const IsVoid& is_void) {
  Voids voids;
  voids.count = std::count_if(samples.begin(), samples.end(), is_void);
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

ISOHF_VECTORISED void fold_row(const std::int32_t* own, const std::int32_t* predictions, int count,
                               std::uint32_t* out) {
  for (int i = 0; i < count; ++i) out[i] = fold(own[i] - predictions[i]);
}
void fold_row(const std::int64_t* own, const std::int64_t* predictions, int count, std::uint32_t* out) {
  for (int i = 0; i < count; ++i) out[i] = fold(own[i] - predictions[i]);
}

/// Activities of `count` places from `first` on.
ISOHF_VECTORISED void find_activities(const std::uint32_t* north, const std::uint32_t* own, int first, int count,
                                      std::uint32_t* out) {
  for (int i = 0; i < count; ++i) {
    out[i] = activity_from_above(north, first + i) + activity_from_west(own, first + i);
  }
}

/// A tile's residuals in coding order, voids left out.
struct Residuals {
  std::vector<std::uint32_t> folded;
  std::vector<std::uint32_t> activities;
  std::size_t count = 0;

  explicit Residuals(std::size_t most) : folded(most), activities(most) {}
  void add(std::uint32_t residual, std::uint32_t activity) {
    folded[count] = residual;
    activities[count++] = activity;
  }
  /// Drops those of `added` last ones that are void.
  template <typename IsVoid>
  void drop_voids(std::size_t added, const IsVoid& is_void) {
    const std::size_t start = count;
    for (std::size_t i = 0; i < added; ++i) {
      if (!is_void(static_cast<int>(i))) add(folded[start + i], activities[start + i]);
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
  residuals.folded.resize(residuals.count);
  residuals.activities.resize(residuals.count);
  return residuals;
}

/// A tile's residuals as they are stored: symbols by context, and the extra bits in coding order.
struct Streams {
  std::vector<std::vector<std::byte>> symbols;
  std::vector<std::byte> extra;
};

ISOHF_VECTORISED void find_levels(const std::uint32_t* activities, std::size_t count, unsigned shift,
                                  std::uint16_t* levels) {
  for (std::size_t i = 0; i < count; ++i) levels[i] = static_cast<std::uint16_t>(activity_level(activities[i], shift));
}

Streams sort_into_streams(std::span<const std::uint32_t> folded, std::span<const std::uint8_t> symbols,
                          std::span<const std::uint16_t> levels, const PayloadHeader& header) {
  const auto table = context_table(header.thresholds);
  std::array<std::size_t, kMaxContexts> counts{};
  for (const std::uint16_t level : levels) ++counts[table[level]];
  Streams streams;
  std::array<std::byte*, kMaxContexts> to{};
  for (std::size_t i = 0; i <= header.thresholds.size(); ++i) {
    streams.symbols.emplace_back(counts[i]);
    to[i] = streams.symbols[i].data();
  }
  streams.extra.resize(folded.size() * 4 + 8);
  std::byte* extra_to = streams.extra.data();
  std::uint64_t bits = 0;
  unsigned bit_count = 0;
  for (std::size_t i = 0; i < folded.size(); ++i) {
    const unsigned symbol = symbols[i];
    *to[table[levels[i]]]++ = static_cast<std::byte>(symbol);
    const unsigned extra_bits = extra_bits_of_symbol(symbol);
    bits |= (std::uint64_t{folded[i]} & ((std::uint64_t{1} << extra_bits) - 1)) << bit_count;
    bit_count += extra_bits;
    if (bit_count >= 32) {
      std::memcpy(extra_to, &bits, 4);
      extra_to += 4;
      bits >>= 32U;
      bit_count -= 32;
    }
  }
  std::memcpy(extra_to, &bits, 8);
  extra_to += (bit_count + 7) / 8;
  streams.extra.resize(static_cast<std::size_t>(extra_to - streams.extra.data()));
  return streams;
}

/// Cuts the residuals into contexts, as many as pay.
Streams make_streams(const Residuals& residuals, PayloadHeader& header) {
  std::vector<std::uint8_t> symbols(residuals.count);
  std::transform(residuals.folded.begin(), residuals.folded.end(), symbols.begin(),
                 [](std::uint32_t folded) { return static_cast<std::uint8_t>(symbol_of(folded)); });
  header.activity_shift = choose_activity_shift(residuals.activities);
  std::vector<std::uint16_t> levels(residuals.count);
  find_levels(residuals.activities.data(), residuals.count, header.activity_shift, levels.data());
  header.thresholds = choose_thresholds(symbols, levels);
  return sort_into_streams(residuals.folded, symbols, levels, header);
}

/// Completes payload and Deflate stream; a block for each part.
void assemble(PayloadHeader& header, std::span<const std::byte> mask, const Streams& streams, EncodedTile& tile) {
  header.mask_bytes = static_cast<std::uint32_t>(mask.size());
  header.extra_bytes = static_cast<std::uint32_t>(streams.extra.size());
  for (const auto& symbols : streams.symbols)
    header.symbol_counts.push_back(static_cast<std::uint32_t>(symbols.size()));
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

EncodedTile encode_codes(const TileShape& shape, const TileCodes& tile) {
  const std::span<const std::uint16_t> codes = tile.codes;
  const Quantisation quantisation{tile.type, 0.0, 1.0};
  const auto void_code = static_cast<std::uint16_t>(quantisation.void_code());
  EncodedTile encoded;
  encoded.content_digest = tile_content_digest(tile);
  const auto is_void = [&](std::uint16_t code) { return code == void_code; };
  const Voids voids = find_voids(codes, is_void);
  encoded.has_voids = voids.count != 0;
  encoded.is_empty = voids.count == shape.stored_vertex_count();
  if (encoded.is_empty) return encoded;

  PayloadHeader header;
  header.type = tile.type;
  header.base = *std::find_if_not(codes.begin(), codes.end(), is_void);
  header.low = header.high = header.base;
  for (const std::uint16_t code : codes) {
    header.low = std::min<std::int32_t>(header.low, code);
    if (!is_void(code)) header.high = std::max<std::int32_t>(header.high, code);
  }
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
  const Voids voids = find_voids(heights, is_void);
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
