#pragma once

#include <optional>
#include <string>

#include "formats/write/raster_sink.h"
#include "isohf/archive.h"
#include "isohf/restore/residual_codec.h"
#include "isohf/restore/surface_rows.h"
#include "raster/output_grid.h"

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
[[nodiscard]] RasterSpec restored_raster(const Metadata& metadata, const OutputGrid& grid, SampleType type);

/// The source's own raster, in its own reference system also where it was projected.
[[nodiscard]] RasterSpec source_raster(const Metadata& metadata, SampleType type);

/// Where a grid of the world lies on the map that the archive's source was projected to (is_warped), its samples areas.
[[nodiscard]] Georeference map_georeference(const Metadata& metadata, const SampleGrid& grid);

/// The grid of the archive's source; where that was projected, square areas as large as its own over the rectangle
/// around its ground.
[[nodiscard]] SampleGrid natural_grid(const Metadata& metadata);

/// True where samples of rasters of the archive stand for areas: as the source's, or on a map.
[[nodiscard]] bool samples_are_areas(const Metadata& metadata);

[[nodiscard]] HorizontalUnit horizontal_unit(const SourceRecord& source);

/// The source's body and horizontal reference system, as recorded.
[[nodiscard]] ReferenceSystem horizontal_system(const SourceRecord& source);

/// Whether a raster of the grid in `output` needs a value for voids.
[[nodiscard]] bool needs_void(const Metadata& metadata, const OutputGrid& grid, const std::string& output);

/// Puts into the spec what its raw numbers mean. A void value that is NaN goes without saying.
void set_mapping(RasterSpec& spec, const SampleMapping& mapping, std::optional<double> void_value);

/// A warning where scale or offset say something and the format of `output` has no place for them.
void warn_of_lost_scale(const std::string& output, const SampleMapping& mapping);

}  // namespace isohf::cli
