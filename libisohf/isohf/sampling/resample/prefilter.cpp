#include "isohf/sampling/resample/prefilter.h"

#include <fmt/format.h>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <numbers>
#include <string>
#include <utility>

#include "isohf/base/assert.h"
#include "isohf/base/simd.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// Points of the unit circle at which spectra are taken; also the period after which an inverse would alias.
constexpr std::size_t kCircle = 8192;
/// What may be left out of an impulse response, as a sum of sizes.
constexpr double kTail = 1e-9;
constexpr std::size_t kLongestHalo = 1024;

constexpr std::int64_t kBlock = 32;         ///< outputs whose sums are kept in registers together
constexpr std::int64_t kStripColumns = 64;  ///< columns that are filtered together: four cache lines of floats
static_assert(kStripColumns % kBlock == 0);

/// a[0] + 2 sum of a[k] cos(2 pi j k / kCircle).
double spectrum_at(const std::vector<double>& even, std::size_t j, const std::vector<double>& cosines) {
  double sum = 0.0;
  for (std::size_t k = even.size() - 1; k > 0; --k) sum += even[k] * cosines[(j * k) % kCircle];
  return even[0] + 2.0 * sum;
}

using FourDoubles = double __attribute__((vector_size(32)));
using EightDoubles = double __attribute__((vector_size(64)));

/// out[b * out_step + i] = p[0] x[i'] + sum over k of p[k] (x[i' - k * step] + x[i' + k * step]), i' = b * kBlock + i.
/// A Pack is a vector of neighbouring samples: left to itself the compiler would vectorise over k.
template <typename Pack>
ISOHF_KERNEL void convolve(const double* x, std::int64_t step, const double* p, std::int64_t halo, std::int64_t blocks,
                           float* __restrict out, std::int64_t out_step) {
  constexpr std::size_t kPack = sizeof(Pack) / sizeof(double);
  constexpr std::size_t kSums = kBlock / kPack;
  for (std::int64_t b = 0; b < blocks; ++b) {
    const double* const centre = x + b * kBlock;
    Pack sums[kSums];  // side by side: each addition waits for the one before it
    for (std::size_t i = 0; i < kSums; ++i) sums[i] = p[0] * unaligned<Pack>(centre + i * kPack).value;
    for (std::int64_t k = 1; k <= halo; ++k) {
      const double* const before = centre - k * step;
      const double* const after = centre + k * step;
      for (std::size_t i = 0; i < kSums; ++i) {
        sums[i] += p[k] * (unaligned<Pack>(before + i * kPack).value + unaligned<Pack>(after + i * kPack).value);
      }
    }
    float* const target = out + b * out_step;
    for (std::size_t i = 0; i < kSums; ++i) {
      const Pack sum = sums[i];
      for (std::size_t k = 0; k < kPack; ++k) target[i * kPack + k] = static_cast<float>(sum[k]);
    }
  }
}

std::int64_t round_up(std::int64_t count, std::int64_t multiple) {
  return (count + multiple - 1) / multiple * multiple;
}

/// Samples or coefficients along a row or a column.
template <typename T>
struct Line {
  T* data;
  std::int64_t step;
  T& operator[](std::int64_t i) const { return data[i * step]; }
};

/// Filters single lines: rows, and columns with voids.
class LineFilter {
 public:
  /// taps as in Prefilter; voids up to `border` samples from a valid one receive coefficients as well.
  LineFilter(const std::vector<double>& taps, std::int64_t border)
      : taps_(taps), reach_(static_cast<std::int64_t>(taps.size()) - 1), border_(border) {}

