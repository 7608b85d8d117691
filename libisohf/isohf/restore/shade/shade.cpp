#include "isohf/shade.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <optional>
#include <vector>

#include "isohf/archive/codec/quantise.h"
#include "isohf/archive/planes/archive_planes.h"
#include "isohf/archive/shadow_seeds/shadow_seed_reader.h"
#include "isohf/archive/textures/texture_reader.h"
#include "isohf/base/arena.h"
#include "isohf/error.h"
#include "isohf/lattice/barycentric.h"
#include "isohf/restore/point_sampler.h"
#include "isohf/restore/shade/light.h"
#include "isohf/surface/photo/srgb.h"
#include "isohf/surface/shade/normals.h"
#include "isohf/surface/shade/shadow.h"

namespace isohf {
namespace {

/// Tiles that are decoded and drawn side by side.
constexpr std::int64_t kBatch = 16;
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

/// Sum of the light of a pixel's points so far, and how many of them have an elevation.
struct Pixel {
  Light light{};
  float points = 0.0F;
};

/// Points along one axis: evenly over the picture, `per_pixel` in each pixel.
class PixelAxis {
 public:
  PixelAxis(double start, double end, std::int64_t pixels, double lattice_step) : start_(start) {
    const double pixel = (end - start) / static_cast<double>(pixels);
    per_pixel_ = std::clamp<std::int64_t>(static_cast<std::int64_t>(std::ceil(pixel / lattice_step - 1e-9)), 1,
                                          kMaxPointsPerPixel);
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
  [[nodiscard]] bool empty() const { return first >= last; }
};

/// One tile, decoded and drawn.
struct TileDrawing {
  TileIndex index{};
  std::vector<float> heights;    ///< world units above the datum, NaN where void
  std::vector<double> entering;  ///< shadow heights in the same units
  std::vector<double> leaving;
  std::int64_t first_pixel_x = 0;
  std::int64_t first_pixel_y = 0;
  std::int64_t pixels_x = 0;
  std::int64_t pixels_y = 0;
  std::vector<Pixel> pixels;
};

constexpr std::int64_t kMostPixels = 1 << 20;  ///< of a side
constexpr std::int64_t kDefaultPixels = 2048;
/// Eq. 16's k where the relief is that of mountains; in flatter lands this share of the elevation range.
constexpr double kDefaultSoftness = 2.0;
constexpr double kDefaultSoftnessShare = 0.005;

double default_softness(const Metadata& metadata) {
  const Statistics& statistics = metadata.statistics;
  const double range = statistics.min && statistics.max ? *statistics.max - *statistics.min : 0.0;
  return range > 0.0 ? std::min(kDefaultSoftness, kDefaultSoftnessShare * range) : kDefaultSoftness;
}

/// Throws Error{kInvalidArgument} for options that are out of their ranges.
void require(const ShadeOptions& options, const GridSize& size) {
  const auto check = [](bool holds, const char* what) {
    if (!holds) throw Error(ErrorCode::kInvalidArgument, std::string("shade: ") + what);
  };
  check(size.first >= 1 && size.second >= 1 && size.first <= kMostPixels && size.second <= kMostPixels,
        "the picture must have 1 to 2^20 pixels a side");
  check(options.sun_elevation_deg > 0.0 && options.sun_elevation_deg < 90.0,
        "the sun must stand above 0 and below 90 degrees");
  check(options.exaggeration > 0.0 && std::isfinite(options.exaggeration), "the exaggeration must be above 0");
  check(!options.softness || *options.softness > 0.0, "the shadow's softness must be above 0");
  check(options.elevation_units_per_world_unit > 0.0, "the elevation units in one world unit must be above 0");
}

class ShadeRenderer {
 public:
  ShadeRenderer(const ArchiveReader& archive, const ShadeOptions& request, const GridSize& size, const Job& job)
      : archive_(archive),
        request_(request),
        job_(job),
        x_(archive.metadata().valid.x0, archive.metadata().valid.x1, size.first, 2.0 * archive.grid().sigma_x()),
        z_(archive.metadata().valid.z0, archive.metadata().valid.z1, size.second, archive.grid().sigma_z()),
        plane_(request.texture
                   ? 0
                   : planes_of(archive.metadata())
                         .plane_for_spacing(x_.pixel() / kVerticesPerPixel, z_.pixel() / kVerticesPerPixel)),
        read_tiles_(tiles_of(archive, plane_)),
        width_(size.first),
        grid_(archive.metadata().plane_grid(plane_)),
        palette_(request.palette, low(archive), high(archive)),
        illumination_(request.sun, request.sun_elevation_deg, request.hillshade) {
    if (request.texture) textures_.emplace(archive, x_.step(), z_.step());
    datum_ = low(archive);
    softness_ = request.softness.value_or(default_softness(archive.metadata()));
    world_per_elevation_ = request.exaggeration / request.elevation_units_per_world_unit;
    fall_ = std::tan(request.sun_elevation_deg * std::numbers::pi / 180.0);
    // Heights that are drawn larger need a sun that much higher for the same shadows.
    seed_sun_deg_ = std::atan(fall_ / request.exaggeration) * 180.0 / std::numbers::pi;
    if (plane_ == 0 && request.shadows && shadow_seed_info(archive.metadata())) {
      seeds_.emplace(archive);
      const bool same_units = seeds_->info().elevation_units_per_world_unit == request.elevation_units_per_world_unit;
      if (!same_units || !seeds_->covers(seed_sun_deg_)) seeds_.reset();
    }
  }

