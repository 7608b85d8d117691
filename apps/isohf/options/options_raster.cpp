#include "options/options_raster.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "formats/files/text.h"
#include "isohf/error.h"
#include "isohf/restore/sample_grids.h"
#include "options/option_values.h"
#include "options/options_source.h"
#include "output/standard_output.h"

namespace isohf::cli {

void add_raster_arguments(CommandLine& line, const std::string& output_name, RasterOptions& options) {
  line.group("Arguments");
  line.positional("ARCHIVE", "-i,--input", "Archive to read", options.archive);
  line.positional(output_name, "-o,--output",
                  "Raster to write: NAME.tif, .exr, .png, .hgt, .asc, .flt, .r16, .raw, .r32 or .npy", options.output);
  line.flag("--overwrite", fmt::format("Replace {} where it exists", output_name), options.overwrite);
}

void require_raster_arguments(const CommandLine& line, const std::string& output_name, const RasterOptions& options) {
  line.require("ARCHIVE", options.archive);
  line.require(output_name, options.output);
  const bool is_archive_name = lower_case(std::filesystem::path(options.output).extension().string()) == ".isohf";
  if (is_archive_name && options.archive != options.output) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("{}: {} has an archive's name; ARCHIVE comes first, {} last",
                                                         options.output, output_name, output_name));
  }
}

void add_size_options(CommandLine& line, const std::string& size_description, RasterOptions& options) {
  line.option("--size", "WxH", size_description,
              [&](const std::string& text) { options.size = parse_size(text, 1, kMostSide); });
  line.option("--spacing", "LENGTH", "Write samples so far apart: world units, or with a unit as in 30m, 0.5km, 100ft",
              [&](const std::string& text) { options.spacing = parse_length(text); });
  line.option("--crs", "SYSTEM",
              "Write the raster in this reference system, each sample by its place: EPSG:2154, WKT, a PROJ string, or "
              "a file with one of them (default: the archive's)",
              [&](const std::string& text) { options.system = system_from(text); });
}

SampleGrid asked_grid_in_system(const RasterOptions& options, ArchiveReader& archive, const WorldBounds& ground,
                                const std::optional<MapBounds>& box, bool quiet) {
  std::vector<Warning> warnings;
  auto system = understand_grid_system(archive, options.system, warnings);
  if (!quiet) print_warnings(warnings);
  std::optional<double> spacing;
  if (options.spacing) {
    const Georeference& place = system->place;
    if (options.spacing->in_metres && place.unit == HorizontalUnit::kDegree) {
      throw Error(
          ErrorCode::kInvalidArgument,
          fmt::format("--spacing has a unit, and coordinates of \"{}\" are degrees; give a plain number of these",
                      place.system.name));
    }
    spacing = options.spacing->in_metres ? options.spacing->value / place.metres_per_unit : options.spacing->value;
  }
  try {
    std::optional<SampleGrid> own;
    if (box && !options.size && !spacing && is_warped(archive.metadata())) {
      own = own_grid_in_box(archive.metadata(), *system, *box);
      if (own) own->system = system;
    }
    const SampleGrid grid =
        own ? *own : grid_in_system(archive.metadata(), ground, std::move(system), options.size, spacing);
    if (grid.goes_by_places() && options.method == RestoreMethod::kHex) {
      throw Error(ErrorCode::kInvalidArgument,
                  "--crs: rows of another reference system are no rows of the archive, along which --method hex goes; "
                  "leave it out, or give --method barycentric");
    }
    if (grid.width <= kMostSide && grid.height <= kMostSide) return grid;
    throw Error(ErrorCode::kInvalidArgument, fmt::format("--spacing makes {} x {} samples, at most {} a side are "
                                                         "possible",
                                                         grid.width, grid.height, kMostSide));
  } catch (const Error& error) {
    throw error.within(options.archive);
  }
}

std::optional<double> spacing_in_world(const RasterOptions& options, const Metadata& metadata) {
  if (!options.spacing) return std::nullopt;
  if (options.spacing->in_metres && metadata.horizontal_unit != "metre") {
    throw Error(ErrorCode::kInvalidArgument,
                options.archive +
                    ": --spacing has a unit, but the archive's world units are not known; give a plain "
                    "number of these");
  }
  const WorldBounds& ground = metadata.valid;
  const double samples = std::max(ground.x1 - ground.x0, ground.z1 - ground.z0) / options.spacing->value;
  if (!(samples <= static_cast<double>(kMostSide))) {
    throw Error(ErrorCode::kInvalidArgument,
                {"--spacing", fmt::format("{}, for {:.3g} samples along a side", options.spacing->value, samples),
                 fmt::format("wide enough for {} at most", kMostSide), ""});
  }
  return options.spacing->value;
}

void add_method_option(CommandLine& line, const std::string& without, RasterOptions& options) {
  line.option("--method", "NAME", fmt::format("hex, barycentric or average (default {})", without),
              [&](const std::string& text) { options.method = restore_method_from_string(text); });
  line.words({"hex", "barycentric", "average"});
}

void add_type_option(CommandLine& line, const std::string& without, RasterOptions& options) {
  line.option("--type", "TYPE", fmt::format("u8, u16, i16, u32, i32, f16, f32 or f64 (default: {})", without),
              [&](const std::string& text) {
                constexpr std::array<SampleType, 8> kTypes = {
                    SampleType::kUint8, SampleType::kUint16,  SampleType::kInt16,   SampleType::kUint32,
                    SampleType::kInt32, SampleType::kFloat16, SampleType::kFloat32, SampleType::kFloat64};
                options.type = kTypes[parse_word(text, {"u8", "u16", "i16", "u32", "i32", "f16", "f32", "f64"})];
              });
}

void add_clamp_option(CommandLine& line, const std::string& type, RasterOptions& options) {
  line.flag("--clamp-range", fmt::format("Move samples that {} does not hold to its ends, instead of refusing", type),
            options.clamp_range);
}

}  // namespace isohf::cli
