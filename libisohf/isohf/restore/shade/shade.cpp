#include "isohf/shade.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <deque>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "isohf/archive/planes/archive_planes.h"
#include "isohf/archive/textures/texture_reader.h"
#include "isohf/archive/tile/quantise.h"
#include "isohf/base/arena.h"
#include "isohf/base/handed_in.h"
#include "isohf/base/memory/memory_budget.h"
#include "isohf/base/simd.h"
#include "isohf/error.h"
#include "isohf/lattice/barycentric.h"
#include "isohf/light/light.h"
#include "isohf/light/relief.h"
#include "isohf/light/shadow_sweep.h"
#include "isohf/photo/srgb.h"
#include "isohf/restore/ground_scale.h"
#include "isohf/restore/point_sampler.h"
#include "isohf/restore/shade/hillshade.h"

namespace isohf {
namespace {

/// The most points in a pixel, either way.
constexpr std::int64_t kMaxPointsPerPixel = 4;
/// Vertices in a pixel, either way, that a coarse plane must have to be drawn: with two its picture can hardly be told
/// from that of all vertices (decision 41).
constexpr double kVerticesPerPixel = 2.0;
constexpr std::size_t kMaxRowBytes = std::size_t{64} << 20U;
/// Pixels that are drawn together, of a row and of so many rows.
constexpr std::int64_t kBlock = 2048;
constexpr std::int64_t kLeastBlock = 64;
constexpr std::int64_t kBlockRows = 16;
/// What a picture's file takes, in rows of it, and besides (measured).
constexpr double kRowsOfFile = 4.0;
constexpr double kFileBytes = 12.0e6;
/// Of a point, for rows of either kind: between which vertices it lies.
constexpr double kPointBytes = 18.0;

/// The colours of an archive's textures, for places that lie a given distance apart.
class ShadeTexture {
 public:
  /// step_x, step_z  world units between the places that colours are asked for. Throws as TextureReader does.
  ShadeTexture(const ArchiveReader& archive, double step_x, double step_z);

  /// Linear light, and how much of the ground it covers.
  struct Colour {
    Light light{};
    float alpha = 0.0F;
  };

  /// Texels of a tile, either way: from the mip level whose texels are no larger than the steps.
  [[nodiscard]] std::size_t side() const { return static_cast<std::size_t>(reader_.info().level_size(level_)); }
  /// [side][side] RGBA; zeros where the tile has no texture. Any thread.
  [[nodiscard]] std::vector<std::uint8_t> read(TileIndex tile) const;

  /// A place between two texels, or two rows of them.
  struct Place {
    std::size_t first;
    float share;
  };
  /// along  0...1 over a tile
  [[nodiscard]] Place place(double along) const;
  /// Interpolated linearly between two rows of a tile's texels; nothing where it has no texture.
  [[nodiscard]] static Colour colour(const std::uint8_t* north, const std::uint8_t* south, float down, Place across);

 private:
  TextureReader reader_;
  int level_ = 0;
};

ShadeTexture::ShadeTexture(const ArchiveReader& archive, double step_x, double step_z) : reader_(archive) {
  const TileGrid& grid = archive.grid();
  const double texels = std::min(step_x / grid.extent_x(), step_z / grid.extent_z()) * (reader_.info().size - 1);
  const double last = reader_.info().levels - 1;
  level_ = static_cast<int>(std::clamp(std::floor(std::log2(std::max(texels, 1e-9)) + 1e-6), 0.0, last));
}

std::vector<std::uint8_t> ShadeTexture::read(TileIndex tile) const {
  if (!reader_.has(tile)) return std::vector<std::uint8_t>(4 * side() * side());
  return reader_.read_rgba(tile, level_).samples;
}

ShadeTexture::Place ShadeTexture::place(double along) const {
  // docs/archive_format.md, "Textures": one texture coordinate for all levels.
  const double u = (0.5 + (reader_.info().size - 1) * along) / reader_.info().size;
  const auto texels = static_cast<double>(side());
  const double at = std::clamp(u * texels - 0.5, 0.0, texels - 1.0);
  const auto first = std::min(static_cast<std::size_t>(at), side() - 2);
  return {first, static_cast<float>(at - static_cast<double>(first))};
}

ShadeTexture::Colour ShadeTexture::colour(const std::uint8_t* north, const std::uint8_t* south, float down,
                                          Place across) {
  Colour colour;
  for (int j = 0; j < 2; ++j) {
    for (std::size_t i = 0; i < 2; ++i) {
      const std::uint8_t* const texel = (j == 0 ? north : south) + 4 * (across.first + i);
      const float alpha = static_cast<float>(texel[3]) / 255.0F;
      const float weight = (i == 0 ? 1.0F - across.share : across.share) * (j == 0 ? 1.0F - down : down) * alpha;
      for (std::size_t c = 0; c < 3; ++c) colour.light[c] += weight * linear_from_srgb()[texel[c]];
      colour.alpha += weight;
    }
  }
  if (colour.alpha > 0.0F) {
    for (float& value : colour.light) value /= colour.alpha;
  }
  return colour;
}

/// Points along one axis: evenly over the picture, `per_pixel` in each pixel.
class PixelAxis {
 public:
  PixelAxis(double start, double end, std::int64_t pixels, double lattice_step) : start_(start) {
    const double pixel = (end - start) / static_cast<double>(pixels);
    per_pixel_ = static_cast<std::int64_t>(
        std::clamp(std::round(pixel / lattice_step), 1.0, static_cast<double>(kMaxPointsPerPixel)));
    count_ = pixels * per_pixel_;
    step_ = (end - start) / static_cast<double>(count_);
  }

  [[nodiscard]] std::int64_t per_pixel() const { return per_pixel_; }
  [[nodiscard]] std::int64_t count() const { return count_; }
  [[nodiscard]] double step() const { return step_; }
  [[nodiscard]] double pixel() const { return step_ * static_cast<double>(per_pixel_); }
  [[nodiscard]] double world(std::int64_t point) const { return start_ + (static_cast<double>(point) + 0.5) * step_; }
  /// The first point at or behind a world coordinate; count() where there is none.
  [[nodiscard]] std::int64_t first_from(double world) const {
    const double point = std::ceil((world - start_) / step_ - 0.5);
    return static_cast<std::int64_t>(std::clamp(point, 0.0, static_cast<double>(count_)));
  }

