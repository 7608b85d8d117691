#include "options.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <vector>

#include "isohf/error.h"
#include "options/option_values.h"
#include "options/tile_range.h"

namespace isohf::view {
namespace {

using cli::CommandLine;

constexpr const char* kFooter =
    R"(Without --screenshot or --verify a window opens; H shows its keys.

Positions are world units of the archive from its North-West corner: x eastwards, y up, z southwards. An archive laid out
in degrees is drawn in metres, but for x and z, which stay degrees.

Shadows are those of isohf shade, for a sun that stands anywhere. Tiles towards the sun that may cast on what is shown are
read as well, some thousand at most.

Tiles and textures on the GPU and on their way there never take more than --memory together; in an archive with
textures, a third goes to tiles and two thirds to textures. Where the far distance would need more, it is shortened and
the figures say so; textures get coarser. The shared vertex and index arrays, the picture and the memory-mapped archive
come on top. Float archives are rounded for viewing to 65535 steps between their lowest and highest elevation.

Exit codes: 0 done, 1 failed, 2 wrong usage, 3 --verify found differences, 130 interrupted.

Examples:
  isohf view dem.isohf
  isohf view dem.isohf --screenshot view.png --sun 110,20 --exaggeration 1.5
  isohf view dem.isohf --date 2026-12-21 --time 15:30
  isohf view dem.isohf --verify)";

/// Below that what is written lies on itself.
constexpr struct {
  int width = 320;
  int height = 200;
} kLegend_px;

[[noreturn]] void refuse(const std::string& text, const std::string& required) {
  throw Error(ErrorCode::kInvalidArgument, "found '" + text + "', must be " + required);
}

/// "X,Y,Z", each as in a list of numbers.
template <std::size_t N>
std::array<double, N> parse_tuple(const std::string& text, const std::string& form) {
  const std::vector<double> numbers = cli::parse_numbers(text);
  if (numbers.size() != N) refuse(text, form);
  std::array<double, N> tuple{};
  for (std::size_t i = 0; i < N; ++i) {
    if (!std::isfinite(numbers[i])) refuse(text, form);
    tuple[i] = numbers[i];
  }
  return tuple;
}

Vec3 parse_place(const std::string& text) {
  const auto [x, y, z] = parse_tuple<3>(text, "X,Y,Z, three numbers");
  return {x, y, z};
}

std::uint64_t parse_mebibytes(const std::string& text) {
  const std::uint64_t bytes = cli::parse_bytes(text);
  if (bytes < 1 << 20) refuse(text, "at least 1M: without a letter it counts bytes");
  return bytes >> 20;
}

void add_actions(CommandLine& line, Options& options, bool& verify) {
  line.group("Actions");
  line.option("--screenshot", "FILE.png", "Write a picture and end", [&](const std::string& text) {
    if (!text.ends_with(".png")) refuse(text, "a file name that ends with .png");
    options.screenshot = text;
  });
  line.flag("--verify", "Check that archive, index arrays and shaders agree with the library", verify);
  line.option("--tiles", "A:B,C:D",
              "Verify columns A to B-1 and rows C to D-1 of tiles alone, from 0 in the North-West",
              [&](const std::string& text) { options.tiles = cli::parse_tile_range(text); });
  line.exclusive({"--screenshot", "--verify"});
  line.flag("--overwrite", "Replace files that exist", options.overwrite);
}

void add_light(CommandLine& line, Options& options, std::optional<double>& time) {
  line.group("Light");
  line.option("--sun", "AZIMUTH,ELEVATION", "Degrees, clockwise from North and above the horizon (default 300,35)",
              [&](const std::string& text) {
                const auto [azimuth, elevation] = parse_tuple<2>(text, "AZIMUTH,ELEVATION, two numbers");
                if (std::abs(azimuth) > 360.0 || std::abs(elevation) > 90.0) {
                  refuse(text, "an azimuth from -360 to 360 and an elevation from -90 to 90");
                }
                options.sun_azimuth_deg = azimuth;
                options.sun_elevation_deg = elevation;
              });
  line.option("--date", "YYYY-MM-DD",
              "The sun of that day over the archive's middle (Earth and Mars); the window has a slider for its hours",
              [&](const std::string& text) {
                const auto [year, month, day] = cli::parse_date(text);
                options.date = {year, month, day};
              });
  line.option("--time", "HH:MM", "With --date: mean solar time there (default 12:00)",
              [&time](const std::string& text) { time = cli::parse_time(text); });
  line.exclusive({"--date", "--sun"});
}

void add_picture(CommandLine& line, Options& options) {
  line.group("Picture");
  line.option("--size", "WxH", "Pixels of the picture or window (default 1280x720)", [&](const std::string& text) {
    const auto [width, height] = cli::parse_size(text, 16, 16384);
    options.view.width = static_cast<int>(width);
    options.view.height = static_cast<int>(height);
  });
  line.option("--position", "X,Y,Z", "Put the eye there; Y is an elevation, and drawn exaggerated as the ground is",
              [&](const std::string& text) { options.position = parse_place(text); });
  line.option("--look-at", "X,Y,Z", "Look there",
              [&](const std::string& text) { options.look_at = parse_place(text); });
  line.option("--fov", "DEG", "Vertical field of view, 1 to 150 (default 50)", [&](const std::string& text) {
    options.view.fov_y_rad = cli::parse_number_in(text, 1.0, 150.0) * std::acos(-1.0) / 180.0;
  });
  line.option("--far", "D", "Draw as far as D world units (default: all of the heightfield)",
              [&](const std::string& text) { options.far_distance = cli::parse_positive_number(text); });
  line.option(
      "--exaggeration", "F",
      "Draw heights F times as high (default 1; more where the ground would look flat, less where its unit is not "
      "known and heights would tower over it)",
      [&](const std::string& text) { options.exaggeration = cli::parse_positive_number(text); });
  line.option(
      "--mode", "NAME",
      "Colour by elevation, levels, strips, texture or normals (default: texture where the archive has "
      "textures, else elevation)",
      [&](const std::string& text) {
        constexpr ColourMode kModes[] = {ColourMode::kElevation, ColourMode::kLevels, ColourMode::kStrips,
                                         ColourMode::kTexture, ColourMode::kNormals};
        options.view.mode = kModes[cli::parse_word(text, {"elevation", "levels", "strips", "texture", "normals"})];
        options.mode_given = true;
      });
  line.option("--palette", "NAME", "Colours of elevations: elevation, gray, mars (default: its body's)",
              [&](const std::string& text) { options.palette = cli::parse_palette(text); });
  line.option("--level", "L[,L2]",
              "Draw every tile at this level of detail, 0 to 12, fractional; two levels alternate like a chessboard",
              [&](const std::string& text) {
                const std::vector<double> levels = cli::parse_numbers(text);
                const auto is_level = [](double level) { return level >= 0.0 && level <= 12.0; };
                if (levels.size() > 2 || !is_level(levels.front()) || !is_level(levels.back())) {
                  refuse(text, "one or two numbers from 0 to 12");
                }
                options.view.fixed_level = levels.front();
                if (levels.size() == 2) options.view.other_level = levels.back();
              });
  line.option("--triangle-size", "A", "Draw triangles of about A square pixels (default 4): more is coarser and faster",
              [&](const std::string& text) { options.view.triangle_px = cli::parse_number_in(text, 0.01, 1e6); });
  line.flag("--wireframe", "Draw the triangles' sides", options.view.wireframe);
}

}  // namespace

