#include "isohf/archive/tile/tile_encoder.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <type_traits>

#include "isohf/archive/container/content_hash.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/deflate/deflate_writer.h"
#include "isohf/archive/tile/adaptive/adaptive_encoder.h"
#include "isohf/archive/tile/predict/context_energy.h"
#include "isohf/archive/tile/predict/hex_predictor.h"
#include "isohf/archive/tile/predict/predictor_fit.h"
#include "isohf/archive/tile/residuals/residual_streams.h"
#include "isohf/archive/tile/residuals/residual_symbols.h"
#include "isohf/archive/tile/tile_payload.h"
#include "isohf/base/assert.h"
#include "isohf/base/memory/scratch.h"
#include "isohf/base/simd.h"

namespace isohf {
namespace {

//                                      passes thinning wide     thinning pairs
constexpr CodingEffort kPlainEffort = {.fit = {0, 1, false}, .streams = {15, false}};
constexpr CodingEffort kNearEffort = {.fit = {2, 9, false}, .streams = {3, true}};
constexpr CodingEffort kWideEffort = {.fit = {2, 9, true}, .streams = {3, true}};
constexpr CodingEffort kDenseEffort = {.fit = {2, 5, true}, .streams = {3, true}};
constexpr std::size_t kFewBytes = 1200;     ///< of a payload in which weights of its own may not pay
constexpr std::int64_t kFewSamples = 1024;  ///< below, there is little to learn from
constexpr std::int64_t kCoarseShare = 110;  ///< of 256 samples that their neighbours foretell (decision 44)

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

/// A payload and its Deflate stream.
struct Deflated {
  std::vector<std::byte> bytes;
  std::uint32_t payload_bytes = 0;
  std::uint32_t payload_crc32 = 0;
};

/// A block for each part.
Deflated deflate_parts(std::span<const std::span<const std::byte>> parts) {
  Deflated deflated;
  DeflateWriter writer(deflated.bytes);
  for (const std::span<const std::byte> part : parts) {
    writer.add(part);
    deflated.payload_crc32 = crc32(part, deflated.payload_crc32);
    deflated.payload_bytes += static_cast<std::uint32_t>(part.size());
  }
  writer.finish();
  return deflated;
}

/// What encode_tile was asked for.
struct Request {
  Effort effort;
  PayloadVersion version;
};

ISOHF_KERNEL std::int32_t count_foretold(const std::int32_t* own, const std::int32_t* north, int first, int last) {
  std::int32_t count = 0;
  for (int p = first; p <= last; ++p) count += own[p] == own[p - 1] + north[p] - north[p - 1] ? 1 : 0;
  return count;
}

/// True where W + NE - NW foretells so many samples of every fourth row that they take about a bit or less each: there
/// payloads of version 2 are shorter by a twentieth and more. Elsewhere they bring 1 %, and are decoded more slowly.
bool is_coarse(const Lattice<std::int32_t>& lattice) {
  std::int64_t foretold = 0;
  std::int64_t all = 0;
  for (int r = 3; r < lattice.rows(); r += 4) {
    const int first = Lattice<std::int32_t>::first(r) + 1;
    foretold += vectorised<count_foretold>(lattice.row(r), lattice.row(r - 1) + r % 2, first, lattice.last(r));
    all += lattice.last(r) + 1 - first;
  }
  return foretold * 256 >= all * kCoarseShare;
}

/// One tile, and the shortest coding of it so far.
template <typename Wide, typename Zigzagged>
class TileCoder {
 public:
  TileCoder(const TileShape& shape, PayloadHeader header, std::span<const std::uint8_t> voids, Lattice<Wide>& lattice)
      : shape_(shape), header_(std::move(header)), voids_(voids), lattice_(lattice) {
    if (header_.has_voids) mask_ = pack_void_mask(voids);
    header_.mask_bytes = static_cast<std::uint32_t>(mask_.size());
  }

  /// The usual coding of an effort first. The best effort tries that of the default too, and little payloads are tried with
  /// simpler ones, so that no effort takes more bytes than a faster one.
  template <typename Try>
  void try_efforts(Effort effort, const Try& try_effort) {
    try_effort(coding_effort(effort));
    if (effort == Effort::kBest) try_effort(kDenseEffort);
    if (best_.bytes.size() >= kFewBytes) return;
    try_effort(kPlainEffort);
    if (effort != Effort::kFast) try_effort(kNearEffort);
  }

  void try_streams(const CodingEffort& effort) {
    PayloadHeader header = header_;
    header.predictors = fit_predictors<Wide>(lattice_, header.low, header.high, effort.fit);
    Residuals<Zigzagged> residuals(static_cast<std::size_t>(shape_.stored_vertex_count()), !voids_.empty());
    find_residuals<Wide, Zigzagged>(lattice_, voids_, header, residuals);
    header.energy_shift = choose_energy_shift(residuals);
    find_all_energies(shape_.columns(), shape_.rows(), header.energy_shift, residuals);
    if (header.has_voids) residuals.drop_voids();
    const Streams streams = make_streams(residuals, effort.streams, header);
    header.extra_bytes = static_cast<std::uint32_t>(streams.extra.size());
    std::vector<std::byte> bytes;
    write_payload_header(header, bytes);
    std::vector<std::span<const std::byte>> parts = {bytes, mask_};
    parts.insert(parts.end(), streams.symbols.begin(), streams.symbols.end());
    parts.emplace_back(streams.extra);
    keep(deflate_parts(parts));
  }