  [[nodiscard]] int plane() const { return plane_; }

  /// Returns whether shadow seeds were used.
  bool run(const TakeShadedRows& take) {
    std::int64_t done = 0;
    for (std::int64_t row = 0; row < grid_.tile_rows(); ++row) {
      const Run points = points_of(z_, row, grid_.tile_rows(), grid_.extent_z());
      for (Run part{points.first, points.first}; part.last < points.last; part.first = part.last) {
        part.last = end_of_part(part.first, points.last);
        draw(row, part);
        flush(part.last / z_.per_pixel(), take);
      }
      done += grid_.tile_columns();
      job_.report({"shade", "tiles", done, grid_.tile_count()});
    }
    return seeds_.has_value();
  }

 private:
  static double low(const ArchiveReader& archive) { return archive.metadata().statistics.min.value_or(0.0); }
  static double high(const ArchiveReader& archive) { return archive.metadata().statistics.max.value_or(0.0); }

  [[nodiscard]] static Run points_of(const PixelAxis& axis, std::int64_t tile, std::int64_t tiles, double extent) {
    return {tile == 0 ? 0 : axis.first_from(static_cast<double>(tile) * extent),
            tile + 1 == tiles ? axis.count() : axis.first_from(static_cast<double>(tile + 1) * extent)};
  }

  /// Rows of pixels that are held at once are bounded: a row of tiles is drawn in parts where it is very large.
  [[nodiscard]] std::int64_t end_of_part(std::int64_t first, std::int64_t last) const {
    const auto row_bytes = static_cast<std::size_t>(width_) * sizeof(Pixel);
    const auto rows = static_cast<std::int64_t>(std::max<std::size_t>(1, kMaxRowBytes / row_bytes));
    return std::min(last, (first / z_.per_pixel() + rows) * z_.per_pixel());
  }

  void draw(std::int64_t tile_row, const Run& rows) {
    const bool east = travel() == LightTravel::kEastward;
    std::vector<double> handed(static_cast<std::size_t>(visible_rows(grid_.shape())), kNoShadow);
    for (std::int64_t first = 0; first < grid_.tile_columns(); first += kBatch) {
      job_.throw_if_cancelled();
      const std::int64_t count = std::min(kBatch, grid_.tile_columns() - first);
      std::vector<TileDrawing> batch(static_cast<std::size_t>(count));
      std::vector<TileIndex> tiles;
      for (std::int64_t i = 0; i < count; ++i) {
        const std::int64_t column = east ? first + i : grid_.tile_columns() - 1 - first - i;
        tiles.push_back(batch[static_cast<std::size_t>(i)].index = {column, tile_row});
      }
      for_each_tile(read_tiles_, tiles, [&](std::size_t i, const TileCodes& codes) { prepare(codes, batch[i]); });
      if (request_.shadows && !seeds_) carry(batch, handed);
      oneapi::tbb::parallel_for(std::size_t{0}, batch.size(), [&](std::size_t i) { draw_tile(batch[i], rows); });
      for (const TileDrawing& tile : batch) merge(tile);
    }
  }

  [[nodiscard]] View2D<const float> view(const TileDrawing& tile) const {
    return {tile.heights.data(), grid_.shape().columns(), grid_.shape().rows()};
  }

