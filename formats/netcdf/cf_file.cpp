#include "formats/netcdf/cf_file.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>
#include <string_view>
#include <tuple>

#include "formats/georeference/files_beside.h"
#include "formats/io/text.h"
#include "formats/open_options.h"
#include "isohf/error.h"
#include "isohf/projection/length_unit.h"
#include "isohf/projection/source_system.h"

namespace isohf {
namespace {

using Variable = CfFile::Variable;

constexpr int kFloat = 5;
constexpr std::uint64_t kMostSide = std::uint64_t{1} << 31U;

/// An axis of evenly spaced coordinates.
struct Axis {
  double first = 0.0;
  double step = 0.0;
};

class CfReader {
 public:
  CfReader(CfFile& file, SourceInfo& info) : file_(file), info_(info) {}

  CfRaster read(const OpenOptions& options) {
    CfRaster raster;
    is_system_given_ = !options.reference_system.empty();
    raster.variable = &choose(options);
    const Variable& variable = *raster.variable;
    info_.sample_type = *variable.sample_type();
    const std::size_t last = variable.dimensions.size() - 1;
    const auto of_dimension = [&](std::size_t i) {
      return file_.variable(file_.dimensions[variable.dimensions[i]].name);
    };
    const Variable* rows = of_dimension(last - 1);
    const Variable* columns = of_dimension(last);
    std::uint64_t height = file_.size_of(variable, last - 1);
    std::uint64_t width = file_.size_of(variable, last);
    raster.by_columns = rows != nullptr && columns != nullptr && is_along_x(*rows) && !is_along_x(*columns);
    if (raster.by_columns) {
      std::swap(rows, columns);
      std::swap(height, width);
    }
    if (std::max(width, height) >= kMostSide) {
      refuse(ErrorCode::kCorrupt, fmt::format("{} has more than 2147483647 samples a side", printable(variable.name)));
    }
    info_.width = static_cast<std::int64_t>(width);
    info_.height = static_cast<std::int64_t>(height);
    raster.from_south =
        runs_from_south(rows, file_.dimensions[variable.dimensions[raster.by_columns ? last : last - 1]].name);
    if (rows != nullptr && columns != nullptr) read_place(variable, *rows, *columns, raster);
    read_attributes(variable);
    return raster;
  }

 private:
  [[noreturn]] void refuse(ErrorCode code, const std::string& what) const {
    throw Error(code, info_.path + ": " + what);
  }

  /// Whether the last two dimensions make a raster, and those before are of one.
  [[nodiscard]] bool is_raster(const Variable& variable) const {
    const std::size_t count = variable.dimensions.size();
    if (count < 2 || !variable.sample_type()) return false;
    for (std::size_t axis = 0; axis < count; ++axis) {
      const std::uint64_t size = file_.size_of(variable, axis);
      if (axis + 2 < count ? size != 1 : size < 2) return false;
    }
    return true;
  }

  const Variable& choose(const OpenOptions& options) {
    const Variable* chosen = nullptr;
    std::string names;
    int rasters = 0;
    for (const Variable& variable : file_.variables) {
      if (!is_raster(variable)) continue;
      // Bounds of cells and places of a curved grid are no elevations, unless they are asked for.
      const std::string unit = variable.text("units");  // degrees_north, degree_E
      const bool is_place = variable.name.ends_with("_bnds") || variable.name.ends_with("_bounds") ||
                            unit.starts_with("degrees_") || unit.starts_with("degree_");
      if (is_place && variable.name != options.channel) continue;
      names += (names.empty() ? "" : ", ") + printable(variable.name);
      ++rasters;
      if (options.channel.empty() ? chosen == nullptr : variable.name == options.channel) chosen = &variable;
    }
    if (rasters == 0) {
      for (const Variable& variable : file_.variables) {
        if (variable.dimensions.size() < 3 || !variable.sample_type()) continue;
        for (std::size_t axis = 0; axis + 2 < variable.dimensions.size(); ++axis) {
          const std::uint64_t steps = file_.size_of(variable, axis);
          if (steps < 2) continue;
          const std::string along = printable(file_.dimensions[variable.dimensions[axis]].name);
          refuse(ErrorCode::kUnsupported, fmt::format("{} has {} steps along {}, must have 1 (ncks -d {},0 takes one)",
                                                      printable(variable.name), steps, along, along));
        }
      }
      refuse(ErrorCode::kUnsupported, "has no variable of two dimensions that do not grow (nccopy -u makes them so)");
    }
    if (chosen == nullptr) {
      refuse(ErrorCode::kInvalidArgument,
             fmt::format("there is no channel \"{}\"; there are {}", printable(options.channel), names));
    }
    if (rasters > 1) {
      info_.channel = printable(chosen->name);
      if (options.channel.empty())
        info_.warnings.push_back(
            fmt::format("there are {} variables ({}); {} is read", rasters, names, printable(chosen->name)));
    }
    return *chosen;
  }

