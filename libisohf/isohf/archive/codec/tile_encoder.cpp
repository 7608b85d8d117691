#include "isohf/archive/codec/tile_encoder.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <type_traits>

#include "isohf/archive/codec/adaptive/adaptive_encoder.h"
#include "isohf/archive/codec/predict/context_energy.h"
#include "isohf/archive/codec/predict/hex_predictor.h"
#include "isohf/archive/codec/predict/predictor_fit.h"
#include "isohf/archive/codec/residuals/residual_streams.h"
#include "isohf/archive/codec/residuals/residual_symbols.h"
#include "isohf/archive/codec/tile_payload.h"
#include "isohf/archive/container/content_hash.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/deflate/deflate_writer.h"
#include "isohf/base/assert.h"
#include "isohf/base/scratch.h"
#include "isohf/base/simd.h"

namespace isohf {
namespace {

//                          passes thinning predictors rounds thinning moves wide
constexpr std::array<CodingEffort, kMaxLevel> kEfforts = {{
    {.fit = {0, 1, 1, 0, 1, 0, false}, .streams = {15, false}},
    {.fit = {1, 15, 1, 0, 1, 0, false}, .streams = {15, true}},
    {.fit = {2, 9, 1, 0, 1, 0, false}, .streams = {3, true}},
    {.fit = {1, 25, 2, 1, 15, 1, false}, .streams = {9, true}},
    {.fit = {1, 15, 2, 1, 9, 1, false}, .streams = {7, true}},
    {.fit = {1, 7, 2, 1, 5, 2, false}, .streams = {5, true}},
    {.fit = {2, 5, 2, 1, 3, 3, false}, .streams = {3, true}},
    {.fit = {2, 5, 2, 1, 3, 3, true}, .streams = {3, true}},
    {.fit = {2, 5, 2, 2, 3, 3, true}, .streams = {3, true}},
    {.fit = {2, 3, 2, 2, 1, 4, true}, .streams = {1, true}},
    {.fit = {2, 3, 2, 4, 1, 4, true}, .streams = {1, true}},
    {.fit = {2, 1, 2, 8, 1, 6, true}, .streams = {1, true}},
}};

/// What payloads of version 2 are worth: one predictor, as what is learnt does what several would. From level 6 on all
/// efforts from the fifth to the one asked for are tried and the shortest payload kept, below they are the same, so that
/// no level takes more bytes than the one before.
constexpr FitEffort kNoFit = {0, 1, 1, 0, 1, 0, false};
constexpr FitEffort kUsualFit = {2, 9, 1, 0, 1, 0, false};
constexpr std::array<FitEffort, kMaxLevel> kAdaptiveEfforts = {{
    kNoFit,
    kUsualFit,
    kUsualFit,
    kUsualFit,
    kUsualFit,
    {2, 5, 1, 0, 1, 0, false},
    {3, 3, 1, 0, 1, 0, false},
    {2, 5, 1, 0, 1, 0, true},
    {3, 3, 1, 0, 1, 0, true},
    {4, 3, 1, 0, 1, 0, true},
    {6, 1, 1, 0, 1, 0, true},
    {8, 1, 1, 0, 1, 0, true},
}};
constexpr int kLastUsualLevel = 5;
constexpr std::size_t kFewBytes = 1200;     ///< of a payload in which weights of its own may not pay
constexpr std::int64_t kFewSamples = 1024;  ///< below, there is little to learn from

/// The void mask, as 0 and 1; empty where nothing is void.
template <typename Sample, typename IsVoid>
std::vector<std::uint8_t> find_voids(std::span<const Sample> samples, std::int64_t count, const IsVoid& is_void) {
  std::vector<std::uint8_t> voids(count == 0 ? 0 : samples.size());
  std::transform(samples.begin(), samples.begin() + static_cast<std::ptrdiff_t>(voids.size()), voids.begin(),
                 [&](Sample sample) { return static_cast<std::uint8_t>(is_void(sample) ? 1 : 0); });
  return voids;
}

/// Puts the samples of a tile into lattice order, voids filled. `sample_at(i)` is the sample with storage index i.
template <typename Wide, typename SampleAt>
void load(Lattice<Wide>& lattice, std::span<const std::uint8_t> voids, Wide base, const SampleAt& sample_at) {
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
    if (!voids.empty()) {
      lattice.open_row(r);
      const Wide* const north = lattice.row(r - 1) + r % 2;
      for (int place = first; place <= last; ++place) {
        if (voids[index(column_of_place(columns, r, place))] != 0) own[place] = void_fill(own, north, place);
      }
    }
    lattice.close_row(r);
  }
}

std::uint16_t zigzag_difference(std::int32_t difference) {
  return static_cast<std::uint16_t>(zigzag(static_cast<std::int16_t>(difference)));
}
std::uint32_t zigzag_difference(std::int64_t difference) {
  return zigzag(static_cast<std::int32_t>(difference));
}

template <typename Zigzagged>
ISOHF_KERNEL void find_magnitudes(const Zigzagged* zigzagged, int count, unsigned shift, std::uint8_t* __restrict out) {
  for (int i = 0; i < count; ++i) out[i] = magnitude(zigzagged[i], shift);
}

/// The columns of a tile's samples in coding order, row by row; a row has as many samples as columns.
template <typename Use>
void for_coding_order(int columns, int r, const Use& use) {
  const int first = r % 2 == 0 ? 1 : 0;
  const int last = r % 2 == 0 ? columns - 2 : columns - 1;
  std::size_t i = 0;
  for (int place = first; place <= last; ++place) use(i++, column_of_place(columns, r, place));
  for (int side = 0; r % 2 == 0 && side < 2; ++side) use(i++, column_of_slid(columns, side));
}

/// Zigzagged residuals of all samples in coding order; 0 where void. `is_void` comes in coding order as well.
template <typename Wide, typename Zigzagged>
void find_residuals(Lattice<Wide>& lattice, std::span<const std::uint8_t> voids, const PayloadHeader& header,
                    Residuals<Zigzagged>& out) {
  const int columns = lattice.columns();
  std::vector<Wide> halves(static_cast<std::size_t>(columns));
  for (int r = 0; r < lattice.rows(); ++r) {
    const int first = Lattice<Wide>::first(r);
    const int count = lattice.last(r) + 1 - first;
    const auto row_start = static_cast<std::size_t>(r) * static_cast<std::size_t>(columns);
    Zigzagged* const zigzagged = out.zigzagged.data() + row_start;
    lattice.open_row(r);
    predict_row<Wide>(lattice, r, header.predictors, header.low, header.high, halves);
    zigzag_row(lattice.row(r) + first, halves.data() + first, count, zigzagged);
    for (int side = 0; r % 2 == 0 && side < 2; ++side) {
      zigzagged[count + side] = zigzag_difference(lattice.slid_prediction(r, side) - lattice.slid(r, side));
    }
    lattice.close_row(r);
    if (voids.empty()) continue;
    for_coding_order(columns, r, [&](std::size_t i, int column) {
      const bool is_void = voids[row_start + static_cast<std::size_t>(column)] != 0;
      out.is_void[row_start + i] = is_void ? 1 : 0;
      if (is_void) zigzagged[i] = 0;
    });
  }
}

/// Energies in coding order, by the magnitudes that `shift` makes of the residuals.
template <typename Zigzagged>
void find_all_energies(int columns, int rows, unsigned shift, Residuals<Zigzagged>& residuals) {
  MagnitudeRows magnitudes(columns);
  std::vector<std::uint16_t> energies(static_cast<std::size_t>(columns));
  for (int r = 0; r < rows; ++r) {
    const int first = r % 2 == 0 ? 1 : 0;
    const int last = r % 2 == 0 ? columns - 2 : columns - 1;
    const auto row_start = static_cast<std::size_t>(r) * static_cast<std::size_t>(columns);
    std::uint16_t* const out = residuals.energies.data() + row_start;
    find_energies(magnitudes.above() + r % 2, magnitudes.far_above(), first, last, out - first);
    std::uint8_t* const current = magnitudes.current();
    vectorised<find_magnitudes<Zigzagged>>(residuals.zigzagged.data() + row_start, last + 1 - first, shift,
                                           current + first);
    if (r % 2 == 0) {
      out[columns - 2] = context_energy_of_slid(current[1], current[2]);
      out[columns - 1] = context_energy_of_slid(current[columns - 3], current[columns - 2]);
    }
    magnitudes.close_row(first, last);
  }
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
  add(std::as_bytes(std::span(header.predictors.map)));
  for (const auto& symbols : streams.symbols) add(symbols);
  add(streams.extra);
  writer.finish();
}

/// What encode_tile was asked for.
struct Request {
  int level;
  PayloadVersion version;
};

/// A payload of version 2; false where it would be longer than a tile's may be.
bool encode_adaptively(const TileShape& shape, const PayloadHeader& header, std::vector<std::uint8_t> voids,
                       Lattice<std::int32_t>& lattice, int level, EncodedTile& tile) {
  AdaptivePayload payload;
  payload.type = header.type;
  payload.low = header.low;
  payload.high = header.high;
  payload.base = header.base;
  payload.is_void = std::move(voids);
  std::vector<std::byte> best;
  const auto try_fit = [&](const FitEffort& fit) {
    payload.predictors = fit_predictors<std::int32_t>(lattice, header.low, header.high, fit);
    payload.has_weights = payload.predictors.weights.front() != kThirdRowWeights;
    std::vector<std::byte> bytes = encode_adaptive(lattice, payload);
    if (best.empty() || bytes.size() < best.size()) best = std::move(bytes);
  };
  for (int tried = std::min(level, kLastUsualLevel); tried <= level; ++tried) {
    try_fit(kAdaptiveEfforts[static_cast<std::size_t>(tried - kMinLevel)]);
  }
  if (level > kMinLevel && best.size() < kFewBytes) try_fit(kNoFit);
  if (best.size() > max_payload_bytes(shape, header.type)) return false;
  DeflateWriter writer(tile.deflated);
  writer.add(best);
  writer.finish();
  tile.payload_crc32 = crc32(best);
  tile.payload_bytes = static_cast<std::uint32_t>(best.size());
  return true;
}

template <typename Wide, typename Zigzagged, typename SampleAt>
void encode_samples(const TileShape& shape, PayloadHeader header, std::span<const std::uint8_t> voids,
                    const SampleAt& sample_at, const Request& request, EncodedTile& tile) {
  const CodingEffort effort = coding_effort(request.level);
  std::vector<std::byte> mask;
  if (!voids.empty()) mask = pack_void_mask(voids);
  header.has_voids = !mask.empty();
  header.is_constant = header.low == header.high;
  Streams streams;
  if (!header.is_constant) {
    Lattice<Wide> lattice(shape);
    load<Wide>(lattice, voids, header.base, sample_at);
    if constexpr (std::is_same_v<Wide, std::int32_t>) {
      const bool is_wanted = request.version == PayloadVersion::kBest ? shape.stored_vertex_count() >= kFewSamples
                                                                      : request.version == PayloadVersion::kAdaptive;
      if (is_wanted && encode_adaptively(shape, header, {voids.begin(), voids.end()}, lattice, request.level, tile)) {
        return;
      }
    }
    header.predictors = fit_predictors<Wide>(lattice, header.low, header.high, effort.fit);
    Residuals<Zigzagged> residuals(static_cast<std::size_t>(shape.stored_vertex_count()), !voids.empty());
    find_residuals<Wide, Zigzagged>(lattice, voids, header, residuals);
    header.energy_shift = choose_energy_shift(residuals);
    find_all_energies(shape.columns(), shape.rows(), header.energy_shift, residuals);
    if (header.has_voids) residuals.drop_voids();
    streams = make_streams(residuals, effort.streams, header);
  }
  assemble(header, mask, streams, tile);
}

/// Smallest and largest code, and how many are void; `low` is the void code where all are.
struct CodeRange {
  std::int32_t low = 0xffff;
  std::int32_t high = 0;
  std::int32_t voids = 0;
};

ISOHF_KERNEL CodeRange range_of_codes(const std::uint16_t* codes, std::size_t count, std::int32_t void_code) {
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

EncodedTile encode_codes(const TileShape& shape, const TileCodes& tile, const Request& request) {
  const std::span<const std::uint16_t> codes = tile.codes;
  const Quantisation quantisation{tile.type, 0.0, 1.0};
  const auto void_code = static_cast<std::uint16_t>(quantisation.void_code());
  EncodedTile encoded;
  encoded.content_digest = tile_content_digest(tile);
  const auto is_void = [&](std::uint16_t code) { return code == void_code; };
  const CodeRange range = vectorised<range_of_codes>(codes.data(), codes.size(), void_code);
  encoded.has_voids = range.voids != 0;
  encoded.is_empty = range.voids == shape.stored_vertex_count();
  if (encoded.is_empty) return encoded;

  PayloadHeader header;
  header.type = tile.type;
  header.base = *std::find_if_not(codes.begin(), codes.end(), is_void);
  header.low = range.low;
  header.high = range.high;
  ISOHF_ASSERT(header.high <= static_cast<std::int32_t>(quantisation.max_code()));
  encoded.code_min = static_cast<std::uint32_t>(header.low);
  encoded.code_max = static_cast<std::uint32_t>(header.high);
  encode_samples<std::int32_t, std::uint16_t>(
      shape, header, find_voids(codes, range.voids, is_void), [&](std::size_t i) { return std::int32_t{codes[i]}; },
      request, encoded);
  return encoded;
}

/// How many floats are void, and the bits, but their signs, that any other has.
struct FloatBits {
  std::int32_t used = 0;
  std::int32_t voids = 0;
};
ISOHF_KERNEL FloatBits bits_of_floats(const float* heights, std::size_t count) {
  std::int32_t used = 0;
  std::int32_t voids = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t magnitude = std::bit_cast<std::int32_t>(heights[i]) & 0x7fffffff;
    const bool is_void = magnitude > 0x7f800000;
    used |= is_void ? 0 : magnitude;
    voids += is_void ? 1 : 0;
  }
  return {used, voids};
}

/// ordered_from_float of all, and the least and the most of those that are no voids.
ISOHF_KERNEL CodeRange order_floats(const float* heights, std::size_t count, unsigned dropped,
                                    std::int32_t* __restrict ordered) {
  std::int32_t low = std::numeric_limits<std::int32_t>::max();
  std::int32_t high = std::numeric_limits<std::int32_t>::min();
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t bits = std::bit_cast<std::int32_t>(heights[i]);
    const std::int32_t magnitude = bits & 0x7fffffff;
    const bool is_void = magnitude > 0x7f800000;
    const std::int32_t value = (magnitude >> dropped) ^ (bits >> 31);
    ordered[i] = value;
    const std::int32_t least = is_void ? low : value;
    const std::int32_t most = is_void ? high : value;
    low = least < low ? least : low;
    high = most > high ? most : high;
  }
  return {low, high, 0};
}

