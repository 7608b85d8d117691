#include "isohf/archive/lane_decoder.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <vector>

#include "isohf/archive/residual_expander.h"
#include "isohf/archive/tile_payload.h"
#include "isohf/archive/void_mask.h"
#include "isohf/base/assert.h"
#include "isohf/base/error.h"
#include "isohf/base/scratch.h"
#include "isohf/base/vectorised.h"

namespace isohf {
namespace {

constexpr std::size_t kLanes = kDecoderLanes;
constexpr int kMargin = 3;

/// A value for each lane.
template <typename T>
using PerLane = std::array<T, kLanes>;

/// What a stretch of places is predicted with: a weight of each lane, one term after the other; NE's comes first.
using StretchWeights = std::array<PerLane<std::int32_t>, kWeightCount + 1>;

/// The rows of all lanes, lane by lane at each place.
struct LaneRows {
  std::int32_t* own;
  const std::int32_t* north;
  const std::int32_t* far;
  const std::int32_t* farther;
  const std::uint16_t* folded;
  const std::uint8_t* is_void;  ///< by place and lane; nullptr where no lane has voids in the row
};

/// The samples' range, and whether a sample has left it.
struct LaneRange {
  PerLane<std::int32_t> low{};
  PerLane<std::int32_t> high{};
  PerLane<std::int32_t> least_seen{};
  PerLane<std::int32_t> most_seen{};
};

/// Predictions completed by residuals, from West to East. Sums modulo 2^32, as the plain decoder has them.
template <std::size_t kTerms, bool kWithVoids>
[[gnu::always_inline]] inline void restore_places(const LaneRows& rows, const StretchWeights& weights, int begin,
                                                  int end, LaneRange& range) {
  using Ints = std::int32_t __attribute__((vector_size(4 * kLanes), aligned(4), may_alias));
  using Words = std::uint32_t __attribute__((vector_size(4 * kLanes), aligned(4), may_alias));
  using Shorts = std::uint16_t __attribute__((vector_size(2 * kLanes), aligned(2), may_alias));
  using Bytes = std::int8_t __attribute__((vector_size(kLanes), aligned(1), may_alias));
  constexpr std::ptrdiff_t kStep = kLanes;
  const std::array<const std::int32_t*, kWeightCount + 1> from = {
      rows.north,
      rows.own - kStep,
      rows.north - kStep,
      rows.own - 2 * kStep,
      rows.north + kStep,
      rows.north - 2 * kStep,
      rows.far,
      rows.far + kStep,
      rows.far - kStep,
      rows.far + 2 * kStep,
      rows.far - 2 * kStep,
      rows.farther,
      rows.farther - kStep,
      rows.farther + kStep,
      rows.farther - 2 * kStep,
      rows.north + 2 * kStep,
      rows.north - 3 * kStep,
      rows.far + 3 * kStep,
      rows.far - 3 * kStep,
  };
  constexpr std::size_t kWest = 1;
  constexpr std::size_t kFarWest = 3;
  const auto* const weight = reinterpret_cast<const Words*>(weights.data());
  const Ints low = *reinterpret_cast<const Ints*>(range.low.data());
  const Ints high = *reinterpret_cast<const Ints*>(range.high.data());
  const Ints least = 2 * low;
  const Ints most = 2 * high - 1;
  Ints least_seen = *reinterpret_cast<const Ints*>(range.least_seen.data());
  Ints most_seen = *reinterpret_cast<const Ints*>(range.most_seen.data());
  Ints west = *reinterpret_cast<const Ints*>(rows.own + (begin - 1) * kStep);
  Ints far_west = *reinterpret_cast<const Ints*>(rows.own + (begin - 2) * kStep);
  for (int place = begin; place < end; ++place) {
    const std::ptrdiff_t at = place * kStep;
    Words sum = weight[kFarWest] * (Words)far_west;
    for (std::size_t term = 0; term < kTerms; ++term) {
      if (term != kWest && term != kFarWest) sum += weight[term] * *reinterpret_cast<const Words*>(from[term] + at);
    }
    sum += weight[kWest] * (Words)west;
    Ints halves = (Ints)sum >> (kWeightBits - 1);
    halves = halves < least ? least : halves;
    halves = halves > most ? most : halves;
    const Words folded = __builtin_convertvector(*reinterpret_cast<const Shorts*>(rows.folded + at), Words);
    const Ints residual = (Ints)((folded >> 1U) ^ -(folded & 1U));
    const Ints turned = -(halves & 1);  // -1 where the residual is added, 0 where it is taken off
    const Ints sample = (((halves + 1) >> 1) + ((residual ^ ~turned) - ~turned)) & 0xffff;
    far_west = west;
    west = sample;
    if constexpr (kWithVoids) {
      const Ints north = *reinterpret_cast<const Ints*>(rows.north + at);
      const Ints is_void = __builtin_convertvector(*reinterpret_cast<const Bytes*>(rows.is_void + at), Ints);
      west = is_void != 0 ? (far_west + north) >> 1 : sample;
    }
    least_seen = west < least_seen ? west : least_seen;
    most_seen = west > most_seen ? west : most_seen;
    *reinterpret_cast<Ints*>(rows.own + at) = west;
  }
  *reinterpret_cast<Ints*>(range.least_seen.data()) = least_seen;
  *reinterpret_cast<Ints*>(range.most_seen.data()) = most_seen;
}

ISOHF_VECTORISED(void, restore_near,
                 (const LaneRows& rows, const StretchWeights& weights, int begin, int end, LaneRange& range),
                 (rows, weights, begin, end, range)) {
  restore_places<kNearWeightCount + 1, false>(rows, weights, begin, end, range);
}
ISOHF_VECTORISED(void, restore_widely,
                 (const LaneRows& rows, const StretchWeights& weights, int begin, int end, LaneRange& range),
                 (rows, weights, begin, end, range)) {
  restore_places<kWeightCount + 1, false>(rows, weights, begin, end, range);
}
ISOHF_VECTORISED(void, restore_with_voids,
                 (const LaneRows& rows, const StretchWeights& weights, int begin, int end, LaneRange& range),
                 (rows, weights, begin, end, range)) {
  restore_places<kWeightCount + 1, true>(rows, weights, begin, end, range);
}

ISOHF_VECTORISED(void, find_magnitudes,
                 (const std::uint16_t* folded, int first, int last, unsigned shift, std::uint8_t* __restrict out),
                 (folded, first, last, shift, out)) {
  for (int place = first; place <= last; ++place) out[place] = magnitude(folded[place], shift);
}

/// One tile's residuals: sorted out to places from the streams of its contexts.
class Lane {
 public:
  Lane(const TileShape& shape, CodeType type)
      : type_(type),
        columns_(shape.columns()),
        samples_(static_cast<std::size_t>(shape.stored_vertex_count())),
        row_(static_cast<std::size_t>(columns_)),
        activities_(static_cast<std::size_t>(columns_)),
        magnitudes_(columns_) {}

