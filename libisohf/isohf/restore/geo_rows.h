#pragma once

#include <cstdint>
#include <span>

#include "isohf/metadata.h"
#include "isohf/restore/archive_geometry.h"
#include "isohf/restore/scattered_surface.h"

namespace isohf {

/// The samples of a raster in degrees, from North to South and West to East.
struct GeoGrid {
  std::int64_t width = 0;
  std::int64_t height = 0;
  GeoPoint first_sample;
  double degrees_x = 1.0;  ///< between columns, > 0
  double degrees_y = 1.0;  ///< between rows, > 0
};

/// The surface of an archive whose source was in degrees at the samples of another raster in degrees, on the triangles,
/// row by row. Each sample goes through the projection by itself: what is found is what lies at its longitude and
/// latitude, however coarse or fine the raster is.
///
/// Memory grows with the samples of a call, not with those before. Works on the caller's oneTBB arena; the bits depend
/// on archive and grid alone.
class GeoRows {
 public:
  /// Throws Error{kInvalidArgument} where the source has no place in degrees.
  GeoRows(const Metadata& metadata, SurfaceRows::ReadTile read_tile, const GeoGrid& samples);

  /// elevations [rows * width] out, vertical units, of rows `first` and on; NaN where the surface has a void or ends,
  /// and where the map has no place.
  void read(std::int64_t first, std::int64_t rows, std::span<double> elevations);

 private:
  GeoPlaces places_;
  GeoGrid samples_;
  ScatteredSurface surface_;
};

}  // namespace isohf
