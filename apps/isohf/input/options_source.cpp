#include "input/options_source.h"

#include <cmath>

#include "formats/readers.h"
#include "isohf/error.h"
#include "options/command_line.h"
#include "options/option_values.h"

namespace isohf::cli {

void add_part_options(CLI::App& line, OpenOptions& options) {
  option(line, "--channel", "NAME|N",
         "Read only this channel, by name or number from 0, ignoring masks and opacity [default: the one that fits "
         "best, with them]",
         options.channel);
  option(line, "--part", "NAME|N",
         "Which file of an archive, part of an OpenEXR, image of a TIFF (from 0) or zoom level of tiles to read",
         options.part);
  option(line, "--encoding", "terrarium|mapbox|gsi|rgba-float",
         "Decode elevations packed into the colours of a picture or its tiles [default: as the file says]",
         [&options](const std::string& text) {
           (void)parse_word(text, {"terrarium", "mapbox", "gsi", "rgba-float"});
           options.encoding = text;
         });
  exclusive(line, {"--channel", "--encoding"});
}

void add_raw_option(CLI::App& line, OpenOptions& options) {
  option(line, "--raw", "WxH:TYPE",
         "Read bare samples, as in 200x200:u16le. Types: u8, i8, or u16, i16, u32, i32, f32, f64 with le or be",
         [&options](const std::string& text) { options.raw = raw_layout_from_string(text); });
}

void add_scale_options(CLI::App& line, OpenOptions& options) {
  option(line, "--z-scale", "FACTOR", "Multiply the file's elevations by FACTOR [default: 1]",
         [&options](const std::string& text) {
           const double scale = parse_number(text);
           if (std::abs(scale) < 1e-20 || std::abs(scale) > 1e20) {
             throw Error(ErrorCode::kInvalidArgument,
                         "found '" + text + "', must be from 1e-20 to 1e20, above or below 0");
           }
           options.z_scale = scale;
         });
  option(line, "--z-offset", "NUMBER", "Then add NUMBER [default: 0]",
         [&options](const std::string& text) { options.z_offset = parse_number_in(text, -1e20, 1e20); });
}

void add_source_options(CLI::App& line, OpenOptions& options) {
  group(line, "Reading the input");
  add_part_options(line, options);
  choice<std::optional<Registration>>(
      line, "--registration", {{"area", Registration::kArea}, {"point", Registration::kPoint}, {"auto", std::nullopt}},
      "Samples are the middle of pixels (area) or grid points (point) [default: as the file says, else area with a "
      "georeference and point without]",
      options.registration);
  option(line, "--nodata", "VALUE,...", "Raw values that mean nodata, instead of the file's; NaN always does",
         [&options](const std::string& text) { options.void_values = parse_numbers(text); });
  option(line, "--valid-range", "LO:HI", "Treat elevations outside this range as nodata",
         [&options](const std::string& text) { options.voids.valid_range = parse_range(text); });
  flag_with_value(line, "--fill", "D",
                  "Fill nodata smoothly, up to D samples (1 to 4096) from the nearest elevation [default D: 100]",
                  [&options](const std::optional<std::string>& text) {
                    options.voids.fill = true;
                    if (text) options.voids.fill_distance = parse_whole_number(*text, 1, kMaxFillDistance);
                  });
  add_scale_options(line, options);
  add_raw_option(line, options);
  option(line, "--sample-spacing", "LENGTH",
         "Distance between samples, instead of the file's: metres, or with a unit as in 100ft",
         [&options](const std::string& text) { options.spacing = parse_length(text).value; });
  option(
      line, "--crs", "SYSTEM",
      "Reference system if the file has none, or lacks its datum or heights: EPSG:2154, WKT, a PROJ string, or a file "
      "containing one",
      [&options](const std::string& text) { options.reference_system = system_from(text); });
  exclusive(line, {"--crs", "--sample-spacing"});
}

CLI::Option* add_geoid_option(CLI::App& line, GeoidRequest& request) {
  return option(line, "--geoid", "FILE.pgm[:WAY]",
                "Apply a GeographicLib geoid: to-ellipsoidal or to-orthometric [default: to-ellipsoidal]",
                [&request](const std::string& text) { request = GeoidRequest::parse(text); });
}

}  // namespace isohf::cli
