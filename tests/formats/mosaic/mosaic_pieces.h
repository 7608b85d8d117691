#pragma once

#include <cstdint>
#include <cstring>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "formats/mosaic/mosaic_source.h"
#include "isohf/raster.h"
#include "support/rasters/place_at.h"
#include "support/rasters/raster.h"

namespace isohf::test {

/// A raster in memory that is cut into files.
struct CutRaster {
  RasterSpec spec;
  std::vector<std::byte> samples;

  [[nodiscard]] std::size_t sample_bytes() const { return size_bytes(spec.sample_type); }

  [[nodiscard]] std::vector<std::byte> part(const Window& window) const {
    std::vector<std::byte> out;
    for (std::int64_t row = window.row; row < window.row + window.rows; ++row) {
      const auto from =
          samples.begin() + (row * spec.width + window.column) * static_cast<std::ptrdiff_t>(sample_bytes());
      out.insert(out.end(), from, from + window.columns * static_cast<std::ptrdiff_t>(sample_bytes()));
    }
    return out;
  }

  [[nodiscard]] RasterSpec spec_of(const Window& window) const {
    RasterSpec piece = spec;
    piece.width = window.columns;
    piece.height = window.rows;
    piece.georeference->origin_x += static_cast<double>(window.column) * piece.georeference->spacing_x;
    piece.georeference->origin_y -= static_cast<double>(window.row) * piece.georeference->spacing_y;
    return piece;
  }

  /// Writes a piece as GeoTIFF.
  void cut(const std::string& path, const Window& window) const { write_raster(path, spec_of(window), part(window)); }
};

/// A georeferenced raster without samples: EPSG 32632, 30 m, or WGS 84 with `degrees`.
inline RasterSpec placed_spec(std::int64_t width, std::int64_t height, SampleType type, Registration registration,
                              bool degrees = false) {
  RasterSpec spec = raster_spec(width, height, type);
  spec.georeference = degrees ? place_at(registration, HorizontalUnit::kDegree, 7.0, 46.0, 1.0 / 1200.0, 4326)
                              : place_at(registration, HorizontalUnit::kMetre, 500015.0, 5200000.0, 30.0, 32632);
  return spec;
}

/// Samples of random bits; floats may be NaN and infinite.
inline CutRaster noise_raster(const RasterSpec& spec) {
  CutRaster raster{spec, {}};
  raster.samples.resize(static_cast<std::size_t>(spec.width * spec.height) * raster.sample_bytes());
  std::mt19937 random(11);
  for (std::byte& byte : raster.samples) byte = static_cast<std::byte>(random() & 0xFFU);
  return raster;
}

/// Samples of type T as `sample` gives them.
template <typename T>
CutRaster raster_of(const RasterSpec& spec, const std::function<double(std::int64_t, std::int64_t)>& sample) {
  CutRaster raster{spec, {}};
  raster.samples.resize(static_cast<std::size_t>(spec.width * spec.height) * sizeof(T));
  std::size_t at = 0;
  for (std::int64_t row = 0; row < spec.height; ++row) {
    for (std::int64_t column = 0; column < spec.width; ++column, at += sizeof(T)) {
      const T value = static_cast<T>(sample(column, row));
      std::memcpy(raster.samples.data() + at, &value, sizeof(T));
    }
  }
  return raster;
}

/// Columns by rows of pieces of about one size; the last ones smaller. `shared`: samples that neighbours share.
inline std::vector<Window> regular_cut(std::int64_t width, std::int64_t height, std::int64_t piece,
                                       std::int64_t shared = 0) {
  std::vector<Window> windows;
  for (std::int64_t row = 0; row + shared < height; row += piece) {
    for (std::int64_t column = 0; column + shared < width; column += piece) {
      windows.push_back(
          {column, row, std::min(piece + shared, width - column), std::min(piece + shared, height - row)});
    }
  }
  return windows;
}

/// Cuts at random places until pieces are small: no common grid of places, every size.
inline std::vector<Window> ragged_cut(std::int64_t width, std::int64_t height, unsigned seed, int cuts) {
  std::mt19937 random(seed);
  std::vector<Window> windows = {{0, 0, width, height}};
  for (int i = 0; i < cuts; ++i) {
    const std::size_t at = random() % windows.size();
    Window& one = windows[at];
    Window other = one;
    if (random() % 2 == 0 && one.columns > 1) {
      one.columns = 1 + static_cast<std::int64_t>(random()) % (one.columns - 1);
      other.column += one.columns;
      other.columns -= one.columns;
    } else if (one.rows > 1) {
      one.rows = 1 + static_cast<std::int64_t>(random()) % (one.rows - 1);
      other.row += one.rows;
      other.rows -= one.rows;
    } else {
      continue;
    }
    windows.push_back(other);
  }
  return windows;
}

/// Writes the pieces into a folder that ends in "/"; their paths.
inline std::vector<std::string> write_pieces(const CutRaster& raster, const std::string& folder,
                                             const std::vector<Window>& windows) {
  std::vector<std::string> paths;
  for (std::size_t i = 0; i < windows.size(); ++i) {
    paths.push_back(folder + "piece" + std::to_string(i) + ".tif");
    raster.cut(paths.back(), windows[i]);
  }
  return paths;
}

inline std::unique_ptr<MosaicSource> open_mosaic(const std::vector<std::string>& paths,
                                                 OverlapRule rule = OverlapRule::kLast,
                                                 const OpenOptions& options = {}) {
  return std::make_unique<MosaicSource>("mosaic", plan_mosaic(paths, options), options, rule);
}

}  // namespace isohf::test
