#include "isohf/archive/lane_decoder.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <vector>

#include "isohf/archive/lane_residuals.h"
#include "isohf/archive/tile_payload.h"
#include "isohf/base/assert.h"
#include "isohf/base/error.h"
#include "isohf/base/vectorised.h"

namespace isohf {
namespace {

constexpr std::size_t kLanes = kDecoderLanes;

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

/// The samples of eight places from first on, lane by lane: a transposed square.
ISOHF_VECTORISED(void, turn_square, (const std::int32_t* samples, const PerLane<std::uint16_t*>& codes, int first),
                 (samples, codes, first)) {
  using Ints = std::int32_t __attribute__((vector_size(4 * kLanes), aligned(4), may_alias));
  using Shorts = std::uint16_t __attribute__((vector_size(2 * kLanes), aligned(2), may_alias));
  Shorts rows[kLanes];
  for (std::size_t i = 0; i < kLanes; ++i) {
    rows[i] = __builtin_convertvector(*reinterpret_cast<const Ints*>(samples + i * kLanes), Shorts);
  }
  // Each step interleaves rows that lie four apart; after three, rows are columns.
  for (int step = 0; step < 3; ++step) {
    Shorts next[kLanes];
    for (std::size_t i = 0; i < kLanes / 2; ++i) {
      next[2 * i] = __builtin_shufflevector(rows[i], rows[i + 4], 0, 8, 1, 9, 2, 10, 3, 11);
      next[2 * i + 1] = __builtin_shufflevector(rows[i], rows[i + 4], 4, 12, 5, 13, 6, 14, 7, 15);
    }
    for (std::size_t i = 0; i < kLanes; ++i) rows[i] = next[i];
  }
  for (std::size_t lane = 0; lane < kLanes; ++lane) *reinterpret_cast<Shorts*>(codes[lane] + first) = rows[lane];
}

/// The samples of all lanes, on their way from residuals to codes.
class LaneSamples {
 public:
  explicit LaneSamples(const TileShape& shape)
      : columns_(shape.columns()),
        stride_(static_cast<std::ptrdiff_t>(kLanes) * (columns_ + 2 * kLaneMargin)),
        samples_(4 * static_cast<std::size_t>(stride_)) {}

  void open(const PayloadHeader& header) {
    const std::size_t lane = headers_.size();
    headers_.push_back(&header);
    for (std::size_t i = lane; i < samples_.size(); i += kLanes) samples_[i] = header.base;
    range.low[lane] = header.low;
    range.high[lane] = header.high;
    is_wide_ |= header.predictors.is_wide;
  }

  /// Restores row r from the residuals taken last.
  void restore_row(int r, const LaneResiduals& residuals) {
    const int first = Lattice<std::int32_t>::first(r);
    const int last = r % 2 == 0 ? columns_ - 2 : columns_ - 1;
    const auto step = static_cast<std::ptrdiff_t>(kLanes);
    const std::int32_t* const north = row(r - 1) + r % 2 * step;
    for (int place : {first - 1, first - 2}) std::copy_n(north + first * step, kLanes, row(r) + place * step);
    if (r <= 3 || r % kBlockPlaces == 0) gather_weights(r);
    range.least_seen = range.low;
    range.most_seen = range.high;
    const LaneRows rows = {
        row(r), north, row(r - 2), row(r - 3) + r % 2 * step, residuals.folded(), residuals.is_void()};
    for (std::size_t stretch = 0; stretch < weights_.size(); ++stretch) {
      const int begin = std::max(first, static_cast<int>(stretch) * kBlockPlaces);
      const bool is_last = stretch + 1 == weights_.size();
      const int end = is_last ? last + 1 : std::min(last + 1, static_cast<int>(stretch + 1) * kBlockPlaces);
      if (residuals.has_voids()) {
        restore_with_voids(rows, weights_[stretch], begin, end, range);
      } else if (is_wide_) {
        restore_widely(rows, weights_[stretch], begin, end, range);
      } else {
        restore_near(rows, weights_[stretch], begin, end, range);
      }
    }
    std::int32_t* const own = row(r);
    for (int place = -kLaneMargin; place < first; ++place) std::copy_n(own + first * step, kLanes, own + place * step);
    for (int place = last + 1; place < columns_ + kLaneMargin; ++place) {
      std::copy_n(own + last * step, kLanes, own + place * step);
    }
  }

  [[nodiscard]] bool is_in_range(std::size_t lane) const {
    return range.least_seen[lane] >= range.low[lane] && range.most_seen[lane] <= range.high[lane];
  }

  /// The samples of row r by place and lane.
  [[nodiscard]] const std::int32_t* samples(int r) { return row(r); }

  LaneRange range;

 private:
  [[nodiscard]] std::int32_t* row(int r) {
    return samples_.data() + (r & 3) * stride_ + static_cast<std::ptrdiff_t>(kLanes) * kLaneMargin;
  }

