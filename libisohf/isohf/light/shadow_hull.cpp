#include "isohf/light/shadow_hull.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "isohf/base/bytes.h"

namespace isohf {
namespace {

/// Stands for the height of a void; no elevation is as large.
constexpr float kFar = 3e38F;

/// Vertices that are looked at together.
constexpr int kBlock = 16;

/// A row of heights, prepared for both directions.
struct RowHeights {
  std::vector<float> heights;       ///< by column; -kFar where void
  std::vector<std::uint8_t> peaks;  ///< 1 where a vertex lies above the line between its neighbours, or may

  template <typename Sample, typename Height>
  void set(const Sample* samples, int columns, int last, Height height) {
    heights.resize(static_cast<std::size_t>(columns));
    peaks.assign(static_cast<std::size_t>(columns), 1);
    for (int c = 0; c < columns; ++c) heights[static_cast<std::size_t>(c)] = height(samples[c]);
    // The outermost vertices have no neighbours on one side, and slid ones stand nearer than others.
    const float* const here = heights.data();
    std::uint8_t* const out = peaks.data();
    for (int c = 3; c <= last - 2; ++c) out[c] = here[c - 1] + here[c + 1] >= 2.0F * here[c] ? 0 : 1;
  }
};

/// Finds a row's casters from the edge where the light leaves backwards. A vertex matters behind that edge only where
/// height + position * fall_min is above that of all vertices nearer to it, and where it is a peak. Both are tested for
/// a block of vertices at once, in single precision and in favour of the vertex; the few that are left are compared
/// exactly.
class CasterSearch {
 public:
  CasterSearch(const TileShape& shape, LightTravel travel, double fall_min)
      : shape_(shape), travel_(travel), fall_min_(fall_min) {
    for (const int parity : {0, 1}) {
      auto& rises = rises_[static_cast<std::size_t>(parity)];
      rises.resize(static_cast<std::size_t>(shape.columns()));
      for (int column = 0; column < shape.columns(); ++column) {
        rises[static_cast<std::size_t>(column)] = static_cast<float>(position(column, parity) * fall_min);
      }
    }
    slack_ = static_cast<float>(half_steps_across(shape) * fall_min * 0x1p-22);
    rows_.starts.reserve(static_cast<std::size_t>(visible_rows(shape)) + 1);
    rows_.starts.push_back(0);
  }

  /// Appends the casters of the next row, nearest first.
  void add(const RowHeights& row_heights, int row) {
    heights_ = row_heights.heights.data();
    peaks_ = row_heights.peaks.data();
    row_ = row;
    first_ = rows_.casters.size();
    best_ = -HUGE_VAL;
    // The vertex on the edge where light leaves is the next tile's.
    const int last = last_visible_column(shape_, row);
    for (int done = 0; done < last - 1; done += kBlock) {
      const int width = std::min(kBlock, last - 1 - done);
      const int begin = travel_ == LightTravel::kEastward ? last - done - width : 2 + done;
      if (width == kBlock) {
        consider_block(begin);
        continue;
      }
      for (int i = 0; i < width; ++i) consider(travel_ == LightTravel::kEastward ? begin + width - 1 - i : begin + i);
    }
    rows_.starts.push_back(static_cast<std::uint32_t>(rows_.casters.size()));
  }

  [[nodiscard]] CasterRows take() { return std::move(rows_); }

 private:
  [[nodiscard]] int position(int column, int row) const {
    const int x = object_x(shape_.columns(), column, row);
    return travel_ == LightTravel::kEastward ? x : half_steps_across(shape_) - x;
  }

  /// Eight flags of a byte each in a word, the first lowest.
  static std::array<std::uint64_t, kBlock / 8> words_of(const void* flags) {
    std::array<std::uint64_t, kBlock / 8> words;
    for (std::size_t i = 0; i < words.size(); ++i) {
      words[i] = load_little<std::uint64_t>(static_cast<const std::byte*>(flags) + 8 * i);
    }
    return words;
  }

  void consider_block(int begin) {
    const std::array<std::uint64_t, kBlock / 8> flags = words_of(peaks_ + begin);
    if ((flags[0] | flags[1]) == 0) return;
    const float* const rises = rises_[static_cast<std::size_t>(row_ % 2)].data() + begin;
    const float* const heights = heights_ + begin;
    // 2^-22: two roundings of the sum, and of best_ in single precision.
    const float best = static_cast<float>(best_);
    const float bar = best - slack_ - std::abs(best) * 0x1p-22F;
    std::array<std::uint8_t, kBlock> high;
    for (std::size_t i = 0; i < kBlock; ++i) high[i] = heights[i] + rises[i] > bar ? 1 : 0;
    const std::array<std::uint64_t, kBlock / 8> high_flags = words_of(high.data());
    const bool east = travel_ == LightTravel::kEastward;
    for (std::size_t k = 0; k < flags.size(); ++k) {
      const std::size_t word = east ? flags.size() - 1 - k : k;
      for (std::uint64_t left = flags[word] & high_flags[word]; left != 0;) {
        const int bit = east ? 63 - std::countl_zero(left) : std::countr_zero(left);
        left &= ~(std::uint64_t{1} << static_cast<unsigned>(bit));
        consider(begin + static_cast<int>(word) * 8 + bit / 8);
      }
    }
  }

