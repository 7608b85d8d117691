#include "input/options_source.h"

#include <cctype>
#include <cmath>
#include <filesystem>
#include <vector>

#include "formats/io/text.h"
#include "formats/readers.h"
#include "input/quantities.h"
#include "isohf/base/output_file.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "options/option_values.h"

namespace isohf::cli {

std::string system_from(const std::string& text) {
  constexpr std::size_t kMostBytes = 65536;
  std::error_code ignored;
  if (text.empty())
    throw Error(ErrorCode::kInvalidArgument, "found '', must be EPSG:2154, WKT, a PROJ string or a file");
  if (!std::filesystem::is_regular_file(text, ignored)) {
    const std::string extension = lower_case(std::filesystem::path(text).extension().string());
    if (extension != ".prj" && extension != ".wkt" && extension != ".txt") return text;
    throw Error(ErrorCode::kInvalidArgument, "found '" + text + "', no such file");
  }
  const std::vector<std::byte> bytes = head_of_file(text, kMostBytes);
  std::string held(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  while (!held.empty() && std::isspace(static_cast<unsigned char>(held.back())) != 0) held.pop_back();
  if (held.empty() || held.find('\0') != held.npos) {
    throw Error(ErrorCode::kInvalidArgument, "found '" + text + "', a file that must hold WKT or a PROJ string");
  }
  return held;
}

void add_part_options(CommandLine& line, OpenOptions& options) {
  line.option(
      "--channel", "NAME|N",
      "Read this channel alone, by name or number from 0, without masks and opacity (default: the only or first "
      "fitting one, with them)",
      options.channel);
  line.option("--part", "NAME|N",
              "Read this file of an archive, or this part of an OpenEXR file, by name or number from 0, or this zoom "
              "level of tiles",
              options.part);
}

void add_raw_option(CommandLine& line, OpenOptions& options) {
  line.option("--raw", "WxH:TYPE",
              "Read bare samples: columns, rows, and u8, i8, or u16, i16, u32, i32, f32, f64 with le or be, as in "
              "200x200:u16le",
              [&](const std::string& text) { options.raw = raw_layout_from_string(text); });
}

void add_source_options(CommandLine& line, OpenOptions& options) {
  line.group("Input");
  add_part_options(line, options);
  line.option(
      "--encoding", "NAME",
      "Decode elevations packed into the colours of PNG or WebP: terrarium, mapbox or rgba-float (default: decode, "
      "with a warning, where the bytes leave no doubt)",
      [&](const std::string& text) {
        (void)parse_word(text, {"terrarium", "mapbox", "rgba-float"});
        options.channel = text;  // one more channel of the picture, as which archives record it
      });
  line.exclusive({"--channel", "--encoding"});
  line.option(
      "--registration", "KIND",
      "Place samples: area (middle of a pixel), point (on posts) or auto (default: as the file says, else areas "
      "with and posts without a georeference)",
      [&](const std::string& text) {
        const std::size_t word = parse_word(text, {"area", "point", "auto"});
        options.registration.reset();
        if (word == 0) options.registration = Registration::kArea;
        if (word == 1) options.registration = Registration::kPoint;
      });
  line.option("--nodata", "VALUE,...", "Treat these raw values as voids, instead of the file's; NaN always is one",
              [&](const std::string& text) {
                try {
                  options.void_values = parse_numbers(text);
                } catch (const Error&) {
                  throw Error(ErrorCode::kInvalidArgument,
                              "found '" + text + "', must be a number or nan, or several with commas between them");
                }
              });
  line.option("--valid-range", "LO:HI", "Treat elevations outside as voids (default: all are valid)",
              [&](const std::string& text) { options.voids.valid_range = parse_range(text); });
  line.flag("--fill", "Fill voids smoothly, up to --fill-distance from the nearest elevation", options.voids.fill);
  line.option(
      "--fill-distance", "D", "Fill voids as far as D samples, 1 to 4096 (default 100); implies --fill",
      [&](const std::string& text) { options.voids.fill_distance = parse_whole_number(text, 1, kMaxFillDistance); });
  line.option("--z-scale", "FACTOR", "Multiply the file's elevations by FACTOR, then add --z-offset (default 1)",
              [&](const std::string& text) {
                const double scale = parse_number(text);
                if (std::abs(scale) < 1e-20 || std::abs(scale) > 1e20) {
                  throw Error(ErrorCode::kInvalidArgument,
                              "found '" + text + "', must be from 1e-20 to 1e20, above or below 0");
                }
                options.z_scale = scale;
              });
  line.option("--z-offset", "NUMBER", "Add NUMBER to the elevations, after --z-scale (default 0)",
              [&](const std::string& text) { options.z_offset = parse_number_in(text, -1e20, 1e20); });
  add_raw_option(line, options);
  line.option("--sample-spacing", "METRES",
              "Set the distance of neighbouring samples, instead of the file's: metres, or with a unit as in 100ft",
              [&](const std::string& text) { options.spacing = parse_length(text).value; });
  line.option("--crs", "SYSTEM",
              "Reference system of an input that names none, or not its datum or heights: EPSG:2154, WKT, a PROJ "
              "string, or a file with one of them; a contradiction is an error",
              [&](const std::string& text) { options.reference_system = system_from(text); });
  line.exclusive({"--crs", "--sample-spacing"});
}

}  // namespace isohf::cli
