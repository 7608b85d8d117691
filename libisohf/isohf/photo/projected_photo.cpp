#include "isohf/photo/projected_photo.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "isohf/base/assert.h"
#include "isohf/photo/srgb.h"

namespace isohf {
namespace {

constexpr std::int64_t kBlock = 64;
/// Blocks of this size are computed pixel by pixel.
constexpr std::int64_t kLeastBlock = 4;
/// Hides the last bits in which mathematical libraries differ.
constexpr double kGrain = 4096.0;
constexpr double kCheckedError = ProjectedPhoto::kTolerance / 2.0;
/// Places along a block's side that are compared with the projection.
constexpr int kProbes = 5;
/// Bytes of the photo that are held at once.
constexpr std::int64_t kHeldBytes = std::int64_t{2} << 20U;
/// Columns and spacing agree on a whole turn within this, in columns.
constexpr double kClosing = 0.01;

double rounded(double position) {
  return std::round(position * kGrain) / kGrain;
}

/// Integral of the hat function max(0, 1 - |t|) from 0 to t.
double hat_integral_from_middle(double t) {
  const double inside = std::clamp(t, -1.0, 1.0);
  return inside - 0.5 * inside * std::abs(inside);
}

/// The pixels below a box on one axis: it is `width` wide around `middle`, a point where that is 0.
struct Box {
  double middle = 0.0;
  double width = 0.0;

  [[nodiscard]] std::int64_t first() const { return static_cast<std::int64_t>(std::floor(middle - 0.5 * width)); }
  [[nodiscard]] std::int64_t last() const { return static_cast<std::int64_t>(std::floor(middle + 0.5 * width)) + 1; }
  /// Weight of pixel k in the mean of the linearly interpolated pixels.
  [[nodiscard]] double weight(std::int64_t k) const {
    constexpr double kPoint = 1e-6;
    const double from = middle - static_cast<double>(k);
    if (width < kPoint) return std::max(0.0, 1.0 - std::abs(from));
    return (hat_integral_from_middle(from + 0.5 * width) - hat_integral_from_middle(from - 0.5 * width)) / width;
  }
};

std::int64_t block_start(std::int64_t at) {
  const std::int64_t inside = ((at % kBlock) + kBlock) % kBlock;
  return at - inside;
}

void put_pixel(const double* light, int channels, std::uint8_t* out) {
  if (channels < 4) {
    for (int c = 0; c < channels; ++c) out[c] = srgb_from_linear(static_cast<float>(light[c]));
    return;
  }
  const double alpha = std::clamp(light[3], 0.0, 1.0);
  for (int c = 0; c < 3; ++c) out[c] = srgb_from_linear(static_cast<float>(alpha > 0.0 ? light[c] / alpha : 0.0));
  out[3] = static_cast<std::uint8_t>(alpha * 255.0 + 0.5);
}

}  // namespace

/// Places in the photo of a window's pixels, and of one column and row more.
struct ProjectedPhoto::Places {
  Window window;
  std::vector<double> u;
  std::vector<double> v;

  [[nodiscard]] std::size_t index(std::int64_t column, std::int64_t row) const {
    return static_cast<std::size_t>((row - window.row) * window.columns + (column - window.column));
  }
  /// The part of a block that lies in the window.
  [[nodiscard]] Window common(const Window& block) const {
    const std::int64_t column = std::max(block.column, window.column);
    const std::int64_t row = std::max(block.row, window.row);
    return {column, row, std::min(block.column + block.columns, window.column + window.columns) - column,
            std::min(block.row + block.rows, window.row + window.rows) - row};
  }
};

struct ProjectedPhoto::Footprint {
  bool is_somewhere = false;
  Box u;
  Box v;
};

/// Rows of the photo below a part of a window. Columns are counted on beyond a turn, or moved to the border.
class ProjectedPhoto::Loaded {
 public:
  Loaded(PhotoSource& photo, bool goes_round, std::int64_t first_column, std::int64_t last_column)
      : photo_(photo),
        goes_round_(goes_round),
        channels_(photo.info().channels),
        first_(inside(first_column)),
        columns_(inside(last_column) - first_ + 1) {}

