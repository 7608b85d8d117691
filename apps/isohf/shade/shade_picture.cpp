#include "shade/shade_picture.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "isohf/archive/shadow_seeds/shadow_seed_reader.h"
#include "isohf/error.h"
#include "isohf/lattice/barycentric.h"
#include "isohf/surface/shade/normals.h"
#include "shade/shade_texture.h"

namespace isohf::cli {
namespace {

/// Tiles that are decoded and drawn side by side.
constexpr std::int64_t kBatch = 16;
/// The most places in a pixel, either way.
constexpr std::int64_t kMaxPlaces = 4;
constexpr std::size_t kMaxRowBytes = std::size_t{64} << 20U;

/// Sum of the light of a pixel's places so far, and how many of them have an elevation.
struct Pixel {
  Light light{};
  float places = 0.0F;
};

/// Places along one axis: evenly over the picture, `per_pixel` in each pixel.
class Places {
 public:
  Places(double start, double end, std::int64_t pixels, double lattice_step) : start_(start) {
    const double pixel = (end - start) / static_cast<double>(pixels);
    per_pixel_ =
        std::clamp<std::int64_t>(static_cast<std::int64_t>(std::ceil(pixel / lattice_step - 1e-9)), 1, kMaxPlaces);
    count_ = pixels * per_pixel_;
    step_ = (end - start) / static_cast<double>(count_);
  }

  [[nodiscard]] std::int64_t per_pixel() const { return per_pixel_; }
  [[nodiscard]] std::int64_t count() const { return count_; }
  [[nodiscard]] double step() const { return step_; }
  [[nodiscard]] double world(std::int64_t place) const { return start_ + (static_cast<double>(place) + 0.5) * step_; }
  /// The first place at or behind a world coordinate; count() where there is none.
  [[nodiscard]] std::int64_t first_from(double world) const {
    const double place = std::ceil((world - start_) / step_ - 0.5);
    return static_cast<std::int64_t>(std::clamp(place, 0.0, static_cast<double>(count_)));
  }

 private:
  double start_;
  double step_ = 1.0;
  std::int64_t per_pixel_ = 1;
  std::int64_t count_ = 0;
};

/// A run of places.
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

class ShadeRenderer {
 public:
  ShadeRenderer(const ArchiveReader& archive, const ShadeRequest& request, const std::atomic<bool>& cancel)
      : archive_(archive),
        request_(request),
        cancel_(cancel),
        grid_(archive.grid()),
        palette_(request.palette, low(archive), high(archive)),
        illumination_(request.travel, request.sun_elevation_deg, request.hillshade),
        x_(archive.metadata().valid.x0, archive.metadata().valid.x1, request.width, 2.0 * grid_.sigma_x()),
        z_(archive.metadata().valid.z0, archive.metadata().valid.z1, request.height, grid_.sigma_z()) {
    if (request.texture) textures_.emplace(archive, x_.step(), z_.step());
    datum_ = low(archive);
    world_per_elevation_ = request.exaggeration / request.elevation_units_per_world_unit;
    fall_ = std::tan(request.sun_elevation_deg * std::numbers::pi / 180.0);
    // Heights that are drawn larger need a sun that much higher for the same shadows.
    seed_sun_deg_ = std::atan(fall_ / request.exaggeration) * 180.0 / std::numbers::pi;
    if (request.shadows && shadow_seed_info(archive.metadata())) {
      seeds_.emplace(archive);
      const bool same_units = seeds_->info().elevation_units_per_world_unit == request.elevation_units_per_world_unit;
      if (!same_units || !seeds_->covers(seed_sun_deg_)) seeds_.reset();
    }
  }

  ShadeReport run(const std::function<void(std::span<const std::uint8_t>)>& write_rows,
                  const std::function<void(std::int64_t, std::int64_t)>& progress) {
    std::int64_t done = 0;
    for (std::int64_t row = 0; row < grid_.tile_rows(); ++row) {
      const Run places = places_of(z_, row, grid_.tile_rows(), grid_.extent_z());
      for (Run part{places.first, places.first}; part.last < places.last; part.first = part.last) {
        part.last = end_of_part(part.first, places.last);
        draw(row, part);
        flush(part.last / z_.per_pixel(), write_rows);
      }
      done += grid_.tile_columns();
      progress(done, grid_.tile_count());
    }
    return {seeds_.has_value()};
  }

