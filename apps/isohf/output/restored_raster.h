#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common.h"
#include "formats/write/raster_sink.h"
#include "isohf/restore/sample_store.h"
#include "isohf/surface.h"

namespace isohf::cli {

/// The format of a raster by its extension, in any case; kOther where create_raster() knows none.
enum class RasterKind { kTiff, kExr, kPng, kHgt, kAsc, kFlt, kRaw16, kRaw32, kNpy, kOther };
[[nodiscard]] RasterKind raster_kind(const std::string& path);

/// The sample type of a raster restored to `path`: the source's own where the format holds it, else the nearest that
/// it holds (float32 in EXR and GridFloat, int16 in HGT, uint16 in PNG and .r16).
[[nodiscard]] SampleType restored_type(const std::string& path, SampleType source_type);

/// What a raster of that grid is: size, georeference and unit, so far as they are known, and what its raw numbers mean.
[[nodiscard]] RasterSpec raster_spec(const Metadata& metadata, const SampleGrid& grid, const SampleMapping& mapping,
                                     std::optional<double> void_value);
/// The source's own raster, in its own reference system also where it was projected.
[[nodiscard]] RasterSpec source_raster_spec(const Metadata& metadata, const SampleMapping& mapping,
                                            std::optional<double> void_value);

/// The raw value that stands for voids, if there are some: NaN in floats, which other programs want to be told.
[[nodiscard]] std::optional<double> void_value_of(SampleType type, bool has_voids);

/// Whether a raster of the grid in `output` needs a value for voids.
[[nodiscard]] bool needs_void(const Metadata& metadata, const SampleGrid& grid, const std::string& output);

/// Whether whole numbers of `mapping` would take the decimals of a source that has some.
[[nodiscard]] bool takes_decimals(const Metadata& metadata, const SampleMapping& mapping);
/// Whether a raster in `output` can say what its numbers mean, itself or in the file beside it.
[[nodiscard]] bool has_scale(const std::string& output);
/// All elevations of a grid, spread over an integer type. Reads them; `has_voids` becomes whether some are void.
[[nodiscard]] SampleMapping spread_over(SampleType type, RowReader rows, const Job& job, bool& has_voids);
/// A warning that elevations in `output` are rounded to whole units.
void warn_of_whole_numbers(const Common& common, const std::string& output, const Metadata& metadata);
/// A warning of how far half floats round the archive's largest elevation.
void warn_of_halves(const Common& common, const std::string& output, const Metadata& metadata);
/// Warnings of what `spec` says and the format of `output` has no place for, or says otherwise.
void warn_of_losses(const Common& common, const std::string& output, const RasterSpec& spec);

/// Throws Error{kInvalidArgument} for a sample that a raster's type does not hold, naming column, row and remedy.
[[noreturn]] void refuse_sample(const std::string& output, SampleType type, std::int64_t column, std::int64_t row,
                                const std::string& value, const std::string& remedy);

/// Where samples go, and what helps where the type of one does not hold it.
struct RasterTarget {
  std::string output;
  SampleMapping mapping;
  std::string remedy;
};
/// Said of rasters by RestoreMethod::kPlane.
inline constexpr const char* kOnAPlane = ", means on a coarse plane (of all tiles: --method average)";

/// What helps whatever the command: --clamp-range, another --method than hex, another format; and how far elevations go,
/// where it is not for an overshoot that the type does not hold them.
[[nodiscard]] std::string usual_remedy(const std::string& output, const SampleMapping& mapping,
                                       const Statistics& elevations, RestoreMethod method);
/// The options by which `mapping`'s type would hold all elevations of an archive, "--z-scale 0.04": its offset stays
/// where it can. Empty of floats, and where the archive has no elevation.
[[nodiscard]] std::string scale_that_holds(const Statistics& elevations, const SampleMapping& mapping, bool has_voids);

/// Rows of elevations, NaN where void, into raw samples; the first row's number and the width are for messages. Adds to
/// `counts`. Throws Error{kInvalidArgument} as refuse_sample.
[[nodiscard]] std::vector<std::byte> store_rows(const SampleStore& store, const RasterTarget& target,
                                                std::int64_t width, std::int64_t first_row,
                                                std::span<const double> elevations, SampleStore::Result& counts);

}  // namespace isohf::cli
