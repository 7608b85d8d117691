#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numeric>
#include <vector>

#include "isohf/archive/tile/adaptive/fine_prediction.h"
#include "isohf/archive/tile/predict/predictors.h"
#include "isohf/archive/tile/predict/sample_lattice.h"
#include "isohf/archive/tile/simd/sample_pairs.h"
#include "isohf/archive/tile/simd/vector_operations.h"
#include "isohf/archive/tile/tile_codes.h"

/// Eight rows of one tile in the lanes of a register, each three and a half places behind the one above, so that what a
/// sample is predicted from is known when its time comes. Samples of version 1 and 2 of payloads are restored so.

namespace isohf {

/// When place 0 of a lane's row is worked on; lanes below 0 are the rows above the band.
constexpr int delay(int lane) {
  return (7 * lane + 1) >> 1;
}

/// What the lanes have at each time: lane i's place t - delay(i) at time t, so that each neighbour of all lanes' samples
/// is one vector: of W the one a time before, of those on the row above the one a lane before, three times before.
class SlantedRows {
 public:
  static constexpr int kLanes = kBandRows;
  static constexpr int kMargin = 3;
  static constexpr int kRowsAbove = 3;
  static constexpr int kDeviationRowsAbove = 2;
  /// A line of the cache.
  struct alignas(64) Time {
    std::array<std::int32_t, kRowsAbove + kLanes> pairs;
    std::array<std::uint16_t, kDeviationRowsAbove + kLanes> deviations;

    [[nodiscard]] std::int32_t& pair(int lane) { return pairs[static_cast<std::size_t>(kRowsAbove + lane)]; }
    [[nodiscard]] std::uint16_t& deviation(int lane) {
      return deviations[static_cast<std::size_t>(kDeviationRowsAbove + lane)];
    }
  };

  explicit SlantedRows(int columns)
      : times_(static_cast<std::size_t>(columns + kMargin + delay(kLanes - 1) + kAhead - kFirstTime)) {}

  [[nodiscard]] Time& at(int time) { return times_[static_cast<std::size_t>(time - kFirstTime)]; }
  [[nodiscard]] Time& at(int lane, int place) { return at(place + delay(lane)); }
  [[nodiscard]] std::int32_t sample(int lane, int place) { return (at(lane, place).pair(lane) >> 16) + kSampleShift; }
  [[nodiscard]] std::uint16_t deviation(int lane, int place) { return at(lane, place).deviation(lane); }
  void fill(int lane, int begin, int end, std::int32_t sample, std::uint16_t deviation) {
    const std::int32_t kept = sample - kSampleShift;
    for (int place = begin; place < end; ++place) {
      at(lane, place).pair(lane) = pair_of(kept, kept);
      if (lane >= -kDeviationRowsAbove) at(lane, place).deviation(lane) = deviation;
    }
    std::int32_t& after = at(lane, end).pair(lane);
    after = pair_of(kept, after >> 16);
  }
  /// The rows above the first band are all `base`.
  void fill_above(int columns, std::int32_t base) {
    for (int lane = -kRowsAbove; lane < 0; ++lane) fill(lane, -kMargin, columns + kMargin, base, 0);
  }
  /// The last rows become those above the next band.
  void next_band(int columns) {
    for (int time = kFirstTime; time < columns + kMargin; ++time) {
      Time& above = at(time);
      const Time& done = at(time + kAhead);
      for (std::size_t i = 0; i < kRowsAbove; ++i) above.pairs[i] = done.pairs[kLanes + i];
      for (std::size_t i = 0; i < kDeviationRowsAbove; ++i) above.deviations[i] = done.deviations[kLanes + i];
    }
  }

 private:
  static constexpr int kFirstTime = delay(-kRowsAbove) - kMargin;
  static constexpr int kAhead = delay(kLanes) - delay(0);  ///< a lane's row is one of the next band so much later

