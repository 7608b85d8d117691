#pragma once

#include <string>

#include "formats/raster_sink.h"
#include "isohf/archive/reader.h"
#include "isohf/restore/residual_codec.h"
#include "isohf/restore/surface_rows.h"

namespace isohf::cli {

/// The format of a raster by its extension, in any case; kOther where create_raster() knows none.
enum class RasterKind { kTiff, kExr, kPng, kHgt, kOther };
[[nodiscard]] RasterKind raster_kind(const std::string& path);

/// The sample type of a raster restored to `path`: the source's own where the format holds it, else the nearest that
/// it holds (float32 in EXR, int16 in HGT, uint16 in PNG).
[[nodiscard]] SampleType restored_type(const std::string& path, SampleType source_type);

/// What a raster of that grid is: size, place and reference system as the source's, so far as they are known.
[[nodiscard]] RasterSpec restored_raster(const Metadata& metadata, const SampleGrid& grid, SampleType type);

/// The source's body and horizontal reference system, as recorded.
[[nodiscard]] ReferenceSystem horizontal_system(const SourceRecord& source);

/// The grid of another raster of elevations, in the archive's world: by the origins of both where they are known in
/// the same unit, else from the North-West corner.
[[nodiscard]] SampleGrid grid_like(const Metadata& metadata, const SourceInfo& other);

}  // namespace isohf::cli
