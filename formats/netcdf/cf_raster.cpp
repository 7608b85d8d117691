#include "formats/netcdf/cf_raster.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "formats/georeference/sidecars.h"
#include "formats/open_options.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/projection/crs/source_system.h"
#include "isohf/projection/length_unit.h"

namespace isohf {
namespace {

using Variable = NetcdfFile::Variable;

/// Evenly spaced coordinates.
struct Axis {
  double first = 0.0;
  double step = 0.0;
};

class CfReader {
 public:
  CfReader(const NetcdfFile& file, const OpenOptions& options, SourceInfo& info)
      : file_(file), options_(options), info_(info), variable_(elevations_of(file, options, info)) {}

  CfRaster read() {
    CfRaster raster{&variable_};
    info_.sample_type = *variable_.sample_type;
    const std::size_t last = variable_.sizes.size() - 1;
    const Variable* rows = coordinates_of(variable_.dimensions[last - 1]);
    const Variable* columns = coordinates_of(variable_.dimensions[last]);
    std::size_t height = variable_.sizes[last - 1];
    std::size_t width = variable_.sizes[last];
    raster.by_columns = rows != nullptr && columns != nullptr && is_along_x(*rows) && !is_along_x(*columns);
    if (raster.by_columns) {
      std::swap(rows, columns);
      std::swap(height, width);
    }
    constexpr std::size_t kMostSide = std::size_t{1} << 31U;
    if (std::max(width, height) >= kMostSide) {
      throw Error(ErrorCode::kCorrupt, fmt::format("{}: has {} x {} samples", info_.path, width, height));
    }
    info_.width = static_cast<std::int64_t>(width);
    info_.height = static_cast<std::int64_t>(height);
    // Rows run as their coordinates do, even if these are uneven.
    raster.from_south = rows == nullptr || coordinate(*rows, height - 1) > coordinate(*rows, 0);
    if (rows == nullptr) {
      info_.warnings.emplace_back(
          "its rows have no coordinates: the first is taken for the southernmost, as GDAL and GMT take it");
    }
    if (rows != nullptr && columns != nullptr) {
      read_place(*rows, *columns, raster);
    } else {
      tell_of_curved_coordinates();
    }
    read_voids();
    read_elevations();
    return raster;
  }

 private:
  [[nodiscard]] std::string text(const char* key) const { return file_.text(variable_.id, key); }
  [[nodiscard]] std::string unit_of(const Variable& variable) const { return file_.text(variable.id, "units"); }

  /// The variable of the dimension's name, else one that says where its samples are; nullptr if there is none.
  [[nodiscard]] const Variable* coordinates_of(const std::string& dimension) const {
    const Variable* found = nullptr;
    for (const Variable& variable : file_.variables()) {
      if (variable.dimensions.size() != 1 || variable.dimensions[0] != dimension || !variable.sample_type) continue;
      if (variable.name == dimension) return &variable;
      if (found == nullptr && is_coordinate(file_, variable)) found = &variable;
    }
    return found;
  }

  [[nodiscard]] bool is_along_x(const Variable& axis) const {
    const char direction = direction_of(unit_of(axis));
    const std::string standard = file_.text(axis.id, "standard_name");
    const std::string name = lower_case(axis.name);
    return direction == 'e' || direction == 'w' || file_.text(axis.id, "axis") == "X" || standard == "longitude" ||
           standard == "projection_x_coordinate" || name == "lon" || name == "longitude" || name == "x";
  }

  /// `values` of an axis, unpacked, East and North positive.
  [[nodiscard]] std::vector<double> unpacked(const Variable& axis, std::vector<double> values) const {
    const char direction = direction_of(unit_of(axis));
    const double sign = direction == 'w' || direction == 's' ? -1.0 : 1.0;
    const double scale = sign * file_.number(axis.id, "scale_factor").value_or(1.0);
    const double offset = sign * file_.number(axis.id, "add_offset").value_or(0.0);
    for (double& value : values) value = value * scale + offset;
    return values;
  }
  [[nodiscard]] double coordinate(const Variable& axis, std::size_t at) const {
    return unpacked(axis, file_.values(axis, at, 1))[0];
  }

  /// nullopt if coordinates lie off the grid by more than a hundredth of a step, and more than float32 rounds them.
  /// Longitudes may go on at -180 after 180.
  [[nodiscard]] std::optional<Axis> axis_of(const Variable& of, bool turns) const {
    const std::size_t count = of.sizes[0];
    const double first = coordinate(of, 0);
    const double span = coordinate(of, count - 1) - first;
    auto axis = even_axis(of, {first, span / static_cast<double>(count - 1)}, 0.0);
    if (!axis && turns && span < 0.0)
      axis = even_axis(of, {first, (span + 360.0) / static_cast<double>(count - 1)}, 360.0);
    // A sample stands for its cell, wherever in it the coordinate is.
    const Variable* const bounds = file_.variable(file_.text(of.id, "bounds"));
    if (axis && bounds != nullptr && bounds->sample_type && bounds->sizes == std::vector<std::size_t>{count, 2}) {
      const std::vector<double> cell = unpacked(of, file_.values(*bounds, 0, 1));
      const double near = 0.01 * std::abs(axis->step);
      const double middle = (cell[0] + cell[1]) / 2.0;
      const bool is_whole = std::abs(std::abs(cell[1] - cell[0]) - std::abs(axis->step)) < near;
      if (is_whole && std::abs(middle - axis->first) > near) axis->first = middle;
    }
    return axis;
  }