  std::vector<Time> times_;
};

/// A pair of terms of the prediction: the lane and the times before at which its eastern sample stands, and the weights
/// of both; a negative one for none.
struct SlantedTerms {
  int lane;
  int back;
  int west;
  int east;
};

inline constexpr int kWeightOfNe = static_cast<int>(kWeightCount);
inline constexpr std::array<SlantedTerms, 10> kSlantedTerms = {{{-3, 11, 13, 11},
                                                                {-3, 9, 10, 12},
                                                                {-2, 10, -1, 17},
                                                                {-2, 8, 9, 7},
                                                                {-2, 6, 5, 6},
                                                                {-2, 4, 8, 16},
                                                                {-1, 5, 15, 4},
                                                                {-1, 3, 1, kWeightOfNe},
                                                                {-1, 1, 3, 14},
                                                                {0, 1, 2, 0}}};
inline constexpr std::size_t kNearestPairs = 2;  ///< the last ones, of the time before

/// The weights of eight rows from `top` on, without a map.
[[nodiscard]] inline std::array<Words, kSlantedTerms.size()> slanted_weights(const Predictors& predictors, int top) {
  std::array<Words, kSlantedTerms.size()> weights{};
  for (int lane = 0; lane < SlantedRows::kLanes; ++lane) {
    const PredictorWeights& of_row = predictors.of_row(top + lane);
    const auto weight_of = [&](int i) -> std::int32_t {
      if (i == kWeightOfNe) return std::accumulate(of_row.begin(), of_row.end(), 1 << kWeightBits, std::minus<>());
      return i < 0 ? 0 : of_row[static_cast<std::size_t>(i)];
    };
    for (std::size_t i = 0; i < weights.size(); ++i) {
      weights[i][lane] =
          static_cast<std::uint32_t>(pair_of(weight_of(kSlantedTerms[i].west), weight_of(kSlantedTerms[i].east)));
    }
  }
  return weights;
}

struct SlantedBand {
  SlantedRows& slanted;
  int columns;
  int rows;
  const std::uint8_t* is_void;  ///< of the band's first row; nullptr where nothing is
};

using Eight = std::uint16_t __attribute__((vector_size(16)));

/// Eight numbers of 16 bits, as words.
template <bool kIsWide>
ISOHF_KERNEL Words from_shorts(const void* numbers) {
  const Eight eight = unaligned<Eight>(numbers).value;
#if defined(ISOHF_HAS_WIDE_BUILTINS)
  using Shorts = short __attribute__((vector_size(16)));
  if constexpr (kIsWide) return (Words)__builtin_ia32_pmovzxwd256((Shorts)eight);
#endif
  return __builtin_convertvector(eight, Words);
}
/// A bit for each lane.
template <bool kIsWide>
ISOHF_KERNEL unsigned lanes_of(Ints mask) {
#if defined(ISOHF_HAS_WIDE_BUILTINS)
  using Floats = float __attribute__((vector_size(32)));
  if constexpr (kIsWide) return static_cast<unsigned>(__builtin_ia32_movmskps256((Floats)mask));
#endif
  unsigned lanes = 0;
  for (int lane = 0; lane < SlantedRows::kLanes; ++lane) lanes |= mask[lane] != 0 ? 1U << lane : 0;
  return lanes;
}

/// What the last time left: a load that overlaps a store of just now would wait for it.
struct Recent {
  Ints own{};
  Ints north{};  ///< of lanes one before
  Ints off{};
  Ints off_north{};
  Ints lowest;  ///< of all samples
  Ints highest;

