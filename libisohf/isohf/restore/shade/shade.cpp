#include "isohf/shade.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <deque>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "isohf/archive/codec/quantise.h"
#include "isohf/archive/planes/archive_planes.h"
#include "isohf/archive/textures/texture_reader.h"
#include "isohf/base/arena.h"
#include "isohf/base/simd.h"
#include "isohf/error.h"
#include "isohf/lattice/barycentric.h"
#include "isohf/restore/point_sampler.h"
#include "isohf/restore/shade/light.h"
#include "isohf/restore/shade/relief.h"
#include "isohf/restore/shade/shadow_sweep.h"
#include "isohf/surface/photo/srgb.h"

namespace isohf {
namespace {

/// The most points in a pixel, either way.
constexpr std::int64_t kMaxPointsPerPixel = 4;
/// Vertices in a pixel, either way, that a coarse plane must have to be drawn: with two its picture can hardly be told
/// from that of all vertices (decision 41).
constexpr double kVerticesPerPixel = 2.0;
constexpr std::size_t kMaxRowBytes = std::size_t{64} << 20U;

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

  /// One tile's texture, from the mip level whose texels are no larger than the steps.
  class Tile {
   public:
    Tile() = default;
    Tile(Picture rgba, int finest_size) : picture_(std::move(rgba)), finest_size_(finest_size) {}
    /// s, t  0...1 from West to East and North to South, interpolated linearly; nothing where the tile has no texture.
    [[nodiscard]] Colour at(double s, double t) const;

