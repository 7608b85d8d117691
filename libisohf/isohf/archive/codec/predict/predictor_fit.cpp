#include "isohf/archive/codec/predict/predictor_fit.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <optional>
#include <vector>

#include "isohf/base/simd.h"

namespace isohf {
namespace {

constexpr std::size_t kMaxMomentTerms = kWeightCount + 1;  ///< the neighbours less NE, and the error so far
constexpr std::size_t kMomentLanes = 8;

/// Entries of a lower triangle, filled up to whole lanes.
constexpr std::size_t moment_count(std::size_t terms) {
  return (terms * (terms + 1) / 2 + kMomentLanes - 1) / kMomentLanes * kMomentLanes;
}

constexpr std::size_t kBlockWidth = kBlockPlaces;
constexpr std::size_t kPairs = 4;

/// Differences of samples as floats: exact as doubles, then rounded once. Floats' differences have 34 bits at most, and
/// machines that turn no 64-bit integers into doubles add them to the lowest bits of 1.5 * 2^52.
ISOHF_KERNEL float as_float(std::int32_t difference) {
  return static_cast<float>(difference);
}
ISOHF_KERNEL float as_float(std::int64_t difference) {
  constexpr double kBase = 6755399441055744.0;
  return static_cast<float>(std::bit_cast<double>(std::bit_cast<std::int64_t>(kBase) + difference) - kBase);
}

/// Neighbours of one row less NE, scaled: blocks of kBlockWidth places, `stride` apart.
template <typename Wide>
ISOHF_KERNEL void scale_blocks(const Wide* samples, const Wide* anchor, const float* scale, int blocks,
                               std::ptrdiff_t stride, float* __restrict out) {
  for (int block = 0; block < blocks; ++block) {
    float* const to = out + block * stride;
    const std::ptrdiff_t from = std::ptrdiff_t{block} * kBlockPlaces;
    for (std::ptrdiff_t i = 0; i < kBlockPlaces; ++i) {
      to[i] = as_float(samples[from + i] - anchor[from + i]) * scale[from + i];
    }
  }
}

/// Sums of products of all pairs of terms, `terms` arrays of `count` floats that lie `stride` apart; count is a
/// multiple of 8. Eight sums a pair and then their tree: the same order on every machine. Pairs are worked on by fours:
/// three more terms than there are must be readable, and three more sums are written than there are pairs.
ISOHF_KERNEL void multiply_pairs(const float* values, std::size_t terms, std::size_t stride, std::size_t count,
                                 float* __restrict out) {
  using Eight = float __attribute__((vector_size(4 * kMomentLanes)));
  using Four = float __attribute__((vector_size(16)));
  for (std::size_t i = 0; i < terms; ++i) {
    const float* const a = values + i * stride;
    for (std::size_t j = 0; j <= i; j += kPairs) {
      const float* const b = values + j * stride;
      Eight sums[kPairs] = {};
      for (std::size_t k = 0; k < count; k += kMomentLanes) {
        const Eight factor = unaligned<Eight>(a + k).value;
        for (std::size_t pair = 0; pair < kPairs; ++pair) {
          sums[pair] += factor * unaligned<Eight>(b + pair * stride + k).value;
        }
      }
      Four halves[kPairs];
      for (std::size_t pair = 0; pair < kPairs; ++pair) {
        halves[pair] = __builtin_shufflevector(sums[pair], sums[pair], 0, 1, 2, 3) +
                       __builtin_shufflevector(sums[pair], sums[pair], 4, 5, 6, 7);
      }
      const Four first = __builtin_shufflevector(halves[0], halves[1], 0, 4, 1, 5) +
                         __builtin_shufflevector(halves[0], halves[1], 2, 6, 3, 7);
      const Four second = __builtin_shufflevector(halves[2], halves[3], 0, 4, 1, 5) +
                          __builtin_shufflevector(halves[2], halves[3], 2, 6, 3, 7);
      unaligned<Four>(out + j).value =
          __builtin_shufflevector(first, second, 0, 1, 4, 5) + __builtin_shufflevector(first, second, 2, 3, 6, 7);
    }
    out += i + 1;
  }
}

ISOHF_KERNEL void add_all(const float* moments, std::size_t count, double* __restrict sum) {
  for (std::size_t i = 0; i < count; ++i) sum[i] += double{moments[i]};
}

ISOHF_KERNEL double weigh_all(const float* moments, const double* products, std::size_t count) {
  using Doubles = double __attribute__((vector_size(32)));
  Doubles sum = {};
  for (std::size_t i = 0; i < count; i += 4) {
    const Doubles values = {double{moments[i]}, double{moments[i + 1]}, double{moments[i + 2]}, double{moments[i + 3]}};
    const Doubles factors = {products[i], products[i + 1], products[i + 2], products[i + 3]};
    sum += values * factors;
  }
  return (sum[0] + sum[2]) + (sum[1] + sum[3]);
}

/// |error| in samples, from predictions in halves.
template <typename Wide>
ISOHF_KERNEL void find_errors(const Wide* own, const Wide* halves, int first, int last, float* __restrict errors) {
  for (int c = first; c <= last; ++c) errors[c] = 0.5F * as_float(2 * own[c] - halves[c]);
}

/// A sample's weight: the inverse of the error that it had, for a quarter, and its neighbours on the row.
ISOHF_KERNEL void weigh_by_errors(const float* __restrict errors, int first, int last, float* __restrict scale) {
  constexpr float kFloor = 0.25F;  // samples; smaller errors are rounding
  for (int c = first + 2; c < last; ++c) {
    const float around = std::abs(errors[c - 2]) + 2.0F * std::abs(errors[c - 1]) + std::abs(errors[c + 1]);
    scale[c] = 1.0F / (0.25F * std::abs(errors[c]) + 0.1875F * around + kFloor);
  }
}

/// Moments of the blocks of a tile: for each the products of its samples' differences and errors, summed.
template <typename Wide>
class BlockMoments {
 public:
  BlockMoments(const Lattice<Wide>& lattice, bool is_wide, Wide low, Wide high)
      : lattice_(lattice),
        low_(low),
        high_(high),
        terms_((is_wide ? kWeightCount : kNearWeightCount) + 1),
        across_(Predictors::blocks_across(lattice.columns())),
        down_(Predictors::blocks_across(lattice.rows())),
        scale_(static_cast<std::size_t>(across_) * kBlockWidth),
        errors_(scale_.size()),
        halves_(scale_.size()),
        stride_(scale_.size() * kBlockWidth),
        values_((terms_ + kPairs - 1) * stride_),
        moments_(moment_count(terms_) * static_cast<std::size_t>(across_ * down_) + kPairs) {}

