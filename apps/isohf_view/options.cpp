#include "options.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <vector>

#include "isohf/error.h"
#include "options/command_line.h"
#include "options/option_values.h"

namespace isohf::view {
namespace {

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

void add_picture(CLI::App& line, Options& options) {
  cli::group(line, "Picture");
  cli::option(line, "--size", "WxH", "Pixels of the picture or window [default: 1280x720]",
              [&options](const std::string& text) {
                const auto [width, height] = cli::parse_size(text, 16, 16384);
                options.view.width = static_cast<int>(width);
                options.view.height = static_cast<int>(height);
              });
  cli::option(line, "--position", "X,Y,Z", "Position of the eye, world units; Y is an elevation, before exaggeration",
              [&options](const std::string& text) { options.position = parse_place(text); });
  cli::option(line, "--look-at", "X,Y,Z", "Look there",
              [&options](const std::string& text) { options.look_at = parse_place(text); });
  cli::option(line, "--fov", "DEG", "Vertical field of view, 1 to 150 [default: 50]",
              [&options](const std::string& text) {
                options.view.fov_y_rad = cli::parse_number_in(text, 1.0, 150.0) * std::acos(-1.0) / 180.0;
              });
  cli::option(line, "--far", "D", "Draw up to D world units away [default: everything]",
              [&options](const std::string& text) { options.far_distance = cli::parse_positive_number(text); });
  cli::option(line, "--exaggeration", "F",
              "Draw heights F times as high [default: 1, or what suits heights whose unit is not known]",
              [&options](const std::string& text) { options.exaggeration = cli::parse_positive_number(text); });
  cli::choice<ColourMode>(line, "--mode",
                          {{"elevation", ColourMode::kElevation},
                           {"levels", ColourMode::kLevels},
                           {"strips", ColourMode::kStrips},
                           {"texture", ColourMode::kTexture},
                           {"normals", ColourMode::kNormals}},
                          "Colours [default: texture if the archive has textures, else elevation]", options.mode);
  cli::option(line, "--palette", "elevation|gray|mars", "Colours of elevations [default: those of its body]",
              [&options](const std::string& text) { options.palette = cli::parse_palette(text); });
  cli::option(
      line, "--level", "L", "Draw every tile at this level of detail, 0 to 12, fractional",
      [&options](const std::string& text) { options.view.fixed_level = cli::parse_number_in(text, 0.0, 12.0); });
  cli::option(
      line, "--triangle-size", "A", "Draw triangles of about A square pixels; more is faster [default: 4]",
      [&options](const std::string& text) { options.view.triangle_px = cli::parse_number_in(text, 0.01, 1e6); });
  line.add_flag("--wireframe", options.view.wireframe, "Draw the edges of triangles");
}

}  // namespace

void add_options(CLI::App& line, Options& options) {
  cli::positional(line, "ARCHIVE", "Archive to view, or a raster, which is converted to a temporary one",
                  options.archive);
  CLI::Option* const screenshot =
      cli::option(line, "--screenshot", "FILE.png", "Write a picture and end", [&options](const std::string& text) {
        if (!text.ends_with(".png")) refuse(text, "a file name that ends with .png");
        options.screenshot = text;
      });
  CLI::Option* const verify =
      line.add_flag("--verify", options.verify, "Compare what is drawn with the library, tile by tile")
          ->excludes(screenshot);
  cli::option(line, "--tiles", "A:B,C:D",
              "Verify only columns A to B-1 and rows C to D-1 of tiles, from 0 in the North-West",
              [&options](const std::string& text) { options.tiles = cli::parse_tile_range(text); })
      ->needs(verify);
  line.add_flag("--overwrite", options.overwrite, "Replace FILE.png if it exists");
  add_picture(line, options);
  line.add_flag("--legend", options.legend, "Draw scale bar, North arrow and colours on pictures")->needs(screenshot);
  cli::group(line, "Light");
  cli::add_sun_options(line, options.sun, options.date, "300,35", -90.0);
  cli::group(line, "Work");
  cli::option(line, "-j,--threads", "N", "Decode tiles with N threads, 1 to 256 [default: all cores but one]",
              [&options](const std::string& text) {
                options.threads = static_cast<int>(cli::parse_whole_number(text, 1, 256));
              });
  cli::option(line, "--memory", "SIZE", "Memory for tiles and textures, as in 400M or 1.5GiB [default: 512M]",
              [&options](const std::string& text) { options.memory_mib = parse_mebibytes(text); });
  cli::most_used(line, {"--screenshot", "--overwrite", "--size", "--sun", "--date", "--time", "--exaggeration",
                        "--palette", "--legend", "--memory"});
  line.footer(kFooter);
}

void complete(Options& options) {
  const auto fail = [](const std::string& why) { throw Error(ErrorCode::kInvalidArgument, why); };
  if (options.legend && (options.view.width < kLegend_px.width || options.view.height < kLegend_px.height)) {
    fail(fmt::format("--legend needs pictures of at least {}x{} (--size)", kLegend_px.width, kLegend_px.height));
  }
  if (options.position && options.look_at && *options.position == *options.look_at) {
    fail("--look-at is the place of --position, which gives no direction; name another place");
  }
  if (options.mode) options.view.mode = *options.mode;
}

}  // namespace isohf::view