  /// False where the payload is not for this decoder. Throws Error where it is broken.
  bool open(const TileShape& shape, std::span<const std::byte> payload) {
    if (payload.size() > max_payload_bytes(shape, type_)) return false;
    ByteReader reader(payload);
    header = read_payload_header(shape, type_, reader);
    if (header.is_constant) return false;
    std::size_t voids = 0;
    if (header.has_voids) {
      is_void = unpack_void_mask(reader.read_bytes(header.mask_bytes), samples_);
      for (const std::uint8_t value : is_void) voids += value;
    }
    read_block_map(shape, reader, header.predictors);
    table_ = context_table(header.thresholds);
    const SymbolStreams symbols(header, reader);
    const auto extra = reader.read_bytes(header.extra_bytes);
    if (reader.remaining() != 0) return false;
    std::size_t count = 0;
    for (const std::uint32_t of_context : header.symbol_counts) count += of_context;
    return count == samples_ - voids && expand(symbols, extra, count);
  }

  /// Takes the residuals of row r's places, to `out[place * kLanes]`, and of its slid vertices. False where a context
  /// has run out.
  bool take_row(int r, std::uint16_t* out) {
    const int first = Lattice<std::int32_t>::first(r);
    const int last = r % 2 == 0 ? columns_ - 2 : columns_ - 1;
    find_activities(magnitudes_.above() + r % 2, magnitudes_.far_above(), first, last, activities_.data());
    void_row_ = has_voids_in(r) ? is_void.data() + static_cast<std::ptrdiff_t>(r) * columns_ : nullptr;
    const std::uint16_t* const activities = activities_.data();
    std::uint16_t* const row = row_.data();
    if (void_row_ == nullptr) {
      for (int place = first; place <= last; ++place) {
        const std::uint16_t folded = *next_[table_[activities[place]]]++;
        row[place] = folded;
        out[static_cast<std::ptrdiff_t>(place) * static_cast<std::ptrdiff_t>(kLanes)] = folded;
      }
    } else {
      for (int place = first; place <= last; ++place) {
        const bool is_void_here = void_row_[column_of_place(columns_, r, place)] != 0;
        const std::uint16_t folded = is_void_here ? std::uint16_t{0} : *next_[table_[activities[place]]]++;
        row[place] = folded;
        out[static_cast<std::ptrdiff_t>(place) * static_cast<std::ptrdiff_t>(kLanes)] = folded;
      }
    }
    std::uint8_t* const magnitudes = magnitudes_.current();
    find_magnitudes(row, first, last, header.activity_shift, magnitudes);
    for (int side = 0; r % 2 == 0 && side < 2; ++side) {
      const int at = side == 0 ? 1 : columns_ - 3;
      if (void_row_ != nullptr && void_row_[column_of_slid(columns_, side)] != 0) continue;
      const std::uint16_t activity = activity_of_slid(magnitudes[at], magnitudes[at + 1]);
      slid_[static_cast<std::size_t>(side)] = *next_[table_[activity]]++;
    }
    magnitudes_.close_row(first, last);
    for (std::size_t i = 0; i < header.symbol_counts.size(); ++i) {
      if (next_[i] > end_[i]) return false;
    }
    return true;
  }