  [[nodiscard]] std::size_t terms() const { return terms_; }
  [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(across_ * down_); }
  [[nodiscard]] int across() const { return across_; }
  [[nodiscard]] const float* of_block(std::size_t block) const {
    return moments_.data() + block * moment_count(terms_);
  }

  /// Takes the rows `start`, `start` + step, ... with their errors as `predictors` leave them.
  void measure(const Predictors& predictors, int start, int step) {
    const auto across = static_cast<std::size_t>(across_);
    take_bands(predictors, start, step, [&](int band, std::size_t count) {
      for (std::size_t block = 0; block < across; ++block) {
        float* const out = moments_.data() + moment_count(terms_) * (static_cast<std::size_t>(band) * across + block);
        vectorised<multiply_pairs>(values_.data() + block * count, terms_, stride_, count, out);
        std::fill(out + terms_ * (terms_ + 1) / 2, out + moment_count(terms_), 0.0F);
      }
    });
  }

  /// The sum of all blocks' moments alone.
  [[nodiscard]] std::vector<double> measure_whole(const Predictors& predictors, int start, int step) {
    std::vector<double> sum(moment_count(terms_));
    std::vector<float> of_band(sum.size() + kPairs);
    take_bands(predictors, start, step, [&](int, std::size_t count) {
      vectorised<multiply_pairs>(values_.data(), terms_, stride_, static_cast<std::size_t>(across_) * count,
                                 of_band.data());
      vectorised<add_all>(of_band.data(), terms_ * (terms_ + 1) / 2, sum.data());
    });
    return sum;
  }

 private:
  /// Calls `use(band, count)` for each row of blocks once its values are there, `count` for a block.
  template <typename Use>
  void take_bands(const Predictors& predictors, int start, int step, const Use& use) {
    int row = start;
    for (int band = 0; band < down_; ++band) {
      const int end = std::min((band + 1) * kBlockPlaces, lattice_.rows());
      int rows = 0;
      for (int r = row; r < end; r += step) ++rows;
      for (int slot = 0; row < end; row += step, ++slot) take_row(row, slot, rows, predictors);
      use(band, kBlockWidth * static_cast<std::size_t>(rows));
    }
  }

