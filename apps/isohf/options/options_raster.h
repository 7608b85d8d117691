#pragma once

#include <optional>
#include <string>

#include "isohf/surface.h"
#include "options/command_line.h"
#include "options/quantities.h"

namespace isohf::cli {

/// What commands that write the surface of an archive as a raster are told alike.
struct RasterOptions {
  std::string archive;
  std::string output;
  bool overwrite = false;
  std::optional<GridSize> size;
  std::optional<LengthValue> spacing;
  std::string system;  ///< a reference system; empty: the archive's own
  std::optional<RestoreMethod> method;
  bool clamp_range = false;
  std::optional<SampleType> type;  ///< of the raster's samples
};

/// Samples on a side, at most.
inline constexpr std::int64_t kMostSide = std::int64_t{1} << 31U;

/// The group "Arguments": ARCHIVE, the output by the name that the command has for it, --overwrite.
void add_raster_arguments(CommandLine& line, const std::string& output_name, RasterOptions& options);
/// Throws Error{kInvalidArgument} where one of the two is not given.
void require_raster_arguments(const CommandLine& line, const std::string& output_name, const RasterOptions& options);

/// --size, --spacing, --crs. `size_description` is what --help says of the first.
void add_size_options(CommandLine& line, const std::string& size_description, RasterOptions& options);
/// The spacing asked for in the archive's world units. Throws Error{kInvalidArgument} for metres where these are
/// unknown.
[[nodiscard]] std::optional<double> spacing_in_world(const RasterOptions& options, const Metadata& metadata);
/// The grid in --crs over a part of the world, which --bbox gives where it is there; warnings are printed.
/// Throws Error{kInvalidArgument} for a system that is not understood, --method hex, and a spacing in metres where coordinates are degrees.
[[nodiscard]] SampleGrid asked_grid_in_system(const RasterOptions& options, ArchiveReader& archive,
                                              const WorldBounds& ground, const std::optional<MapBounds>& box,
                                              bool quiet);
/// --method. `without` is what --help says of the default.
void add_method_option(CommandLine& line, const std::string& without, RasterOptions& options);
/// --type. `without` is what --help says of the default.
void add_type_option(CommandLine& line, const std::string& without, RasterOptions& options);
/// --clamp-range. `type` is whose range it is.
void add_clamp_option(CommandLine& line, const std::string& type, RasterOptions& options);

}  // namespace isohf::cli