  void consider(int column) {
    const double height = static_cast<double>(heights_[column]);
    if (height <= -static_cast<double>(kFar)) return;
    const int place = position(column, row_);
    const double value = height + place * fall_min_;
    if (!(value > best_)) return;
    best_ = value;
    const ShadowCaster next{half_steps_across(shape_) - place, height};
    // Outwards the hull rises ever less.
    std::vector<ShadowCaster>& out = rows_.casters;
    while (out.size() >= first_ + 2) {
      const ShadowCaster& far = out.back();
      const ShadowCaster& near = out[out.size() - 2];
      if ((far.height - near.height) * static_cast<double>(next.distance - far.distance) >
          (next.height - far.height) * static_cast<double>(far.distance - near.distance)) {
        break;
      }
      out.pop_back();
    }
    out.push_back(next);
  }

  const TileShape& shape_;
  LightTravel travel_;
  double fall_min_;
  std::array<std::vector<float>, 2> rises_;  ///< of even and odd rows, by column: position * fall_min
  float slack_ = 0.0F;
  CasterRows rows_;
  const float* heights_ = nullptr;
  const std::uint8_t* peaks_ = nullptr;
  int row_ = 0;
  std::size_t first_ = 0;
  double best_ = 0.0;
};

template <typename Sample, typename Height>
TileCasters casters_of(const TileShape& shape, View2D<const Sample> samples, double fall_min, Height height) {
  CasterSearch eastward(shape, LightTravel::kEastward, fall_min);
  CasterSearch westward(shape, LightTravel::kWestward, fall_min);
  RowHeights heights;
  for (int row = 1; row <= visible_rows(shape); ++row) {
    heights.set(samples.row(row), shape.columns(), last_visible_column(shape, row), height);
    eastward.add(heights, row);
    westward.add(heights, row);
  }
  return {eastward.take(), westward.take()};
}

}  // namespace

void ShadowHull::push(std::int64_t position, double height) {
  // Overtopped at fall_min, hence at every larger fall. What lies deeper is not: the hull rises faster than fall_min.
  while (!points_.empty() &&
         points_.back().height - height <= static_cast<double>(position - points_.back().position) * fall_min_) {
    points_.pop_back();
  }
  while (points_.size() >= 2) {
    const Point& near = points_.back();
    const Point& far = points_[points_.size() - 2];
    const double rise = near.height - height;
    const double run = static_cast<double>(position - near.position);
    const double rise_beyond = far.height - near.height;
    const double run_beyond = static_cast<double>(near.position - far.position);
    if (rise * run_beyond > rise_beyond * run) break;
    points_.pop_back();
  }
  points_.push_back({position, height});
}

void ShadowHull::casters_at(std::int64_t position, std::vector<ShadowCaster>& out) const {
  for (std::size_t i = points_.size(); i-- > 0;) out.push_back({position - points_[i].position, points_[i].height});
}

TileCasters tile_casters(const TileShape& shape, View2D<const std::uint16_t> codes, std::uint16_t void_code,
                         double fall_min) {
  return casters_of(shape, codes, fall_min,
                    [void_code](std::uint16_t code) { return code == void_code ? -kFar : static_cast<float>(code); });
}

TileCasters tile_casters(const TileShape& shape, View2D<const float> heights, double fall_min) {
  return casters_of(shape, heights, fall_min, [](float height) { return std::abs(height) < kFar ? height : -kFar; });
}

CasterRows pass_on_casters(const TileShape& shape, const CasterRows& entering, const CasterRows& own, double fall_min) {
  CasterRows out;
  out.starts.reserve(static_cast<std::size_t>(visible_rows(shape)) + 1);
  out.starts.push_back(0);
  const std::int64_t across = half_steps_across(shape);
  ShadowHull hull(fall_min);
  for (int row = 1; row <= visible_rows(shape); ++row) {
    hull.clear();
    // Positions count from the edge where the light enters, farthest first.
    const auto before = entering.row(row);
    for (auto caster = before.rbegin(); caster != before.rend(); ++caster) hull.push(-caster->distance, caster->height);
    const auto inside = own.row(row);
    for (auto caster = inside.rbegin(); caster != inside.rend(); ++caster) {
      hull.push(across - caster->distance, caster->height);
    }
    hull.casters_at(across, out.casters);
    out.starts.push_back(static_cast<std::uint32_t>(out.casters.size()));
  }
  return out;
}

CasterRows beyond_padding(const CasterRows& casters) {
  CasterRows out;
  out.starts.push_back(0);
  for (int row = 1; row < static_cast<int>(casters.starts.size()); ++row) {
    for (const ShadowCaster& caster : casters.row(row)) {
      if (caster.distance > padding_distance(row)) out.casters.push_back(caster);
    }
    out.starts.push_back(static_cast<std::uint32_t>(out.casters.size()));
  }
  return out;
}

CasterRows no_casters(const TileShape& shape) {
  CasterRows none;
  none.starts.assign(static_cast<std::size_t>(visible_rows(shape)) + 1, 0);
  return none;
}

}  // namespace isohf
