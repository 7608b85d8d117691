#include "formats/planetary/pds3_place.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <numbers>
#include <optional>
#include <tuple>

#include "formats/georeference/units.h"

namespace isohf {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
/// Bounds and offsets agree where they differ by less, in pixels; the meanings of the offsets differ by 1.
constexpr double kSamePlace = 0.25;

std::string spaced(std::string text) {
  std::replace(text.begin(), text.end(), '_', ' ');
  return text;
}

std::string capitalised(std::string text) {
  for (std::size_t i = 1; i < text.size(); ++i) {
    text[i] = static_cast<char>(std::tolower(static_cast<unsigned char>(text[i])));
  }
  return text;
}

/// A length in metres; kilometres where no unit stands there, as the data dictionary has it. "km/pixel" counts as km.
std::optional<double> metres(const LabelFields& fields, const char* key) {
  const std::optional<double> number = fields.number(key);
  if (!number || !(*number > 0.0)) return std::nullopt;
  const std::string unit = fields.unit(key);
  if (unit.empty()) return *number * 1000.0;
  const std::optional<LinearUnit> length = linear_unit(unit.substr(0, unit.find('/')));
  return length ? std::optional(*number * length->metres) : std::nullopt;
}

class Placer {
 public:
  Placer(const LabelFields& map, std::int64_t columns, std::int64_t rows, Pds3Place& place)
      : map_(map), columns_(columns), rows_(rows), place_(place), geo_(place.georeference) {}

  void read(const std::string& target) {
    projection_ = spaced(map_.word("MAP_PROJECTION_TYPE").value_or(""));
    read_ellipsoid();
    const double rotation = map_.number("MAP_PROJECTION_ROTATION").value_or(0.0);
    if (rotation != 0.0) {
      warn(loss(fmt::format("the map is rotated by {} degrees; its place is left out", rotation)));
      return;
    }
    if (!read_scale()) {
      warn(loss("the label gives no MAP_RESOLUTION in pixels per degree and no MAP_SCALE; the place is left out"));
      return;
    }
    if (degrees_) {
      geo_.unit = HorizontalUnit::kDegree;
      geo_.system.name = fmt::format("{} {}", target, map_.word("COORDINATE_SYSTEM_NAME").value_or("PLANETOCENTRIC"));
    } else {
      geo_.unit = HorizontalUnit::kMetre;
      geo_.system.name = fmt::format("{} {}", projection_.empty() ? "UNKNOWN PROJECTION" : projection_, target);
    }
    geo_.spacing_x = geo_.spacing_y = spacing_;
    geo_.registration = Registration::kArea;
    read_bounds();
    const std::optional<double> line = map_.number("LINE_PROJECTION_OFFSET");
    const std::optional<double> sample = map_.number("SAMPLE_PROJECTION_OFFSET");
    if (line && sample) {
      place_by_offsets(*sample, *line);
    } else {
      place_by_bounds();
    }
    if (degrees_ && geo_.has_origin) choose_turn();
  }

 private:
  void warn(Warning text) { place_.warnings.push_back(std::move(text)); }

  void read_ellipsoid() {
    const std::optional<double> a = metres(map_, "A_AXIS_RADIUS");
    const std::optional<double> c = metres(map_, "C_AXIS_RADIUS");
    if (!a) return;
    geo_.system.semi_major_axis_m = a;
    geo_.system.inverse_flattening = c && *c != *a ? *a / (*a - *c) : 0.0;
  }

  /// Which unit the map has, and how many of them lie between samples; false where the label does not say.
  bool read_scale() {
    const bool simple = projection_ == "SIMPLE CYLINDRICAL";
    cylindrical_ = simple || projection_ == "EQUIRECTANGULAR" || projection_ == "EQUIDISTANT CYLINDRICAL";
    const double centre = map_.number("CENTER_LATITUDE").value_or(0.0);
    if (!simple) true_latitude_ = map_.number("FIRST_STANDARD_PARALLEL").value_or(centre);
    if (simple) bases_[1] = centre;
    degrees_ = cylindrical_ && true_latitude_ == 0.0;

    const std::string unit = map_.unit("MAP_RESOLUTION");
    const bool per_degree = unit.empty() || unit.find("/deg") != std::string::npos;
    // 0 stands for what the label does not say.
    const double resolution = per_degree ? std::max(0.0, map_.number("MAP_RESOLUTION").value_or(0.0)) : 0.0;
    const double scale = metres(map_, "MAP_SCALE").value_or(0.0);
    const double radius = geo_.system.semi_major_axis_m.value_or(0.0);
    // The radius that the label itself uses: HiRISE's is that of the ellipsoid at the true latitude.
    radius_ = resolution > 0.0 && scale > 0.0 ? scale * resolution / kDegree : radius;
    if (degrees_) {
      spacing_ = resolution > 0.0 ? 1.0 / resolution : scale / (radius * kDegree);
    } else {
      spacing_ = scale > 0.0 ? scale : radius * kDegree / resolution;
    }
    return spacing_ > 0.0 && std::isfinite(spacing_);
  }

  /// The West and North edges in units of the map, and the middle of the projection.
  void read_bounds() {
    const bool west_positive = map_.word("POSITIVE_LONGITUDE_DIRECTION").value_or("EAST") == "WEST";
    const double east = west_positive ? -1.0 : 1.0;
    const double centre = east * map_.number("CENTER_LONGITUDE").value_or(0.0);
    if (degrees_) centre_x_ = centre;
    if (!cylindrical_) return;
    const double to_x = degrees_ ? 1.0 : radius_ * kDegree * std::cos(true_latitude_ * kDegree);
    const double to_y = degrees_ ? 1.0 : radius_ * kDegree;
    turn_ = 360.0 * to_x;
    if (const auto value = map_.number("WESTERNMOST_LONGITUDE")) west_ = (east * *value - centre) * to_x + centre_x_;
    if (const auto value = map_.number("MAXIMUM_LATITUDE")) north_ = *value * to_y;
    if (const auto value = map_.number("MINIMUM_LATITUDE")) south_ = *value * to_y;
    if (const auto value = map_.number("EASTERNMOST_LONGITUDE")) east_ = (east * *value - centre) * to_x + centre_x_;
  }

