#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "isohf/surface/resample/kernels.h"
#include "isohf/surface/resample/source_warp.h"
#include "isohf/surface/resample/vertex_cutter.h"
#include "isohf/surface/source/source_axis.h"
#include "isohf/surface/source/source_scan.h"

namespace isohf {

/// Where a source's samples lie in the world: all that resampling it needs beside the samples.
struct SourceGeometry {
  std::int64_t width = 0;
  std::int64_t height = 0;
  Registration registration = Registration::kPoint;
  double first_sample_x = 0.0;  ///< world place of sample (0, 0)
  double first_sample_z = 0.0;
  double spacing_x = 1.0;  ///< world units between columns and rows
  double spacing_z = 1.0;
  Outside outside = Outside::kCover;
  bool wraps_x = false;           ///< the East edge is the West edge
  std::optional<WarpPlace> warp;  ///< where the source was projected; first sample and spacings then say nothing
};

/// The source's axes as the cutter of this grid reads them: in world units, or in positions where it was projected.
struct SourceAxes {
  SourceAxis x;
  SourceAxis z;
};
[[nodiscard]] SourceAxes make_axes(const TileGrid& grid, const SourceGeometry& geometry);

/// `limits` as in TileCutter.
[[nodiscard]] std::unique_ptr<VertexCutter> make_cutter(const TileGrid& grid, const SourceGeometry& geometry,
                                                        const Kernel& kernel, const ElevationRange& limits);

}  // namespace isohf