  /// Filters samples `from` to `to` of a line of `count`, run by run; out[0] is the coefficient at `from`. Places of
  /// out that no run reaches are left alone. out may be the line itself.
  void filter(Line<const float> line, std::int64_t count, std::int64_t from, std::int64_t to, Line<float> out) {
    // A run that is cut here has its true end further from `from` and `to` than they can tell.
    const std::int64_t margin = reach_ + 2 * border_;
    const std::int64_t last = std::min(count, to + margin);
    std::int64_t begin = next_valid(line, std::max<std::int64_t>(0, from - margin), last);
    // Runs with their ends continued, and a last block that may go on beyond what is asked for.
    samples_.resize(
        static_cast<std::size_t>(std::max<std::int64_t>(0, last - begin) + border_ + 2 * pad() + kBlock + reach_));
    while (begin < last) {
      double* run = samples_.data() + pad();
      const std::int64_t first = begin <= border_ ? 0 : begin;  // as far as the source's own end
      std::int64_t end = begin;
      std::int64_t next = begin;
      while (next < last && next - end <= 2 * border_) {
        bridge(run, end - first, next - first, line[next]);
        for (end = next; end < last && !std::isnan(line[end]); ++end) run[end - first] = static_cast<double>(line[end]);
        next = next_valid(line, end, last);
      }
      const std::int64_t samples = end - begin;
      if (next == count && count - end <= border_) end = count;
      fill_to_ends(run + (begin - first), samples, first - begin, end - begin);
      const std::int64_t wanted = std::max(first - border_, from);
      filter_run(run, end - first, wanted - first, std::min(end + border_, to) - first,
                 {out.data + (wanted - from) * out.step, out.step});
      begin = next;
    }
  }

 private:
  /// Samples before and after a run.
  [[nodiscard]] std::int64_t pad() const { return reach_ + border_; }

  static std::int64_t next_valid(Line<const float> line, std::int64_t at, std::int64_t last) {
    while (at < last && std::isnan(line[at])) ++at;
    return at;
  }

  /// Straight across the voids from `end` to `next`: both of their sides want to continue there.
  static void bridge(double* run, std::int64_t end, std::int64_t next, float after) {
    for (std::int64_t k = end; k < next; ++k) {
      const double part = static_cast<double>(k - end + 1) / static_cast<double>(next - end + 1);
      run[k] = run[end - 1] + part * (static_cast<double>(after) - run[end - 1]);
    }
  }

  /// Voids between the source's ends and the `count` samples nearest to them, at places `from` to 0 and count to `to`.
  void fill_to_ends(double* samples, std::int64_t count, std::int64_t from, std::int64_t to) const {
    for (std::int64_t k = from; k < 0; ++k) go_on(samples, count, k);
    for (std::int64_t k = count; k < to; ++k) go_on(samples, count, k);
  }

  void go_on(double* samples, std::int64_t count, std::int64_t k) const {
    double height = 0.0;
    continue_row(k, count, [&](std::int64_t at, int weight) { height += weight * samples[at]; });
    samples[k] = height;
  }

  /// out[0] receives the coefficient at `from`, and so on to `to`, of a run of `count` samples with room for pad() more
  /// on either side.
  void filter_run(double* run, std::int64_t count, std::int64_t from, std::int64_t to, Line<float> out) {
    if (from >= to) return;
    for (std::int64_t k = -pad(); k < 0; ++k) go_on(run, count, k);
    for (std::int64_t k = count; k < count + pad(); ++k) go_on(run, count, k);
    const std::int64_t blocks = round_up(to - from, kBlock) / kBlock;
    coefficients_.resize(static_cast<std::size_t>(blocks * kBlock));
    vectorised<convolve<FourDoubles>, convolve<FourDoubles>, convolve<EightDoubles>>(
        run + from, 1, taps_.data(), reach_, blocks, coefficients_.data(), kBlock);
    for (std::int64_t k = 0; k < to - from; ++k) out[k] = coefficients_[static_cast<std::size_t>(k)];
  }

  const std::vector<double>& taps_;
  std::int64_t reach_;
  std::int64_t border_;
  std::vector<double> samples_;
  std::vector<float> coefficients_;
};

/// Columns that are filtered together, row by row, with room for their coefficients.
struct Strip {
  std::vector<double> samples;
  std::vector<float> coefficients;
  std::array<int, kStripColumns> has_void{};
};