  static bool is_along_x(const Variable& axis) {
    const std::string unit = lower_case(axis.text("units"));
    const std::string name = lower_case(axis.name);
    const std::string standard = axis.text("standard_name");
    return axis.text("axis") == "X" || unit.starts_with("degrees_e") || unit.starts_with("degree_e") ||
           standard == "longitude" || standard == "projection_x_coordinate" || name == "lon" || name == "longitude" ||
           name == "x";
  }

  /// nullopt where coordinates lie off the grid by more than a hundredth of a step, and more than float32 rounds them.
  /// Longitudes may go on at -180 after 180.
  std::optional<Axis> axis_of(const Variable& of, std::uint64_t count, bool turns) {
    if (of.dimensions.size() != 1 || !of.sample_type()) return std::nullopt;
    const auto [first, last] = ends_of(of, count);
    if (const auto axis = even_axis(of, count, {first, (last - first) / static_cast<double>(count - 1)}, 0.0))
      return axis;
    if (!turns || last >= first) return std::nullopt;
    return even_axis(of, count, {first, (last + 360.0 - first) / static_cast<double>(count - 1)}, 360.0);
  }

  /// Coordinates of an axis, packed or not.
  std::vector<double> coordinates(const Variable& of, std::uint64_t first, std::uint64_t count) {
    std::vector<double> there = file_.numbers(of, first, count);
    const double scale = of.number("scale_factor").value_or(1.0);
    const double offset = of.number("add_offset").value_or(0.0);
    for (double& coordinate : there) coordinate = coordinate * scale + offset;
    return there;
  }

  std::pair<double, double> ends_of(const Variable& of, std::uint64_t count) {
    return {coordinates(of, 0, 1)[0], coordinates(of, count - 1, 1)[0]};
  }

  /// turn  what coordinates may be apart by and still be one; 0: nothing
  std::optional<Axis> even_axis(const Variable& of, std::uint64_t count, const Axis& axis, double turn) {
    const double last = axis.first + static_cast<double>(count - 1) * axis.step;
    const double rounded = of.type == kFloat ? 1.5 * std::max(std::abs(axis.first), std::abs(last)) * 0x1p-24 : 0.0;
    const double most = std::max(0.01 * std::abs(axis.step), std::min(rounded, 0.2 * std::abs(axis.step)));
    constexpr std::uint64_t kAtOnce = 65536;
    for (std::uint64_t done = 0; done < count; done += kAtOnce) {
      const std::vector<double> there = coordinates(of, done, std::min(kAtOnce, count - done));
      for (std::size_t i = 0; i < there.size(); ++i) {
        double off = there[i] - axis.first - static_cast<double>(done + i) * axis.step;
        if (turn > 0.0) off -= turn * std::round(off / turn);
        if (!(std::abs(off) <= most)) return std::nullopt;
      }
    }
    return axis.step == 0.0 ? std::nullopt : std::optional(axis);
  }

  /// Rows run as their coordinates do, even where these are uneven. Without any the South comes first for GDAL and GMT.
  bool runs_from_south(const Variable* rows, std::string_view dimension) {
    if (rows != nullptr && rows->dimensions.size() == 1 && rows->sample_type()) {
      const auto [first, last] = ends_of(*rows, static_cast<std::uint64_t>(info_.height));
      return last > first;
    }
    // libnetcdf's name for those of HDF5, which has none: GDAL takes it for netCDF, and begins in the South, by the file's name.
    static constexpr std::array<std::string_view, 7> kNames = {".nc", ".nc2", ".nc3", ".nc4", ".cdf", ".grd", ".gmac"};
    const std::string extension = lower_case(std::filesystem::path(info_.path).extension().string());
    if (dimension.starts_with("phony_dim_") && std::ranges::find(kNames, extension) == kNames.end()) return false;
    info_.warnings.emplace_back(
        "its rows have no coordinates: the first is taken for the southernmost, as GDAL and GMT take it");
    return true;
  }