  /// turn  what coordinates may be apart by and still be one; 0: nothing
  [[nodiscard]] std::optional<Axis> even_axis(const Variable& of, const Axis& axis, double turn) const {
    const std::size_t count = of.sizes[0];
    const double last = axis.first + static_cast<double>(count - 1) * axis.step;
    const double rounding = of.sample_type == SampleType::kFloat32 ? 1.5 * 0x1p-24 : 0.0;
    const double rounded = rounding * std::max(std::abs(axis.first), std::abs(last));
    const double most = std::max(0.01 * std::abs(axis.step), std::min(rounded, 0.2 * std::abs(axis.step)));
    constexpr std::size_t kAtOnce = 65536;
    for (std::size_t done = 0; done < count; done += kAtOnce) {
      const std::vector<double> there = unpacked(of, file_.values(of, done, std::min(kAtOnce, count - done)));
      for (std::size_t i = 0; i < there.size(); ++i) {
        double off = there[i] - axis.first - static_cast<double>(done + i) * axis.step;
        if (turn > 0.0) off -= turn * std::round(off / turn);
        if (!(std::abs(off) <= most)) return std::nullopt;
      }
    }
    return axis.step == 0.0 ? std::nullopt : std::optional(axis);
  }

  void tell_of_curved_coordinates() {
    std::string names;
    for (const Variable& other : file_.variables()) {
      if (other.dimensions.size() < 2 || !is_coordinate(file_, other)) continue;
      const bool is_alike =
          std::equal(other.dimensions.end() - 2, other.dimensions.end(), variable_.dimensions.end() - 2);
      if (is_alike) names += (names.empty() ? "" : ", ") + printable(other.name);
    }
    if (!names.empty()) lose_place(fmt::format("isohf does not read its curved coordinates ({})", names));
  }

  void read_place(const Variable& rows, const Variable& columns, CfRaster& raster) {
    const std::string unit = unit_of(columns);
    const auto y = axis_of(rows, false);
    const auto x = axis_of(columns, direction_of(unit) != '\0');
    if (!x || !y) return lose_place("its coordinates are not evenly spaced");
    raster.from_east = x->step < 0.0;
    Georeference& place = info_.georeference;
    const bool are_posts = file_.number(NetcdfFile::kGlobal, "node_offset") == 0.0;  // of GMT
    place.registration = are_posts ? Registration::kPoint : Registration::kArea;
    place.spacing_x = std::abs(x->step);
    place.spacing_y = std::abs(y->step);
    place.has_origin = true;
    place.origin_x = x->first + (raster.from_east ? static_cast<double>(info_.width - 1) * x->step : 0.0);
    place.origin_y = y->first + (raster.from_south ? static_cast<double>(info_.height - 1) * y->step : 0.0);
    read_system(unit);
  }

  void read_system(const std::string& unit) {
    Georeference& place = info_.georeference;
    const bool is_degrees = direction_of(unit) != '\0';
    const auto length = linear_unit(unit);
    const GridMapping mapping = grid_mapping_of(file_, variable_, length ? length->metres : 1.0);
    const bool is_map = !mapping.name.empty() && mapping.name != "latitude_longitude";
    if (!mapping.system.empty()) {
      read_system_text(mapping.system, info_.path, info_);
      const bool is_other =
          place.unit == HorizontalUnit::kMetre ? is_degrees : place.unit == HorizontalUnit::kDegree && length;
      if (is_other) return lose_place(fmt::format("its grid mapping has no coordinates in {}", printable(unit)));
      if (place.unit == HorizontalUnit::kMetre && length) place.metres_per_unit = length->metres;
    } else if (is_map && !length) {
      lose_place(fmt::format("its grid mapping {} comes without crs_wkt", printable(mapping.name)));
    } else if (is_degrees) {
      place.unit = HorizontalUnit::kDegree;
      if (options_.reference_system.empty()) place.system = wgs84_system();  // what CF means if nothing else is given
    } else if (length) {
      place.unit = HorizontalUnit::kMetre;
      place.metres_per_unit = length->metres;
      if (!mapping.name.empty()) {
        info_.warnings.push_back(loss(fmt::format(
            "its grid mapping {} comes without crs_wkt: the reference system is left out", printable(mapping.name))));
      }
    } else if (!unit.empty() && unit != "1" && !unit.starts_with("user_")) {  // the latter of older GMT
      info_.warnings.push_back(
          loss(fmt::format("its coordinates are in \"{}\", which is no unit that isohf knows: they are kept as numbers "
                           "(`reference_system` says what they are)",
                           printable(unit))));
    }
  }

