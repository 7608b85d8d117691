#include "input/options_lattice.h"

#include <limits>

#include "input/quantities.h"
#include "isohf/convert/frame/source_frame.h"
#include "isohf/error.h"
#include "options/option_values.h"

namespace isohf::cli {
namespace {

constexpr std::int64_t kMostCount = std::numeric_limits<std::int32_t>::max();

}  // namespace

void add_shape_options(CommandLine& line, PlanRequest& request) {
  line.group("Tile shape");
  line.option("--shape", "CxR|N",
              "Stored elevations of one tile, columns by rows, as in 212x243; or the shape of about N triangles",
              [&](const std::string& text) {
                if (text.find_first_of("xX") == std::string::npos) {
                  request.budget = ShapeBudget{ShapeBudget::Kind::kTriangles, parse_whole_number(text, 1, kMostCount)};
                  return;
                }
                const auto [columns, rows] = parse_size(text, 1, kMaxTileRows);
                request.shape = {static_cast<int>(columns), static_cast<int>(rows)};
              });
  line.option(
      "--levels", "N", "Levels of detail, 1 to 14 (default 4, fewer for a small input)",
      [&](const std::string& text) { request.levels = static_cast<int>(parse_whole_number(text, 1, kMaxTileLevels)); });
}

void check_spacing_unit(const SourceInfo& info, const PlanRequest& request, bool spacing_in_metres) {
  if (!spacing_in_metres || make_source_frame(info, request.ground).in_metres) return;
  throw Error(ErrorCode::kInvalidArgument,
              info.path +
                  ": --spacing has a unit, but the input's coordinates are in none that is known; give a plain "
                  "number, or --sample-spacing in metres");
}

void add_lattice_options(CommandLine& line, PlanRequest& request, bool& spacing_in_metres) {
  line.group("Lattice");
  line.option("--density", "RATIO",
              "Lattice samples for one input sample, as in 0.5 or 1/2; 0.866 is the isotropic optimum (default 1)",
              [&](const std::string& text) { request.density = parse_ratio(text); });
  line.option("--spacing", "LENGTH",
              "Distance of neighbouring lattice columns: world units (metres where the input's are known), or with a "
              "unit as in 30m, 0.5km, 100ft",
              [&](const std::string& text) {
                const LengthValue length = parse_length(text);
                request.spacing = length.value;
                spacing_in_metres = length.in_metres;
              });
  line.option("--tiles", "NxM", "Number of tile columns by tile rows",
              [&](const std::string& text) { request.tiles = parse_size(text, 1, kMaxTilesPerAxis); });
  line.exclusive({"--density", "--spacing", "--tiles"});
  line.flag("--fit", "Stretch the tiles a little so that they end on the input's edge", request.fit);
  line.option(
      "--outside", "RULE",
      "Fill tiles beyond the input: cover (the slope goes on for two lattice steps, then level), clamp (the edge "
      "value goes on) or void (default cover)",
      [&](const std::string& text) {
        constexpr Outside kRules[] = {Outside::kCover, Outside::kClamp, Outside::kVoid};
        request.outside = kRules[parse_word(text, {"cover", "clamp", "void"})];
      });
}

void add_code_type_option(CommandLine& line, CodeType& type) {
  line.option("--type", "TYPE", "Stored elevation: u16, u8 (codes with one step for all tiles) or f32 (default u16)",
              [&](const std::string& text) {
                constexpr CodeType kTypes[] = {CodeType::kU16, CodeType::kU8, CodeType::kF32};
                type = kTypes[parse_word(text, {"u16", "u8", "f32"})];
              });
}

void add_quantisation_options(CommandLine& line, ConvertOptions& options) {
  line.group("Elevations");
  add_code_type_option(line, options.code_type);
  line.option("--z-range", "MIN:MAX",
              "Store nothing outside: elevations beyond are refused (default: found in a first pass)",
              [&](const std::string& text) { options.z_range = parse_range(text); });
  line.flag("--clamp-range", "Move elevations outside --z-range to its ends and count them, instead of refusing",
            options.clamp_range);
  line.option("--step", "S|finest|auto",
              "Elevation of one code: a number, the finest that the type holds, or chosen from the input's own step "
              "(default auto)",
              [&](const std::string& text) {
                if (text == "auto") {
                  options.step.reset();
                } else if (text == "finest") {
                  options.step = 0.0;
                } else {
                  double step = 0.0;
                  if (!read_number(text, step) || !(step > 0.0) || step > std::numeric_limits<double>::max()) {
                    throw Error(ErrorCode::kInvalidArgument,
                                "found '" + text + "', must be a number greater than 0, finest or auto");
                  }
                  options.step = step;
                }
              });
  line.option("--max-rounding", "E",
              "Store every vertex's elevation to within E (as MAX_Z_ERROR of LERC): by steps of twice that, or with a "
              "finer --step by those codes within reach that vary least",
              [&](const std::string& text) { options.max_rounding = parse_positive_number(text); });
  line.option("--max-error", "E",
              "Hold the surface, as drawn, to within E of every input sample: chooses density, step and filter where "
              "they are not given, measures all, and refuses what cannot be held",
              [&](const std::string& text) { options.max_error = parse_positive_number(text); });
}

}  // namespace isohf::cli
