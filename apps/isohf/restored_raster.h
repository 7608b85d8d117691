#pragma once

#include <string>

#include "formats/raster_sink.h"
#include "isohf/archive/reader.h"
#include "isohf/restore/residual_codec.h"
#include "isohf/restore/surface_rows.h"

namespace isohf::cli {

/// The format of a raster by its extension, in any case; kOther where create_raster() knows none.
enum class RasterKind { kTiff, kExr, kPng, kHgt, kAsc, kFlt, kRaw16, kRaw32, kNpy, kOther };
[[nodiscard]] RasterKind raster_kind(const std::string& path);

/// Whether the file, or the one beside it, says what scale and offset are.
[[nodiscard]] bool has_scale(RasterKind kind);

/// The sample type of a raster restored to `path`: the source's own where the format holds it, else the nearest that
/// it holds (float32 in EXR and GridFloat, int16 in HGT, uint16 in PNG and .r16).
[[nodiscard]] SampleType restored_type(const std::string& path, SampleType source_type);

/// What a raster of that grid is: size, place and reference system as the source's, so far as they are known.
[[nodiscard]] RasterSpec restored_raster(const Metadata& metadata, const SampleGrid& grid, SampleType type);

/// The source's own raster, in its own reference system also where it was projected.
[[nodiscard]] RasterSpec source_raster(const Metadata& metadata, SampleType type);

/// Where a grid of the world lies on the map that the archive's source was projected to (is_warped), its samples areas.
[[nodiscard]] Georeference map_georeference(const Metadata& metadata, const SampleGrid& grid);

/// The grid of the archive's source; where that was projected, square areas as large as its own over the rectangle
/// around its ground.
[[nodiscard]] SampleGrid natural_grid(const Metadata& metadata);

/// True where samples of rasters of the archive stand for areas: as the source's, or on a map.
[[nodiscard]] bool samples_are_areas(const Metadata& metadata);

/// The source's body and horizontal reference system, as recorded.
[[nodiscard]] ReferenceSystem horizontal_system(const SourceRecord& source);

/// The part of the world between these coordinates of the source. Throws Error{kInvalidArgument} where the archive does
/// not know where its source lay.
[[nodiscard]] WorldBounds world_bounds(const Metadata& metadata, double west, double south, double east, double north);

/// The grid of another raster of elevations, in the archive's world: by the origins of both where they are known in
/// the same unit, else from the North-West corner.
[[nodiscard]] SampleGrid grid_like(const Metadata& metadata, const SourceInfo& other);

}  // namespace isohf::cli