  [[nodiscard]] bool has_voids_in(int r) const {
    if (is_void.empty()) return false;
    const auto row = is_void.begin() + static_cast<std::ptrdiff_t>(r) * columns_;
    return std::find(row, row + columns_, std::uint8_t{1}) != row + columns_;
  }
  [[nodiscard]] const std::uint8_t* void_row() const { return void_row_; }
  /// The residual of a slid vertex of the row taken last; 0 West, 1 East.
  [[nodiscard]] std::uint32_t slid(int side) const { return slid_[static_cast<std::size_t>(side)]; }

  PayloadHeader header;
  std::vector<std::uint8_t> is_void;  ///< in row order; empty where nothing is void

 private:
  bool expand(const SymbolStreams& symbols, std::span<const std::byte> extra, std::size_t count) {
    std::vector<std::byte> padded(extra.size() + 8);
    std::copy(extra.begin(), extra.end(), padded.begin());
    const std::span<const std::byte> bits = std::span(padded).first(extra.size());
    // A row may run past a context's last residual, and past the last of all; that is told when it is done.
    const auto spare = static_cast<std::size_t>(columns_) + 2;
    folded_ = std::make_unique_for_overwrite<std::uint16_t[]>(count + spare);
    std::fill_n(folded_.get() + count, spare, std::uint16_t{0});
    std::uint16_t* to = folded_.get();
    std::uint64_t position = 0;
    for (std::size_t i = 0; i < header.symbol_counts.size(); ++i) {
      position = expand_residuals(symbols[i], bits, position, to);
      if (position == kNotExpanded) return false;
      next_[i] = to;
      to += symbols[i].size();
      end_[i] = to;
    }
    if ((position + 7) / 8 != extra.size()) return false;
    return position % 8 == 0 || (std::to_integer<unsigned>(extra[position / 8]) >> (position % 8)) == 0;
  }

  CodeType type_;
  int columns_;
  std::size_t samples_;
  std::array<std::uint8_t, kActivityLimit> table_{};
  std::unique_ptr<std::uint16_t[]> folded_;
  std::array<const std::uint16_t*, kMaxContexts> next_{};
  std::array<const std::uint16_t*, kMaxContexts> end_{};
  std::vector<std::uint16_t> row_;
  std::vector<std::uint16_t> activities_;
  MagnitudeRows magnitudes_;
  const std::uint8_t* void_row_ = nullptr;
  std::array<std::uint32_t, 2> slid_{};
};

/// The samples of all lanes, on their way from residuals to codes.
class LaneSamples {
 public:
  explicit LaneSamples(const TileShape& shape)
      : columns_(shape.columns()),
        stride_(static_cast<std::ptrdiff_t>(kLanes) * (columns_ + 2 * kMargin)),
        samples_(4 * static_cast<std::size_t>(stride_)),
        folded_(kLanes * static_cast<std::size_t>(columns_)),
        is_void_(folded_.size()) {}

  void open(std::size_t lane, const PayloadHeader& header) {
    for (std::size_t i = lane; i < samples_.size(); i += kLanes) samples_[i] = header.base;
    range.low[lane] = header.low;
    range.high[lane] = header.high;
    is_wide_ |= header.predictors.is_wide;
  }

