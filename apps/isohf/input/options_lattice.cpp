#include "input/options_lattice.h"

#include <limits>

#include "input/quantities.h"
#include "isohf/convert/frame/source_frame.h"
#include "isohf/error.h"
#include "options/command_line.h"
#include "options/option_values.h"

namespace isohf::cli {
namespace {

constexpr std::int64_t kMostCount = std::numeric_limits<std::int32_t>::max();

}  // namespace

void add_shape_options(CLI::App& line, PlanRequest& request) {
  group(line, "Tile shape");
  option(line, "--shape", "CxR|N", "Stored elevations per tile, as in 212x243; or the best shape of about N triangles",
         [&request](const std::string& text) {
           request.shape.reset();
           request.budget.reset();
           if (text.find_first_of("xX") == std::string::npos) {
             request.budget = ShapeBudget{ShapeBudget::Kind::kTriangles, parse_whole_number(text, 1, kMostCount)};
             return;
           }
           const auto [columns, rows] = parse_size(text, 1, kMaxTileRows);
           request.shape = {static_cast<int>(columns), static_cast<int>(rows)};
         });
  option(line, "--levels", "N", "Levels of detail, 1 to 14 [default: 4, or fewer for a small input]",
         [&request](const std::string& text) {
           request.levels = static_cast<int>(parse_whole_number(text, 1, kMaxTileLevels));
         });
}

void check_spacing_unit(const SourceInfo& info, const PlanRequest& request, bool spacing_in_metres) {
  if (!spacing_in_metres || make_source_frame(info, request.ground).in_metres) return;
  throw Error(ErrorCode::kInvalidArgument,
              info.path +
                  ": --spacing has a unit, but the input's coordinates are in none that is known; give a plain "
                  "number, or --sample-spacing in metres");
}

void add_lattice_options(CLI::App& line, PlanRequest& request, bool& spacing_in_metres) {
  group(line, "Lattice");
  option(line, "--density", "RATIO",
         "Vertices per sample, as in 0.5 or 1/2; 0.866 is the isotropic optimum [default: 1]",
         [&request](const std::string& text) { request.density = parse_ratio(text); });
  option(line, "--spacing", "LENGTH",
         "Distance between neighbouring columns of vertices: world units, or with a unit as in 30m, 0.5km, 100ft",
         [&request, &spacing_in_metres](const std::string& text) {
           const LengthValue length = parse_length(text);
           request.spacing = length.value;
           spacing_in_metres = length.in_metres;
         });
  exclusive(line, {"--density", "--spacing"});
  line.add_flag("--fit", request.fit, "Stretch tiles slightly to end on the input's edge");
  choice<Outside>(line, "--outside", {{"cover", Outside::kCover}, {"clamp", Outside::kClamp}, {"void", Outside::kVoid}},
                  "Beyond the input, continue the slope for two lattice steps and then level (cover), repeat the edge "
                  "(clamp), or store nodata (void) [default: cover]",
                  request.outside);
}

void add_quantisation_options(CLI::App& line, ConvertOptions& options) {
  group(line, "Precision");
  choice<CodeType>(line, "--type", {{"u16", CodeType::kU16}, {"u8", CodeType::kU8}, {"f32", CodeType::kF32}},
                   "Stored elevations: codes with one step for all tiles, or floats [default: u16]", options.code_type);
  CLI::Option* const range = option(line, "--z-range", "MIN:MAX",
                                    "Refuse elevations outside this range [default: the range found in a first pass]",
                                    [&options](const std::string& text) { options.z_range = parse_range(text); });
  line.add_flag("--clamp-range", options.clamp_range, "Clamp elevations to --z-range, and count them, instead")
      ->needs(range);
  option(line, "--step", "S|finest|auto", "Elevation step of one code [default: auto, from the input's own step]",
         [&options](const std::string& text) {
           options.step.reset();
           if (text == "auto") return;
           options.step = 0.0;
           if (text == "finest") return;
           double step = 0.0;
           if (!read_number(text, step) || !(step > 0.0) || step > std::numeric_limits<double>::max()) {
             throw Error(ErrorCode::kInvalidArgument,
                         "found '" + text + "', must be a number greater than 0, finest or auto");
           }
           options.step = step;
         });
  option(line, "--max-rounding", "E",
         "Store every vertex to within E, as LERC's MAX_Z_ERROR; this does not bound the surface between them",
         [&options](const std::string& text) { options.max_rounding = parse_positive_number(text); });
  option(line, "--max-error", "E",
         "Keep the surface, as drawn, within E of every sample, or fail. Chooses density, step and filter unless given",
         [&options](const std::string& text) { options.max_error = parse_positive_number(text); });
}

}  // namespace isohf::cli