 private:
  double start_;
  double step_ = 1.0;
  std::int64_t per_pixel_ = 1;
  std::int64_t count_ = 0;
};

/// A run of points.
struct Run {
  std::int64_t first = 0;
  std::int64_t last = 0;  ///< behind the last
};

constexpr float kVoid = std::numeric_limits<float>::quiet_NaN();

/// Heights of codes, all at once; returns how many are void.
ISOHF_KERNEL int heights_of_codes(const std::uint16_t* codes, int count, int void_code, float offset, float scale,
                                  float* __restrict heights) {
  int voids = 0;
  for (int i = 0; i < count; ++i) {
    const int code = codes[i];
    const float height = offset + scale * static_cast<float>(code);
    heights[i] = code == void_code ? kVoid : height;
    voids += code == void_code ? 1 : 0;
  }
  return voids;
}

/// A lattice row at points: between two vertices each.
ISOHF_KERNEL void between_vertices(const float* row, const std::int32_t* west, const std::int32_t* east,
                                   const float* share, int count, float* __restrict out) {
  for (int i = 0; i < count; ++i) {
    const float from = row[west[i]];
    out[i] = from + share[i] * (row[east[i]] - from);
  }
}

ISOHF_KERNEL void between_rows(const float* north, const float* south, float share, int count, float* __restrict out) {
  for (int i = 0; i < count; ++i) out[i] = north[i] + share * (south[i] - north[i]);
}

/// The same, and slopes there, heights per half step. per_half_step is 1 over the half steps between the vertices.
ISOHF_KERNEL void between_vertices_with_slopes(const float* row, const std::int32_t* west, const std::int32_t* east,
                                               const float* share, const float* per_half_step, int count,
                                               float* __restrict out, float* __restrict slopes) {
  for (int i = 0; i < count; ++i) {
    const float from = row[west[i]];
    const float rise = row[east[i]] - from;
    out[i] = from + share[i] * rise;
    slopes[i] = per_half_step[i] * rise;
  }
}

/// How the sun stands over the triangles between an odd row and an even one. All in heights.
struct FacetSun {
  float along;   ///< towards the sun for one half step East
  float across;  ///< and for one row, from the odd to the even one
  float fall;    ///< of the light from the sun's middle
  float gain;    ///< part of the sun that one more unit of rise hides
};

/// The part of the sun that triangles hide from their own points, if it is more than what is hidden already.
///
///   odd row   0-------2     u: half steps from the vertex of the odd row to the West
///              \  A  / \    A: |u - 1| <= 1 - down, has its base on the odd row
///   even row    1---/-B-3   B: has its base on the even row
///
/// down  0...1 from the odd row to the even one
ISOHF_KERNEL void hide_by_facets(const float* odd, const float* even, const float* odd_slope, const float* even_slope,
                                 const float* from_vertex, int count, float down, FacetSun sun,
                                 float* __restrict hidden) {
  for (int i = 0; i < count; ++i) {
    const float u = from_vertex[i];
    const float off = u > 1.0F ? u - 1.0F : 1.0F - u;
    const bool has_odd_base = off <= 1.0F - down;
    const float to_odd_apex = u < 1.0F ? -u : 2.0F - u;
    const float to_apex = has_odd_base ? 1.0F - u : to_odd_apex;
    const float base = has_odd_base ? odd_slope[i] : even_slope[i];
    const float between = even[i] - odd[i] + (even_slope[i] - odd_slope[i]) * to_apex;
    const float rise = sun.along * base + sun.across * between;
    const float part = 0.5F + (rise - sun.fall) * sun.gain;
    hidden[i] = part > hidden[i] ? part : hidden[i];
  }
}

/// The share of the sun that is seen where so much of it is hidden.
ISOHF_KERNEL void share_of_hidden(float* __restrict values, int count) {
  for (int i = 0; i < count; ++i) {
    float share = 1.0F - values[i];
    share = share > 0.0F ? share : 0.0F;
    values[i] = share < 1.0F ? share : 1.0F;
  }
}

/// Between which vertices of a row of tiles each column of points lies, and how far from the first to the second: on
/// odd rows and on even ones (conventions.md, "A tile").
class PointColumns {
 public:
  PointColumns(const TileGrid& grid, const PixelAxis& axis)
      : axis_(axis), sigma_x_(grid.sigma_x()), half_steps_(2.0 * grid.shape().cell_columns()) {
    const int cells = grid.shape().cell_columns();
    for (std::int64_t tile = 0; tile < grid.tile_columns(); ++tile) {
      starts_.push_back(west_[0].size());
      const std::int64_t end = tile + 1 == grid.tile_columns()
                                   ? axis.count()
                                   : axis.first_from(static_cast<double>(tile + 1) * grid.extent_x());
      while (static_cast<std::int64_t>(west_[0].size()) < end) {
        const double x = object_x(static_cast<std::size_t>(tile), west_[0].size());
        const double inside = std::clamp(x, 0.0, 2.0 * cells);
        from_vertex_.push_back(static_cast<float>(inside - 2.0 * std::floor(inside / 2.0)));
        per_half_step_[1].push_back(0.5F);
        per_half_step_[0].push_back(inside < 1.0 || inside >= 2.0 * cells - 1.0 ? 1.0F : 0.5F);
        add(1, 1.0 + inside / 2.0);
        // Column 1 of even rows lies at 0, then come odd half steps, and column C-2 lies on the edge again.
        add(0, inside < 1.0                 ? 1.0 + inside
               : inside < 2.0 * cells - 1.0 ? 2.0 + (inside - 1.0) / 2.0
                                            : cells + 1.0 + (inside - (2.0 * cells - 1.0)));
      }
    }
    starts_.push_back(west_[0].size());
  }

  [[nodiscard]] std::size_t count() const { return starts_.back(); }
  [[nodiscard]] double object_x(std::size_t tile, std::size_t point) const {
    return axis_.world(static_cast<std::int64_t>(point)) / sigma_x_ - static_cast<double>(tile) * half_steps_;
  }
  /// The tiles under some of them.
  [[nodiscard]] Run tiles_under(const Run& points) const {
    const auto tile_of = [this](std::int64_t point) {
      return std::upper_bound(starts_.begin(), starts_.end(), static_cast<std::size_t>(point)) - starts_.begin() - 1;
    };
    return {tile_of(points.first), tile_of(points.last - 1) + 1};
  }
  /// Those of `points` that lie on a tile.
  [[nodiscard]] Run of_tile(std::int64_t tile, const Run& points) const {
    const auto start = [this](std::int64_t of) {
      return static_cast<std::int64_t>(starts_[static_cast<std::size_t>(of)]);
    };
    return {std::max(points.first, start(tile)), std::min(points.last, start(tile + 1))};
  }

