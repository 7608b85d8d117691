#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>

#include "formats/netcdf/cf_raster.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// How CF's standard names of elevations begin, the ground before what is below ice or water.
constexpr std::array<std::string_view, 11> kStandardNames = {
    "surface_altitude", "ground_level_altitude", "height_above_", "altitude", "bedrock_", "sea_floor_",
    "model_sea_floor_", "surface_geopotential",  "geopotential",  "height",   "depth"};
/// What variables of elevations are called.
constexpr std::string_view kNames =
    " elevation elev z band1 dem dtm dsm surface topo topography altitude alt height h hgt hgt_m orography orog "
    "terrain "
    "relief zs usurf bed topg bedrock bathymetry bathy depth geopotential phis ";
/// Words in names and long names of elevations, and of what is about them.
constexpr std::array<std::string_view, 8> kWords = {"elevation", "altitude", "topograph", "bathymetr",
                                                    "orograph",  "terrain",  "height",    "geopotential"};
constexpr std::array<std::string_view, 14> kOtherWords = {"mask",      "flag",   "count",     "error",     "uncertain",
                                                          "deviation", "stdev",  "number of", "quality",   "slope",
                                                          "aspect",    "weight", "thickness", "interpolat"};

/// What speaks for a variable, the best first. Each has a thousand places.
enum Evidence { kStandardName = 0, kName = 1000, kWord = 2000, kNothing = 3000, kAgainst = 4000 };

/// The dimension before the last two that has not one place; their number if all have.
std::size_t first_steps(const NetcdfFile::Variable& variable) {
  const auto end = variable.sizes.end() - 2;
  const auto found = std::find_if(variable.sizes.begin(), end, [](std::size_t size) { return size != 1; });
  return static_cast<std::size_t>(found - variable.sizes.begin());
}

/// The less, the likelier a variable holds elevations.
int place_of(const NetcdfFile& file, const NetcdfFile::Variable& variable) {
  const std::string standard = lower_case(file.text(variable.id, "standard_name"));
  const std::string name = lower_case(variable.name);
  const std::string words = name + ' ' + lower_case(file.text(variable.id, "long_name"));
  const auto are_in = [&](const auto& list) {
    return std::ranges::any_of(list, [&](std::string_view word) { return words.find(word) != std::string::npos; });
  };
  const int base = first_steps(variable) < variable.sizes.size() - 2 ? 500 : 0;  // behind what has no steps
  const bool has_flags =
      !file.text(variable.id, "flag_meanings").empty() || !file.numbers(variable.id, "flag_values").empty();
  // "surface_altitude standard_error": a modifier makes it something else.
  if (has_flags || standard.find(' ') != std::string::npos) return base + kAgainst;
  const auto begins = [&](std::string_view begin) { return standard.starts_with(begin); };
  const auto known = std::ranges::find_if(kStandardNames, begins) - kStandardNames.begin();
  if (known < std::ssize(kStandardNames)) return base + kStandardName + static_cast<int>(known);
  if (size_bytes(*variable.sample_type) == 1 || are_in(kOtherWords) || name.starts_with("err") || name == "tid") {
    return base + kAgainst;
  }
  const std::size_t named = kNames.find(' ' + name + ' ');
  if (named != std::string_view::npos) return base + kName + static_cast<int>(named);
  return base + (are_in(kWords) ? kWord : kNothing);
}

}  // namespace

char direction_of(std::string_view unit) {
  const std::string text = lower_case(unit);
  if (!text.starts_with("deg")) return '\0';
  std::string_view rest = text;
  for (const std::string_view part : {"deg", "ree", "s", "_", " "}) {
    if (rest.starts_with(part)) rest.remove_prefix(part.size());
  }
  if (rest.starts_with("lat")) return 'n';
  if (rest.starts_with("lon")) return 'e';
  for (const std::string_view direction : {"east", "west", "north", "south"}) {
    if (rest == direction || rest == direction.substr(0, 1)) return direction[0];
  }
  return rest.empty() ? ' ' : '\0';
}

bool is_coordinate(const NetcdfFile& file, const NetcdfFile::Variable& variable) {
  const char direction = direction_of(file.text(variable.id, "units"));
  const std::string standard = file.text(variable.id, "standard_name");
  const std::string name = lower_case(variable.name);
  return (direction != '\0' && direction != ' ') || standard == "latitude" || standard == "longitude" ||
         standard.starts_with("projection_") || name.ends_with("_bnds") || name.ends_with("_bounds");
}

const NetcdfFile::Variable& elevations_of(const NetcdfFile& file, const OpenOptions& options, SourceInfo& info) {
  const auto refuse = [&](ErrorCode code, const std::string& what) { throw Error(code, info.path + ": " + what); };
  std::set<std::string> bounds;
  for (const NetcdfFile::Variable& variable : file.variables()) bounds.insert(file.text(variable.id, "bounds"));
  std::vector<std::pair<int, const NetcdfFile::Variable*>> rasters;
  for (const NetcdfFile::Variable& variable : file.variables()) {
    const std::size_t rank = variable.sizes.size();
    const bool is_raster =
        rank >= 2 && std::min(variable.sizes[rank - 1], variable.sizes[rank - 2]) >= 2 && variable.sample_type;
    const bool is_place = bounds.contains(variable.name) || is_coordinate(file, variable);
    if (is_raster && (!is_place || variable.name == options.channel)) {
      rasters.emplace_back(place_of(file, variable), &variable);
    }
  }
  if (rasters.empty()) {
    const bool is_old_gmt = file.variable("x_range") != nullptr && file.variable("spacing") != nullptr;
    refuse(ErrorCode::kUnsupported,
           is_old_gmt
               ? fmt::format("this is a GMT grid from before CF; gmt grdconvert {} OUT.nc converts it", info.path)
               : "has no variable of numbers along two dimensions");
  }
  std::ranges::stable_sort(rasters, {}, &std::pair<int, const NetcdfFile::Variable*>::first);
  // Those for which as much speaks; any evidence counts as much.
  const int alike = std::max<int>(rasters[0].first / 1000 * 1000, kWord) + 1000;
  std::string names;
  std::string others;
  const NetcdfFile::Variable* chosen = nullptr;
  for (const auto& [place, variable] : rasters) {
    const std::string name = (names.empty() ? "" : ", ") + printable(variable->name);
    names += name;
    if (place < alike && variable != rasters[0].second) others += others.empty() ? name.substr(2) : name;
    if (options.channel.empty() ? chosen == nullptr : variable->name == options.channel) chosen = variable;
  }
  if (chosen == nullptr) {
    refuse(ErrorCode::kInvalidArgument,
           fmt::format("there is no channel \"{}\"; there are {}", printable(options.channel), names));
  }
  if (const std::size_t at = first_steps(*chosen); at < chosen->sizes.size() - 2) {
    refuse(ErrorCode::kUnsupported,
           fmt::format("{0} has {1} steps along {2}, must have 1 (ncks -d {2},0 takes one)", printable(chosen->name),
                       chosen->sizes[at], printable(chosen->dimensions[at])));
  }
  if (rasters.size() > 1) info.channel = printable(chosen->name);
  if (rasters.size() == 1 || !options.channel.empty()) return *chosen;
  info.warnings.push_back(
      others.empty()
          ? Warning(fmt::format("there are {} variables ({}); {} is read", rasters.size(), names, info.channel))
          : loss(fmt::format("{} is read; left out are {}, which may be elevations as well "
                             "(`channel` names another)",
                             info.channel, others)));
  return *chosen;
}

}  // namespace isohf