  /// The weights of all lanes for row r and those below it in its blocks: one stretch where no lane has a map.
  void gather_weights(int r) {
    const bool has_map = r > 2 && std::any_of(headers_.begin(), headers_.end(), [](const PayloadHeader* header) {
                           return !header->predictors.map.empty();
                         });
    weights_.assign(has_map ? static_cast<std::size_t>(Predictors::blocks_across(columns_)) : 1, StretchWeights{});
    for (std::size_t stretch = 0; stretch < weights_.size(); ++stretch) {
      for (std::size_t lane = 0; lane < headers_.size(); ++lane) {
        const Predictors& predictors = headers_[lane]->predictors;
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
  std::vector<const PayloadHeader*> headers_;
  std::vector<std::int32_t> samples_;
  std::vector<StretchWeights> weights_;
};

/// The slid vertices' codes of one lane; false where one lies outside the range.
bool restore_slid(const LaneResiduals& residuals, std::size_t lane, const PayloadHeader& header,
                  const std::int32_t* samples, int columns, std::uint16_t* codes) {
  bool is_good = true;
  for (int side = 0; side < 2; ++side) {
    const int column = column_of_slid(columns, side);
    if (residuals.void_row(lane) != nullptr && residuals.void_row(lane)[column] != 0) continue;
    const std::ptrdiff_t step = kLanes;
    const std::int32_t* const at = samples + (side == 0 ? 1 : columns - 3) * step + static_cast<std::ptrdiff_t>(lane);
    const auto prediction = static_cast<std::uint32_t>((at[0] + at[step]) >> 1);
    const auto sample = static_cast<std::int32_t>((prediction - unzigzag(residuals.slid(lane, side))) & 0xffffU);
    codes[column] = static_cast<std::uint16_t>(sample);
    is_good &= sample >= header.low && sample <= header.high;
  }
  return is_good;
}

/// Writes the row of all lanes by place; columns of slid vertices hold nothing of use yet.
void write_places(const std::int32_t* samples, const PerLane<std::uint16_t*>& codes, std::size_t lanes, int first,
                  int last) {
  int place = first;
  for (; place + static_cast<int>(kLanes) <= last + 1; place += static_cast<int>(kLanes)) {
    turn_square(samples + place * static_cast<std::ptrdiff_t>(kLanes), codes, place);
  }
  for (; place <= last; ++place) {
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      codes[lane][place] = static_cast<std::uint16_t>(samples[static_cast<std::size_t>(place) * kLanes + lane]);
    }
  }
}

/// Tiles on their way: payloads, residuals, samples, codes.
class LaneDecoder {
 public:
  LaneDecoder(const TileShape& shape, CodeType type)
      : shape_(shape),
        type_(type),
        void_code_(static_cast<std::uint16_t>(Quantisation{type, 0.0, 1.0}.void_code())),
        residuals_(shape.columns()),
        samples_(shape),
        spare_row_(static_cast<std::size_t>(shape.columns())) {}

  /// False where the payload is not for this decoder, or broken.
  bool open(std::span<const std::byte> bytes, TileCodes& tile) {
    auto payload = std::make_unique<LanePayload>();
    try {
      if (!payload->open(shape_, type_, bytes)) return false;
    } catch (const Error&) {
      return false;  // decode_tile says what is wrong
    }
    tile.codes.resize(static_cast<std::size_t>(shape_.stored_vertex_count()));
    residuals_.open(*payload);
    samples_.open(payload->header);
    codes_.push_back(tile.codes.data());
    is_good_.push_back(true);
    payloads_.push_back(std::move(payload));
    return true;
  }

  void run() {
    for (int r = 0; r < shape_.rows() && !payloads_.empty(); ++r) {
      residuals_.take_row(r);
      samples_.restore_row(r, residuals_);
      write_row(r);
    }
  }

  [[nodiscard]] bool is_good(std::size_t lane) const { return is_good_[lane]; }

 private:
  void write_row(int r) {
    const int columns = shape_.columns();
    const int last = r % 2 == 0 ? columns - 2 : columns - 1;
    PerLane<std::uint16_t*> rows{};
    rows.fill(spare_row_.data());
    for (std::size_t lane = 0; lane < codes_.size(); ++lane) {
      rows[lane] = codes_[lane] + static_cast<std::ptrdiff_t>(r) * columns;
    }
    write_places(samples_.samples(r), rows, codes_.size(), r % 2 == 0 ? 1 : 0, last);
    for (std::size_t lane = 0; lane < codes_.size(); ++lane) {
      bool is_good = residuals_.is_good(lane) && samples_.is_in_range(lane);
      std::uint16_t* const row = rows[lane];
      if (r % 2 == 0) {
        row[0] = row[1];
        row[columns - 1] = row[columns - 2];
        is_good &= restore_slid(residuals_, lane, payloads_[lane]->header, samples_.samples(r), columns, row);
      }
      const std::uint8_t* const void_row = residuals_.void_row(lane);
      for (int column = 0; void_row != nullptr && column < columns; ++column) {
        if (void_row[column] != 0) row[column] = void_code_;
      }
      is_good_[lane] = is_good_[lane] && is_good;
    }
  }

  const TileShape& shape_;
  CodeType type_;
  std::uint16_t void_code_;
  std::vector<std::unique_ptr<LanePayload>> payloads_;
  std::vector<std::uint16_t*> codes_;
  std::vector<bool> is_good_;
  LaneResiduals residuals_;
  LaneSamples samples_;
  std::vector<std::uint16_t> spare_row_;  ///< of lanes without a tile
};

}  // namespace

void decode_lanes(const TileShape& shape, CodeType type, std::span<const std::span<const std::byte>> payloads,
                  std::span<TileCodes> tiles, std::span<bool> decoded) {
  ISOHF_ASSERT(payloads.size() <= kDecoderLanes && tiles.size() == payloads.size());
  std::fill(decoded.begin(), decoded.end(), false);
  if (type == CodeType::kF32) return;
  LaneDecoder decoder(shape, type);
  std::vector<std::size_t> opened;
  for (std::size_t i = 0; i < payloads.size(); ++i) {
    tiles[i] = {};
    tiles[i].type = type;
    if (decoder.open(payloads[i], tiles[i])) opened.push_back(i);
  }
  decoder.run();
  for (std::size_t lane = 0; lane < opened.size(); ++lane) decoded[opened[lane]] = decoder.is_good(lane);
}

}  // namespace isohf