  void take_row(int r, int slot, int slots, const Predictors& predictors) {
    const Neighbours<Wide> at(lattice_, r);
    predict_row<Wide>(lattice_, r, predictors, low_, high_, halves_);
    const std::ptrdiff_t stride = std::ptrdiff_t{slots} * kBlockPlaces;
    float* const out = values_.data() + std::ptrdiff_t{slot} * kBlockPlaces;
    vectorised<find_errors<Wide>>(at.own, halves_.data(), at.first, at.last, errors_.data());
    std::fill(scale_.begin(), scale_.end(), 0.0F);  // WW of the first two and the East of the last are not of the row
    vectorised<weigh_by_errors>(errors_.data(), at.first, at.last, scale_.data());
    for (std::size_t term = 0; term + 1 < terms_; ++term) {
      vectorised<scale_blocks<Wide>>(at.of_weight(term), at.north, scale_.data(), across_, stride,
                                     out + term * stride_);
    }
    float* const to = out + (terms_ - 1) * stride_;
    for (int block = 0; block < across_; ++block) {
      for (std::ptrdiff_t i = 0; i < kBlockPlaces; ++i) {
        const auto place = static_cast<std::size_t>(block * kBlockPlaces + i);
        to[block * stride + i] = errors_[place] * scale_[place];
      }
    }
  }

  const Lattice<Wide>& lattice_;
  Wide low_;
  Wide high_;
  std::size_t terms_;
  int across_;
  int down_;
  std::vector<float> scale_;
  std::vector<float> errors_;
  std::vector<Wide> halves_;
  std::size_t stride_;
  std::vector<float> values_;
  std::vector<float> moments_;
};

constexpr int kRowsToThin = 96;  // below, all rows take part

using Solution = std::array<double, kWeightCount>;

/// Solves the normal equations by LDL^T. Only the four operations of IEEE arithmetic, so the same everywhere; nullopt
/// where they are singular.
std::optional<Solution> solve(const std::vector<double>& moments, std::size_t terms) {
  const std::size_t n = terms - 1;
  const auto moment = [&](std::size_t i, std::size_t j) { return moments[i * (i + 1) / 2 + j]; };
  std::array<Solution, kWeightCount> lower{};
  Solution diagonal{};
  Solution solution{};
  double trace = 0.0;
  for (std::size_t i = 0; i < n; ++i) trace += moment(i, i);
  const double ridge = trace * 1e-7 + 1e-3;  // flat and one-dimensional terrain leaves weights undecided
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = moment(i, j) + (i == j ? ridge : 0.0);
      for (std::size_t k = 0; k < j; ++k) sum -= lower[i][k] * lower[j][k] * diagonal[k];
      if (i == j) {
        if (!(sum > 0.0)) return std::nullopt;
        diagonal[i] = sum;
      } else {
        lower[i][j] = sum / diagonal[j];
      }
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    double sum = moment(n, i);
    for (std::size_t k = 0; k < i; ++k) sum -= lower[i][k] * solution[k];
    solution[i] = sum;
  }
  for (std::size_t i = n; i-- > 0;) {
    double sum = solution[i] / diagonal[i];
    for (std::size_t k = i + 1; k < n; ++k) sum -= lower[k][i] * solution[k];
    solution[i] = sum;
  }
  return solution;
}

/// Weights that a solution, a change of `weights`, leads to; nullopt where they exceed what the header may hold.
std::optional<PredictorWeights> changed(const PredictorWeights& weights, const Solution& solution) {
  PredictorWeights out{};
  double sum = 0.0;
  for (std::size_t i = 0; i < kWeightCount; ++i) {
    const double scaled = std::floor(weights[i] + solution[i] * (1 << kWeightBits) + 0.5);
    sum += std::abs(scaled);
    if (!(sum < kWeightSumLimit)) return std::nullopt;
    out[i] = static_cast<std::int16_t>(scaled);
  }
  return out;
}

/// Products that weigh a block's moments to its squared error once the weights have changed by `solution`.
std::array<double, moment_count(kMaxMomentTerms)> products_of(const Solution& solution, std::size_t terms) {
  std::array<double, moment_count(kMaxMomentTerms)> products{};
  const auto value = [&](std::size_t i) { return i + 1 < terms ? solution[i] : -1.0; };
  std::size_t at = 0;
  for (std::size_t i = 0; i < terms; ++i) {
    for (std::size_t j = 0; j <= i; ++j) products[at++] = value(i) * value(j) * (i == j ? 1.0 : 2.0);
  }
  return products;
}

template <typename Wide>
class Fit {
 public:
  Fit(const Lattice<Wide>& lattice, Wide low, Wide high, const FitEffort& effort)
      : effort_(effort),
        rows_(lattice.rows()),
        samples_(static_cast<double>(lattice.rows()) * lattice.columns()),
        moments_(lattice, effort.is_wide, low, high) {
    predictors_.is_wide = effort.is_wide;
  }