  /// Values of a stored row of tiles_under(points) at these points, and their slopes per half step; null: not wanted.
  void read(const float* values, int row, int stored_columns, const Run& points, float* out, float* slopes) const {
    const auto parity = static_cast<std::size_t>(row % 2);
    const Run tiles = tiles_under(points);
    for (std::int64_t tile = tiles.first; tile < tiles.last; ++tile, values += stored_columns) {
      const Run here = of_tile(tile, points);
      const auto first = static_cast<std::size_t>(here.first);
      const auto count = static_cast<int>(here.last - here.first);
      const std::int64_t place = here.first - points.first;
      const std::int32_t* const west = west_[parity].data() + first;
      const std::int32_t* const east = east_[parity].data() + first;
      const float* const share = share_[parity].data() + first;
      if (slopes == nullptr) {
        vectorised<between_vertices>(values, west, east, share, count, out + place);
      } else {
        vectorised<between_vertices_with_slopes>(values, west, east, share, per_half_step_[parity].data() + first,
                                                 count, out + place, slopes + place);
      }
    }
  }
  /// Half steps of points from the nearest vertex of an odd row to the West.
  [[nodiscard]] const float* from_vertex(const Run& points) const { return from_vertex_.data() + points.first; }

 private:
  /// A void beyond a vertex that a point lies on takes nothing from it.
  void add(std::size_t parity, double place) {
    double vertex = std::floor(place);
    double share = place - vertex;
    if (share > 1.0 - kOnVertex) vertex += 1.0, share = 0.0;
    if (share < kOnVertex) share = 0.0;
    west_[parity].push_back(static_cast<std::int32_t>(vertex));
    east_[parity].push_back(static_cast<std::int32_t>(vertex) + (share > 0.0 ? 1 : 0));
    share_[parity].push_back(static_cast<float>(share));
  }

  static constexpr double kOnVertex = 1e-6;
  PixelAxis axis_;
  double sigma_x_;
  double half_steps_;
  std::vector<std::size_t> starts_;  ///< [tiles + 1] their first points
  std::vector<std::int32_t> west_[2];
  std::vector<std::int32_t> east_[2];
  std::vector<float> share_[2];
  std::vector<float> per_half_step_[2];  ///< 1 over the half steps between both vertices
  std::vector<float> from_vertex_;
};

/// A row of the picture before it is shaded: sums over points until its last point is there, means then.
struct PixelRow {
  std::vector<float> heights;  ///< [-1...width], world units above the datum; NaN where void
  std::vector<float> shares;   ///< of the sun that is seen
  std::vector<float> cover;    ///< points that have a height; empty with one point a pixel
  std::vector<float> photo;    ///< [4 * width] light times opacity, opacity
};

constexpr std::int64_t kMostPixels = 1 << 20;  ///< of a side
constexpr std::int64_t kDefaultPixels = 2048;
bool casts_shadows(const ShadeOptions& options) {
  return options.kind == ShadeKind::kShadowMask || (options.kind == ShadeKind::kPicture && options.shadows);
}

/// Throws Error{kInvalidArgument} for options that are out of their ranges.
void require(const ShadeOptions& options, const GridSize& size) {
  const auto check = [](bool holds, const char* what) {
    if (!holds) throw Error(ErrorCode::kInvalidArgument, what);
  };
  require_known("the kind", options.kind, ShadeKind::kShadowMask);
  require_known("the palette", options.palette.value_or(ShadePalette::kElevation), ShadePalette::kMars);
  check(size.first >= 1 && size.second >= 1 && size.first <= kMostPixels && size.second <= kMostPixels,
        "the picture must have 1 to 2^20 pixels a side");
  check(std::isfinite(options.sun_azimuth_deg), "the sun's azimuth must be a number of degrees");
  check(options.sun_elevation_deg > 0.0 && options.sun_elevation_deg <= 90.0 &&
            (options.sun_elevation_deg < 90.0 || !casts_shadows(options)),
        "the sun must stand above 0 and below 90 degrees, or at 90 where it casts no shadows");
  check(options.exaggeration > 0.0 && std::isfinite(options.exaggeration), "the exaggeration must be above 0");
  check(!options.softness || (*options.softness > 0.0 && std::isfinite(*options.softness)),
        "the shadow's softness must be above 0");
}

class ShadeRenderer {
 public:
  ShadeRenderer(const ArchiveReader& archive, const ShadeOptions& request, const GridSize& size, const Job& job)
      : archive_(archive),
        request_(request),
        job_(job),
        samples_(shade_samples(request)),
        x_(archive.metadata().valid.x0, archive.metadata().valid.x1, size.first, 2.0 * archive.grid().sigma_x()),
        z_(archive.metadata().valid.z0, archive.metadata().valid.z1, size.second, archive.grid().sigma_z()),
        plane_(request.texture
                   ? 0
                   : planes_of(archive.metadata())
                         .plane_for_spacing(x_.pixel() / kVerticesPerPixel, z_.pixel() / kVerticesPerPixel)),
        read_tile_(tiles_of(archive, plane_)),
        size_(size),
        width_(static_cast<std::size_t>(size.first)),
        grid_(archive.metadata().plane_grid(plane_)),
        columns_(grid_, x_),
        palette_(shade_colours(archive.metadata(), request.palette)),
        illumination_(request.sun_azimuth_deg, request.sun_elevation_deg, has_air(archive.metadata())),
        datum_(archive.metadata().statistics.min.value_or(0.0)),
        ground_(ground_scale(archive.metadata())),
        world_per_elevation_(request.exaggeration * ground_.elevation) {
    if (request.texture) textures_.emplace(archive, x_.step(), z_.step());
    if (casts_shadows(request)) begin_sweep();
    divide_memory();
    heights_.emplace(grid_, scratch_);
    if (sweep_) hidden_.emplace(grid_, scratch_);
    if (!textures_) return;
    texels_.emplace(4 * textures_->side() * static_cast<std::size_t>(grid_.tile_columns()), scratch_);
    for (std::size_t row = 0; row < textures_->side(); ++row) texels_->add(static_cast<std::int64_t>(row));
  }