  /// Where a lane's residuals of the row's place 0 go, and what is void.
  [[nodiscard]] std::uint16_t* folded(std::size_t lane) { return folded_.data() + lane; }
  [[nodiscard]] std::uint8_t* is_void(std::size_t lane) { return is_void_.data() + lane; }

  /// Restores row r. `lanes` may be less than kLanes; the others hold what they like.
  void restore_row(int r, std::span<Lane* const> lanes, bool has_voids) {
    const int first = Lattice<std::int32_t>::first(r);
    const int last = r % 2 == 0 ? columns_ - 2 : columns_ - 1;
    const auto step = static_cast<std::ptrdiff_t>(kLanes);
    const std::int32_t* const north = row(r - 1) + r % 2 * step;
    for (int place : {first - 1, first - 2}) std::copy_n(north + first * step, kLanes, row(r) + place * step);
    if (r <= 3 || r % kBlockPlaces == 0) gather_weights(r, lanes);
    range.least_seen = range.low;
    range.most_seen = range.high;
    const LaneRows rows = {row(r), north, row(r - 2), row(r - 3) + r % 2 * step, folded_.data(), is_void_.data()};
    for (std::size_t stretch = 0; stretch < weights_.size(); ++stretch) {
      const int begin = std::max(first, static_cast<int>(stretch) * kBlockPlaces);
      const bool is_last = stretch + 1 == weights_.size();
      const int end = is_last ? last + 1 : std::min(last + 1, static_cast<int>(stretch + 1) * kBlockPlaces);
      if (has_voids) {
        restore_with_voids(rows, weights_[stretch], begin, end, range);
      } else if (is_wide_) {
        restore_widely(rows, weights_[stretch], begin, end, range);
      } else {
        restore_near(rows, weights_[stretch], begin, end, range);
      }
    }
    std::int32_t* const own = row(r);
    for (int place = -kMargin; place < first; ++place) std::copy_n(own + first * step, kLanes, own + place * step);
    for (int place = last + 1; place < columns_ + kMargin; ++place) {
      std::copy_n(own + last * step, kLanes, own + place * step);
    }
  }

  [[nodiscard]] bool is_in_range(std::size_t lane) const {
    return range.least_seen[lane] >= range.low[lane] && range.most_seen[lane] <= range.high[lane];
  }

  /// The samples of a lane in row r by place, kLanes apart.
  [[nodiscard]] const std::int32_t* samples(int r, std::size_t lane) { return row(r) + lane; }

  LaneRange range;

 private:
  [[nodiscard]] std::int32_t* row(int r) {
    return samples_.data() + (r & 3) * stride_ + static_cast<std::ptrdiff_t>(kLanes) * kMargin;
  }

  /// The weights of all lanes for row r and those below it in its blocks: one stretch where no lane has a map.
  void gather_weights(int r, std::span<Lane* const> lanes) {
    const bool has_map = r > 2 && std::any_of(lanes.begin(), lanes.end(),
                                              [](const Lane* lane) { return !lane->header.predictors.map.empty(); });
    weights_.assign(has_map ? static_cast<std::size_t>(Predictors::blocks_across(columns_)) : 1, StretchWeights{});
    for (std::size_t stretch = 0; stretch < weights_.size(); ++stretch) {
      for (std::size_t lane = 0; lane < lanes.size(); ++lane) {
        const Predictors& predictors = lanes[lane]->header.predictors;
        std::size_t index = 0;
        if (!predictors.map.empty()) {
          index = predictors.map[static_cast<std::size_t>(r / kBlockPlaces * predictors.block_columns) + stretch];
        }
        const PredictorWeights& weights = r > 2 ? predictors.weights[index] : predictors.of_row(r);
        std::int32_t anchor = 1 << kWeightBits;
        for (std::size_t i = 0; i < kWeightCount; ++i) {
          weights_[stretch][i + 1][lane] = weights[i];
          anchor -= weights[i];
        }
        weights_[stretch][0][lane] = anchor;
      }
    }
  }

