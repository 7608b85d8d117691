#include "input/convert_setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <filesystem>
#include <limits>

#include "formats/io/file_stamp.h"
#include "input/options_source.h"
#include "isohf/base/text/number_text.h"
#include "isohf/convert/frame/source_frame.h"
#include "isohf/error.h"
#include "isohf/photo/texture_cutter.h"
#include "isohf/picture.h"
#include "isohf/projection/crs/crs.h"
#include "isohf/resampling.h"
#include "options/command_line.h"
#include "options/option_values.h"
#include "output/output_kinds.h"

namespace isohf::cli {
namespace {

[[noreturn]] void refuse(const std::string& why) {
  throw Error(ErrorCode::kInvalidArgument, why);
}

void parse_shape(const std::string& text, PlanRequest& request) {
  constexpr std::int64_t kMostTriangles = std::numeric_limits<std::int32_t>::max();
  request.shape.reset();
  request.budget.reset();
  if (text.find_first_of("xX") == std::string::npos) {
    request.budget = ShapeBudget{ShapeBudget::Kind::kTriangles, parse_whole_number(text, 1, kMostTriangles)};
  } else {
    request.shape = parse_size(text, 1, kMaxTileRows);
  }
}

ProjectionRequest parse_map(const std::string& text) {
  static const std::vector<std::string> kKinds = {"auto",
                                                  "none",
                                                  "equirectangular",
                                                  "local",
                                                  "utm",
                                                  "transverse-mercator",
                                                  "lambert-conformal",
                                                  "polar-stereographic"};
  const std::string word = text.substr(0, text.find(':'));
  try {
    // A file may have the name of a kind.
    return ProjectionRequest::parse(std::ranges::find(kKinds, word) != kKinds.end() ? text : system_from(text));
  } catch (const Error& error) {
    throw Error(error.code(), error.what() + did_you_mean(word, kKinds), error.parts());
  }
}

std::optional<double> parse_step(const std::string& text) {
  if (text == "auto") return std::nullopt;
  if (text == "finest") return 0.0;
  const std::optional<double> step = number_from(text);
  if (!step || !std::isfinite(*step) || *step <= 0.0)
    refuse("found '" + text + "', must be a number greater than 0, finest or auto");
  return step;
}

void add_map_options(CLI::App& line, GroundRequest& request) {
  group(line, "Map");
  option(line, "--to-crs", "SYSTEM",
         "Map of the result: auto, none, equirectangular, local, utm, transverse-mercator, lambert-conformal, "
         "polar-stereographic (parameters follow a colon, as in utm:32N), or a reference system as for --crs [default: "
         "auto for degrees, none for maps]",
         [&request](const std::string& text) { request.projection = parse_map(text); });
  line.add_flag_callback(
      "--wrap-x", [&request] { request.wrap = Wrap::kAlways; },
      "Join the East edge to the West edge, or fail [default: if the input goes all the way round]");
  line.add_flag_callback(
      "--no-wrap", [&request] { request.wrap = Wrap::kNever; }, "Do not join them");
  exclusive(line, {"--wrap-x", "--no-wrap"});
}

void add_lattice_options(CLI::App& line, PlanRequest& request, bool& spacing_in_metres) {
  group(line, "Lattice");
  option(line, "--density", "RATIO",
         "Vertices per sample, as in 0.5 or 1/2; 0.866 is the isotropic optimum [default: about 1]",
         [&request](const std::string& text) { request.density = parse_ratio(text); });
  option(line, "--spacing", "LENGTH",
         "Distance between neighbouring columns of vertices: world units, or with a unit as in 30m, 0.5km, 100ft",
         [&request, &spacing_in_metres](const std::string& text) {
           const LengthValue length = parse_length(text);
           request.spacing = length.value;
           spacing_in_metres = length.in_metres;
         });
  exclusive(line, {"--density", "--spacing"});
  line.add_flag(
      "--fit", request.fit,
      "Stretch tiles by up to an eighth to end on the input's edge [default: square tiles, nodata beyond it]");
  group(line, "Tile shape");
  option(line, "--shape", "CxR|N", "Stored elevations per tile, as in 212x243; or the best shape of about N triangles",
         [&request](const std::string& text) { parse_shape(text, request); });
  option(line, "--levels", "N", "Levels of detail, 1 to 14 [default: 4, or fewer for a small input]",
         [&request](const std::string& text) {
           request.levels = static_cast<int>(parse_whole_number(text, 1, kMaxTileLevels));
         });
}

void add_precision_options(CLI::App& line, ConvertOptions& options) {
  group(line, "Precision");
  choice<CodeType>(line, "--type", {{"u16", CodeType::kU16}, {"u8", CodeType::kU8}, {"f32", CodeType::kF32}},
                   "Stored elevations: codes with one step for all tiles, or floats [default: u16]", options.code_type);
  CLI::Option* const range = option(line, "--z-range", "MIN:MAX",
                                    "Refuse elevations outside this range [default: the range found in a first pass]",
                                    [&options](const std::string& text) { options.z_range = parse_range(text); });
  line.add_flag("--clamp-range", options.clamp_range, "Clamp elevations to --z-range, and count them, instead")
      ->needs(range);
  option(line, "--step", "S|finest|auto", "Elevation step of one code [default: auto, from the input's own step]",
         [&options](const std::string& text) { options.step = parse_step(text); });
  option(line, "--max-rounding", "E",
         "Store every vertex to within E, as LERC's MAX_Z_ERROR; this does not bound the surface between them",
         [&options](const std::string& text) { options.max_rounding = parse_positive_number(text); });
  option(line, "--max-error", "E",
         "Keep the surface, as drawn, within E of every sample, or fail. Chooses density, step and filter unless given",
         [&options](const std::string& text) { options.max_error = parse_positive_number(text); });
  group(line, "Reconstruction");
  option(line, "--filter", "nearest|bilinear|limited-cubic|bspline3",
         "Reconstruction filter [default: " + to_string(kDefaultFilter) + "]",
         [&options](const std::string& text) { options.filter = filter_from_string(text); });
  option(line, "--acquisition", "point|box|gaussian:SIGMA|TAPS",
         "How samples were taken; taps as in 0.25,0.5,0.25 [default: " + to_string(options.acquisition) + "]",
         [&options](const std::string& text) { options.acquisition = acquisition_from_string(text); });
}

void add_extra_options(CLI::App& line, ConvertCommandOptions& options) {
  group(line, "Size and extras");
  choice<Effort>(line, "--effort", {{"fast", Effort::kFast}, {"default", Effort::kDefault}, {"best", Effort::kBest}},
                 "Effort to make the archive small; the elevations are the same", options.convert.effort);
  line.add_flag("--lossless", options.convert.lossless,
                "Store residuals too, so that isohf export returns every sample bit for bit");
  CLI::Option* const seeds =
      line.add_flag("--shadow-seeds", options.with_seeds, "Store what each tile needs to compute its own cast shadows");
  option(line, "--sun-min", "DEG", "Lowest sun for --shadow-seeds; a lower one takes more room [default: 2]",
         [&options](const std::string& text) { options.seeds.sun_min_deg = parse_number(text); })
      ->needs(seeds);
  CLI::Option* const photo = option(line, "--texture", "PHOTO",
                                    "Cut a texture for every tile from a picture, placed by its georeference, else "
                                    "over the whole input",
                                    options.photo);
  option(line, "--texture-size", "N", "At most N texels a side, a power of two from 64 to 4096 [default: 1024]",
         [&options](const std::string& text) {
           options.texture.max_size = static_cast<int>(parse_whole_number(text, kMinTextureSize, kMaxTextureSize));
           if (!std::has_single_bit(static_cast<unsigned>(options.texture.max_size)))
             refuse(fmt::format("found '{}', must be a power of two", text));
         })
      ->needs(photo);
}

/// "--fill 50" reads 50 as an input.
void check_fill(const ConvertCommandOptions& options) {
  const std::string& first = options.inputs.names.front();
  std::error_code none;
  if (options.open.voids.fill && first.find_first_not_of("0123456789") == std::string::npos &&
      !std::filesystem::exists(first, none))
    refuse(fmt::format("{0}: no such file; if it is the distance of --fill, write --fill={0}", first));
}

}  // namespace

void add_conversion_options(CLI::App& line, ConvertCommandOptions& options, Common& common) {
  option(line, "-o,--output", "OUTPUT", "Archive to write [default: the last name, if it ends in .isohf]",
         options.output);
  line.add_flag("--overwrite", options.convert.overwrite, "Replace OUTPUT if it exists");
  line.add_flag("--resume", options.convert.resume,
                "Continue OUTPUT.part of an interrupted run after checking it, and skip complete archives");
  option(line, "--out-dir", "DIR", "Make DIR/NAME.isohf from each input; all names are inputs", options.out_dir);
  line.add_flag("--keep-going", options.keep_going, "With --out-dir: continue after a failed input");
  option(line, "--shard", "K/N", "Make shard K of N, some rows of tiles; isohf merge joins them",
         [&options](const std::string& text) { options.shard = shard_number_from_string(text); });
  add_source_options(line, options.open);
  add_mosaic_options(line, options.inputs);
  add_lattice_options(line, options.convert.plan, options.spacing_in_metres);
  add_map_options(line, options.convert.plan.ground);
  add_geoid_option(line, options.geoid);
  add_precision_options(line, options.convert);
  add_extra_options(line, options);
  add_work_options(line, options.work, common);
  add_memory_option(line, options.work);
}

void complete(const CLI::App& line, ConvertCommandOptions& options) {
  const auto refuse_with = [&](const char* one, std::initializer_list<const char*> others) {
    for (const char* other : others) {
      if (given(line, one) && given(line, other)) refuse(fmt::format("{} cannot be combined with {}", other, one));
    }
  };
  refuse_with("--out-dir", {"--output", "--shard", "--on-top"});
  refuse_with("--shard", {"--resume", "--max-error"});
  if (options.keep_going && options.out_dir.empty()) refuse("--keep-going needs --out-dir");
  // The last name is the output only if it ends in .isohf: a forgotten output must not cost the last input.
  std::vector<std::string>& names = options.inputs.names;
  if (options.out_dir.empty() && options.output.empty() && names.size() > 1 && is_archive_name(names.back())) {
    options.output = names.back();
    names.pop_back();
  }
  check_fill(options);
  if (options.convert.lossless && !options.geoid.path.empty())
    refuse("--lossless keeps the input's own samples, --geoid changes them; give one of the two");
  options.inputs.as_given = recorded_options(line);
  options.work.scratch_folder = scratch_folder_for(options.out_dir.empty() ? options.output : options.out_dir + "/");
  if (options.with_seeds) options.convert.shadow_seeds = options.seeds;
  options.convert.strict = options.common.strict;
}

Prepared prepare(ConvertCommandOptions& options, std::vector<std::string> files) {
  options.open.buffer_bytes = options.work.reader_bytes(options.open.buffer_bytes);
  PlanRequest& plan = options.convert.plan;
  options.inputs.onto = plan.ground.projection;
  OpenedInputs opened = open_inputs(std::move(files), options.inputs, options.open, options.work);
  if (opened.is_reprojected) plan.ground.projection = ProjectionRequest{};
  Prepared prepared{std::move(opened.files),
                    laid_out(std::move(opened.source), options.geoid, plan.ground, options.convert.lossless), nullptr};
  const SourceInfo& info = prepared.source->info();
  understand_ground(info, plan.ground);
  options.convert.source_note = opened.note;
  if (const std::string& file = options.geoid.path; !file.empty()) {
    prepared.files.push_back(file);
    options.convert.source_note.fingerprint += fmt::format(" | {} {}", file, FileStamp::of(file).text());
  }
  if (!options.photo.empty()) {
    prepared.photo = open_photo(options.photo);
    options.texture.photo = prepared.photo.get();
    if (const auto& place = prepared.photo->info().georeference; place && info.georeference.has_origin)
      options.texture.same_system = are_same(place->system, info.georeference.system);
    options.convert.texture = options.texture;
  }
  if (options.spacing_in_metres && !make_source_frame(info, plan.ground).in_metres) {
    refuse(info.path +
           ": --spacing has a unit, but the input's coordinates are in none that is known; give a plain number, or "
           "--sample-spacing in metres");
  }
  return prepared;
}

}  // namespace isohf::cli