  Predictors run() {
    for (int pass = 0; pass < effort_.passes; ++pass) {
      const auto [start, step] = rows_of(pass, effort_.pass_thinning);
      const auto solution = solve(moments_.measure_whole(predictors_, start, step), moments_.terms());
      const auto weights = solution ? changed(predictors_.weights[0], *solution) : std::nullopt;
      if (!weights) break;
      predictors_.weights[0] = *weights;
    }
    for (int round = 0; round < effort_.rounds && effort_.predictors > 1; ++round) {
      const auto [start, step] = rows_of(round, effort_.round_thinning);
      moments_.measure(predictors_, start, step);
      split();
      if (predictors_.map.empty()) break;
    }
    return predictors_;
  }

 private:
  /// The first row that takes part, and how far apart they are.
  [[nodiscard]] std::pair<int, int> rows_of(int turn, int thinning) const {
    const int step = rows_ >= kRowsToThin ? thinning : 1;
    return {3 + turn % step, step};
  }

  template <typename Takes>
  std::vector<double> sum_of_blocks(const Takes& takes) const {
    const std::size_t count = moment_count(moments_.terms());
    std::vector<double> sum(count);
    for (std::size_t block = 0; block < moments_.size(); ++block) {
      if (!takes(block)) continue;
      vectorised<add_all>(moments_.of_block(block), count, sum.data());
    }
    return sum;
  }

  /// What the weights would have to change by in each block's class, and each block to the class where it errs least.
  void split() {
    const std::size_t terms = moments_.terms();
    const std::size_t count = moment_count(terms);
    const auto classes = static_cast<std::size_t>(effort_.predictors);
    // The moments go by errors of the present predictors: a block's changes are changes of its present one.
    const std::vector<PredictorWeights> before = predictors_.weights;
    const std::vector<std::uint8_t> map_before = predictors_.map;
    const bool is_first = map_before.empty();
    std::vector<std::uint8_t> map = is_first ? first_classes(classes) : map_before;
    std::vector<PredictorWeights> weights(classes, before[0]);
    if (!is_first) weights = before;
    const std::size_t bases = is_first ? 1 : classes;
    for (int move = 0; move < effort_.moves; ++move) {
      for (std::size_t k = 0; k < classes; ++k) refit(k, map, map_before, before, weights);
      if (move + 1 == effort_.moves && !is_first) break;
      // From each base, the way to each class.
      std::vector<std::array<double, moment_count(kMaxMomentTerms)>> products;
      for (std::size_t base = 0; base < bases; ++base) {
        for (std::size_t k = 0; k < classes; ++k) products.push_back(products_of(way(before[base], weights[k]), terms));
      }
      for (std::size_t block = 0; block < map.size(); ++block) {
        const std::size_t base = is_first ? 0 : map_before[block];
        double least = std::numeric_limits<double>::infinity();
        for (std::size_t k = 0; k < classes; ++k) {
          const double error =
              vectorised<weigh_all>(moments_.of_block(block), products[base * classes + k].data(), count);
          if (error < least) {
            least = error;
            map[block] = static_cast<std::uint8_t>(k);
          }
        }
      }
    }
    for (std::size_t k = 0; k < classes; ++k) refit(k, map, map_before, before, weights);
    if (is_first) {
      const std::vector<std::uint8_t> all_alike(map.size());
      std::vector<PredictorWeights> single(1, before[0]);
      refit(0, all_alike, map_before, before, single);
      predictors_.weights = single;
      if (!pays(before[0], single, all_alike, weights, map)) return;
    }
    predictors_.weights = weights;
    predictors_.map = map;
    predictors_.block_columns = moments_.across();
  }