   private:
    Picture picture_;
    int finest_size_ = 0;
  };
  /// Any thread.
  [[nodiscard]] Tile read(TileIndex tile) const;

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

ShadeTexture::Tile ShadeTexture::read(TileIndex tile) const {
  if (!reader_.has(tile)) return {};
  return {reader_.read_rgba(tile, level_), reader_.info().size};
}

ShadeTexture::Colour ShadeTexture::Tile::at(double s, double t) const {
  Colour colour;
  if (picture_.samples.empty()) return colour;
  // docs/archive_format.md, "Textures": one texture coordinate for all levels.
  const auto place = [this](double along) {
    const double u = (0.5 + (finest_size_ - 1) * along) / finest_size_;
    return std::clamp(u * picture_.width - 0.5, 0.0, picture_.width - 1.0);
  };
  const double x = place(s);
  const double y = place(t);
  const auto column = std::min(static_cast<int>(x), picture_.width - 2);
  const auto row = std::min(static_cast<int>(y), picture_.height - 2);
  const auto right = static_cast<float>(x - column);
  const auto down = static_cast<float>(y - row);
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) {
      const std::uint8_t* const texel = picture_.pixel(column + i, row + j);
      const float alpha = static_cast<float>(texel[3]) / 255.0F;
      const float weight = (i == 0 ? 1.0F - right : right) * (j == 0 ? 1.0F - down : down) * alpha;
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

/// The share of the sun of ground so far below the height up to which it is dark: Eq. 16 as sun_share_on_surface()
/// has it.
ISOHF_KERNEL void share_of_depth(float* __restrict values, int count, float per_depth) {
  for (int i = 0; i < count; ++i) {
    float share = 1.0F - values[i] * per_depth;
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
  [[nodiscard]] Run of_tile(std::size_t tile) const {
    return {static_cast<std::int64_t>(starts_[tile]), static_cast<std::int64_t>(starts_[tile + 1])};
  }

  /// Values of a stored row of the tiles at all columns of points.
  void read(const TileRowValues& tiles, int row, int stored_columns, float* out) const {
    const auto parity = static_cast<std::size_t>(row % 2);
    for (std::size_t tile = 0; tile < tiles.size(); ++tile) {
      const std::size_t first = starts_[tile];
      const auto points = static_cast<int>(starts_[tile + 1] - first);
      vectorised<between_vertices>(tiles[tile].data() + static_cast<std::ptrdiff_t>(row) * stored_columns,
                                   west_[parity].data() + first, east_[parity].data() + first,
                                   share_[parity].data() + first, points, out + first);
    }
  }

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
    if (!holds) throw Error(ErrorCode::kInvalidArgument, std::string("shade: ") + what);
  };
  check(size.first >= 1 && size.second >= 1 && size.first <= kMostPixels && size.second <= kMostPixels,
        "the picture must have 1 to 2^20 pixels a side");
  check(std::isfinite(options.sun_azimuth_deg), "the sun's azimuth must be a number of degrees");
  check(options.sun_elevation_deg > 0.0 && options.sun_elevation_deg <= 90.0 &&
            (options.sun_elevation_deg < 90.0 || !casts_shadows(options)),
        "the sun must stand above 0 and below 90 degrees, or at 90 where it casts no shadows");
  check(options.exaggeration > 0.0 && std::isfinite(options.exaggeration), "the exaggeration must be above 0");
  check(!options.softness || *options.softness > 0.0, "the shadow's softness must be above 0");
  check(options.elevation_units_per_world_unit > 0.0, "the elevation units in one world unit must be above 0");
  check(std::is_sorted(options.colours.begin(), options.colours.end(),
                       [](const ColourStop& a, const ColourStop& b) { return a.elevation < b.elevation; }),
        "the colours must be ordered by rising elevation");
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
        read_tiles_(tiles_of(archive, plane_)),
        size_(size),
        width_(static_cast<std::size_t>(size.first)),
        grid_(archive.metadata().plane_grid(plane_)),
        columns_(grid_, x_),
        palette_(request.colours.empty() ? shade_colours(archive.metadata(), request.palette) : request.colours),
        illumination_(request.sun_azimuth_deg, request.sun_elevation_deg, request.relief),
        sun_(towards_sun(request.sun_azimuth_deg, request.sun_elevation_deg)),
        datum_(archive.metadata().statistics.min.value_or(0.0)),
        world_per_elevation_(request.exaggeration / request.elevation_units_per_world_unit) {
    if (request.texture) textures_.emplace(archive, x_.step(), z_.step());
    if (!casts_shadows(request)) return;
    const double softness = request.softness.value_or(default_softness(archive.metadata())) * world_per_elevation_;
    share_per_depth_ = static_cast<float>(2.0 / softness);
    const double fall = std::tan(request.sun_elevation_deg * std::numbers::pi / 180.0);
    sweep_.emplace(grid_, archive.metadata().valid, request.sun_azimuth_deg, fall, softness);
  }

  [[nodiscard]] int plane() const { return plane_; }

  void run(const TakeShadedRows& take) {
    ShadowSweep::State light;
    for (std::int64_t row = 0; row < grid_.tile_rows(); ++row) {
      decode(row);
      if (sweep_) light = sweep_->pass(row, sweep_->from_south() ? from_south(row) : light, heights_, &depths_);
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
  [[nodiscard]] Run points_of(std::int64_t tile_row) const {
    const auto edge = [this](std::int64_t row) { return z_.first_from(static_cast<double>(row) * grid_.extent_z()); };
    return {tile_row == 0 ? 0 : edge(tile_row), tile_row + 1 == grid_.tile_rows() ? z_.count() : edge(tile_row + 1)};
  }

  /// Rows of pixels that are held at once are bounded: a row of tiles is drawn in parts where it is very large.
  [[nodiscard]] std::int64_t end_of_part(std::int64_t first, std::int64_t last) const {
    const std::size_t row_bytes = width_ * sizeof(float) * (textures_ ? 7 : 3);
    const auto rows = static_cast<std::int64_t>(std::max<std::size_t>(1, kMaxRowBytes / row_bytes));
    return std::min(last, (first / z_.per_pixel() + rows) * z_.per_pixel());
  }

  /// The heights of a row of tiles, and its textures.
  void decode(std::int64_t tile_row) {
    job_.throw_if_cancelled();
    std::vector<TileIndex> tiles;
    for (std::int64_t column = 0; column < grid_.tile_columns(); ++column) tiles.push_back({column, tile_row});
    heights_.resize(tiles.size());
    has_voids_ = false;
    const Quantisation& quantisation = archive_.metadata().quantisation;
    const auto offset = static_cast<float>((quantisation.offset - datum_) * world_per_elevation_);
    const auto scale = static_cast<float>(quantisation.scale * world_per_elevation_);
    for_each_tile(read_tiles_, tiles, [&](std::size_t i, const TileCodes& codes) {
      std::vector<float>& heights = heights_[i];
      heights.resize(static_cast<std::size_t>(grid_.shape().stored_vertex_count()));
      if (codes.type != CodeType::kF32) {
        const int voids =
            vectorised<heights_of_codes>(codes.codes.data(), static_cast<int>(heights.size()),
                                         static_cast<int>(quantisation.void_code()), offset, scale, heights.data());
        if (voids > 0) has_voids_ = true;
        return;
      }
      for (std::size_t k = 0; k < heights.size(); ++k) {
        const double height = (static_cast<double>(codes.heights[k]) - datum_) * world_per_elevation_;
        heights[k] = std::isfinite(height) ? static_cast<float>(height) : kVoid;
        if (!std::isfinite(height)) has_voids_ = true;
      }
    });
    if (!textures_) return;
    photos_.resize(tiles.size());
    oneapi::tbb::parallel_for(std::size_t{0}, tiles.size(),
                              [&](std::size_t i) { photos_[i] = textures_->read(tiles[i]); });
  }

  /// What enters a row of tiles from the South: rows further South are passed over first, and what entered some of
  /// them is kept, as many as memory is granted, evenly spaced.
  const ShadowSweep::State& from_south(std::int64_t tile_row) {
    const std::int64_t rows = grid_.tile_rows();
    if (south_.empty()) {
      const auto most = static_cast<std::int64_t>(kMaxRowBytes / sweep_->state_bytes());
      // Every stride-th is kept for all time, and those in between for the rows that are drawn next.
      south_stride_ = 1;
      while (rows / south_stride_ + south_stride_ > std::max<std::int64_t>(most, 2) &&
             south_stride_ * south_stride_ < rows) {
        ++south_stride_;
      }
      south_.resize(static_cast<std::size_t>(rows));
      pass_from_south(rows - 1, 0, [&](std::int64_t row) { return row % south_stride_ == south_stride_ - 1; });
    }
    const std::int64_t group_end = std::min(rows, (tile_row / south_stride_ + 1) * south_stride_) - 1;
    if (tile_row % south_stride_ == 0 && group_end > tile_row) {
      pass_from_south(group_end, tile_row, [](std::int64_t) { return true; });
    }
    if (tile_row > 0) south_[static_cast<std::size_t>(tile_row) - 1] = {};
    return south_[static_cast<std::size_t>(tile_row)];
  }

  /// Passes over the rows `first` down to `last`, but for that one, and keeps what enters those that are wanted. Leaves
  /// the heights of row `last`.
  template <typename Wanted>
  void pass_from_south(std::int64_t first, std::int64_t last, const Wanted& wanted) {
    ShadowSweep::State light = south_[static_cast<std::size_t>(first)];
    for (std::int64_t row = first; row > last; --row) {
      decode(row);
      light = sweep_->pass(row, light, heights_, nullptr);
      if (wanted(row - 1)) south_[static_cast<std::size_t>(row) - 1] = light;
    }
    decode(last);
  }

  [[nodiscard]] PixelRow& pixel_row(std::int64_t row) { return rows_[static_cast<std::size_t>(row - first_row_)]; }

  PixelRow empty_row() const {
    PixelRow row;
    row.heights.resize(width_ + 2);
    if (sweep_) row.shares.resize(width_);
    if (x_.per_pixel() * z_.per_pixel() > 1) row.cover.resize(width_);
    if (textures_) row.photo.resize(4 * width_);
    return row;
  }

  void draw(std::int64_t tile_row, const Run& points) {
    const std::int64_t first = points.first / z_.per_pixel();
    const std::int64_t end = (points.last - 1) / z_.per_pixel() + 1;
    while (first_row_ + static_cast<std::int64_t>(rows_.size()) < end) rows_.push_back(empty_row());
    oneapi::tbb::parallel_for(oneapi::tbb::blocked_range<std::int64_t>(first, end, 16), [&](const auto& some) {
      const std::int64_t from = std::max(points.first, some.begin() * z_.per_pixel());
      const std::int64_t to = std::min(points.last, some.end() * z_.per_pixel());
      draw_points(tile_row, {from, to});
    });
  }

  /// A field of the tiles at rows of points, one after the other.
  class Field {
   public:
    Field(const PointColumns& columns, const TileRowValues& tiles, const TileShape& shape)
        : columns_(columns), tiles_(tiles), shape_(shape), north_(columns.count()), south_(columns.count()) {}

    void read(int row, float share, float* out) {
      if (row == south_row_) std::swap(north_, south_), std::swap(north_row_, south_row_);
      keep(row, north_, north_row_);
      if (share == 0.0F) return static_cast<void>(std::copy(north_.begin(), north_.end(), out));
      keep(row + 1, south_, south_row_);
      vectorised<between_rows>(static_cast<const float*>(north_.data()), static_cast<const float*>(south_.data()),
                               share, static_cast<int>(north_.size()), out);
    }

    /// Beside voids the mesh's own triangles say which points have a height: where one row has none.
    void mend(double z, float* out) const {
      for (std::size_t tile = 0; tile < tiles_.size(); ++tile) {
        const Run points = columns_.of_tile(tile);
        for (auto i = static_cast<std::size_t>(points.first); i < static_cast<std::size_t>(points.last); ++i) {
          if (std::isnan(north_[i]) == std::isnan(south_[i])) continue;
          const View2D<const float> values(tiles_[tile].data(), shape_.columns(), shape_.rows());
          out[i] = static_cast<float>(interpolate(barycentric(shape_, {columns_.object_x(tile, i), z}), values));
        }
      }
    }

   private:
    void keep(int row, std::vector<float>& values, int& kept) const {
      if (kept != row) columns_.read(tiles_, row, shape_.columns(), values.data());
      kept = row;
    }
    const PointColumns& columns_;
    const TileRowValues& tiles_;
    const TileShape& shape_;
    std::vector<float> north_;
    std::vector<float> south_;
    int north_row_ = -1;
    int south_row_ = -1;
  };

  void draw_points(std::int64_t tile_row, const Run& points) {
    const TileShape& shape = grid_.shape();
    Field heights(columns_, heights_, shape);
    std::optional<Field> depths;
    if (sweep_) depths.emplace(columns_, depths_, shape);
    const bool single = x_.per_pixel() * z_.per_pixel() == 1;
    std::vector<float> height(single ? 0 : columns_.count());
    std::vector<float> share(single || !sweep_ ? 0 : columns_.count());
    for (std::int64_t j = points.first; j < points.last; ++j) {
      const double z = (z_.world(j) - static_cast<double>(tile_row) * grid_.extent_z()) / grid_.sigma_z();
      const double inside = std::clamp(z, 0.0, static_cast<double>(shape.cell_rows()));
      const double nearest = std::round(inside);
      const double place = std::abs(inside - nearest) < 1e-6 ? nearest : inside;
      const auto row = static_cast<int>(place);
      const auto part = static_cast<float>(place - row);
      PixelRow& pixels = pixel_row(j / z_.per_pixel());
      float* const h = single ? pixels.heights.data() + 1 : height.data();
      float* const s = single ? pixels.shares.data() : share.data();
      heights.read(row + 1, part, h);
      if (has_voids_ && part > 0.0F) heights.mend(place, h);
      if (sweep_) {
        depths->read(row + 1, part, s);
        vectorised<share_of_depth>(s, static_cast<int>(columns_.count()), share_per_depth_);
      }
      if (!single) add(height, share, pixels);
      if (textures_) add_photo(z / shape.cell_rows(), pixels);
      if ((j + 1) % z_.per_pixel() == 0) finish(pixels);
    }
  }

  void add(const std::vector<float>& height, const std::vector<float>& share, PixelRow& pixels) const {
    const auto per_pixel = static_cast<std::size_t>(x_.per_pixel());
    for (std::size_t pixel = 0, i = 0; pixel < width_; ++pixel) {
      for (std::size_t k = 0; k < per_pixel; ++k, ++i) {
        if (std::isnan(height[i])) continue;
        pixels.heights[1 + pixel] += height[i];
        pixels.cover[pixel] += 1.0F;
        if (sweep_) pixels.shares[pixel] += share[i];
      }
    }
  }

  void add_photo(double t, PixelRow& pixels) const {
    for (std::size_t tile = 0; tile < photos_.size(); ++tile) {
      const Run columns = columns_.of_tile(tile);
      for (std::int64_t i = columns.first; i < columns.last; ++i) {
        const double s = x_.world(i) / grid_.extent_x() - static_cast<double>(tile);
        const ShadeTexture::Colour colour = photos_[tile].at(s, t);
        float* const out = pixels.photo.data() + 4 * (i / x_.per_pixel());
        for (std::size_t k = 0; k < 3; ++k) out[k] += colour.light[k] * colour.alpha;
        out[3] += colour.alpha;
      }
    }
  }

  /// Means of sums, and the heights beyond both ends, which go on with the slope.
  void finish(PixelRow& pixels) const {
    for (std::size_t i = 0; i < pixels.cover.size(); ++i) {
      const float cover = pixels.cover[i];
      pixels.heights[1 + i] = cover > 0.0F ? pixels.heights[1 + i] / cover : kVoid;
      if (sweep_ && cover > 0.0F) pixels.shares[i] /= cover;
    }
    const auto points = static_cast<float>(x_.per_pixel() * z_.per_pixel());
    for (float& value : pixels.photo) value /= points;
    std::vector<float>& heights = pixels.heights;
    heights.front() = width_ > 1 ? 2.0F * heights[1] - heights[2] : heights[1];
    heights.back() = width_ > 1 ? 2.0F * heights[width_] - heights[width_ - 1] : heights[1];
  }

  /// Shades and hands over the rows before `end`, but for the last one as long as the one South of it isn't there.
  void hand_over(std::int64_t end, const TakeShadedRows& take) {
    const std::int64_t last = end == size_.second ? end : end - 1;
    if (last <= taken_) return;
    const std::size_t row_bytes = width_ * static_cast<std::size_t>(samples_.channels) * size_bytes(samples_.type);
    std::vector<std::byte> bytes(row_bytes * static_cast<std::size_t>(last - taken_));
    oneapi::tbb::parallel_for(oneapi::tbb::blocked_range<std::int64_t>(taken_, last, 16), [&](const auto& some) {
      std::vector<float> scratch(3 * width_);
      std::vector<float> beyond(width_ + 2);
      for (std::int64_t row = some.begin(); row < some.end(); ++row) {
        shade_row(row, scratch, beyond, bytes.data() + row_bytes * static_cast<std::size_t>(row - taken_));
      }
    });
    take(bytes);
    taken_ = last;
    while (first_row_ < taken_ - 1) {
      rows_.pop_front();
      ++first_row_;
    }
  }

  void shade_row(std::int64_t row, std::vector<float>& scratch, std::vector<float>& beyond, std::byte* out) {
    const PixelRow& pixels = pixel_row(row);
    const auto heights_at = [&](std::int64_t other) {
      if (other >= 0 && other < size_.second) return pixel_row(other).heights.data() + 1;
      // Beyond both ends the slope goes on.
      const std::int64_t opposite = 2 * row - other;
      const bool has = opposite >= 0 && opposite < size_.second;
      const std::vector<float>& inner = has ? pixel_row(opposite).heights : pixels.heights;
      for (std::size_t i = 0; i < beyond.size(); ++i) beyond[i] = 2.0F * pixels.heights[i] - inner[i];
      return beyond.data() + 1;
    };
    const ReliefRows rows{heights_at(row - 1), pixels.heights.data() + 1, heights_at(row + 1)};
    const PixelSize pixel{x_.pixel(), z_.pixel()};
    const std::span<float> one(scratch.data(), width_);
    switch (request_.kind) {
      case ShadeKind::kPicture:
        if (request_.relief) relief_normals(rows, pixel, scratch);
        return colour_row(pixels, scratch, out);
      case ShadeKind::kHillshade:
        relief_hillshade(rows, pixel, sun_, one);
        break;
      case ShadeKind::kMultidirectional:
        relief_multidirectional(rows, pixel, request_.sun_elevation_deg, one);
        break;
      case ShadeKind::kSlope:
        relief_slope(rows, pixel, one);
        break;
      case ShadeKind::kAspect:
        relief_aspect(rows, pixel, one);
        break;
      case ShadeKind::kShadowMask:
        std::copy_n(pixels.shares.begin(), width_, one.begin());
        break;
    }
    // A slope is known by a pixel's neighbours alone.
    for (std::size_t i = 0; i < width_; ++i) {
      if (std::isnan(rows.here[i])) one[i] = kVoid;
    }
    if (samples_.type == SampleType::kUint8) {
      return bytes_from_shares(one, {reinterpret_cast<std::uint8_t*>(out), width_});
    }
    const bool is_share = !std::isfinite(*samples_.void_value);
    auto* const floats = static_cast<float*>(static_cast<void*>(out));
    for (std::size_t i = 0; i < width_; ++i) floats[i] = std::isnan(one[i]) && !is_share ? kShadeVoid : one[i];
  }

  void colour_row(const PixelRow& pixels, const std::vector<float>& normals, std::byte* out) const {
    const auto points = static_cast<float>(x_.per_pixel() * z_.per_pixel());
    for (std::size_t i = 0; i < width_; ++i) {
      const float height = pixels.heights[1 + i];
      if (std::isnan(height)) continue;
      const float alpha = pixels.cover.empty() ? 1.0F : pixels.cover[i] / points;
      const Normal normal =
          request_.relief ? Normal{normals[i], normals[width_ + i], normals[2 * width_ + i]} : Normal{0.0F, 1.0F, 0.0F};
      Light light = illumination_.on(normal, sweep_ ? pixels.shares[i] : 1.0F);
      const Light ground = palette_.at(static_cast<double>(height) / world_per_elevation_ + datum_);
      for (std::size_t k = 0; k < 3; ++k) {
        const float colour =
            textures_ ? ground[k] * (1.0F - pixels.photo[4 * i + 3]) + pixels.photo[4 * i + k] : ground[k];
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
  ReadTiles read_tiles_;
  GridSize size_;
  std::size_t width_;
  TileGrid grid_;
  PointColumns columns_;
  Palette palette_;
  Illumination illumination_;
  Normal sun_;
  double datum_;
  double world_per_elevation_;
  float share_per_depth_ = 1.0F;
  std::optional<ShadowSweep> sweep_;
  std::optional<ShadeTexture> textures_;
  TileRowValues heights_;  ///< of the row of tiles that is drawn
  std::atomic<bool> has_voids_ = false;
  TileRowValues depths_;
  std::vector<ShadeTexture::Tile> photos_;
  std::vector<ShadowSweep::State> south_;  ///< what enters each row of tiles from the South, where it is kept
  std::int64_t south_stride_ = 1;
  std::deque<PixelRow> rows_;  ///< from the last one handed over to those that are begun
  std::int64_t first_row_ = 0;
  std::int64_t taken_ = 0;
};

}  // namespace

ShadeSamples shade_samples(const ShadeOptions& options) {
  const bool is_picture = options.kind == ShadeKind::kPicture;
  if (options.kind == ShadeKind::kSlope || options.kind == ShadeKind::kAspect) {
    return {SampleType::kFloat32, 1, static_cast<double>(kShadeVoid)};
  }
  if (is_picture) return {options.floats ? SampleType::kFloat32 : SampleType::kUint8, 4, std::nullopt};
  if (options.floats) return {SampleType::kFloat32, 1, std::numeric_limits<double>::quiet_NaN()};
  return {SampleType::kUint8, 1, 0.0};
}

GridSize shade_size(const ArchiveReader& archive, std::optional<std::int64_t> longest) {
  const WorldBounds& bounds = archive.metadata().valid;
  const double side = std::max(bounds.x1 - bounds.x0, bounds.z1 - bounds.z0);
  const std::int64_t most = longest.value_or(kDefaultPixels);
  const double least = longest ? 0.0 : 2.0 * archive.grid().sigma_x();
  const double pixel = std::max(least, side / static_cast<double>(most));
  const auto pixels = [&](double length) {
    return std::clamp<std::int64_t>(static_cast<std::int64_t>(std::lround(length / pixel)), 1, most);
  };
  return {pixels(bounds.x1 - bounds.x0), pixels(bounds.z1 - bounds.z0)};
}

ShadeReport shade_rows(const ArchiveReader& archive, const ShadeOptions& options, const TakeShadedRows& take,
                       const Job& job) {
  ShadeReport report{options.size.value_or(shade_size(archive))};
  require(options, report.size);
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
    throw Error(ErrorCode::kInvalidArgument, "shade: a Picture holds bytes, not slopes, aspects or floats");
  }
  const GridSize size = options.size.value_or(shade_size(archive));
  require(options, size);
  Picture picture(static_cast<int>(size.first), static_cast<int>(size.second), samples.channels);
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