 private:
  static double low(const ArchiveReader& archive) { return archive.metadata().statistics.min.value_or(0.0); }
  static double high(const ArchiveReader& archive) { return archive.metadata().statistics.max.value_or(0.0); }

  [[nodiscard]] static Run places_of(const Places& axis, std::int64_t tile, std::int64_t tiles, double extent) {
    return {tile == 0 ? 0 : axis.first_from(static_cast<double>(tile) * extent),
            tile + 1 == tiles ? axis.count() : axis.first_from(static_cast<double>(tile + 1) * extent)};
  }

  /// Rows of pixels that are held at once are bounded: a row of tiles is drawn in parts where it is very large.
  [[nodiscard]] std::int64_t end_of_part(std::int64_t first, std::int64_t last) const {
    const auto row_bytes = static_cast<std::size_t>(request_.width) * sizeof(Pixel);
    const auto rows = static_cast<std::int64_t>(std::max<std::size_t>(1, kMaxRowBytes / row_bytes));
    return std::min(last, (first / z_.per_pixel() + rows) * z_.per_pixel());
  }

  void draw(std::int64_t tile_row, const Run& rows) {
    const bool east = request_.travel == LightTravel::kEastward;
    std::vector<double> handed(static_cast<std::size_t>(visible_rows(grid_.shape())), kNoShadow);
    for (std::int64_t first = 0; first < grid_.tile_columns(); first += kBatch) {
      if (cancel_.load(std::memory_order_relaxed)) throw Error(ErrorCode::kCancelled, "interrupted");
      const std::int64_t count = std::min(kBatch, grid_.tile_columns() - first);
      std::vector<TileDrawing> batch(static_cast<std::size_t>(count));
      for (std::int64_t i = 0; i < count; ++i) {
        const std::int64_t column = east ? first + i : grid_.tile_columns() - 1 - first - i;
        batch[static_cast<std::size_t>(i)].index = {column, tile_row};
      }
      oneapi::tbb::parallel_for(std::size_t{0}, batch.size(), [&](std::size_t i) { decode(batch[i]); });
      if (request_.shadows && !seeds_) carry(batch, handed);
      oneapi::tbb::parallel_for(std::size_t{0}, batch.size(), [&](std::size_t i) { draw_tile(batch[i], rows); });
      for (const TileDrawing& tile : batch) merge(tile);
    }
  }

  [[nodiscard]] View2D<const float> view(const TileDrawing& tile) const {
    return {tile.heights.data(), grid_.shape().columns(), grid_.shape().rows()};
  }

  /// Heights, and what the tile alone would hand on or what enters it by the seeds.
  void decode(TileDrawing& tile) const {
    const TileCodes codes = archive_.read_tile(tile.index);
    const Quantisation& quantisation = archive_.metadata().quantisation;
    const bool is_float = codes.type == CodeType::kF32;
    const std::size_t n = is_float ? codes.heights.size() : codes.codes.size();
    tile.heights.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      double elevation = NAN;
      if (is_float) {
        elevation = static_cast<double>(codes.heights[i]);
      } else if (codes.codes[i] != quantisation.void_code()) {
        elevation = quantisation.offset + quantisation.scale * codes.codes[i];
      }
      tile.heights[i] = static_cast<float>((elevation - datum_) * world_per_elevation_);
    }
    if (!request_.shadows) return;
    if (seeds_) {
      tile.entering = seeds_->entering(tile.index, codes, request_.travel, seed_sun_deg_);
      for (double& height : tile.entering) height = (height - datum_) * world_per_elevation_;
    } else {
      tile.leaving.resize(static_cast<std::size_t>(visible_rows(grid_.shape())));
      tile_shadow(grid_, view(tile), light(), {}, {}, tile.leaving);
    }
  }

  [[nodiscard]] ShadowLight light() const { return {request_.travel, fall_}; }

  /// Hands shadows from tile to tile in the light's order.
  void carry(std::vector<TileDrawing>& batch, std::vector<double>& handed) const {
    const double across = grid_.extent_x() * fall_;
    for (TileDrawing& tile : batch) {
      tile.entering = handed;
      for (std::size_t i = 0; i < handed.size(); ++i) handed[i] = std::max(tile.leaving[i], handed[i] - across);
    }
  }