  [[nodiscard]] int plane() const { return plane_; }

  void run(const TakeShadedRows& take) {
    ShadowSweep::State light;
    for (std::int64_t row = 0; row < grid_.tile_rows(); ++row) {
      if (sweep_ && sweep_->from_south()) light = from_south(row);
      decode(row);
      if (sweep_) light = sweep_->pass(row, light, *heights_, &*hidden_);
      if (textures_) read_textures(row);
      const Run points = points_of(row);
      for (Run part{points.first, points.first}; part.last < points.last; part.first = part.last) {
        part.last = end_of_part(part.first, points.last);
        draw(row, part);
        hand_over(part.last / z_.per_pixel(), take);
      }
      job_.report({"shade", "tiles", (row + 1) * grid_.tile_columns(), grid_.tile_count()});
    }
  }

 private:
  void begin_sweep() {
    const ShadeOptions& request = request_;
    // Heights are those of the picture, in world units.
    SweptSun sun = swept_sun(request.sun_azimuth_deg, request.sun_elevation_deg,
                             sun_radius_deg(archive_.metadata().source.body), 1.0, 1.0);
    if (request.softness) sun.softness = *request.softness * world_per_elevation_;
    const TileGrid ground = scaled(grid_, ground_);
    sweep_.emplace(ground, scaled(archive_.metadata().valid, ground_), sun);
    if (!sun.softness) {
      const double azimuth = sun.azimuth_deg * std::numbers::pi / 180.0;
      facet_sun_ = FacetSun{static_cast<float>(std::sin(azimuth) / ground.sigma_x()),
                            static_cast<float>(-std::cos(azimuth) / ground.sigma_z()), static_cast<float>(sun.fall),
                            static_cast<float>(1.0 / (sun.upper_fall - sun.lower_fall))};
    }
    if (!sweep_->from_south()) return;
    // What enters every stride-th row of tiles is kept for all time, and those in between for the rows that are drawn
    // next.
    const auto most = static_cast<std::int64_t>(kMaxRowBytes / sweep_->state_bytes());
    while (kept_states() > std::max<std::int64_t>(most, 2) && south_stride_ * south_stride_ < grid_.tile_rows()) {
      ++south_stride_;
    }
  }

  [[nodiscard]] std::int64_t kept_states() const { return grid_.tile_rows() / south_stride_ + south_stride_; }

  /// Of a row of pixels: sums and means, and what is handed over.
  [[nodiscard]] double sums_bytes() const {
    const int fields = 1 + (sweep_ ? 1 : 0) + (points_in_pixel() > 1 ? 1 : 0) + (textures_ ? 4 : 0);
    return static_cast<double>(width_) * fields * sizeof(float);
  }
  [[nodiscard]] double shaded_bytes() const {
    return static_cast<double>(width_) * static_cast<double>(samples_.channels) *
           static_cast<double>(size_bytes(samples_.type));
  }
  [[nodiscard]] std::int64_t points_in_pixel() const { return x_.per_pixel() * z_.per_pixel(); }

  /// With so many rows of pixels at once.
  [[nodiscard]] double memory_bytes(bool in_scratch, std::int64_t rows) const {
    const TileShape& shape = grid_.shape();
    const auto tiles = static_cast<double>(grid_.tile_columns());
    const double threads = threads_of(job_);
    const double picture = shaded_bytes() * static_cast<double>(size_.second);
    double bytes = reading_bytes(job_, static_cast<double>(shape.stored_vertex_count())) +
                   static_cast<double>(columns_.count()) * 2.0 * kPointBytes + std::min(kFileBytes, picture) +
                   (static_cast<double>(rows) + 3.0) * sums_bytes() +
                   (static_cast<double>(rows) + kRowsOfFile) * shaded_bytes();
    if (textures_) {
      const auto texels = static_cast<double>(textures_->side() * textures_->side());
      bytes += 4.0 * texels * (threads * 3.0 + (in_scratch ? 0.0 : tiles));
    }
    if (!in_scratch) bytes += (sweep_ ? 2.0 : 1.0) * TileRowValues::memory_bytes(grid_);
    if (!sweep_) return bytes;
    const auto state = static_cast<double>(sweep_->state_bytes());
    if (sweep_->from_south() && !in_scratch) bytes += static_cast<double>(kept_states()) * state;
    // Rows of vertices, twice, and lines at half steps: what they carry and hide, the ground, and what enters
    // and leaves.
    return bytes + 3.0 * state + sweep_->passing_bytes();
  }

  /// Throws Error{kOutOfMemory}. Where memory is short, rows of tiles lie in scratch files, and fewer rows of pixels
  /// are drawn at once.
  void divide_memory() {
    const auto most = static_cast<std::int64_t>(static_cast<double>(kMaxRowBytes) / (sums_bytes() + shaded_bytes()));
    rows_at_once_ = std::clamp<std::int64_t>(most, 1, size_.second);
    const auto few = std::min<std::int64_t>(rows_at_once_, kBlockRows);
    scratch_ = scratch_for(job_, memory_bytes(false, few), memory_bytes(true, 1), "this picture");
    const auto fits = [this](std::int64_t rows) {
      return memory_bytes(scratch_.has_value(), rows) <= static_cast<double>(job_.bound_bytes());
    };
    while (job_.bound_bytes() != 0 && rows_at_once_ > 1 && !fits(rows_at_once_))
      rows_at_once_ -= (rows_at_once_ + 7) / 8;
    if (scratch_) south_stride_ = 1;
  }

  [[nodiscard]] Run points_of(std::int64_t tile_row) const {
    const auto edge = [this](std::int64_t row) { return z_.first_from(static_cast<double>(row) * grid_.extent_z()); };
    return {tile_row == 0 ? 0 : edge(tile_row), tile_row + 1 == grid_.tile_rows() ? z_.count() : edge(tile_row + 1)};
  }

  /// Rows of pixels that are held at once are bounded: a row of tiles is drawn in parts where it is very large.
  [[nodiscard]] std::int64_t end_of_part(std::int64_t first, std::int64_t last) const {
    return std::min(last, (first / z_.per_pixel() + rows_at_once_) * z_.per_pixel());
  }