  void read_place(const Variable& variable, const Variable& rows, const Variable& columns, CfRaster& raster) {
    const std::string unit = trimmed(columns.text("units"));
    // Those of a geostationary view are angles as well, but no longitudes.
    const bool is_radians =
        (unit == "radian" || unit == "radians" || unit == "rad") &&
        (columns.text("standard_name") == "longitude" || lower_case(columns.name).starts_with("lon"));
    const bool is_degrees = unit.starts_with("degree") || is_radians;
    auto y = axis_of(rows, static_cast<std::uint64_t>(info_.height), false);
    auto x = axis_of(columns, static_cast<std::uint64_t>(info_.width), is_degrees && !is_radians);
    if (!x || !y) {
      info_.warnings.push_back(loss("its coordinates are not evenly spaced: where it lies is left out"));
      return;
    }
    if (is_radians) {
      for (double* value : {&x->first, &x->step, &y->first, &y->step}) *value *= 180.0 / std::numbers::pi;
    }
    if (x->step < 0.0) refuse(ErrorCode::kUnsupported, "its columns run from East to West (gdalwarp turns it)");
    const auto offset = file_.attributes.find("node_offset");  // GMT: 1 for pixels
    const auto* const pixels =
        offset == file_.attributes.end() ? nullptr : std::get_if<std::vector<double>>(&offset->second);
    Georeference& place = info_.georeference;
    place.registration =
        pixels != nullptr && !pixels->empty() && pixels->front() == 0.0 ? Registration::kPoint : Registration::kArea;
    place.spacing_x = x->step;
    place.spacing_y = std::abs(y->step);
    place.has_origin = true;
    place.origin_x = x->first;
    place.origin_y = raster.from_south ? y->first + static_cast<double>(info_.height - 1) * y->step : y->first;
    const std::string mapping = variable.text("grid_mapping");
    const Variable* const system = mapping.empty() ? nullptr : file_.variable(mapping);
    std::string wkt = system == nullptr ? "" : system->text("crs_wkt");
    if (wkt.empty() && system != nullptr) wkt = system->text("spatial_ref");
    const auto length = linear_unit(unit);
    const std::string kind = system == nullptr ? "" : system->text("grid_mapping_name");
    if (kind == "rotated_latitude_longitude" || columns.text("standard_name").starts_with("grid_")) {
      leave_out_place("its degrees are those of a rotated grid (gdalwarp turns it)");
    } else if (!wkt.empty()) {
      read_system_text(wkt, info_.path, info_);
      if (place.unit == HorizontalUnit::kMetre && length) place.metres_per_unit = length->metres;
    } else if (const std::string map = length && system != nullptr ? map_of(*system, kind, length->metres) : "";
               !map.empty()) {
      read_system_text(map, info_.path, info_);
    } else if (!kind.empty() && kind != "latitude_longitude" && !length) {
      leave_out_place(fmt::format("its grid mapping {} comes without crs_wkt", printable(kind)));
    } else if (is_degrees) {
      place.unit = HorizontalUnit::kDegree;
      const std::string figure = system == nullptr ? "" : figure_of(*system);
      if (figure.empty()) {
        if (!is_system_given_) place.system = wgs84_system();  // what CF means where nothing else stands
      } else {
        read_system_text("+proj=longlat" + figure + " +no_defs +type=crs", info_.path, info_);
      }
    } else if (length) {
      place.unit = HorizontalUnit::kMetre;
      place.metres_per_unit = length->metres;
      if (kind.empty()) return;
      info_.warnings.push_back(loss(
          fmt::format("its grid mapping {} comes without crs_wkt: the reference system is left out", printable(kind))));
    } else if (!unit.empty() && unit != "1" && unit != "user_x_unit") {  // the latter of older GMT
      info_.warnings.push_back(
          loss(fmt::format("its coordinates are in \"{}\", which is no unit that isohf knows: they are kept as numbers "
                           "(`reference_system` says what they are)",
                           printable(unit))));
    }
  }

