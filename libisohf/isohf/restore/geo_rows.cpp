#include "isohf/restore/geo_rows.h"

#include <fmt/format.h>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <cmath>
#include <utility>
#include <vector>

#include "isohf/base/assert.h"
#include "isohf/error.h"

namespace isohf {

GeoRows::GeoRows(const Metadata& metadata, SurfaceRows::ReadTile read_tile, const GeoGrid& samples)
    : places_(metadata), samples_(samples), surface_(metadata.grid, metadata.quantisation, std::move(read_tile)) {
  places_.require_geo();
  if (samples.width < 1 || samples.height < 1 || !(samples.degrees_x > 0.0) || !(samples.degrees_y > 0.0)) {
    throw Error(
        ErrorCode::kInvalidArgument,
        fmt::format("a grid of {}x{} samples {} x {} degrees apart, must have at least one and positive spacing",
                    samples.width, samples.height, samples.degrees_x, samples.degrees_y));
  }
}

void GeoRows::read(std::int64_t first, std::int64_t rows, std::span<double> elevations) {
  ISOHF_ASSERT(elevations.size() == static_cast<std::size_t>(rows * samples_.width));
  std::vector<WorldPoint> places(elevations.size());
  oneapi::tbb::parallel_for(
      oneapi::tbb::blocked_range<std::size_t>(0, places.size(), 1024),
      [&](const oneapi::tbb::blocked_range<std::size_t>& part) {
        for (std::size_t i = part.begin(); i < part.end(); ++i) {
          const auto sample = static_cast<std::int64_t>(i);
          const auto column = static_cast<double>(sample % samples_.width);
          const auto row = static_cast<double>(first + sample / samples_.width);
          places[i] = places_.world_from_geo({samples_.first_sample.longitude + column * samples_.degrees_x,
                                              samples_.first_sample.latitude - row * samples_.degrees_y});
        }
      });
  surface_.read(places, elevations);
}

}  // namespace isohf