  void lose_place(const std::string& why) {
    info_.warnings.push_back(loss(why + ": where it lies is left out (gdalwarp makes a grid that has a place)"));
    const Registration registration = info_.georeference.registration;
    info_.georeference = {};
    info_.georeference.registration = registration;
  }

  void read_voids() {
    const double turn = text("_Unsigned") != "true" ? 0.0 : size_bytes(info_.sample_type) == 1 ? 256.0 : 65536.0;
    const auto as_stored = [&](double value) { return value < 0.0 ? value + turn : value; };
    const auto set_void = [&](double value) {
      const auto stored = void_value_as_stored(info_.sample_type, as_stored(value));
      if (stored && std::ranges::find(info_.void_values, *stored) == info_.void_values.end()) {
        info_.void_values.push_back(*stored);
      }
    };
    for (const char* key : {"_FillValue", "missing_value"}) {
      std::ranges::for_each(file_.numbers(variable_.id, key), set_void);
    }
    // What netCDF fills with if nothing is declared, by type; bytes have none.
    static const std::map<int, double> kFilled = {
        {3, -32767.0}, {4, -2147483647.0}, {5, 9.969209968386869e36}, {6, 9.969209968386869e36},
        {8, 65535.0},  {9, 4294967295.0}};
    const auto filled = kFilled.find(variable_.type);
    if (filled != kFilled.end() && info_.void_values.empty()) set_void(filled->second);
    const auto bound = [&](std::optional<double> value, double& limit) {
      if (value && !std::isnan(*value)) limit = as_stored(*value);
    };
    const std::vector<double> range = file_.numbers(variable_.id, "valid_range");
    bound(range.size() == 2 ? range[0] : file_.number(variable_.id, "valid_min"), info_.valid_min);
    bound(range.size() == 2 ? range[1] : file_.number(variable_.id, "valid_max"), info_.valid_max);
  }

  /// What a sample means: scale, direction and unit.
  void read_elevations() {
    info_.z_scale = file_.number(variable_.id, "scale_factor").value_or(1.0);
    info_.z_offset = file_.number(variable_.id, "add_offset").value_or(0.0);
    if (info_.z_scale == 0.0 || !std::isfinite(info_.z_scale) || !std::isfinite(info_.z_offset)) {
      throw Error(ErrorCode::kCorrupt, info_.path + ": scale_factor or add_offset is no scale");
    }
    const auto multiply = [&](double factor, const char* why) {
      info_.z_scale *= factor;
      info_.z_offset = info_.z_offset * factor + 0.0;  // never -0
      info_.warnings.emplace_back(why);
    };
    const std::string standard = text("standard_name");
    const std::string positive = lower_case(text("positive"));
    if (positive == "down" || (positive.empty() && standard.find("depth") != std::string::npos)) {
      multiply(-1.0, "its numbers are depths, positive down: elevations are their negatives");
    }
    const std::string name = lower_case(variable_.name + ' ' + text("long_name"));
    if (positive.empty() && standard.empty() && name.find("depth") != std::string::npos && !options_.z_scale) {
      info_.warnings.push_back(
          loss(fmt::format("{} may be depths, positive down: they are read as elevations (`z_scale` -1 takes their "
                           "negatives, 1 keeps them)",
                           printable(variable_.name))));
    }
    const std::string unit = text("units");
    // "m above mean sea level"; geopotential metres are 9.80665 m2/s2.
    if (const auto length = linear_unit(unit == "gpm" ? "m" : unit.substr(0, unit.find(" above")))) {
      info_.vertical_unit = length->name;
      info_.metres_per_vertical_unit = length->metres;
    } else if (is_geopotential(unit)) {
      multiply(1.0 / 9.80665, "its numbers are geopotentials: divided by 9.80665 m/s2 they are elevations");
      info_.vertical_unit = "metre";
    } else if (!unit.empty() && !unit.starts_with("user_") && !options_.z_scale) {  // the latter of older GMT
      info_.warnings.push_back(loss(fmt::format(
          "{} is in \"{}\", which is no unit of length: its numbers are read as elevations (`z_scale` converts them)",
          printable(variable_.name), printable(unit))));
    }
  }

  /// m2/s2, in whatever spelling; turbulence and waves have that unit as well.
  [[nodiscard]] bool is_geopotential(std::string unit) const {
    std::erase_if(unit, [](char c) { return c == '*' || c == '^' || c == ' ' || c == '.'; });
    const std::string words = lower_case(text("standard_name") + text("long_name") + ' ' + variable_.name);
    return (unit == "m2s-2" || unit == "m2/s2" || unit == "Jkg-1" || unit == "J/kg") &&
           (words.find("geopotential") != std::string::npos || words.ends_with(" z") || words.ends_with(" phis"));
  }

  const NetcdfFile& file_;
  const OpenOptions& options_;
  SourceInfo& info_;
  const Variable& variable_;
};

}  // namespace

CfRaster read_cf(const NetcdfFile& file, const OpenOptions& options, SourceInfo& info) {
  return CfReader(file, options, info).read();
}

}  // namespace isohf