  void leave_out_place(const std::string& why) {
    info_.warnings.push_back(loss(why + ": where it lies is left out"));
    const Registration registration = info_.georeference.registration;
    info_.georeference = {};
    info_.georeference.registration = registration;
  }

  /// A map by its parameters, as PROJ spells it; empty for a mapping that has no such spelling here.
  static std::string map_of(const Variable& system, std::string_view kind, double metres) {
    struct Mapping {
      std::string_view kind;
      const char* projection;
      const char* parallel;  ///< what a standard parallel is to it
    };
    static constexpr std::array<Mapping, 9> kMappings = {{{"transverse_mercator", "tmerc", ""},
                                                          {"mercator", "merc", "lat_ts"},
                                                          {"polar_stereographic", "stere", "lat_ts"},
                                                          {"stereographic", "stere", ""},
                                                          {"lambert_conformal_conic", "lcc", "lat_1"},
                                                          {"albers_conical_equal_area", "aea", "lat_1"},
                                                          {"lambert_azimuthal_equal_area", "laea", ""},
                                                          {"azimuthal_equidistant", "aeqd", ""},
                                                          {"lambert_cylindrical_equal_area", "cea", "lat_ts"}}};
    const auto* const found = std::ranges::find(kMappings, kind, &Mapping::kind);
    if (found == kMappings.end()) return {};
    std::string map = fmt::format("+proj={}", found->projection);
    const auto add = [&](std::string_view key, double value) { map += fmt::format(" +{}={:.17g}", key, value); };
    const auto parallels = system.numbers("standard_parallel");
    const std::string_view parallel = found->parallel;
    if (!parallels.empty() && !parallel.empty()) add(parallel, parallels.front());
    if (parallel == "lat_1" && !parallels.empty()) add("lat_2", parallels.back());
    if (kind == "polar_stereographic" && !system.number("latitude_of_projection_origin")) {
      add("lat_0", !parallels.empty() && parallels.front() < 0.0 ? -90.0 : 90.0);
    }
    for (const auto& [name, key, scale] : {std::tuple{"latitude_of_projection_origin", "lat_0", 1.0},
                                           {"longitude_of_projection_origin", "lon_0", 1.0},
                                           {"longitude_of_central_meridian", "lon_0", 1.0},
                                           {"straight_vertical_longitude_from_pole", "lon_0", 1.0},
                                           {"scale_factor_at_central_meridian", "k_0", 1.0},
                                           {"scale_factor_at_projection_origin", "k_0", 1.0},
                                           {"false_easting", "x_0", metres},
                                           {"false_northing", "y_0", metres}}) {
      if (const auto value = system.number(name)) add(key, *value * scale);
    }
    if (metres != 1.0) add("to_meter", metres);
    const std::string figure = figure_of(system);
    return map + (figure.empty() ? " +datum=WGS84" : figure) + " +no_defs +type=crs";
  }

  /// The ellipsoid and prime meridian of latitude_longitude, as PROJ spells them; empty for WGS 84's.
  static std::string figure_of(const Variable& system) {
    std::string figure;
    const auto add = [&](const char* name, const char* key) {
      if (const auto value = system.number(name)) figure += fmt::format(" +{}={:.17g}", key, *value);
    };
    const auto axis = system.number("semi_major_axis");
    if (axis) {
      add("semi_major_axis", "a");
      const auto flattening = system.number("inverse_flattening");
      if (flattening.value_or(0.0) > 0.0) {
        add("inverse_flattening", "rf");
      } else if (system.number("semi_minor_axis")) {
        add("semi_minor_axis", "b");
      } else {
        figure += fmt::format(" +b={:.17g}", *axis);
      }
      if (*axis == 6378137.0 && std::abs(flattening.value_or(0.0) - 298.257223563) < 1e-6) figure.clear();
    } else {
      add("earth_radius", "R");
    }
    if (system.number("longitude_of_prime_meridian").value_or(0.0) == 0.0) return figure;
    if (figure.empty()) figure = " +ellps=WGS84";
    add("longitude_of_prime_meridian", "pm");
    return figure;
  }

