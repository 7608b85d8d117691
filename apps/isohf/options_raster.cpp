#include "options_raster.h"

#include <fmt/format.h>

#include "option_values.h"

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
}

void add_size_options(CommandLine& line, const std::string& size_description, RasterOptions& options) {
  line.option("--size", "WxH", size_description,
              [&](const std::string& text) { options.size = parse_size(text, 1, kMostSide); });
  line.option("--spacing", "D", "Write samples D world units apart",
              [&](const std::string& text) { options.spacing = parse_positive_number(text); });
}

void add_method_option(CommandLine& line, const std::string& without, RasterOptions& options) {
  line.option("--method", "NAME", fmt::format("hex or barycentric (default {})", without),
              [&](const std::string& text) { options.method = restore_method_from_string(text); });
  line.words({"hex", "barycentric"});
}

void add_clamp_option(CommandLine& line, const std::string& type, RasterOptions& options) {
  line.flag("--clamp-range", fmt::format("Move samples that {} does not hold to its ends, instead of refusing", type),
            options.clamp_range);
}

}  // namespace isohf::cli