  /// The heights of a row of tiles.
  void decode(std::int64_t tile_row) {
    job_.throw_if_cancelled();
    has_voids_ = false;
    const auto columns = static_cast<std::size_t>(grid_.shape().columns());
    const TileIndex begin{0, tile_row};
    for_each_tile(read_tile_, begin, grid_.tile_columns(), [&](std::int64_t tile, const TileCodes& decoded) {
      std::vector<float> line(columns);
      bool has_voids = false;
      for (int row = 0; row < grid_.shape().rows(); ++row) {
        has_voids = heights_of_row(decoded, static_cast<std::size_t>(row) * columns, line) || has_voids;
        heights_->write_row(row, tile, line);
      }
      if (has_voids) has_voids_ = true;
    });
  }

  /// Heights of codes from the one numbered `first` on; returns whether one is void.
  bool heights_of_row(const TileCodes& codes, std::size_t first, std::span<float> heights) const {
    const Quantisation& quantisation = archive_.metadata().quantisation;
    if (codes.type != CodeType::kF32) {
      const auto offset = static_cast<float>((quantisation.offset - datum_) * world_per_elevation_);
      const auto scale = static_cast<float>(quantisation.scale * world_per_elevation_);
      return vectorised<heights_of_codes>(codes.codes.data() + first, static_cast<int>(heights.size()),
                                          static_cast<int>(quantisation.void_code()), offset, scale,
                                          heights.data()) > 0;
    }
    bool has_voids = false;
    for (std::size_t k = 0; k < heights.size(); ++k) {
      const double height = (static_cast<double>(codes.heights[first + k]) - datum_) * world_per_elevation_;
      heights[k] = std::isfinite(height) ? static_cast<float>(height) : kVoid;
      has_voids = has_voids || !std::isfinite(height);
    }
    return has_voids;
  }

  void read_textures(std::int64_t tile_row) {
    oneapi::tbb::parallel_for(std::int64_t{0}, grid_.tile_columns(), [&](std::int64_t tile) {
      const std::vector<std::uint8_t> texels = textures_->read({tile, tile_row});
      const std::size_t line = 4 * textures_->side();
      for (std::size_t row = 0; row < textures_->side(); ++row) {
        texels_->write(static_cast<std::int64_t>(row), static_cast<std::size_t>(tile) * line,
                       std::span(texels).subspan(row * line, line));
      }
    });
  }

  /// What enters a row of tiles from the South: rows further South are passed over first, and what entered some of
  /// them is kept, as many as memory is granted, evenly spaced.
  ShadowSweep::State from_south(std::int64_t tile_row) {
    const std::int64_t rows = grid_.tile_rows();
    if (tile_row == 0) {
      pass_from_south(rows - 1, 0, [&](std::int64_t row) { return row % south_stride_ == south_stride_ - 1; });
    }
    const std::int64_t group_end = std::min(rows, (tile_row / south_stride_ + 1) * south_stride_) - 1;
    if (tile_row % south_stride_ == 0 && group_end > tile_row) {
      pass_from_south(group_end, tile_row, [](std::int64_t) { return true; });
    }
    if (tile_row > 0) south_->drop(tile_row - 1);
    return kept_state(tile_row);
  }

  [[nodiscard]] ShadowSweep::State kept_state(std::int64_t row) const {
    ShadowSweep::State buffer;
    if (row == grid_.tile_rows() - 1) return buffer;
    const std::span<const float> kept = south_->read(row, 0, south_width_, buffer);
    return {kept.begin(), kept.end()};
  }

  /// Passes over the rows `first` down to `last`, but for that one, and keeps what enters those that are wanted.
  template <typename Wanted>
  void pass_from_south(std::int64_t first, std::int64_t last, const Wanted& wanted) {
    ShadowSweep::State light = kept_state(first);
    for (std::int64_t row = first; row > last; --row) {
      decode(row);
      light = sweep_->pass(row, light, *heights_, nullptr);
      if (!wanted(row - 1)) continue;
      south_width_ = light.size();
      if (!south_) south_.emplace(south_width_, scratch_);
      south_->add(row - 1);
      south_->write(row - 1, 0, light);
    }
  }

  [[nodiscard]] PixelRow& pixel_row(std::int64_t row) { return rows_[static_cast<std::size_t>(row - first_row_)]; }

  PixelRow empty_row() const {
    PixelRow row;
    row.heights.resize(width_ + 2);
    if (sweep_) row.shares.resize(width_);
    if (points_in_pixel() > 1) row.cover.resize(width_);
    if (textures_) row.photo.resize(4 * width_);
    return row;
  }

  void draw(std::int64_t tile_row, const Run& points) {
    const std::int64_t first = points.first / z_.per_pixel();
    const std::int64_t end = (points.last - 1) / z_.per_pixel() + 1;
    while (first_row_ + static_cast<std::int64_t>(rows_.size()) < end) rows_.push_back(empty_row());
    for_each_block(first, end, [&](const Run& rows, const Run& pixels) {
      const std::int64_t from = std::max(points.first, rows.first * z_.per_pixel());
      const std::int64_t to = std::min(points.last, rows.last * z_.per_pixel());
      draw_points(tile_row, {from, to}, pixels);
    });
    for (std::int64_t row = first; row < points.last / z_.per_pixel(); ++row) extend(pixel_row(row));
  }

  /// Work on blocks of rows and columns of pixels, on all threads. Throws Error{kCancelled}: one tile may have pixels
  /// for minutes.
  template <typename Work>
  void for_each_block(std::int64_t first, std::int64_t end, const Work& work) const {
    // Of so many lattice columns that a few rows of their vertices are little.
    const std::int64_t vertices = grid_.tile_columns() * grid_.shape().columns();
    const std::int64_t width = std::clamp<std::int64_t>(2 * kBlock * size_.first / vertices, kLeastBlock, kBlock);
    const std::int64_t across = (size_.first + width - 1) / width;
    const std::int64_t down = (end - first + kBlockRows - 1) / kBlockRows;
    oneapi::tbb::parallel_for(std::int64_t{0}, across * down, [&](std::int64_t block) {
      job_.throw_if_cancelled();
      const std::int64_t row = first + block / across * kBlockRows;
      const std::int64_t column = block % across * width;
      work(Run{row, std::min(row + kBlockRows, end)}, Run{column, std::min(column + width, size_.first)});
    });
  }

  /// A field of the tiles at rows of points, one after the other.
  class Field {
   public:
    enum class Slopes { kUnwanted, kWanted };