  [[nodiscard]] std::int64_t rows_at_once() const {
    return std::max<std::int64_t>(1, kHeldBytes / (columns_ * channels_));
  }

  void load(std::int64_t row, std::int64_t rows) {
    row_ = row;
    pixels_.resize(static_cast<std::size_t>(columns_ * rows * channels_));
    const std::int64_t width = photo_.info().width;
    for (std::int64_t done = 0; done < columns_;) {
      const std::int64_t column = (((first_ + done) % width) + width) % width;
      const std::int64_t count = std::min(width - column, columns_ - done);
      if (count == columns_) return photo_.read_window({column, row, count, rows}, pixels_);
      run_.resize(static_cast<std::size_t>(count * rows * channels_));
      photo_.read_window({column, row, count, rows}, run_);
      for (std::int64_t r = 0; r < rows; ++r) {
        std::copy_n(run_.begin() + r * count * channels_, count * channels_,
                    pixels_.begin() + (r * columns_ + done) * channels_);
      }
      done += count;
    }
  }

  /// Adds a box's pixels of one row of the photo, `weight` for all of them together.
  void add_row(const Box& box, std::int64_t row, double weight, double* sums) const {
    const std::array<float, 256>& light = linear_from_srgb();
    const std::uint8_t* const line = pixels_.data() + (row - row_) * columns_ * channels_;
    for (std::int64_t k = box.first(); k <= box.last(); ++k) {
      const std::uint8_t* const pixel = line + (inside(k) - first_) * channels_;
      const double share = weight * box.weight(k);
      const double alpha = channels_ == 4 ? share * pixel[3] / 255.0 : share;
      for (std::int64_t c = 0; c < std::min<std::int64_t>(channels_, 3); ++c) {
        sums[c] += alpha * static_cast<double>(light[pixel[c]]);
      }
      if (channels_ == 4) sums[3] += alpha;
    }
  }

 private:
  [[nodiscard]] std::int64_t inside(std::int64_t column) const {
    return goes_round_ ? column : std::clamp<std::int64_t>(column, 0, photo_.info().width - 1);
  }

