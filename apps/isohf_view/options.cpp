#include "options.h"

#include <CLI/CLI.hpp>
#include <array>
#include <map>
#include <vector>

#ifndef ISOHF_VERSION
#define ISOHF_VERSION "0"
#endif

namespace isohf::view {
namespace {

constexpr const char* kDescription =
    "View an isometric heightfield archive, or draw and check it without a screen.\n"
    "Without --screenshot, --flight, --verify or --sweep a window opens.";

constexpr const char* kFooter =
    "Axes: x eastwards, y up, z southwards, world units of the archive, from its North-West corner.\n"
    "Shadows need an archive with shadow seeds (isohf convert --shadow-seeds). They are those of light along the "
    "rows,\n"
    "from East or West: at azimuth 90 or 270 exactly the sun's, as isohf shade draws them. At other azimuths they are\n"
    "those of the sun as it is seen in that plane, whose elevation has the tangent tan(elevation) / |sin(azimuth)|; a\n"
    "sun due North or South casts none.\n"
    "Memory: tiles and textures on the GPU and on their way there never take more than --memory MiB together, in an\n"
    "archive with textures a third for tiles and two thirds for textures. Where the far distance would need more, it\n"
    "is shortened and the figures say so; textures get coarser. Besides: the shared vertex and index arrays\n"
    "(some bytes a vertex of one tile), the picture, and the memory-mapped archive.\n"
    "Float archives are rounded for viewing to 65535 steps between their lowest and highest elevation.\n"
    "Flight file: one line a place, 'seconds x y z look_x look_y look_z', # begins a comment; places are joined by\n"
    "smooth curves.\n"
    "Exit codes: 0 done, 1 failed, 2 usage, 3 --verify found differences, 130 interrupted.";

Vec3 vec3_from(const std::vector<double>& values) {
  return {values[0], values[1], values[2]};
}

const std::map<std::string, ColourMode>& modes() {
  static const std::map<std::string, ColourMode> kModes{
      {"elevation", ColourMode::kElevation}, {"plain", ColourMode::kPlain},     {"levels", ColourMode::kLevels},
      {"strips", ColourMode::kStrips},       {"texture", ColourMode::kTexture}, {"normals", ColourMode::kNormals}};
  return kModes;
}

/// Numbers as CLI11 collects them, before they become options.
struct Raw {
  std::vector<double> position;
  std::vector<double> look_at;
  std::vector<double> sun;
  std::string size = "1280x720";
  double fov_deg = 50.0;
  std::vector<double> level;
  double far_distance = 0.0;
  double exaggeration = 1.0;
  std::string shadows;
  double shadow_softness = 0.0;
};

void add_picture_options(CLI::App& app, Options& options, Raw& raw) {
  app.add_option("--size", raw.size, "Picture or window size in pixels, WIDTHxHEIGHT")->capture_default_str();
  app.add_option("--position", raw.position, "Where the eye is: X,Y,Z")->delimiter(',')->expected(3);
  app.add_option("--look-at", raw.look_at, "What it looks at: X,Y,Z")->delimiter(',')->expected(3);
  app.add_flag("--fly", options.fly, "Begin with the fly camera rather than the orbit camera");
  app.add_option("--sun", raw.sun, "AZIMUTH,ELEVATION in degrees, clockwise from North, above the horizon")
      ->delimiter(',')
      ->expected(2);
  app.add_option("--shadows", raw.shadows, "Cast shadows, on or off; default: on where the archive has shadow seeds")
      ->check(CLI::IsMember({"on", "off"}));
  app.add_option("--shadow-softness", raw.shadow_softness,
                 "The sun's apparent size at the caster's distance, world units; default: 2, or 0.5 % of the range of "
                 "heights where that is less")
      ->check(CLI::PositiveNumber);
  app.add_option(
         "--exaggeration", raw.exaggeration,
         "Vertical exaggeration; default: 1, or less where the ground's unit is not known and heights would tower "
         "over it")
      ->check(CLI::PositiveNumber);
  app.add_option("--mode", options.view.mode,
                 "Colours; default: texture where the archive has textures, else elevation")
      ->transform(CLI::CheckedTransformer(modes()));
  app.add_option("--level", raw.level,
                 "Draw every tile at this level of detail, fractional; two levels A,B: like a chessboard")
      ->delimiter(',')
      ->expected(1, 2)
      ->check(CLI::Range(0.0, 12.0));
  app.add_option("--triangle-size", options.view.triangle_px,
                 "Area that triangles are meant to have, pixels: more is coarser and faster")
      ->check(CLI::Range(0.01, 1e6))
      ->capture_default_str();
  app.add_option("--fov", raw.fov_deg, "Vertical field of view, degrees")
      ->check(CLI::Range(1.0, 150.0))
      ->capture_default_str();
  app.add_option("--far", raw.far_distance, "Far distance, world units; default: all of the heightfield")
      ->check(CLI::PositiveNumber);
  app.add_flag("--wireframe", options.view.wireframe, "Draw the triangles' sides");
  app.add_flag("--borders", options.view.borders, "Draw the tiles' borders");
  app.add_flag("!--no-haze", options.view.haze, "No haze towards the far distance");
  app.add_flag("--beyond", options.view.beyond, "Show tiles beyond the source's edge as well");
  app.add_flag("!--no-overlay", options.overlay, "No figures on the picture");
  app.add_flag("--switch", options.view.plain_switching, "Switch levels of detail at once instead of fading");
}

bool parse_size(const std::string& text, ViewState& view) {
  char rest = 0;
  return std::sscanf(text.c_str(), "%dx%d%c", &view.width, &view.height, &rest) == 2 && view.width >= 16 &&
         view.height >= 16 && view.width <= 16384 && view.height <= 16384;
}

}  // namespace

ParsedOptions parse_options(int argc, char** argv) {
  Options options;
  Raw raw;
  CLI::App app(kDescription, "isohf-view");
  app.footer(kFooter);
  app.set_version_flag("--version", std::string("isohf-view ") + ISOHF_VERSION);
  app.add_option("archive", options.archive, "Archive to view")->required();
  auto* screenshot = app.add_option("--screenshot", options.screenshot, "Write a picture, PNG, and end");
  auto* flight = app.add_option("--flight", options.flight, "Fly along a path without a screen");
  app.add_option("--frames", options.frames, "Frames of the flight (300), or after which the window closes")
      ->check(CLI::Range(1, 10000000));
  app.add_option("--csv", options.csv, "Write figures of each frame of the flight or step of the sweep");
  app.add_option("--plot", options.plot, "Write a chart of the flight's frame times, SVG")->needs(flight);
  app.add_flag("--baseline", options.baseline, "After the flight, measure a plain static mesh of the same triangles");
  bool verify = false;
  app.add_flag("--verify", verify, "Check that archive, index arrays and shaders agree with the library");
  bool sweep = false;
  app.add_flag("--sweep", sweep, "Go from level 0 to 2 in small steps and measure how the picture changes");
  app.add_option("--steps", options.sweep_steps, "Steps of the sweep")
      ->check(CLI::Range(4, 10000))
      ->capture_default_str();
  bool window = false;
  app.add_flag("--window", window, "Open a window even with --screenshot, which then shows the window");
  app.add_option("--memory", options.memory_mib, "Bound of the memory that tiles take, MiB")
      ->check(CLI::Range(1, 1 << 20))
      ->capture_default_str();
  app.add_option("--upload", options.upload_mib, "Most that goes to the GPU in one frame, MiB")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  app.add_option("-j,--threads", options.threads, "Threads that decode tiles; default: one less than there are cores")
      ->check(CLI::Range(1, 256));
  add_picture_options(app, options, raw);
  try {
    app.parse(argc, argv);
    if (!parse_size(raw.size, options.view)) {
      throw CLI::ValidationError("--size", "'" + raw.size + "' is not WIDTHxHEIGHT, each 16 to 16384");
    }
    const int actions = (flight->count() > 0) + verify + sweep + (screenshot->count() > 0 && !window);
    if (actions > 1 || (window && actions > 0)) {
      throw CLI::ValidationError("--screenshot, --flight, --verify, --sweep, --window", "only one of them at a time");
    }
  } catch (const CLI::ParseError& error) {
    const int code = app.exit(error);
    return {std::nullopt, code == 0 ? 0 : 2};
  }
  options.mode_given = app.count("--mode") > 0;
  if (!raw.level.empty()) options.view.fixed_level = raw.level[0];
  if (raw.level.size() > 1) options.view.other_level = raw.level[1];
  if (app.count("--far") > 0) options.far_distance = raw.far_distance;
  if (app.count("--exaggeration") > 0) options.exaggeration = raw.exaggeration;
  if (!raw.shadows.empty()) options.shadows = raw.shadows == "on";
  if (app.count("--shadow-softness") > 0) options.shadow_softness = raw.shadow_softness;
  if (!raw.position.empty()) options.position = vec3_from(raw.position);
  if (!raw.look_at.empty()) options.look_at = vec3_from(raw.look_at);
  if (!raw.sun.empty()) {
    options.sun_azimuth_deg = raw.sun[0];
    options.sun_elevation_deg = raw.sun[1];
  }
  options.view.fov_y_rad = raw.fov_deg * std::acos(-1.0) / 180.0;
  if (screenshot->count() > 0 && !window) options.action = Options::Action::kScreenshot;
  if (flight->count() > 0) options.action = Options::Action::kFlight;
  if (verify) options.action = Options::Action::kVerify;
  if (sweep) options.action = Options::Action::kSweep;
  return {options, 0};
}

}  // namespace isohf::view