  /// How far, in pixels, the bounds are from a raster whose first sample has these coordinates.
  [[nodiscard]] double distance_to_bounds(double x, double y) const {
    double distance = 0.0;
    if (west_) distance = std::abs(std::remainder(x - spacing_ / 2.0 - *west_, turn_)) / spacing_;
    if (north_) distance = std::max(distance, std::abs(y + spacing_ / 2.0 - *north_) / spacing_);
    return distance;
  }

  void place_by_offsets(double sample, double line) {
    const std::array<std::array<double, 2>, 3> first = {
        {{-sample, line}, {1.0 - sample, line - 1.0}, {sample, -line}}};  // columns East, rows North of the middle
    std::size_t best = 0;
    double best_base = bases_[0];
    double least = INFINITY;
    for (std::size_t i = 0; i < first.size(); ++i) {
      for (const double base : bases_) {
        const double distance = distance_to_bounds(centre_x_ + first[i][0] * spacing_, base + first[i][1] * spacing_);
        if (distance < least) std::tie(best, best_base, least) = std::tuple(i, base, distance);
      }
    }
    if (!west_ || !north_) {
      // A map round its own middle tells by its size alone.
      const auto middle = [&](double one) {
        return 2.0 * sample == static_cast<double>(columns_) + one && 2.0 * line == static_cast<double>(rows_) + one;
      };
      best = middle(1.0) ? 1 : 0;
      best_base = bases_[0];
      if (!middle(1.0) && !middle(-1.0)) {
        warn(
            "nothing in the label confirms LINE_ and SAMPLE_PROJECTION_OFFSET; they are taken from the middle of the "
            "first sample");
      }
    } else if (!(least <= kSamePlace)) {
      best = 0;
      best_base = bases_[0];
      warn(
          fmt::format("LINE_ and SAMPLE_PROJECTION_OFFSET lie {:.2f} samples or more off MAXIMUM_LATITUDE and "
                      "WESTERNMOST_LONGITUDE; the offsets are followed",
                      least));
    }
    geo_.has_origin = true;
    geo_.origin_x = centre_x_ + first[best][0] * spacing_;
    geo_.origin_y = best_base + first[best][1] * spacing_;
  }

  void place_by_bounds() {
    if (!west_ || !north_ || !south_ || !east_) {
      warn(loss("the label gives neither projection offsets nor bounds; the origin is unknown"));
      return;
    }
    const auto spans = [&](std::int64_t columns, std::int64_t rows) {
      const double width = static_cast<double>(columns) * spacing_;
      return std::abs(std::remainder(*east_ - *west_ - width, turn_)) <= kSamePlace * spacing_ &&
             std::abs(*north_ - *south_ - static_cast<double>(rows) * spacing_) <= kSamePlace * spacing_;
    };
    double inward = 0.0;
    if (spans(columns_, rows_)) {
      inward = spacing_ / 2.0;
    } else if (spans(columns_ - 1, rows_ - 1)) {
      geo_.registration = Registration::kPoint;
    } else {
      warn(loss(fmt::format(
          "the label's bounds do not span {} x {} samples and it gives no projection offsets; the origin is "
          "unknown",
          columns_, rows_)));
      return;
    }
    geo_.has_origin = true;
    geo_.origin_x = *west_ + inward;
    geo_.origin_y = *north_ - inward;
  }

  /// The turn of longitude that the label's bounds name; within [-180, 360) where they name none.
  void choose_turn() {
    if (west_ && *west_ >= -180.0 && *west_ < 360.0) {
      geo_.origin_x += 360.0 * std::round((*west_ - geo_.origin_x) / 360.0);
    } else if (geo_.origin_x < -180.0 || geo_.origin_x >= 360.0) {
      geo_.origin_x -= 360.0 * std::floor((geo_.origin_x + 180.0) / 360.0);
    }
  }

  const LabelFields& map_;
  std::int64_t columns_;
  std::int64_t rows_;
  Pds3Place& place_;
  Georeference& geo_;
  std::string projection_;
  bool cylindrical_ = false;
  bool degrees_ = false;
  double true_latitude_ = 0.0;
  double spacing_ = 0.0;
  double radius_ = 0.0;
  double centre_x_ = 0.0;             // where the offsets count from
  std::array<double, 2> bases_ = {};  // latitudes that the lines may count from
  double turn_ = 360.0;               // once round
  std::optional<double> west_;        // edges
  std::optional<double> east_;
  std::optional<double> north_;
  std::optional<double> south_;
};

}  // namespace

Pds3Place place_from_pds3(const std::string& path, const LabelBlock& root, std::int64_t columns, std::int64_t rows) {
  Pds3Place place;
  const LabelEntry* target = root.entry("TARGET_NAME");
  const std::string name = target == nullptr || target->values.empty() ? "" : target->values.front().text;
  const auto maps = root.all("IMAGE_MAP_PROJECTION");
  if (!maps.empty()) Placer(LabelFields(path, *maps.front()), columns, rows, place).read(name);
  ReferenceSystem& system = place.georeference.system;
  system.body = body_of(name, system.semi_major_axis_m);
  if (body_of(name, std::nullopt).empty() && !name.empty()) system.body = capitalised(name);
  return place;
}

}  // namespace isohf