  void draw_tile(TileDrawing& tile, const Run& rows) const {
    const Run columns = places_of(x_, tile.index.column, grid_.tile_columns(), grid_.extent_x());
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
        add_place(tile, shadow, normals, barycentric(shape, {x, z}), colour,
                  row[i / x_.per_pixel() - tile.first_pixel_x]);
      }
    }
  }

  void add_place(const TileDrawing& tile, const std::vector<float>& shadow, const std::vector<Normal>& normals,
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
    const double softness = request_.softness * world_per_elevation_;
    const double share = request_.shadows ? sun_share_on_surface(height, dark_to, softness) : 1.0;
    const Light light = illumination_.on(normal, share);
    const Light& ground = palette_.at(height / world_per_elevation_ + datum_);
    for (std::size_t k = 0; k < 3; ++k) {
      pixel.light[k] += (ground[k] + (photo.light[k] - ground[k]) * photo.alpha) * light[k];
    }
    pixel.places += 1.0F;
  }

  void merge(const TileDrawing& tile) {
    const std::int64_t width = request_.width;
    for (std::int64_t y = 0; y < tile.pixels_y; ++y) {
      const auto row = static_cast<std::size_t>(tile.first_pixel_y + y - first_row_);
      if (rows_.size() < (row + 1) * static_cast<std::size_t>(width)) {
        rows_.resize((row + 1) * static_cast<std::size_t>(width));
      }
      Pixel* const to = rows_.data() + row * static_cast<std::size_t>(width) + tile.first_pixel_x;
      const Pixel* const from = tile.pixels.data() + y * tile.pixels_x;
      for (std::int64_t x = 0; x < tile.pixels_x; ++x) {
        for (std::size_t k = 0; k < 3; ++k) to[x].light[k] += from[x].light[k];
        to[x].places += from[x].places;
      }
    }
  }

  /// Hands over the rows before `end`, which nothing will be added to.
  void flush(std::int64_t end, const std::function<void(std::span<const std::uint8_t>)>& write_rows) {
    const auto count = static_cast<std::size_t>(end - first_row_);
    if (count == 0) return;
    const auto width = static_cast<std::size_t>(request_.width);
    rows_.resize(std::max(rows_.size(), count * width));
    std::vector<std::uint8_t> bytes(count * width * kShadeChannels);
    const auto places = static_cast<float>(x_.per_pixel() * z_.per_pixel());
    oneapi::tbb::parallel_for(std::size_t{0}, count, [&](std::size_t row) {
      for (std::size_t i = row * width; i < (row + 1) * width; ++i) {
        const Pixel& pixel = rows_[i];
        if (pixel.places == 0.0F) continue;
        std::uint8_t* const out = bytes.data() + i * kShadeChannels;
        for (std::size_t k = 0; k < 3; ++k) out[k] = value_from_light(pixel.light[k] / pixel.places);
        out[3] = static_cast<std::uint8_t>(pixel.places / places * 255.0F + 0.5F);
      }
    });
    write_rows(bytes);
    rows_.erase(rows_.begin(), rows_.begin() + static_cast<std::ptrdiff_t>(count * width));
    first_row_ = end;
  }

  const ArchiveReader& archive_;
  const ShadeRequest& request_;
  const std::atomic<bool>& cancel_;
  const TileGrid& grid_;
  Palette palette_;
  Illumination illumination_;
  Places x_;
  Places z_;
  double datum_ = 0.0;
  double world_per_elevation_ = 1.0;
  double fall_ = 1.0;
  double seed_sun_deg_ = 0.0;
  std::optional<ShadowSeedReader> seeds_;
  std::optional<ShadeTexture> textures_;
  std::vector<Pixel> rows_;  ///< rows of the picture that are not handed over yet
  std::int64_t first_row_ = 0;
};

}  // namespace

ShadeReport render_shade(const ArchiveReader& archive, const ShadeRequest& request,
                         const std::function<void(std::span<const std::uint8_t>)>& write_rows,
                         const std::function<void(std::int64_t, std::int64_t)>& progress,
                         const std::atomic<bool>& cancel) {
  return ShadeRenderer(archive, request, cancel).run(write_rows, progress);
}

}  // namespace isohf::cli
