#include "isohf/archive/codec/predict/block_moments.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "isohf/archive/codec/predict/hex_predictor.h"
#include "isohf/base/simd.h"

namespace isohf {
namespace {

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

}  // namespace

template <typename Wide>
BlockMoments<Wide>::BlockMoments(const Lattice<Wide>& lattice, bool is_wide, Wide low, Wide high)
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

template <typename Wide>
void BlockMoments<Wide>::measure(const Predictors& predictors, int start, int step) {
  const auto across = static_cast<std::size_t>(across_);
  take_bands(predictors, start, step, [&](int band, std::size_t count) {
    for (std::size_t block = 0; block < across; ++block) {
      float* const out = moments_.data() + moment_count(terms_) * (static_cast<std::size_t>(band) * across + block);
      vectorised<multiply_pairs>(values_.data() + block * count, terms_, stride_, count, out);
      std::fill(out + terms_ * (terms_ + 1) / 2, out + moment_count(terms_), 0.0F);
    }
  });
}

template <typename Wide>
std::vector<double> BlockMoments<Wide>::measure_whole(const Predictors& predictors, int start, int step) {
  std::vector<double> sum(moment_count(terms_));
  std::vector<float> of_band(sum.size() + kPairs);
  take_bands(predictors, start, step, [&](int, std::size_t count) {
    vectorised<multiply_pairs>(values_.data(), terms_, stride_, static_cast<std::size_t>(across_) * count,
                               of_band.data());
    add_moments(of_band.data(), terms_ * (terms_ + 1) / 2, sum.data());
  });
  return sum;
}

/// Calls `use(band, count)` for each row of blocks once its values are there, `count` for a block.
template <typename Wide>
template <typename Use>
void BlockMoments<Wide>::take_bands(const Predictors& predictors, int start, int step, const Use& use) {
  int row = start;
  for (int band = 0; band < down_; ++band) {
    const int end = std::min((band + 1) * kBlockPlaces, lattice_.rows());
    int rows = 0;
    for (int r = row; r < end; r += step) ++rows;
    for (int slot = 0; row < end; row += step, ++slot) take_row(row, slot, rows, predictors);
    use(band, kBlockWidth * static_cast<std::size_t>(rows));
  }
}

template <typename Wide>
void BlockMoments<Wide>::take_row(int r, int slot, int slots, const Predictors& predictors) {
  const Neighbours<Wide> at(lattice_, r);
  predict_row<Wide>(lattice_, r, predictors, low_, high_, halves_);
  const std::ptrdiff_t stride = std::ptrdiff_t{slots} * kBlockPlaces;
  float* const out = values_.data() + std::ptrdiff_t{slot} * kBlockPlaces;
  vectorised<find_errors<Wide>>(at.own, halves_.data(), at.first, at.last, errors_.data());
  std::fill(scale_.begin(), scale_.end(), 0.0F);  // WW of the first two and the East of the last are not of the row
  vectorised<weigh_by_errors>(errors_.data(), at.first, at.last, scale_.data());
  for (std::size_t term = 0; term + 1 < terms_; ++term) {
    vectorised<scale_blocks<Wide>>(at.of_weight(term), at.north, scale_.data(), across_, stride, out + term * stride_);
  }
  float* const to = out + (terms_ - 1) * stride_;
  for (int block = 0; block < across_; ++block) {
    for (std::ptrdiff_t i = 0; i < kBlockPlaces; ++i) {
      const auto place = static_cast<std::size_t>(block * kBlockPlaces + i);
      to[block * stride + i] = errors_[place] * scale_[place];
    }
  }
}

template class BlockMoments<std::int32_t>;
template class BlockMoments<std::int64_t>;

void add_moments(const float* moments, std::size_t count, double* __restrict sum) {
  vectorised<add_all>(moments, count, sum);
}

double weigh_moments(const float* moments, const double* products, std::size_t count) {
  return vectorised<weigh_all>(moments, products, count);
}

}  // namespace isohf
