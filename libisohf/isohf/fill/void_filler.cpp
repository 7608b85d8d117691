#include "isohf/fill/void_filler.h"

#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>

#include "isohf/base/sample.h"

namespace isohf {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// A ray's step in columns and rows, its length, and the angle that the ray stands for, as a share of the circle: half
/// way to its neighbours on either side.
struct Ray {
  int dx;
  int dy;
  double length;
  double share;
};

//   . 3 2 3 .        1 along the axes, 2 along the diagonals, 3 two by one
//   3 . . . 3
//   2 . x . 1
//   3 . . . 3
//   . 3 1 3 2
constexpr double kSqrt2 = 1.4142135623730951;
constexpr double kSqrt5 = 2.23606797749979;
constexpr double kAngle = 26.56505117707799;  // atan(1/2), degrees
constexpr double kAxis = kAngle / 360.0;
constexpr double kDiagonal = (45.0 - kAngle) / 360.0;
constexpr double kTwoByOne = 22.5 / 360.0;
constexpr std::array<Ray, 16> kRays = {{{1, 0, 1.0, kAxis},
                                        {0, 1, 1.0, kAxis},
                                        {-1, 0, 1.0, kAxis},
                                        {0, -1, 1.0, kAxis},
                                        {1, 1, kSqrt2, kDiagonal},
                                        {-1, 1, kSqrt2, kDiagonal},
                                        {-1, -1, kSqrt2, kDiagonal},
                                        {1, -1, kSqrt2, kDiagonal},
                                        {2, 1, kSqrt5, kTwoByOne},
                                        {1, 2, kSqrt5, kTwoByOne},
                                        {-1, 2, kSqrt5, kTwoByOne},
                                        {-2, 1, kSqrt5, kTwoByOne},
                                        {-2, -1, kSqrt5, kTwoByOne},
                                        {-1, -2, kSqrt5, kTwoByOne},
                                        {1, -2, kSqrt5, kTwoByOne},
                                        {2, -1, kSqrt5, kTwoByOne}}};

/// Radii of the smoothing passes, samples.
constexpr std::array<std::int64_t, 8> kRadii = {8, 4, 2, 1, 4, 2, 1, 1};

/// Columns that are filled at once: wider voids are cut, and smoothed beyond the cuts as far as these are seen.
constexpr std::int64_t kBoxColumns = 4096;
/// Of each sample of a box: two values, its distance, and whether ground is near.
constexpr double kBoxBytes = 19.0;

std::int64_t sum_of_radii() {
  return std::accumulate(kRadii.begin(), kRadii.end(), std::int64_t{0});
}

}  // namespace

/// A part of the rows with the voids that are to be filled, and a margin for the smoothing.
struct VoidFiller::Box {
  std::int64_t column = 0;
  std::int64_t row = 0;
  std::int64_t columns = 0;
  std::int64_t rows = 0;
  std::int64_t first_filled = 0;  ///< column, and the one behind the last: the others are margin
  std::int64_t end_filled = 0;
  std::vector<double> values;          ///< raw; NaN where void and not (yet) filled
  std::vector<std::int16_t> distance;  ///< of a void to the nearest sample that was found, rounded down; 0: no void
  std::vector<char> is_near;           ///< 0: nothing but voids within the distance; empty: not looked into

  [[nodiscard]] std::size_t at(std::int64_t c, std::int64_t r) const {
    return static_cast<std::size_t>((r - row) * columns + c - column);
  }
};

VoidFiller::VoidFiller(const SourceInfo& info, std::int64_t distance) : info_(info), distance_(distance) {}

std::int64_t VoidFiller::smoothing_reach() {
  return sum_of_radii();
}

std::int64_t VoidFiller::reach() const {
  return distance_ + smoothing_reach();
}

std::int64_t VoidFiller::box_columns() const {
  return std::max(kBoxColumns, distance_);
}

std::int64_t VoidFiller::columns_at_once() const {
  return std::min(box_columns() + 2 * reach(), info_.width);
}

double VoidFiller::memory_bytes(std::int64_t rows) const {
  const std::int64_t columns = std::min(box_columns() + 2 * smoothing_reach(), info_.width);
  return static_cast<double>((rows + 2 * smoothing_reach()) * columns) * kBoxBytes + static_cast<double>(info_.width);
}