  /// A payload of version 2; none where it would be longer than a tile's may be.
  void try_adaptive(const CodingEffort& effort) {
    AdaptivePayload payload;
    payload.type = header_.type;
    payload.low = header_.low;
    payload.high = header_.high;
    payload.base = header_.base;
    payload.is_void.assign(voids_.begin(), voids_.end());
    payload.predictors = fit_predictors<Wide>(lattice_, header_.low, header_.high, effort.fit);
    payload.has_weights = payload.predictors.weights != kThirdRowWeights;
    const std::vector<std::byte> bytes = encode_adaptive(lattice_, std::move(payload));
    if (bytes.size() > max_payload_bytes(shape_, header_.type)) return;
    keep(deflate_parts(std::array{std::span<const std::byte>(bytes)}));
  }

  [[nodiscard]] bool has_any() const { return !best_.bytes.empty(); }
  [[nodiscard]] Deflated take() { return std::move(best_); }

 private:
  void keep(Deflated now) {
    if (!has_any() || now.bytes.size() < best_.bytes.size()) best_ = std::move(now);
  }

  const TileShape& shape_;
  PayloadHeader header_;
  std::span<const std::uint8_t> voids_;
  Lattice<Wide>& lattice_;
  std::vector<std::byte> mask_;
  Deflated best_;
};

template <typename Wide, typename Zigzagged, typename SampleAt>
Deflated encode_samples(const TileShape& shape, PayloadHeader header, std::span<const std::uint8_t> voids,
                        const SampleAt& sample_at, const Request& request) {
  header.has_voids = !voids.empty();
  header.is_constant = header.low == header.high;
  if (header.is_constant) {
    std::vector<std::byte> mask;
    if (header.has_voids) mask = pack_void_mask(voids);
    header.mask_bytes = static_cast<std::uint32_t>(mask.size());
    std::vector<std::byte> bytes;
    write_payload_header(header, bytes);
    return deflate_parts(std::array{std::span<const std::byte>(bytes), std::span<const std::byte>(mask)});
  }
  Lattice<Wide> lattice(shape);
  load<Wide>(lattice, voids, header.base, sample_at);
  TileCoder<Wide, Zigzagged> coder(shape, std::move(header), voids, lattice);
  bool is_adaptive = false;
  if constexpr (std::is_same_v<Wide, std::int32_t>) {
    const bool is_best = request.version == PayloadVersion::kBest && shape.stored_vertex_count() >= kFewSamples;
    is_adaptive = request.version == PayloadVersion::kAdaptive || (is_best && is_coarse(lattice));
    // Where codes are coarse, twelve weights may be worth as much as eighteen.
    const Effort least = request.effort == Effort::kBest ? Effort::kBest : Effort::kDefault;
    if (is_adaptive || (is_best && request.effort == Effort::kBest)) {
      coder.try_efforts(least, [&](const CodingEffort& effort) { coder.try_adaptive(effort); });
    }
  }
  if (!is_adaptive || !coder.has_any()) {
    coder.try_efforts(request.effort, [&](const CodingEffort& effort) { coder.try_streams(effort); });
  }
  return coder.take();
}

void store(EncodedTile& tile, Deflated deflated) {
  tile.deflated = std::move(deflated.bytes);
  tile.payload_bytes = deflated.payload_bytes;
  tile.payload_crc32 = deflated.payload_crc32;
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
  store(encoded, encode_samples<std::int32_t, std::uint16_t>(
                     shape, header, find_voids(codes, range.voids, is_void),
                     [&](std::size_t i) { return std::int32_t{codes[i]}; }, request));
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
  store(encoded, encode_samples<std::int64_t, std::uint32_t>(
                     shape, header, find_voids(heights, bits.voids, is_void),
                     [&](std::size_t i) { return std::int64_t{ordered.data()[i]}; }, request));
  return encoded;
}

}  // namespace

CodingEffort coding_effort(Effort effort) {
  return effort == Effort::kFast ? kNearEffort : kWideEffort;
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

EncodedTile encode_tile(const TileShape& shape, const TileCodes& tile, Effort effort, PayloadVersion version) {
  const auto samples = static_cast<std::size_t>(shape.stored_vertex_count());
  const bool is_float = tile.type == CodeType::kF32;
  ISOHF_ASSERT(tile.codes.size() == (is_float ? 0 : samples) && tile.heights.size() == (is_float ? samples : 0));
  const Request request{effort, version};
  try {
    return is_float ? encode_floats(shape, tile, request) : encode_codes(shape, tile, request);
  } catch (const std::bad_alloc&) {
    throw Error(ErrorCode::kOutOfMemory, "no memory to code a tile of " + std::to_string(samples) + " samples");
  }
}

}  // namespace isohf