    Field(const PointColumns& columns, const TileRowValues& values, const TileShape& shape, const Run& points,
          Slopes slopes = Slopes::kUnwanted)
        : columns_(columns),
          values_(values),
          shape_(shape),
          points_(points),
          tiles_(columns.tiles_under(points)),
          slopes_(slopes) {}

    void read(int row, float share, float* out) {
      if (row == south_.row || row + 1 == north_.row) std::swap(north_, south_);
      keep(row, north_);
      if (share == 0.0F) return static_cast<void>(std::copy(north_.points.begin(), north_.points.end(), out));
      keep(row + 1, south_);
      vectorised<between_rows>(static_cast<const float*>(north_.points.data()),
                               static_cast<const float*>(south_.points.data()), share,
                               static_cast<int>(north_.points.size()), out);
    }

    /// Hides what the triangles at these points hide of the sun by facing away from it. Needs Slopes::kWanted.
    /// share  0...1 from stored row `row` to the next
    void hide_by_own_triangles(int row, float share, FacetSun sun, float* hidden) {
      if (row == south_.row || row + 1 == north_.row) std::swap(north_, south_);
      keep(row, north_);
      keep(row + 1, south_);
      const bool is_odd = row % 2 != 0;
      const Row& odd = is_odd ? north_ : south_;
      const Row& even = is_odd ? south_ : north_;
      if (!is_odd) sun.across = -sun.across;
      vectorised<hide_by_facets>(odd.points.data(), even.points.data(), odd.slopes.data(), even.slopes.data(),
                                 columns_.from_vertex(points_), static_cast<int>(odd.points.size()),
                                 is_odd ? share : 1.0F - share, sun, hidden);
    }

    /// Beside voids the mesh's own triangles say which points have a height: where one row has none.
    void mend(double z, float* out) const {
      for (std::int64_t tile = tiles_.first; tile < tiles_.last; ++tile) {
        const Run here = columns_.of_tile(tile, points_);
        for (std::int64_t point = here.first; point < here.last; ++point) {
          const auto i = static_cast<std::size_t>(point - points_.first);
          if (std::isnan(north_.points[i]) == std::isnan(south_.points[i])) continue;
          const auto x = columns_.object_x(static_cast<std::size_t>(tile), static_cast<std::size_t>(point));
          out[i] = static_cast<float>(on_triangle(tile, barycentric(shape_, {x, z})));
        }
      }
    }

   private:
    struct Row {
      int row = -1;
      std::vector<float> buffer;
      std::span<const float> vertices;  ///< of the tiles
      std::vector<float> points;
      std::vector<float> slopes;
    };

    void keep(int row, Row& kept) const {
      if (kept.row == row) return;
      kept.row = row;
      kept.vertices = values_.row(row, tiles_.first, tiles_.last - tiles_.first, kept.buffer);
      kept.points.resize(static_cast<std::size_t>(points_.last - points_.first));
      if (slopes_ == Slopes::kWanted) kept.slopes.resize(kept.points.size());
      columns_.read(kept.vertices.data(), row, shape_.columns(), points_, kept.points.data(),
                    slopes_ == Slopes::kWanted ? kept.slopes.data() : nullptr);
    }
    /// As interpolate() has it.
    [[nodiscard]] double on_triangle(std::int64_t tile, const Barycentric& at) const {
      double sum = 0.0;
      for (std::size_t i = 0; i < 3; ++i) {
        if (!(at.weights[i] > 0.0)) continue;
        const std::int64_t column = (tile - tiles_.first) * shape_.columns() + at.vertices[i].column;
        const Row& row = at.vertices[i].row == north_.row ? north_ : south_;
        sum += at.weights[i] * static_cast<double>(row.vertices[static_cast<std::size_t>(column)]);
      }
      return sum;
    }

    const PointColumns& columns_;
    const TileRowValues& values_;
    const TileShape& shape_;
    Run points_;
    Run tiles_;
    Slopes slopes_;
    Row north_;
    Row south_;
  };

  void draw_points(std::int64_t tile_row, const Run& rows, const Run& block) {
    const TileShape& shape = grid_.shape();
    const Run columns{block.first * x_.per_pixel(), block.last * x_.per_pixel()};
    Field heights(columns_, *heights_, shape, columns, facet_sun_ ? Field::Slopes::kWanted : Field::Slopes::kUnwanted);
    std::optional<Field> hidden;
    if (sweep_) hidden.emplace(columns_, *hidden_, shape, columns);
    TexelRows texels;
    const bool single = points_in_pixel() == 1;
    const auto count = static_cast<std::size_t>(columns.last - columns.first);
    std::vector<float> height(single ? 0 : count);
    std::vector<float> share(single || !sweep_ ? 0 : count);
    for (std::int64_t j = rows.first; j < rows.last; ++j) {
      const double z = (z_.world(j) - static_cast<double>(tile_row) * grid_.extent_z()) / grid_.sigma_z();
      const double inside = std::clamp(z, 0.0, static_cast<double>(shape.cell_rows()));
      const double nearest = std::round(inside);
      const double place = std::abs(inside - nearest) < 1e-6 ? nearest : inside;
      const auto row = static_cast<int>(place);
      const auto part = static_cast<float>(place - row);
      PixelRow& pixels = pixel_row(j / z_.per_pixel());
      float* const h = single ? pixels.heights.data() + 1 + block.first : height.data();
      float* const s = single ? pixels.shares.data() + (sweep_ ? block.first : 0) : share.data();
      heights.read(row + 1, part, h);
      if (has_voids_ && part > 0.0F) heights.mend(place, h);
      if (sweep_) {
        hidden->read(row + 1, part, s);
        if (facet_sun_) hide_by_own_triangles(heights, tile_row, row + 1, part, s);
        vectorised<share_of_hidden>(s, static_cast<int>(count));
      }
      if (!single) add(height, share, block, pixels);
      if (textures_) add_photo(texels, z / shape.cell_rows(), columns, pixels);
      if ((j + 1) % z_.per_pixel() == 0) finish(pixels, block);
    }
  }