  void read_attributes(const Variable& variable) {
    const double unsigned_range = variable.text("_Unsigned") != "true" ? 0.0 : variable.type == 1 ? 256.0 : 65536.0;
    const auto set_void = [&](double value) {
      if (value < 0.0) value += unsigned_range;
      const auto stored = void_value_as_stored(info_.sample_type, value);
      if (stored && std::ranges::find(info_.void_values, *stored) == info_.void_values.end())
        info_.void_values.push_back(*stored);
    };
    for (const char* key : {"_FillValue", "missing_value"}) {
      std::ranges::for_each(variable.numbers(key), set_void);
    }
    // What the format fills with where nothing is said, but for bytes.
    static const std::map<int, double> kFilled = {
        {3, -32767.0}, {4, -2147483647.0}, {5, 9.969209968386869e36}, {6, 9.969209968386869e36},
        {8, 65535.0},  {9, 4294967295.0}};
    if (const auto filled = kFilled.find(variable.type); filled != kFilled.end() && info_.void_values.empty()) {
      set_void(filled->second);
    }
    const auto bound = [&](const char* key, std::size_t end, double& limit) {
      const std::span<const double> range = variable.numbers("valid_range");
      const std::span<const double> list = range.size() == 2 ? range.subspan(end, 1) : variable.numbers(key);
      if (!list.empty() && !std::isnan(list[0])) limit = list[0] < 0.0 ? list[0] + unsigned_range : list[0];
    };
    bound("valid_min", 0, info_.valid_min);
    bound("valid_max", 1, info_.valid_max);
    info_.z_scale = variable.number("scale_factor").value_or(1.0);
    info_.z_offset = variable.number("add_offset").value_or(0.0);
    if (info_.z_scale == 0.0 || !std::isfinite(info_.z_scale) || !std::isfinite(info_.z_offset)) {
      refuse(ErrorCode::kCorrupt, "scale_factor or add_offset is no scale");
    }
    if (lower_case(variable.text("positive")) == "down" ||
        variable.text("standard_name").starts_with("sea_floor_depth")) {
      info_.z_scale = -info_.z_scale;
      info_.z_offset = 0.0 - info_.z_offset;  // never -0
      info_.warnings.emplace_back("its numbers are depths, positive down: elevations are their negatives");
    }
    const auto unit = linear_unit(variable.text("units"));
    if (!unit) return;
    info_.vertical_unit = unit->name;
    info_.metres_per_vertical_unit = unit->metres;
  }

  CfFile& file_;
  SourceInfo& info_;
  bool is_system_given_ = false;  ///< by the user
};

}  // namespace

std::optional<SampleType> CfFile::Variable::sample_type() const {
  static constexpr std::array<std::optional<SampleType>, 12> kTypes = {
      std::nullopt,        SampleType::kInt8,    std::nullopt,         SampleType::kInt16,
      SampleType::kInt32,  SampleType::kFloat32, SampleType::kFloat64, SampleType::kUint8,
      SampleType::kUint16, SampleType::kUint32,  SampleType::kFloat64, SampleType::kFloat64};
  if (type < 0 || type >= static_cast<int>(kTypes.size())) return std::nullopt;
  const auto stored = kTypes[static_cast<std::size_t>(type)];
  // Of before there were unsigned types.
  if (text("_Unsigned") != "true" || !stored) return stored;
  return stored == SampleType::kInt8 ? SampleType::kUint8 : stored == SampleType::kInt16 ? SampleType::kUint16 : stored;
}

std::string CfFile::Variable::text(std::string_view key) const {
  const auto found = attributes.find(key);
  const auto* const text = found == attributes.end() ? nullptr : std::get_if<std::string>(&found->second);
  return text == nullptr ? std::string() : *text;
}

std::span<const double> CfFile::Variable::numbers(std::string_view key) const {
  const auto found = attributes.find(key);
  const auto* const list = found == attributes.end() ? nullptr : std::get_if<std::vector<double>>(&found->second);
  return list == nullptr ? std::span<const double>() : *list;
}

std::optional<double> CfFile::Variable::number(std::string_view key) const {
  const std::span<const double> list = numbers(key);
  return list.empty() ? std::nullopt : std::optional(list.front());
}

const CfFile::Variable* CfFile::variable(std::string_view name) const {
  const auto found = std::ranges::find(variables, name, &Variable::name);
  return found == variables.end() ? nullptr : &*found;
}

CfRaster read_cf(CfFile& file, SourceInfo& info, const OpenOptions& options) {
  return CfReader(file, info).read(options);
}

}  // namespace isohf