/// Column intervals that hold the voids of the rows and what smoothing sees around them; as high as smoothing needs.
std::vector<VoidFiller::Box> VoidFiller::boxes(const ReadVoidRows& read, std::int64_t first, std::int64_t end) const {
  const std::int64_t margin = smoothing_reach();
  std::vector<char> any(static_cast<std::size_t>(info_.width), 0);
  for (std::int64_t row = first; row < end; ++row) {
    const VoidRows rows = read(row, row + 1, 0, info_.width);
    const char* const voids = rows.voids.front();
    if (voids == nullptr) continue;
    for (std::size_t c = 0; c < any.size(); ++c) any[c] = static_cast<char>(any[c] | voids[c]);
  }
  std::vector<Box> found;
  for (std::int64_t c = 0; c < info_.width; ++c) {
    if (any[static_cast<std::size_t>(c)] == 0) continue;
    const std::int64_t from = std::max<std::int64_t>(c - margin, 0);
    const std::int64_t to = std::min(c + margin + 1, info_.width);
    const bool follows = !found.empty() && found.back().column + found.back().columns >= from;
    const bool is_cut = follows && c - found.back().first_filled >= box_columns();
    if (is_cut) found.back().end_filled = c;
    if (!follows || is_cut) {
      Box& box = found.emplace_back();
      box.column = from;
      box.first_filled = is_cut ? c : from;
      box.row = std::max<std::int64_t>(first - margin, 0);
      box.rows = std::min(end + margin, info_.height) - box.row;
    }
    found.back().columns = to - found.back().column;
    found.back().end_filled = to;
  }
  return found;
}

/// The mean of what the rays from each void of a row meet.
void VoidFiller::cast_row(const VoidRows& rows, Box& box, std::int64_t row) const {
  const LoadSample load = load_sample(info_.sample_type);
  const std::size_t size = size_bytes(info_.sample_type);
  const auto entry = static_cast<std::size_t>(row - rows.first);
  const char* const voids = rows.voids[entry];
  for (std::int64_t c = box.column; c < box.column + box.columns; ++c) {
    const std::size_t at = box.at(c, row);
    if (voids == nullptr || voids[c - rows.column] == 0) {
      box.values[at] = load(rows.raw[entry] + static_cast<std::size_t>(c - rows.column) * size);
      continue;
    }
    if (!box.is_near.empty() && box.is_near[at] == 0) {
      box.values[at] = kNone;
      box.distance[at] = 1;
      continue;
    }
    double sum = 0.0;
    double weights = 0.0;
    double least = HUGE_VAL;
    double most = -HUGE_VAL;
    double nearest = HUGE_VAL;
    for (const Ray& ray : kRays) {
      auto steps = static_cast<std::int64_t>(static_cast<double>(distance_) / ray.length);
      if (ray.dx != 0) steps = std::min(steps, ray.dx > 0 ? (info_.width - 1 - c) / ray.dx : c / -ray.dx);
      if (ray.dy != 0) steps = std::min(steps, ray.dy > 0 ? (info_.height - 1 - row) / ray.dy : row / -ray.dy);
      for (std::int64_t step = 1; step <= steps; ++step) {
        const std::int64_t column = c + step * ray.dx - rows.column;
        const auto there = static_cast<std::size_t>(row + step * ray.dy - rows.first);
        if (rows.voids[there] != nullptr && rows.voids[there][column] != 0) continue;
        const double value = load(rows.raw[there] + static_cast<std::size_t>(column) * size);
        const double length = static_cast<double>(step) * ray.length;
        const double weight = ray.share / (length * std::sqrt(length));
        sum += weight * value;
        weights += weight;
        least = std::min(least, value);
        most = std::max(most, value);
        nearest = std::min(nearest, length);
        break;
      }
    }
    box.values[at] = weights > 0.0 ? std::clamp(sum / weights, least, most) : kNone;
    box.distance[at] = static_cast<std::int16_t>(std::min(std::max(nearest, 1.0), 32767.0));
  }
}

/// Marks the samples whose square of 2 * distance + 1 on a side holds an elevation: sixteen long rays from each of the
/// others, deep in a large void, would be cast for nothing. O(1) for each sample.
void VoidFiller::look_for_ground(const VoidRows& rows, Box& box) const {
  const std::int64_t from = std::max<std::int64_t>(box.column - distance_, 0);
  const std::int64_t to = std::min(box.column + box.columns + distance_, info_.width);
  std::vector<std::int32_t> valid(static_cast<std::size_t>(to - from), 0);  // in the square's rows, by column
  const auto add_row = [&](std::int64_t row, std::int32_t sign) {
    if (row < 0 || row >= info_.height) return;
    const char* const voids = rows.voids[static_cast<std::size_t>(row - rows.first)];
    for (std::int64_t c = from; c < to; ++c) {
      valid[static_cast<std::size_t>(c - from)] += sign * (voids == nullptr ? 1 : 1 - voids[c - rows.column]);
    }
  };
  box.is_near.resize(static_cast<std::size_t>(box.columns * box.rows));
  for (std::int64_t row = box.row - distance_; row < box.row + distance_; ++row) add_row(row, 1);
  std::vector<std::int64_t> before(valid.size() + 1, 0);
  for (std::int64_t row = box.row; row < box.row + box.rows; ++row) {
    add_row(row + distance_, 1);
    for (std::size_t i = 0; i < valid.size(); ++i) before[i + 1] = before[i] + valid[i];
    for (std::int64_t c = box.column; c < box.column + box.columns; ++c) {
      const auto first = static_cast<std::size_t>(std::max(c - distance_, from) - from);
      const auto end = static_cast<std::size_t>(std::min(c + distance_ + 1, to) - from);
      box.is_near[box.at(c, row)] = before[end] > before[first] ? 1 : 0;
    }
    add_row(row - distance_, -1);
  }
}