  /// On a lattice row the triangles towards the sun count.
  void hide_by_own_triangles(Field& heights, std::int64_t tile_row, int row, float part, float* hidden) const {
    const bool is_before = part == 0.0F && facet_sun_->across < 0.0F;
    const int north = is_before ? row - 1 : row;
    const bool is_in_world =
        (north > 0 || tile_row > 0) && (north < grid_.shape().rows() - 2 || tile_row + 1 < grid_.tile_rows());
    if (is_in_world) heights.hide_by_own_triangles(north, is_before ? 1.0F : part, *facet_sun_, hidden);
  }

  void add(const std::vector<float>& height, const std::vector<float>& share, const Run& block,
           PixelRow& pixels) const {
    const auto per_pixel = static_cast<std::size_t>(x_.per_pixel());
    const auto end = static_cast<std::size_t>(block.last);
    for (std::size_t pixel = static_cast<std::size_t>(block.first), i = 0; pixel < end; ++pixel) {
      for (std::size_t k = 0; k < per_pixel; ++k, ++i) {
        if (std::isnan(height[i])) continue;
        pixels.heights[1 + pixel] += height[i];
        pixels.cover[pixel] += 1.0F;
        if (sweep_) pixels.shares[pixel] += share[i];
      }
    }
  }

  struct TexelRows {
    std::vector<std::uint8_t> north;
    std::vector<std::uint8_t> south;
  };

  void add_photo(TexelRows& buffers, double t, const Run& points, PixelRow& pixels) const {
    const Run tiles = columns_.tiles_under(points);
    const ShadeTexture::Place down = textures_->place(t);
    const std::size_t line = 4 * textures_->side();
    const auto texels = [&](std::size_t row, std::vector<std::uint8_t>& buffer) {
      return texels_
          ->read(static_cast<std::int64_t>(row), static_cast<std::size_t>(tiles.first) * line,
                 static_cast<std::size_t>(tiles.last - tiles.first) * line, buffer)
          .data();
    };
    const std::uint8_t* north = texels(down.first, buffers.north);
    const std::uint8_t* south = texels(down.first + 1, buffers.south);
    for (std::int64_t tile = tiles.first; tile < tiles.last; ++tile) {
      const Run columns = columns_.of_tile(tile, points);
      for (std::int64_t i = columns.first; i < columns.last; ++i) {
        const double s = x_.world(i) / grid_.extent_x() - static_cast<double>(tile);
        const ShadeTexture::Colour colour = ShadeTexture::colour(north, south, down.share, textures_->place(s));
        float* const out = pixels.photo.data() + 4 * (i / x_.per_pixel());
        for (std::size_t k = 0; k < 3; ++k) out[k] += colour.light[k] * colour.alpha;
        out[3] += colour.alpha;
      }
      north += line;
      south += line;
    }
  }

  /// Means of sums.
  void finish(PixelRow& pixels, const Run& block) const {
    const auto first = static_cast<std::size_t>(block.first);
    const auto end = static_cast<std::size_t>(block.last);
    for (std::size_t i = first; !pixels.cover.empty() && i < end; ++i) {
      const float cover = pixels.cover[i];
      pixels.heights[1 + i] = cover > 0.0F ? pixels.heights[1 + i] / cover : kVoid;
      if (sweep_ && cover > 0.0F) pixels.shares[i] /= cover;
    }
    const auto points = static_cast<float>(points_in_pixel());
    for (std::size_t i = 4 * first; textures_ && i < 4 * end; ++i) pixels.photo[i] /= points;
  }

  /// The heights beyond both ends, which go on with the slope.
  void extend(PixelRow& pixels) const {
    std::vector<float>& heights = pixels.heights;
    heights.front() = width_ > 1 ? 2.0F * heights[1] - heights[2] : heights[1];
    heights.back() = width_ > 1 ? 2.0F * heights[width_] - heights[width_ - 1] : heights[1];
  }

  /// Shades and hands over the rows before `end`, but for the last one as long as the one South of it isn't there.
  void hand_over(std::int64_t end, const TakeShadedRows& take) {
    const std::int64_t last = end == size_.second ? end : end - 1;
    if (last <= taken_) return;
    const std::size_t pixel_bytes = static_cast<std::size_t>(samples_.channels) * size_bytes(samples_.type);
    std::vector<std::byte> bytes(width_ * pixel_bytes * static_cast<std::size_t>(last - taken_));
    for_each_block(taken_, last, [&](const Run& rows, const Run& pixels) {
      const auto count = static_cast<std::size_t>(pixels.last - pixels.first);
      std::vector<float> scratch(3 * count);
      std::vector<float> beyond(count + 2);
      for (std::int64_t row = rows.first; row < rows.last; ++row) {
        const std::size_t place =
            width_ * static_cast<std::size_t>(row - taken_) + static_cast<std::size_t>(pixels.first);
        shade_row(row, pixels, scratch, beyond, bytes.data() + pixel_bytes * place);
      }
    });
    take(bytes);
    taken_ = last;
    while (first_row_ < taken_ - 1) {
      rows_.pop_front();
      ++first_row_;
    }
  }

  void shade_row(std::int64_t row, const Run& block, std::vector<float>& scratch, std::vector<float>& beyond,
                 std::byte* out) {
    const PixelRow& pixels = pixel_row(row);
    const auto count = static_cast<std::size_t>(block.last - block.first);
    const auto heights_of = [&](const PixelRow& of) { return of.heights.data() + 1 + block.first; };
    const auto heights_at = [&](std::int64_t other) {
      if (other >= 0 && other < size_.second) return heights_of(pixel_row(other));
      // Beyond both ends the slope goes on.
      const std::int64_t opposite = 2 * row - other;
      const bool has = opposite >= 0 && opposite < size_.second;
      const float* const here = heights_of(pixels) - 1;
      const float* const inner = has ? heights_of(pixel_row(opposite)) - 1 : here;
      for (std::size_t i = 0; i < beyond.size(); ++i) beyond[i] = 2.0F * here[i] - inner[i];
      return static_cast<const float*>(beyond.data() + 1);
    };
    const ReliefRows rows{heights_at(row - 1), heights_of(pixels), heights_at(row + 1)};
    const PixelSize pixel{x_.pixel() * ground_.x, z_.pixel() * ground_.z};
    if (request_.kind == ShadeKind::kPicture) {
      relief_normals(rows, pixel, scratch);
      return colour_row(pixels, block, scratch, out);
    }
    const std::span<float> one(scratch.data(), count);
    std::copy_n(pixels.shares.begin() + block.first, count, one.begin());
    for (std::size_t i = 0; i < count; ++i) {
      if (std::isnan(rows.here[i])) one[i] = kVoid;
    }
    if (samples_.type == SampleType::kUint8) {
      return bytes_from_shares(one, {reinterpret_cast<std::uint8_t*>(out), count});
    }
    std::copy(one.begin(), one.end(), static_cast<float*>(static_cast<void*>(out)));
  }