  PhotoSource& photo_;
  bool goes_round_;
  std::int64_t channels_;
  std::int64_t first_;
  std::int64_t columns_;
  std::int64_t row_ = 0;
  std::vector<std::uint8_t> pixels_;
  std::vector<std::uint8_t> run_;
};

ProjectedPhoto::ProjectedPhoto(PhotoSource& photo, const WarpPlace& place, const PhotoFrame& frame, std::int64_t width,
                               std::int64_t height)
    : photo_(photo),
      warp_(place),
      frame_(frame),
      info_(photo.info()),
      round_(place.columns_round()),
      goes_round_(std::abs(static_cast<double>(place.width) - round_) <= kClosing) {
  ISOHF_ASSERT(place.width == info_.width && place.height == info_.height);
  info_.width = width;
  info_.height = height;
  info_.georeference.reset();
}

SourcePosition ProjectedPhoto::at(double column, double row) const {
  return warp_.source_from_world(
      {frame_.first_pixel_x + column * frame_.spacing_x, frame_.first_pixel_z + row * frame_.spacing_z});
}

SourcePosition ProjectedPhoto::at(double column, double row, double near_u) const {
  SourcePosition position = at(column, row);
  position.u = near_u + std::remainder(position.u - near_u, round_);
  return position;
}

void ProjectedPhoto::fill(const Window& block, Places& places) const {
  const Window common = places.common(block);
  if (common.columns <= 0 || common.rows <= 0) return;
  if (block.columns <= kLeastBlock) {
    for (std::int64_t row = common.row; row < common.row + common.rows; ++row) {
      for (std::int64_t column = common.column; column < common.column + common.columns; ++column) {
        const SourcePosition position = at(static_cast<double>(column), static_cast<double>(row));
        places.u[places.index(column, row)] = rounded(position.u);
        places.v[places.index(column, row)] = rounded(position.v);
      }
    }
    return;
  }
  // A corner is the next block's first pixel: blocks meet without a step.
  const auto size = static_cast<double>(block.columns);
  const auto column_at = [&](double s) { return static_cast<double>(block.column) + s * size; };
  const auto row_at = [&](double t) { return static_cast<double>(block.row) + t * size; };
  const double near_u = at(column_at(0.5), row_at(0.5)).u;
  std::array<SourcePosition, 4> corners;
  for (std::size_t i = 0; i < 4; ++i) {
    corners[i] = at(column_at(i % 2 == 0 ? 0.0 : 1.0), row_at(i / 2 == 0 ? 0.0 : 1.0), near_u);
    corners[i] = {rounded(corners[i].u), rounded(corners[i].v)};
  }
  const auto between = [&](double s, double t) {
    const auto mix = [&](double a, double b, double c, double d) {
      const double north = a + (b - a) * s;
      const double south = c + (d - c) * s;
      return north + (south - north) * t;
    };
    return SourcePosition{mix(corners[0].u, corners[1].u, corners[2].u, corners[3].u),
                          mix(corners[0].v, corners[1].v, corners[2].v, corners[3].v)};
  };
  bool is_close = true;
  for (int i = 0; is_close && i < kProbes * kProbes; ++i) {
    const int column = i % kProbes;
    const int row = i / kProbes;
    const double s = static_cast<double>(column) / (kProbes - 1);
    const double t = static_cast<double>(row) / (kProbes - 1);
    const SourcePosition exact = at(column_at(s), row_at(t), near_u);
    const SourcePosition found = between(s, t);
    // False as well where either is NaN.
    is_close = std::abs(found.u - exact.u) <= kCheckedError && std::abs(found.v - exact.v) <= kCheckedError;
  }
  if (!is_close) {
    const std::int64_t half = block.columns / 2;
    for (const std::int64_t row : {block.row, block.row + half}) {
      for (const std::int64_t column : {block.column, block.column + half}) fill({column, row, half, half}, places);
    }
    return;
  }
  for (std::int64_t row = common.row; row < common.row + common.rows; ++row) {
    const double t = static_cast<double>(row - block.row) / size;
    for (std::int64_t column = common.column; column < common.column + common.columns; ++column) {
      const SourcePosition position = between(static_cast<double>(column - block.column) / size, t);
      places.u[places.index(column, row)] = position.u;
      places.v[places.index(column, row)] = position.v;
    }
  }
}

ProjectedPhoto::Places ProjectedPhoto::places_of(const Window& window) const {
  Places places{{window.column, window.row, window.columns + 1, window.rows + 1}, {}, {}};
  const auto count = static_cast<std::size_t>(places.window.columns * places.window.rows);
  places.u.resize(count);
  places.v.resize(count);
  for (std::int64_t row = block_start(window.row); row <= window.row + window.rows; row += kBlock) {
    for (std::int64_t column = block_start(window.column); column <= window.column + window.columns; column += kBlock) {
      fill({column, row, kBlock, kBlock}, places);
    }
  }
  return places;
}

ProjectedPhoto::Footprint ProjectedPhoto::footprint(const Places& places, std::int64_t column, std::int64_t row) const {
  const std::size_t here = places.index(column, row);
  const std::size_t east = here + 1;
  const std::size_t south = places.index(column, row + 1);
  if (std::isnan(places.u[here]) || std::isnan(places.v[here])) return {};
  const auto length = [](double along, double across) {
    const double both = std::hypot(along, across);
    return std::isnan(both) ? 1.0 : both;
  };
  const double width = length(std::remainder(places.u[east] - places.u[here], round_),
                              std::remainder(places.u[south] - places.u[here], round_));
  const double height = length(places.v[east] - places.v[here], places.v[south] - places.v[here]);
  // Farther out all places are alike: no pixel but the border's is near.
  const double middle = static_cast<double>(warp_.place().width - 1) / 2.0;
  const double u = goes_round_ ? places.u[here] : middle + std::remainder(places.u[here] - middle, round_);
  const auto rows = static_cast<double>(warp_.place().height);
  return {true,
          {u, std::clamp(width - 1.0, 0.0, round_)},
          {std::clamp(places.v[here], -rows, 2.0 * rows), std::clamp(height - 1.0, 0.0, rows)}};
}

void ProjectedPhoto::average(const Window& part, const Places& places, std::vector<double>& sums) {
  const auto channels = static_cast<std::size_t>(info_.channels);
  const std::int64_t last_row = warp_.place().height - 1;
  const auto row_of = [&](std::int64_t k) { return std::clamp<std::int64_t>(k, 0, last_row); };
  std::vector<Footprint> footprints;
  footprints.reserve(static_cast<std::size_t>(part.columns * part.rows));
  std::array<std::int64_t, 4> bounds = {INT64_MAX, INT64_MIN, INT64_MAX, INT64_MIN};
  for (std::int64_t row = part.row; row < part.row + part.rows; ++row) {
    for (std::int64_t column = part.column; column < part.column + part.columns; ++column) {
      const Footprint& below = footprints.emplace_back(footprint(places, column, row));
      if (!below.is_somewhere) continue;
      bounds = {std::min(bounds[0], below.u.first()), std::max(bounds[1], below.u.last()),
                std::min(bounds[2], row_of(below.v.first())), std::max(bounds[3], row_of(below.v.last()))};
    }
  }
  sums.assign(footprints.size() * channels, 0.0);
  if (bounds[0] > bounds[1]) return;
  Loaded loaded(photo_, goes_round_, bounds[0], bounds[1]);
  for (std::int64_t row = bounds[2]; row <= bounds[3];) {
    const std::int64_t end = row + std::min(loaded.rows_at_once(), bounds[3] - row + 1);
    loaded.load(row, end - row);
    for (std::size_t i = 0; i < footprints.size(); ++i) {
      const Footprint& below = footprints[i];
      if (!below.is_somewhere || row_of(below.v.last()) < row || row_of(below.v.first()) >= end) continue;
      for (std::int64_t k = below.v.first(); k <= below.v.last(); ++k) {
        const std::int64_t at_row = row_of(k);
        if (at_row < row || at_row >= end) continue;
        loaded.add_row(below.u, at_row, below.v.weight(k), sums.data() + i * channels);
      }
    }
    row = end;
  }
}

void ProjectedPhoto::read_window(const Window& window, std::span<std::uint8_t> samples) {
  const auto channels = static_cast<std::size_t>(info_.channels);
  ISOHF_ASSERT(samples.size() == static_cast<std::size_t>(window.columns * window.rows) * channels);
  const Places places = places_of(window);
  std::vector<double> sums;
  for (std::int64_t row = block_start(window.row); row < window.row + window.rows; row += kBlock) {
    for (std::int64_t column = block_start(window.column); column < window.column + window.columns; column += kBlock) {
      Window part = places.common({column, row, kBlock, kBlock});
      part.columns = std::min(part.columns, window.column + window.columns - part.column);
      part.rows = std::min(part.rows, window.row + window.rows - part.row);
      average(part, places, sums);
      const double* light = sums.data();
      for (std::int64_t r = part.row; r < part.row + part.rows; ++r) {
        const std::int64_t first = (r - window.row) * window.columns + part.column - window.column;
        std::uint8_t* out = samples.data() + static_cast<std::size_t>(first) * channels;
        for (std::int64_t c = 0; c < part.columns; ++c, light += channels, out += channels) {
          put_pixel(light, info_.channels, out);
        }
      }
    }
  }
}

bool ProjectedPhoto::shows(const Window& window) const {
  const auto middle = static_cast<double>(warp_.place().width - 1) / 2.0;
  const auto half_width = static_cast<double>(warp_.place().width) / 2.0;
  const auto rows = static_cast<double>(warp_.place().height);
  for (std::int64_t row = window.row; row < window.row + window.rows; row += kBlock) {
    const Places places =
        places_of({window.column, row, window.columns, std::min(kBlock, window.row + window.rows - row)});
    for (std::size_t i = 0; i < places.u.size(); ++i) {
      const bool in_columns = std::abs(std::remainder(places.u[i] - middle, round_)) <= half_width;
      if (in_columns && places.v[i] >= -0.5 && places.v[i] <= rows - 0.5) return true;
    }
  }
  return false;
}

}  // namespace isohf