  /// Squared errors of all blocks with the weights that the map gives them, from errors that `base` leaves.
  double error_of(const PredictorWeights& base, const std::vector<PredictorWeights>& weights,
                  const std::vector<std::uint8_t>& map) const {
    const std::size_t terms = moments_.terms();
    std::vector<std::array<double, moment_count(kMaxMomentTerms)>> products;
    for (const PredictorWeights& to : weights) products.push_back(products_of(way(base, to), terms));
    double sum = 0.0;
    for (std::size_t block = 0; block < map.size(); ++block) {
      sum += vectorised<weigh_all>(moments_.of_block(block), products[map[block]].data(), moment_count(terms));
    }
    return sum;
  }

  /// True where several predictors save more bits than they and their map take: a sample costs half the binary
  /// logarithm of its squared error. Blocks that choose between equals seem to gain a little; hence the factor 2.
  bool pays(const PredictorWeights& base, const std::vector<PredictorWeights>& single,
            const std::vector<std::uint8_t>& single_map, const std::vector<PredictorWeights>& several,
            const std::vector<std::uint8_t>& map) const {
    const double before = error_of(base, single, single_map);
    const double after = error_of(base, several, map);
    const double saved = 0.72 * samples_ * (1.0 - after / before);
    const auto cost = static_cast<double>(map.size() + 8 * 2 * (moments_.terms() - 1) * (several.size() - 1));
    return before > 0.0 && saved > 2.0 * cost;
  }

  static Solution way(const PredictorWeights& from, const PredictorWeights& to) {
    Solution solution{};
    for (std::size_t i = 0; i < kWeightCount; ++i) solution[i] = (to[i] - from[i]) / double{1 << kWeightBits};
    return solution;
  }

  /// Fits class k to its blocks. Errors of blocks whose base is another class are brought to that of class k.
  void refit(std::size_t k, const std::vector<std::uint8_t>& map, const std::vector<std::uint8_t>& map_before,
             const std::vector<PredictorWeights>& before, std::vector<PredictorWeights>& weights) const {
    const std::size_t terms = moments_.terms();
    std::vector<double> total(moment_count(terms));
    const std::size_t base_of_class = map_before.empty() ? 0 : k;
    for (std::size_t base = 0; base < before.size(); ++base) {
      const auto sum = sum_of_blocks(
          [&](std::size_t block) { return map[block] == k && (map_before.empty() ? 0 : map_before[block]) == base; });
      const Solution change = way(before[base_of_class], before[base]);  // error' = error + change · differences
      for (std::size_t i = 0; i < sum.size(); ++i) total[i] += sum[i];
      if (base == base_of_class) continue;
      const std::size_t last = (terms - 1) * terms / 2;
      for (std::size_t j = 0; j + 1 < terms; ++j) {
        for (std::size_t i = 0; i + 1 < terms; ++i) {
          total[last + j] += change[i] * (i >= j ? sum[i * (i + 1) / 2 + j] : sum[j * (j + 1) / 2 + i]);
        }
      }
    }
    const auto solution = solve(total, terms);
    const auto fitted = solution ? changed(before[base_of_class], *solution) : std::nullopt;
    if (fitted) weights[k] = *fitted;
  }

  /// Blocks in order of how the weight of W would have to change in them, in equal parts.
  std::vector<std::uint8_t> first_classes(std::size_t classes) const {
    const std::size_t blocks = moments_.size();
    const std::size_t terms = moments_.terms();
    std::vector<float> key(blocks);
    for (std::size_t block = 0; block < blocks; ++block) {
      const float* const moments = moments_.of_block(block);
      key[block] = moments[(terms - 1) * terms / 2] / (moments[0] + 1e-3F);
    }
    std::vector<std::size_t> order(blocks);
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return key[a] < key[b]; });
    std::vector<std::uint8_t> map(blocks);
    for (std::size_t i = 0; i < blocks; ++i) map[order[i]] = static_cast<std::uint8_t>(i * classes / blocks);
    return map;
  }

  FitEffort effort_;
  int rows_;
  double samples_;
  BlockMoments<Wide> moments_;
  Predictors predictors_;
};

}  // namespace

template <typename Wide>
Predictors fit_predictors(const Lattice<Wide>& lattice, Wide low, Wide high, const FitEffort& effort) {
  return Fit<Wide>(lattice, low, high, effort).run();
}

template Predictors fit_predictors(const Lattice<std::int32_t>& lattice, std::int32_t low, std::int32_t high,
                                   const FitEffort& effort);
template Predictors fit_predictors(const Lattice<std::int64_t>& lattice, std::int64_t low, std::int64_t high,
                                   const FitEffort& effort);

}  // namespace isohf