  void colour_row(const PixelRow& pixels, const Run& block, const std::vector<float>& normals, std::byte* out) const {
    const auto points = static_cast<float>(points_in_pixel());
    const auto count = static_cast<std::size_t>(block.last - block.first);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t at = static_cast<std::size_t>(block.first) + i;
      const float height = pixels.heights[1 + at];
      if (std::isnan(height)) continue;
      const float alpha = pixels.cover.empty() ? 1.0F : pixels.cover[at] / points;
      const Normal normal{normals[i], normals[count + i], normals[2 * count + i]};
      Light light = illumination_.on(normal, sweep_ ? pixels.shares[at] : 1.0F);
      const Light ground = palette_.at(static_cast<double>(height) / world_per_elevation_ + datum_);
      for (std::size_t k = 0; k < 3; ++k) {
        const float colour =
            textures_ ? ground[k] * (1.0F - pixels.photo[4 * at + 3]) + pixels.photo[4 * at + k] : ground[k];
        light[k] *= colour;
      }
      if (request_.floats) {
        float* const to = static_cast<float*>(static_cast<void*>(out)) + 4 * i;
        for (std::size_t k = 0; k < 3; ++k) to[k] = light[k] * alpha;
        to[3] = alpha;
        continue;
      }
      auto* const to = reinterpret_cast<std::uint8_t*>(out) + 4 * i;
      for (std::size_t k = 0; k < 3; ++k) to[k] = value_from_light(light[k]);
      to[3] = static_cast<std::uint8_t>(alpha * 255.0F + 0.5F);
    }
  }

  const ArchiveReader& archive_;
  const ShadeOptions& request_;
  const Job& job_;
  ShadeSamples samples_;
  PixelAxis x_;
  PixelAxis z_;
  int plane_;  ///< the coarsest with vertices enough
  ReadTile read_tile_;
  GridSize size_;
  std::size_t width_;
  TileGrid grid_;
  PointColumns columns_;
  Palette palette_;
  Illumination illumination_;
  double datum_;
  GroundScale ground_;
  double world_per_elevation_;
  std::optional<ShadowSweep> sweep_;
  std::optional<FacetSun> facet_sun_;  ///< none where the sun has one softness at all distances
  std::optional<ShadeTexture> textures_;
  ScratchFolder scratch_;
  std::int64_t rows_at_once_ = 1;         ///< of pixels
  std::optional<TileRowValues> heights_;  ///< of the row of tiles that is drawn
  std::atomic<bool> has_voids_ = false;
  std::optional<TileRowValues> hidden_;
  std::optional<KeptRows<std::uint8_t>> texels_;  ///< rows of [tile columns][side] texels
  std::optional<KeptRows<float>> south_;          ///< what enters each row of tiles from the South, where it is kept
  std::size_t south_width_ = 0;
  std::int64_t south_stride_ = 1;
  std::deque<PixelRow> rows_;  ///< from the last one handed over to those that are begun
  std::int64_t first_row_ = 0;
  std::int64_t taken_ = 0;
};

}  // namespace

ShadeSamples shade_samples(const ShadeOptions& options) {
  const bool is_picture = options.kind == ShadeKind::kPicture;
  if (is_picture) return {options.floats ? SampleType::kFloat32 : SampleType::kUint8, 4, std::nullopt};
  if (options.floats) return {SampleType::kFloat32, 1, std::numeric_limits<double>::quiet_NaN()};
  return {SampleType::kUint8, 1, 0.0};
}

GridSize shade_size(const ArchiveReader& archive, std::optional<std::int64_t> longest) {
  const WorldBounds& bounds = archive.metadata().valid;
  const double side = std::max(bounds.x1 - bounds.x0, bounds.z1 - bounds.z0);
  const std::int64_t most = longest.value_or(kDefaultPixels);
  if (most < 1 || most > kMostPixels) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("the longer side is {} pixels, must be 1 to 2^20", most));
  }
  const double least = longest ? 0.0 : 2.0 * archive.grid().sigma_x();
  const double pixel = std::max(least, side / static_cast<double>(most));
  const auto pixels = [&](double length) {
    return std::clamp<std::int64_t>(static_cast<std::int64_t>(std::lround(length / pixel)), 1, most);
  };
  return {pixels(bounds.x1 - bounds.x0), pixels(bounds.z1 - bounds.z0)};
}

ShadeReport shade_rows(const ArchiveReader& archive, const ShadeOptions& options, const TakeShadedRows& take,
                       const Job& job) {
  require_callback(take);
  ShadeReport report{options.size.value_or(shade_size(archive))};
  require(options, report.size);
  if (options.kind == ShadeKind::kHillshade) {
    hillshade_rows(archive, options, report.size, take, job);
    return report;
  }
  Arena(job).execute([&] {
    ShadeRenderer renderer(archive, options, report.size, job);
    report.plane = renderer.plane();
    renderer.run(take);
  });
  return report;
}

Picture shade(const ArchiveReader& archive, const ShadeOptions& options, const Job& job) {
  const ShadeSamples samples = shade_samples(options);
  if (samples.type != SampleType::kUint8) {
    throw Error(ErrorCode::kInvalidArgument, "a Picture holds bytes, not floats");
  }
  const GridSize size = options.size.value_or(shade_size(archive));
  require(options, size);
  Picture picture = [&] {
    try {
      return Picture(static_cast<int>(size.first), static_cast<int>(size.second), samples.channels);
    } catch (const std::exception&) {  // too long for a vector, or no memory
      throw Error(ErrorCode::kOutOfMemory,
                  fmt::format("{} x {} pixels do not fit memory; shade_rows() gives rows", size.first, size.second));
    }
  }();
  std::size_t done = 0;
  (void)shade_rows(
      archive, options,
      [&](std::span<const std::byte> rows) {
        std::transform(rows.begin(), rows.end(), picture.samples.begin() + static_cast<std::ptrdiff_t>(done),
                       [](std::byte value) { return static_cast<std::uint8_t>(value); });
        done += rows.size();
      },
      job);
  return picture;
}

}  // namespace isohf