  /// Of a band that nothing is known of yet.
  ISOHF_KERNEL Recent(Ints low, Ints high) : lowest(high), highest(low) {}
  template <bool kIsWide>
  ISOHF_KERNEL bool is_within(Ints low, Ints high) const {
    return lanes_of<kIsWide>((lowest < low) | (highest > high)) == 0;
  }
  /// `before` is what the lanes one before had: of all but the first it is what they have now.
  ISOHF_KERNEL void keep(Ints pairs, Ints deviations, Ints pairs_before, Ints deviations_before) {
    own = pairs;
    off = deviations;
    north = __builtin_shufflevector(pairs, pairs_before, 8, 0, 1, 2, 3, 4, 5, 6);
    off_north = __builtin_shufflevector(deviations, deviations_before, 8, 0, 1, 2, 3, 4, 5, 6);
  }
  /// After a row has been opened or closed.
  template <bool kIsWide>
  ISOHF_KERNEL void reload(SlantedRows::Time& now) {
    own = unaligned<Ints>(&now.pair(0)).value;
    north = unaligned<Ints>(&now.pair(-1)).value;
    off = (Ints)from_shorts<kIsWide>(&now.deviation(0));
    off_north = (Ints)from_shorts<kIsWide>(&now.deviation(-1));
  }
};

/// Of active lanes, and of others: all ones where the sample is void.
template <bool kIsWide>
ISOHF_KERNEL Ints voids_at(const SlantedBand& band, int t) {
  Ints is_void{};
  for (int lane = 0; lane < band.rows; ++lane) {
    const int place = t - delay(lane);
    if (place < 0 || place >= band.columns) continue;
    const int column = column_of_place(band.columns, lane, place);
    is_void[lane] = band.is_void[static_cast<std::ptrdiff_t>(lane) * band.columns + column] != 0 ? -1 : 0;
  }
  return is_void;
}

inline int first_of(int lane) {
  return Lattice<std::int32_t>::first(lane);
}
inline int last_of(int lane, int columns) {
  return lane % 2 == 0 ? columns - 2 : columns - 1;
}

/// Sets the margins of a row that begins, of one whose first two places are known, of one that is done.
inline void open_row(const SlantedBand& band, int lane) {
  const int first = first_of(lane);
  band.slanted.fill(lane, first - 2, first, band.slanted.sample(lane - 1, first + lane % 2), 0);
}
inline void close_west(const SlantedBand& band, int lane) {
  const int first = first_of(lane);
  band.slanted.fill(lane, -SlantedRows::kMargin, first, band.slanted.sample(lane, first),
                    band.slanted.deviation(lane, first));
}
inline void close_east(const SlantedBand& band, int lane) {
  const int last = last_of(lane, band.columns);
  band.slanted.fill(lane, last + 1, band.columns + SlantedRows::kMargin, band.slanted.sample(lane, last),
                    band.slanted.deviation(lane, last));
}

/// step(time, t, lanes at work, whether these are all of them and nothing is void) at each time of a band, in order. False
/// where a step says so.
template <bool kIsWide, typename Step>
ISOHF_KERNEL bool walk_band(const SlantedBand& band, Recent& recent, const Step& step) {
  Ints active{};
  // The next lanes to open, to close in the West and in the East: rows begin and end one after the other.
  int opening = 0;
  int west = 0;
  int east = 0;
  const int times = band.columns + delay(SlantedRows::kLanes - 1);
  for (int t = 0; t < times;) {
    if (opening < band.rows && t == first_of(opening) + delay(opening)) {
      open_row(band, opening);
      active[opening++] = -1;
    }
    recent.reload<kIsWide>(band.slanted.at(t - 1));
    const int opens = opening < band.rows ? first_of(opening) + delay(opening) : times;
    const int has_west = west < band.rows ? first_of(west) + 2 + delay(west) : times;
    const int ends = east < band.rows ? last_of(east, band.columns) + 1 + delay(east) : times;
    const bool is_full = opening == SlantedRows::kLanes && east == 0 && band.is_void == nullptr;
    for (const int until = std::min({times, opens, has_west, ends}); t < until; ++t) {
      if (!step(&band.slanted.at(t), t, active, is_full)) return false;
    }
    if (t == has_west && west < band.rows) close_west(band, west++);
    if (t == ends && east < band.rows) {
      close_east(band, east);
      active[east++] = 0;
    }
  }
  return true;
}

/// The voids of `rows` rows from `top` on; nullptr where none of them is.
[[nodiscard]] const std::uint8_t* voids_of_band(const std::vector<std::uint8_t>& is_void, int top, int rows,
                                                int columns);

/// The codes of a band that is done, row by row, voids among them: all but those of slid vertices, which get anything
/// where they are none.
class BandCodes {
 public:
  BandCodes(int columns, CodeType type)
      : columns_(columns),
        stride_(columns + 2 * kSpare),
        void_(static_cast<std::uint16_t>(Quantisation{type, 0.0, 1.0}.void_code())),
        codes_(static_cast<std::size_t>(stride_ * SlantedRows::kLanes)) {}

  void store(const SlantedBand& band, std::uint16_t* codes);

 private:
  static constexpr int kSpare = 40;  ///< places beyond both ends of a row that are at work when others are

  int columns_;
  int stride_;
  std::uint16_t void_;
  std::vector<std::uint16_t> codes_;
};

}  // namespace isohf