  int columns_;
  std::ptrdiff_t stride_;
  bool is_wide_ = false;
  std::vector<std::int32_t> samples_;
  std::vector<std::uint16_t> folded_;
  std::vector<std::uint8_t> is_void_;
  std::vector<StretchWeights> weights_;
};

/// The slid vertex's code; false where it lies outside the range.
bool restore_slid(const Lane& lane, const std::int32_t* samples, int columns, int side, std::uint16_t& code) {
  const std::ptrdiff_t step = kLanes;
  const std::ptrdiff_t at = (side == 0 ? 1 : columns - 3) * step;
  const auto prediction = static_cast<std::uint32_t>((samples[at] + samples[at + step]) >> 1);
  const auto sample = static_cast<std::int32_t>((prediction - unzigzag(lane.slid(side))) & 0xffffU);
  code = static_cast<std::uint16_t>(sample);
  return sample >= lane.header.low && sample <= lane.header.high;
}

/// Writes a lane's row of codes; false where a slid vertex lies outside the range.
bool write_codes(const Lane& lane, const std::int32_t* samples, int columns, int r, std::uint16_t void_code,
                 std::uint16_t* codes) {
  const std::ptrdiff_t step = kLanes;
  const int first = Lattice<std::int32_t>::first(r);
  const int last = r % 2 == 0 ? columns - 2 : columns - 1;
  for (int place = first; place <= last; ++place) codes[place] = static_cast<std::uint16_t>(samples[place * step]);
  bool is_good = true;
  if (r % 2 == 0) {
    codes[0] = codes[1];
    codes[columns - 1] = codes[columns - 2];
    for (int side = 0; side < 2; ++side) {
      const int column = column_of_slid(columns, side);
      if (lane.void_row() != nullptr && lane.void_row()[column] != 0) continue;
      is_good &= restore_slid(lane, samples, columns, side, codes[column]);
    }
  }
  if (lane.void_row() == nullptr) return is_good;
  for (int column = 0; column < columns; ++column) {
    if (lane.void_row()[column] != 0) codes[column] = void_code;
  }
  return is_good;
}

}  // namespace

void decode_lanes(const TileShape& shape, CodeType type, std::span<const std::span<const std::byte>> payloads,
                  std::span<TileCodes> tiles, std::span<bool> decoded) {
  ISOHF_ASSERT(payloads.size() <= kDecoderLanes && tiles.size() == payloads.size());
  std::fill(decoded.begin(), decoded.end(), false);
  if (type == CodeType::kF32) return;
  const auto void_code = static_cast<std::uint16_t>(Quantisation{type, 0.0, 1.0}.void_code());
  std::vector<std::unique_ptr<Lane>> owned;
  std::vector<Lane*> lanes;
  std::vector<std::size_t> tile_of;
  LaneSamples samples(shape);
  for (std::size_t i = 0; i < payloads.size(); ++i) {
    tiles[i] = {};
    tiles[i].type = type;
    auto lane = std::make_unique<Lane>(shape, type);
    try {
      if (!lane->open(shape, payloads[i])) continue;
    } catch (const Error&) {
      continue;  // decode_tile says what is wrong
    }
    tiles[i].codes.resize(static_cast<std::size_t>(shape.stored_vertex_count()));
    samples.open(lanes.size(), lane->header);
    lanes.push_back(lane.get());
    tile_of.push_back(i);
    owned.push_back(std::move(lane));
  }
  std::vector<bool> is_good(lanes.size(), true);
  const int columns = shape.columns();
  for (int r = 0; r < shape.rows() && !lanes.empty(); ++r) {
    bool has_voids = false;
    for (std::size_t lane = 0; lane < lanes.size(); ++lane) {
      if (!is_good[lane]) continue;
      if (!lanes[lane]->take_row(r, samples.folded(lane))) is_good[lane] = false;
      has_voids |= lanes[lane]->void_row() != nullptr;
    }
    if (has_voids) {
      for (std::size_t lane = 0; lane < lanes.size(); ++lane) {
        const std::uint8_t* const void_row = lanes[lane]->void_row();
        for (int place = 0; place < columns; ++place) {
          samples.is_void(lane)[static_cast<std::size_t>(place) * kLanes] =
              void_row == nullptr ? std::uint8_t{0} : void_row[column_of_place(columns, r, place)];
        }
      }
    }
    samples.restore_row(r, lanes, has_voids);
    for (std::size_t lane = 0; lane < lanes.size(); ++lane) {
      std::uint16_t* const codes = tiles[tile_of[lane]].codes.data() + static_cast<std::ptrdiff_t>(r) * columns;
      if (!is_good[lane]) continue;
      is_good[lane] = samples.is_in_range(lane) &&
                      write_codes(*lanes[lane], samples.samples(r, lane), columns, r, void_code, codes);
    }
  }
  for (std::size_t lane = 0; lane < lanes.size(); ++lane) decoded[tile_of[lane]] = is_good[lane];
}

}  // namespace isohf