  /// Heights, and what the tile alone would hand on or what enters it by the seeds.
  void prepare(const TileCodes& codes, TileDrawing& tile) const {
    tile.heights.resize(static_cast<std::size_t>(grid_.shape().stored_vertex_count()));
    for (std::size_t i = 0; i < tile.heights.size(); ++i) {
      const double elevation = elevation_of_vertex(codes, archive_.metadata().quantisation, i);
      tile.heights[i] = static_cast<float>((elevation - datum_) * world_per_elevation_);
    }
    if (!request_.shadows) return;
    if (seeds_) {
      tile.entering = seeds_->entering(tile.index, codes, travel(), seed_sun_deg_);
      for (double& height : tile.entering) height = (height - datum_) * world_per_elevation_;
    } else {
      tile.leaving.resize(static_cast<std::size_t>(visible_rows(grid_.shape())));
      tile_shadow(grid_, view(tile), light(), {}, {}, tile.leaving);
    }
  }

  [[nodiscard]] ShadowLight light() const { return {travel(), fall_}; }
  [[nodiscard]] LightTravel travel() const {
    return request_.sun == SunSide::kWest ? LightTravel::kEastward : LightTravel::kWestward;
  }

  /// Hands shadows from tile to tile in the light's order.
  void carry(std::vector<TileDrawing>& batch, std::vector<double>& handed) const {
    const double across = grid_.extent_x() * fall_;
    for (TileDrawing& tile : batch) {
      tile.entering = handed;
      for (std::size_t i = 0; i < handed.size(); ++i) handed[i] = std::max(tile.leaving[i], handed[i] - across);
    }
  }

  void draw_tile(TileDrawing& tile, const Run& rows) const {
    const Run columns = points_of(x_, tile.index.column, grid_.tile_columns(), grid_.extent_x());
    if (columns.empty() || rows.empty()) return;
    const TileShape& shape = grid_.shape();
    std::vector<float> shadow;
    if (request_.shadows) {
      shadow.resize(tile.heights.size());
      tile_shadow(grid_, view(tile), light(), tile.entering, {shadow.data(), shape.columns(), shape.rows()}, {});
    }
    std::vector<Normal> normals;
    if (request_.hillshade) {
      normals.resize(tile.heights.size());
      tile_normals(grid_, view(tile), {normals.data(), shape.columns(), shape.rows()});
    }
    const ShadeTexture::Tile texture = textures_ ? textures_->read(tile.index) : ShadeTexture::Tile();
    tile.first_pixel_x = columns.first / x_.per_pixel();
    tile.first_pixel_y = rows.first / z_.per_pixel();
    tile.pixels_x = (columns.last - 1) / x_.per_pixel() + 1 - tile.first_pixel_x;
    tile.pixels_y = (rows.last - 1) / z_.per_pixel() + 1 - tile.first_pixel_y;
    tile.pixels.assign(static_cast<std::size_t>(tile.pixels_x * tile.pixels_y), {});
    const double x_scale = 1.0 / grid_.sigma_x();
    const double z_scale = 1.0 / grid_.sigma_z();
    for (std::int64_t j = rows.first; j < rows.last; ++j) {
      const double z = (z_.world(j) - static_cast<double>(tile.index.row) * grid_.extent_z()) * z_scale;
      Pixel* const row = tile.pixels.data() + (j / z_.per_pixel() - tile.first_pixel_y) * tile.pixels_x;
      for (std::int64_t i = columns.first; i < columns.last; ++i) {
        const double x = (x_.world(i) - static_cast<double>(tile.index.column) * grid_.extent_x()) * x_scale;
        const ShadeTexture::Colour colour = texture.at(x / (2.0 * shape.cell_columns()), z / shape.cell_rows());
        add_point(tile, shadow, normals, barycentric(shape, {x, z}), colour,
                  row[i / x_.per_pixel() - tile.first_pixel_x]);
      }
    }
  }

  void add_point(const TileDrawing& tile, const std::vector<float>& shadow, const std::vector<Normal>& normals,
                 const Barycentric& at, const ShadeTexture::Colour& photo, Pixel& pixel) const {
    double height = 0.0;
    double dark_to = 0.0;
    Normal normal{0.0F, 0.0F, 0.0F};
    for (std::size_t k = 0; k < 3; ++k) {
      if (!(at.weights[k] > 0.0)) continue;
      const auto vertex =
          static_cast<std::size_t>(at.vertices[k].row) * static_cast<std::size_t>(grid_.shape().columns()) +
          static_cast<std::size_t>(at.vertices[k].column);
      height += at.weights[k] * static_cast<double>(tile.heights[vertex]);
      if (request_.shadows) dark_to += at.weights[k] * static_cast<double>(shadow[vertex]);
      if (request_.hillshade) {
        const auto weight = static_cast<float>(at.weights[k]);
        normal.x += weight * normals[vertex].x;
        normal.y += weight * normals[vertex].y;
        normal.z += weight * normals[vertex].z;
      }
    }
    if (std::isnan(height)) return;
    if (request_.hillshade) {
      const float length = std::sqrt(normal.x * normal.x + normal.y * normal.y + normal.z * normal.z);
      normal = {normal.x / length, normal.y / length, normal.z / length};
    }
    const double softness = softness_ * world_per_elevation_;
    const double share = request_.shadows ? sun_share_on_surface(height, dark_to, softness) : 1.0;
    const Light light = illumination_.on(normal, share);
    const Light& ground = palette_.at(height / world_per_elevation_ + datum_);
    for (std::size_t k = 0; k < 3; ++k) {
      pixel.light[k] += (ground[k] + (photo.light[k] - ground[k]) * photo.alpha) * light[k];
    }
    pixel.points += 1.0F;
  }

