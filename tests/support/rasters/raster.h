#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/registry.h"
#include "formats/write/raster_sink.h"
#include "isohf/base/sample.h"
#include "isohf/raster.h"
#include "support/rasters/samples.h"

/// Raster files, written and read whole.
namespace isohf::test {

struct Raster {
  SourceInfo info;
  std::vector<std::byte> raw;     ///< as stored
  std::vector<float> elevations;  ///< NaN where void

  [[nodiscard]] float at(std::int64_t column, std::int64_t row) const {
    return elevations[static_cast<std::size_t>(row * info.width + column)];
  }
};

inline Raster read_raster(const std::string& path, const OpenOptions& options = {}) {
  const auto source = open_raster(path, options);
  Raster raster{source->info(), read_whole(*source), {}};
  raster.elevations.resize(static_cast<std::size_t>(raster.info.width * raster.info.height));
  heights_from_samples(raster.info, 0.0, raster.raw, raster.elevations);
  return raster;
}

/// A raster without a place.
inline RasterSpec raster_spec(std::int64_t width, std::int64_t height, SampleType type, int channels = 1) {
  RasterSpec spec;
  spec.width = width;
  spec.height = height;
  spec.sample_type = type;
  spec.channels = channels;
  return spec;
}

inline void write_raster(const std::string& path, const RasterSpec& spec, std::span<const std::byte> samples) {
  const auto sink = create_raster(path, spec);
  sink->write_rows(samples);
  sink->finish();
}

}  // namespace isohf::test