/// Copies a strip of columns, rows begin to end of the band, continued at the band's ends; notes which have voids.
void load_strip(View2D<const float> band, std::int64_t column, std::int64_t columns, std::int64_t begin,
                std::int64_t end, Strip& strip) {
  strip.has_void.fill(0);
  double* samples = strip.samples.data();
  int* has_void = strip.has_void.data();
  for (std::int64_t r = begin; r < end; ++r, samples += kStripColumns) {
    std::fill(samples, samples + kStripColumns, 0.0);
    continue_row(r, band.rows(), [&](std::int64_t at, int weight) {
      const float* row = band.row(at) + column;
      for (std::int64_t i = 0; i < columns; ++i) {
        has_void[i] |= static_cast<int>(row[i] != row[i]);
        samples[i] += weight * static_cast<double>(row[i]);
      }
    });
  }
}

/// Calls work(begin, end) on parts of 0 ... count, on as many threads as the caller's arena has. A waiting thread takes
/// up nothing else meanwhile: the caller may be a serial stage of a pipeline.
template <typename Work>
void in_parallel(std::int64_t count, std::int64_t grain, const Work& work) {
  oneapi::tbb::this_task_arena::isolate([&] {
    oneapi::tbb::parallel_for(oneapi::tbb::blocked_range<std::int64_t>(0, count, static_cast<std::size_t>(grain)),
                              [&](const auto& range) { work(range.begin(), range.end()); });
  });
}

}  // namespace

Prefilter::Prefilter(std::vector<double> taps, int border)
    : taps_(std::move(taps)), border_(taps_.size() == 1 ? 0 : border) {}

Prefilter Prefilter::make(Filter filter, const Acquisition& acquisition) {
  const Acquisition used = with_taps(acquisition);
  // A conversion asks several times for the same, and many conversions do: it takes longer than a small raster.
  static std::mutex mutex;
  static std::map<std::pair<Filter, std::string>, Prefilter> made;
  constexpr std::size_t kMostMade = 16;
  const std::pair key(filter, to_string(acquisition));
  {
    const std::lock_guard lock(mutex);
    if (const auto found = made.find(key); found != made.end()) return found->second;
  }
  const Kernel kernel = Kernel::make(filter);
  const std::vector<double> response = sampled_response(kernel, used);
  const std::vector<double> at_points = sampled_response(kernel, Acquisition{});
  std::vector<double> cosines(kCircle);
  for (std::size_t j = 0; j < kCircle; ++j) {
    cosines[j] = std::cos(2.0 * std::numbers::pi * static_cast<double>(j) / kCircle);
  }

  std::vector<double> inverse(kCircle / 2 + 1);
  double worst_gain = 0.0;
  std::size_t worst_at = 0;
  for (std::size_t j = 0; j <= kCircle / 2; ++j) {
    const double spectrum = spectrum_at(response, j, cosines);
    inverse[j] = 1.0 / spectrum;
    const double gain =
        spectrum > 0.0 ? spectrum_at(at_points, j, cosines) / spectrum : std::numeric_limits<double>::infinity();
    if (gain > worst_gain) {
      worst_gain = gain;
      worst_at = j;
    }
  }
  if (!(worst_gain <= kMostGain)) {
    throw Error(
        ErrorCode::kInvalidArgument,
        fmt::format("acquisition {} cannot be undone with {}: waves of {:.3g} samples would have to be "
                    "amplified {}, at most {:g} times is allowed; give a milder filter, or point",
                    to_string(acquisition), to_string(filter),
                    static_cast<double>(kCircle) / static_cast<double>(worst_at),
                    std::isinf(worst_gain) ? "without bound" : fmt::format("{:.4g} times", worst_gain), kMostGain));
  }

  // p[k] is the mean of cos(omega k) / A(omega) over the circle.
  std::vector<double> taps;
  for (std::size_t k = 0; k <= kLongestHalo; ++k) {
    double sum = 0.5 * (inverse.front() + ((k & 1U) != 0 ? -inverse.back() : inverse.back()));
    for (std::size_t j = 1; j < kCircle / 2; ++j) sum += inverse[j] * cosines[(j * k) % kCircle];
    taps.push_back(2.0 * sum / static_cast<double>(kCircle));
  }
  double tail = 0.0;
  while (taps.size() > 1 && tail + 2.0 * std::abs(taps.back()) < kTail) {
    tail += 2.0 * std::abs(taps.back());
    taps.pop_back();
  }
  // A gain of at most 100 by a filter of at most 255 taps or a Gaussian fades within a few hundred samples.
  if (taps.size() > kLongestHalo) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("acquisition {}: the inverse does not fade within {} samples",
                                                         to_string(acquisition), kLongestHalo));
  }
  if (taps.size() == 1) taps[0] = 1.0;
  Prefilter prefilter(std::move(taps), (kernel.taps() + 1) / 2);
  const std::lock_guard lock(mutex);
  if (made.size() == kMostMade) made.clear();
  made.emplace(key, prefilter);
  return prefilter;
}