std::optional<Options> parse_options(const cli::Arguments& arguments) {
  Options options;
  bool verify = false;
  std::optional<double> time;
  CommandLine line("view", "Views an archive of an isometric heightfield, or draws and checks it without a screen.");
  line.group("Arguments");
  line.positional("ARCHIVE", "-i,--input",
                  "Archive to view, or a raster: it is converted for as long as it is looked at", options.archive);
  add_actions(line, options, verify);
  add_picture(line, options);
  line.flag("--legend", "Write scale bar, North arrow and the colours' legend on pictures", options.legend);
  add_light(line, options, time);
  line.group("Work");
  line.option(
      "-j,--threads", "N", "Decode tiles with N threads, 1 to 256 (default: one less than there are cores)",
      [&](const std::string& text) { options.threads = static_cast<int>(cli::parse_whole_number(text, 1, 256)); });
  line.option("--memory", "SIZE", "Hold tiles and textures in SIZE of memory (default 512M); as in 400M or 1.5GiB",
              [&](const std::string& text) { options.memory_mib = parse_mebibytes(text); });
  cli::add_common_options(line, options.common);
  line.footer(kFooter);
  if (!line.parse(arguments)) return std::nullopt;
  line.require("ARCHIVE", options.archive);
  const auto needs = [&](const char* option, bool is_met, const char* needed) {
    if (line.given(option) && !is_met) line.fail(std::string(option) + " needs " + needed);
  };
  needs("--legend", !options.screenshot.empty(), "--screenshot");
  if (options.legend && (options.view.width < kLegend_px.width || options.view.height < kLegend_px.height)) {
    line.fail(fmt::format("--legend needs pictures of at least {}x{} (--size)", kLegend_px.width, kLegend_px.height));
  }
  needs("--tiles", verify, "--verify");
  needs("--time", options.date.has_value(), "--date");
  if (time) options.date->hours = *time;
  if (options.position && options.look_at && *options.position == *options.look_at) {
    line.fail("--look-at is the place of --position, which gives no direction; name another place");
  }
  if (!options.screenshot.empty()) options.action = Options::Action::kScreenshot;
  if (verify) options.action = Options::Action::kVerify;
  return options;
}

}  // namespace isohf::view