  void merge(const TileDrawing& tile) {
    const std::int64_t width = width_;
    for (std::int64_t y = 0; y < tile.pixels_y; ++y) {
      const auto row = static_cast<std::size_t>(tile.first_pixel_y + y - first_row_);
      if (rows_.size() < (row + 1) * static_cast<std::size_t>(width)) {
        rows_.resize((row + 1) * static_cast<std::size_t>(width));
      }
      Pixel* const to = rows_.data() + row * static_cast<std::size_t>(width) + tile.first_pixel_x;
      const Pixel* const from = tile.pixels.data() + y * tile.pixels_x;
      for (std::int64_t x = 0; x < tile.pixels_x; ++x) {
        for (std::size_t k = 0; k < 3; ++k) to[x].light[k] += from[x].light[k];
        to[x].points += from[x].points;
      }
    }
  }

  /// Hands over the rows before `end`, which nothing will be added to.
  void flush(std::int64_t end, const TakeShadedRows& take) {
    const auto count = static_cast<std::size_t>(end - first_row_);
    if (count == 0) return;
    const auto width = static_cast<std::size_t>(width_);
    rows_.resize(std::max(rows_.size(), count * width));
    std::vector<std::uint8_t> bytes(count * width * kShadeChannels);
    const auto points = static_cast<float>(x_.per_pixel() * z_.per_pixel());
    oneapi::tbb::parallel_for(std::size_t{0}, count, [&](std::size_t row) {
      for (std::size_t i = row * width; i < (row + 1) * width; ++i) {
        const Pixel& pixel = rows_[i];
        if (pixel.points == 0.0F) continue;
        std::uint8_t* const out = bytes.data() + i * kShadeChannels;
        for (std::size_t k = 0; k < 3; ++k) out[k] = value_from_light(pixel.light[k] / pixel.points);
        out[3] = static_cast<std::uint8_t>(pixel.points / points * 255.0F + 0.5F);
      }
    });
    take(bytes);
    rows_.erase(rows_.begin(), rows_.begin() + static_cast<std::ptrdiff_t>(count * width));
    first_row_ = end;
  }

  const ArchiveReader& archive_;
  const ShadeOptions& request_;
  const Job& job_;
  PixelAxis x_;
  PixelAxis z_;
  int plane_;  ///< the coarsest with vertices enough
  ReadTiles read_tiles_;
  std::int64_t width_;
  TileGrid grid_;
  Palette palette_;
  Illumination illumination_;
  double datum_ = 0.0;
  double world_per_elevation_ = 1.0;
  double fall_ = 1.0;
  double softness_ = 2.0;
  double seed_sun_deg_ = 0.0;
  std::optional<ShadowSeedReader> seeds_;
  std::optional<ShadeTexture> textures_;
  std::vector<Pixel> rows_;  ///< rows of the picture that are not handed over yet
  std::int64_t first_row_ = 0;
};

}  // namespace

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
    report.used_seeds = renderer.run(take);
  });
  return report;
}

Picture shade(const ArchiveReader& archive, const ShadeOptions& options, const Job& job) {
  const GridSize size = options.size.value_or(shade_size(archive));
  require(options, size);
  Picture picture(static_cast<int>(size.first), static_cast<int>(size.second), static_cast<int>(kShadeChannels));
  std::size_t done = 0;
  (void)shade_rows(
      archive, options,
      [&](std::span<const std::uint8_t> rows) {
        std::copy(rows.begin(), rows.end(), picture.samples.begin() + static_cast<std::ptrdiff_t>(done));
        done += rows.size();
      },
      job);
  return picture;
}

}  // namespace isohf