Prefilter Prefilter::smoothing() {
  return {{20.0 / 64.0, 15.0 / 64.0, 6.0 / 64.0, 1.0 / 64.0}, 0};
}

void Prefilter::filter_rows(View2D<float> band, bool wraps) const {
  if (is_identity()) return;
  in_parallel(band.rows(), 4, [&](std::int64_t begin, std::int64_t end) {
    LineFilter lines(taps_, border_);
    // All that a coefficient depends on, written down once more on either side.
    const std::int64_t beyond = wraps ? halo() : 0;
    std::vector<float> round(static_cast<std::size_t>(wraps ? band.columns() + 2 * beyond : 0));
    for (std::int64_t r = begin; r < end; ++r) {
      float* row = band.row(r);
      if (wraps) {
        const std::int64_t columns = band.columns();
        for (std::int64_t k = 0; k < static_cast<std::int64_t>(round.size()); ++k) {
          round[static_cast<std::size_t>(k)] = row[((k - beyond) % columns + columns) % columns];
        }
        lines.filter({round.data(), 1}, columns + 2 * beyond, beyond, beyond + columns, {row, 1});
        continue;
      }
      lines.filter({row, 1}, band.columns(), 0, band.columns(), {row, 1});
    }
  });
}

void Prefilter::filter_columns(View2D<const float> band, std::int64_t first, View2D<float> out) const {
  ISOHF_ASSERT(out.columns() == band.columns() && first >= 0 && first + out.rows() <= band.rows());
  if (is_identity()) {
    for (std::int64_t r = 0; r < out.rows(); ++r) {
      if (out.row(r) != band.row(first + r)) std::copy_n(band.row(first + r), band.columns(), out.row(r));
    }
    return;
  }
  const std::int64_t rows = out.rows();
  const auto reach = static_cast<std::int64_t>(taps_.size()) - 1;
  in_parallel(round_up(band.columns(), kStripColumns) / kStripColumns, 1, [&](std::int64_t begin, std::int64_t end) {
    Strip strip;
    strip.samples.resize(static_cast<std::size_t>((rows + 2 * reach) * kStripColumns));
    strip.coefficients.resize(static_cast<std::size_t>(rows * kStripColumns));
    LineFilter lines(taps_, border_);
    for (std::int64_t column = begin * kStripColumns; column < std::min(end * kStripColumns, band.columns());
         column += kStripColumns) {
      const std::int64_t columns = std::min(kStripColumns, band.columns() - column);
      load_strip(band, column, columns, first - reach, first + rows + reach, strip);
      // Columns do not touch each other: those with voids come out wrong here and are done again, run by run.
      vectorised<convolve<FourDoubles>, convolve<FourDoubles>, convolve<EightDoubles>>(
          strip.samples.data() + reach * kStripColumns, kStripColumns, taps_.data(), reach,
          rows * kStripColumns / kBlock, strip.coefficients.data(), kBlock);
      for (std::int64_t i = 0; i < columns; ++i) {
        if (strip.has_void[static_cast<std::size_t>(i)] == 0) continue;
        const Line<float> coefficients{strip.coefficients.data() + i, kStripColumns};
        for (std::int64_t r = 0; r < rows; ++r) coefficients[r] = std::numeric_limits<float>::quiet_NaN();
        lines.filter({band.data() + column + i, band.stride()}, band.rows(), first, first + rows, coefficients);
      }
      for (std::int64_t r = 0; r < rows; ++r) {
        std::copy_n(strip.coefficients.data() + r * kStripColumns, columns, out.row(r) + column);
      }
    }
  });
}

void Prefilter::filter(View2D<float> raster) const {
  filter_rows(raster);
  filter_columns(raster, 0, raster);
}

}  // namespace isohf