void VoidFiller::cast_rays(const VoidRows& rows, Box& box) const {
  std::int64_t voids = 0;
  for (std::int64_t row = box.row; row < box.row + box.rows; ++row) {
    const char* const in_row = rows.voids[static_cast<std::size_t>(row - rows.first)];
    if (in_row == nullptr) continue;
    const char* const from = in_row + (box.column - rows.column);
    voids += std::count(from, from + box.columns, 1);
  }
  constexpr std::int64_t kManyVoids = 1 << 16;  // below, the rays cost less than the look
  if (voids > kManyVoids) look_for_ground(rows, box);
  box.values.resize(static_cast<std::size_t>(box.columns * box.rows));
  box.distance.assign(box.values.size(), 0);
  oneapi::tbb::this_task_arena::isolate([&] {
    oneapi::tbb::parallel_for(box.row, box.row + box.rows, [&](std::int64_t row) { cast_row(rows, box, row); });
  });
}

/// Every filled sample becomes the mean of eight around it, on a circle that no known sample lies in. Opposite ones
/// count together, so that a plane stays one where the circle leaves the raster.
void VoidFiller::smooth(Box& box) const {
  std::vector<double> next = box.values;
  for (const std::int64_t radius : kRadii) {
    oneapi::tbb::this_task_arena::isolate([&] {
      oneapi::tbb::parallel_for(box.row, box.row + box.rows, [&](std::int64_t row) {
        for (std::int64_t c = box.column; c < box.column + box.columns; ++c) {
          const std::size_t at = box.at(c, row);
          if (box.distance[at] == 0 || std::isnan(box.values[at])) continue;
          const std::int64_t s = std::min<std::int64_t>(radius, box.distance[at]);
          const auto d = std::max<std::int64_t>(1, std::lround(static_cast<double>(s) / kSqrt2));
          double sum = 0.0;
          int pairs = 0;
          const auto add = [&](std::int64_t dx, std::int64_t dy) {
            const bool inside = c + dx < box.column + box.columns && c - dx >= box.column && c + dx >= box.column &&
                                c - dx < box.column + box.columns && row + dy >= box.row &&
                                row + dy < box.row + box.rows && row - dy >= box.row && row - dy < box.row + box.rows;
            if (!inside) return;
            const double mean = (box.values[box.at(c + dx, row + dy)] + box.values[box.at(c - dx, row - dy)]) / 2.0;
            if (std::isnan(mean)) return;
            sum += mean;
            ++pairs;
          };
          add(s, 0);
          add(0, s);
          add(d, d);
          add(d, -d);
          next[at] = pairs > 0 ? sum / pairs : box.values[at];
        }
      });
    });
    std::swap(next, box.values);
  }
}

std::vector<std::int64_t> VoidFiller::fill(const ReadVoidRows& read, std::int64_t first, std::int64_t end,
                                           std::span<std::byte> samples) const {
  const StoreSample store = store_sample(info_.sample_type);
  const std::size_t size = size_bytes(info_.sample_type);
  std::vector<std::int64_t> filled(static_cast<std::size_t>(end - first), 0);
  for (Box box : boxes(read, first, end)) {
    cast_rays(read(std::max<std::int64_t>(first - reach(), 0), std::min(end + reach(), info_.height),
                   std::max<std::int64_t>(box.column - distance_, 0),
                   std::min(box.column + box.columns + distance_, info_.width)),
              box);
    smooth(box);
    for (std::int64_t row = first; row < end; ++row) {
      std::byte* const out = samples.data() + static_cast<std::size_t>((row - first) * info_.width) * size;
      for (std::int64_t c = box.first_filled; c < box.end_filled; ++c) {
        const std::size_t at = box.at(c, row);
        if (box.distance[at] == 0 || std::isnan(box.values[at])) continue;
        store(storable(box.values[at]), out + static_cast<std::size_t>(c) * size);
        ++filled[static_cast<std::size_t>(row - first)];
      }
    }
  }
  return filled;
}

/// The nearest number that the sample type holds and that means an elevation.
double VoidFiller::storable(double raw) const {
  const double nearest = nearest_sample(info_.sample_type, raw);
  const auto is_valid = [&](double value) { return !info_.is_nodata(value); };
  double up = nearest;
  double down = nearest;
  // Every step leaves one void value behind; the elevations that it was made of lie on both sides.
  for (std::size_t i = 0; i <= info_.void_values.size() + 1; ++i) {
    if (is_valid(up) && (!is_valid(down) || up - raw <= raw - down)) return up;
    if (is_valid(down)) return down;
    up = next_sample(info_.sample_type, up);
    down = previous_sample(info_.sample_type, down);
  }
  return nearest;
}

}  // namespace isohf