EncodedTile encode_floats(const TileShape& shape, const TileCodes& tile, const Request& request) {
  const std::span<const float> heights = tile.heights;
  const FloatBits bits = vectorised<bits_of_floats>(heights.data(), heights.size());
  EncodedTile encoded;
  encoded.content_digest = tile_content_digest(tile);
  const auto is_void = [](float height) { return std::isnan(height); };
  encoded.has_voids = bits.voids != 0;
  encoded.is_empty = bits.voids == shape.stored_vertex_count();
  if (encoded.is_empty) return encoded;

  PayloadHeader header;
  header.type = CodeType::kF32;
  header.dropped_bits =
      bits.used == 0 ? 0 : static_cast<std::uint8_t>(std::countr_zero(static_cast<std::uint32_t>(bits.used)));
  Scratch<std::int32_t> ordered(heights.size());
  const CodeRange range = vectorised<order_floats>(heights.data(), heights.size(), header.dropped_bits, ordered.data());
  header.base = ordered_from_float(*std::find_if_not(heights.begin(), heights.end(), is_void), header.dropped_bits);
  header.low = range.low;
  header.high = range.high;
  encoded.code_min = std::bit_cast<std::uint32_t>(float_from_ordered(header.low, header.dropped_bits));
  encoded.code_max = std::bit_cast<std::uint32_t>(float_from_ordered(header.high, header.dropped_bits));
  encode_samples<std::int64_t, std::uint32_t>(
      shape, header, find_voids(heights, bits.voids, is_void),
      [&](std::size_t i) { return std::int64_t{ordered.data()[i]}; }, request, encoded);
  return encoded;
}

}  // namespace

CodingEffort coding_effort(int level) {
  if (level < kMinLevel || level > kMaxLevel) {
    throw Error(ErrorCode::kInvalidArgument, "level " + std::to_string(level) + ", must be " +
                                                 std::to_string(kMinLevel) + " to " + std::to_string(kMaxLevel));
  }
  return kEfforts[static_cast<std::size_t>(level - kMinLevel)];
}

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

EncodedTile encode_tile(const TileShape& shape, const TileCodes& tile, int level, PayloadVersion version) {
  const auto samples = static_cast<std::size_t>(shape.stored_vertex_count());
  const bool is_float = tile.type == CodeType::kF32;
  ISOHF_ASSERT(tile.codes.size() == (is_float ? 0 : samples) && tile.heights.size() == (is_float ? samples : 0));
  try {
    static_cast<void>(coding_effort(level));
    const Request request{level, version};
    return is_float ? encode_floats(shape, tile, request) : encode_codes(shape, tile, request);
  } catch (const std::bad_alloc&) {
    throw Error(ErrorCode::kOutOfMemory, "no memory to code a tile of " + std::to_string(samples) + " samples");
  }
}

}  // namespace isohf
