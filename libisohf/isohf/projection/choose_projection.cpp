#include "isohf/projection/choose_projection.h"

#include <fmt/format.h>

#include <GeographicLib/UTMUPS.hpp>
#include <algorithm>
#include <cmath>
#include <optional>

#include "isohf/error.h"

namespace isohf {
namespace {

using Kind = ProjectionKind;

/// Beyond this a map no longer shows sizes, and its lattice wastes three quarters of its vertices.
constexpr double kWorstError = 1.0;
/// A cone's map of a pole is a point with a gap, or an arc.
constexpr double kConicLatitude = 89.0;
/// A cone cut open far from its central meridian comes round again behind the ground.
constexpr double kConicWidth = 180.0;
constexpr double kCylinderHalfWidth = 80.0;
/// Where a ground that goes all the way round counts as a polar cap.
constexpr double kCapLatitude = 45.0;
constexpr double kUtmNorth = 84.0;
constexpr double kUtmSouth = -80.0;

double rounded(double degrees) {
  return std::round(degrees * 1e4) / 1e4;
}

double farther_from_equator(const GeoExtent& ground) {
  return std::max(std::abs(ground.south), std::abs(ground.north));
}

bool is_on_one_side(const GeoExtent& ground) {
  return ground.south >= 0.0 || ground.north <= 0.0;
}

/// Parallels a sixth of the height within the ground (Deetz and Adams 1921): errors of either sign are about equal.
std::pair<double, double> standard_parallels(const GeoExtent& ground) {
  const double sixth = (ground.north - ground.south) / 6.0;
  return {rounded(ground.south + sixth), rounded(ground.north - sixth)};
}

/// The parallel whose scale lies half way between those at the pole and at the ground's far side. On the sphere the
/// scale of a map true at the pole is 2 / (1 + sin(latitude)).
double polar_parallel(const GeoExtent& ground) {
  constexpr double kDegree = M_PI / 180.0;
  const double sign = ground.north + ground.south >= 0.0 ? 1.0 : -1.0;
  const double far = std::clamp(std::min(sign * ground.south, sign * ground.north), 0.0, 90.0);
  const double near = std::clamp(std::max(sign * ground.south, sign * ground.north), 0.0, 90.0);
  const double scale = 1.0 / (1.0 + std::sin(far * kDegree)) + 1.0 / (1.0 + std::sin(near * kDegree));
  return sign * rounded(std::asin(std::min(2.0 / scale - 1.0, 1.0)) / kDegree);
}

class Choice {
 public:
  Choice(const ProjectionRequest& request, const ProjectionProblem& problem)
      : request_(request), problem_(problem), ground_(problem.ground), middle_(problem.ground.middle()) {}

  [[nodiscard]] ProjectionChoice make() const {
    if (request_.is_auto) return automatic();
    if (request_.kind == Kind::kNone) return {{}, {}, "asked for: world units are degrees"};
    const ProjectionSpec spec = specify(request_.kind);
    if (const std::string fault = fault_of(spec); !fault.empty()) refuse(fault);
    return {spec, worst_scale_error(Projection(spec), ground_),
            request_.system_body.empty() ? "asked for"
                                         : "asked for, with " + request_.system_body + " in place of the Earth"};
  }

 private:
  [[noreturn]] void refuse(const std::string& fault) const {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: `projection` {}: {}; `projection` {} works", problem_.path, request_.name(), fault,
                            to_string(automatic().spec.kind)));
  }

  [[nodiscard]] double parameter(std::size_t i, double otherwise) const {
    return i < request_.parameters.size() ? request_.parameters[i] : otherwise;
  }

  [[nodiscard]] ProjectionSpec specify(Kind kind) const {
    ProjectionSpec spec;
    spec.kind = kind;
    spec.ellipsoid = problem_.ellipsoid;
    spec.longitude_0 = rounded(std::remainder(middle_.longitude, 360.0));
    spec.latitude_0 = rounded(middle_.latitude);
    switch (kind) {
      case Kind::kEquirectangular:
        spec.longitude_0 = std::remainder(middle_.longitude, 360.0);
        spec.latitude_0 = middle_.latitude;
        break;
      case Kind::kLocal:
        spec.longitude_0 = parameter(0, spec.longitude_0);
        spec.latitude_0 = parameter(1, spec.latitude_0);
        break;
      case Kind::kTransverseMercator:
        spec.longitude_0 = parameter(0, spec.longitude_0);
        spec.scale_0 = parameter(1, 1.0);
        break;
      case Kind::kUtm:
        fill_utm(spec);
        break;
      case Kind::kLambertConformal: {
        const auto [south, north] = standard_parallels(ground_);
        spec.parallel_1 = parameter(0, south);
        spec.parallel_2 = parameter(1, north);
        spec.longitude_0 = parameter(2, spec.longitude_0);
        // A Mercator map: reference systems know no other origin than the equator for it.
        if (spec.parallel_1 == -spec.parallel_2) spec.latitude_0 = 0.0;
        break;
      }
      case Kind::kPolarStereographic:
        spec.latitude_0 = 0.0;
        spec.parallel_1 = parameter(0, polar_parallel(ground_));
        // A whole cap has its conventional side down.
        spec.longitude_0 = parameter(1, problem_.goes_round ? 0.0 : spec.longitude_0);
        break;
      case Kind::kSystem:
        spec = request_.system_map;
        spec.ellipsoid = problem_.ellipsoid;
        break;
      case Kind::kNone:
        break;
    }
    return spec;
  }

  void fill_utm(ProjectionSpec& spec) const {
    spec.utm_zone = request_.utm_zone;
    if (spec.utm_zone == 0) {
      const double latitude = std::clamp(middle_.latitude, kUtmSouth, kUtmNorth - 1e-9);
      spec.utm_zone = GeographicLib::UTMUPS::StandardZone(latitude, std::remainder(middle_.longitude, 360.0),
                                                          GeographicLib::UTMUPS::UTM);
      if (middle_.latitude < 0.0) spec.utm_zone = -spec.utm_zone;
    }
    spec.longitude_0 = 6.0 * std::abs(spec.utm_zone) - 183.0;
    spec.latitude_0 = 0.0;
    spec.scale_0 = 0.9996;
    spec.false_easting = 500000.0;
    spec.false_northing = spec.utm_zone < 0 ? 10000000.0 : 0.0;
  }

  /// Why the ground does not suit the map; empty where it does.
  [[nodiscard]] std::string fault_of(const ProjectionSpec& spec) const {
    if (spec.kind != Kind::kEquirectangular && problem_.wraps_x) {
      return "`wrap_x` needs the input's rows to stay rows";
    }
    if (std::string fault = fault_of_ground(spec); !fault.empty()) return fault;
    // Whoever names a system has data of it, whatever its lengths are worth.
    if (spec.kind == Kind::kEquirectangular || spec.kind == Kind::kSystem) return {};
    ScaleError error;
    try {
      error = worst_scale_error(Projection(spec), ground_);
    } catch (const Error& why) {
      return why.what();
    }
    if (error.worst <= kWorstError) return {};
    return fmt::format("lengths at longitude {:.4g}, latitude {:.4g} would err by {}", error.place.longitude,
                       error.place.latitude,
                       std::isfinite(error.worst) ? fmt::format("{:.3g} %", 100.0 * error.worst) : "any amount");
  }

  [[nodiscard]] std::string fault_of_ground(const ProjectionSpec& spec) const {
    const double half_width = std::max(std::abs(ground_.east - middle_.longitude), 0.0) +
                              std::abs(std::remainder(middle_.longitude - spec.longitude_0, 360.0));
    switch (spec.kind) {
      case Kind::kEquirectangular:
        if (!problem_.in_degrees) return "it is for inputs in degrees, this one is on a map";
        if (!(std::abs(middle_.latitude) < 89.9)) {
          return fmt::format("its middle latitude is {:.6g} degrees, where a degree of longitude has no length",
                             middle_.latitude);
        }
        return {};
      case Kind::kUtm:
        if ((!problem_.body.empty() && problem_.body != "Earth") || !is_of_earth()) {
          return fmt::format("UTM zones are the Earth's, the input shows {}",
                             problem_.body.empty() ? "another body" : problem_.body);
        }
        if (ground_.north > kUtmNorth || ground_.south < kUtmSouth) {
          return fmt::format("UTM zones reach from latitude -80 to 84, the input from {:.6g} to {:.6g}", ground_.south,
                             ground_.north);
        }
        [[fallthrough]];
      case Kind::kTransverseMercator:
        if (half_width > kCylinderHalfWidth) {
          return fmt::format("the input reaches {:.4g} degrees from the central meridian, at most {:g} are possible",
                             half_width, kCylinderHalfWidth);
        }
        return {};
      case Kind::kLambertConformal:
        if (farther_from_equator(ground_) > kConicLatitude) {
          return fmt::format("the input reaches latitude {:.6g}, a cone shows up to {:g}",
                             ground_.north > kConicLatitude ? ground_.north : ground_.south, kConicLatitude);
        }
        if (half_width > kConicWidth / 2.0) {
          return fmt::format("the input reaches {:.4g} degrees from the central meridian, at most {:g} are possible",
                             half_width, kConicWidth / 2.0);
        }
        return {};
      case Kind::kPolarStereographic: {
        const double side = spec.parallel_1 > 0.0 ? 1.0 : -1.0;
        const double far = std::min(side * ground_.south, side * ground_.north);
        if (far >= 0.0) return {};
        return fmt::format("the input reaches latitude {:.6g}, beyond the equator seen from the pole", side * far);
      }
      case Kind::kLocal:
        if (farther_than_a_quarter(spec)) {
          return "the input reaches more than a quarter of the way round the body from the centre";
        }
        return {};
      case Kind::kSystem:
      case Kind::kNone:
        break;
    }
    return {};
  }

  [[nodiscard]] bool is_of_earth() const {
    const double a = problem_.ellipsoid.semi_major_axis_m;
    return a > 6370000.0 && a < 6380000.0;
  }

  [[nodiscard]] bool farther_than_a_quarter(const ProjectionSpec& spec) const {
    const Projection map(spec);
    double farthest = 0.0;
    for (const double latitude : {ground_.south, middle_.latitude, ground_.north}) {
      for (const double longitude : {ground_.west, middle_.longitude, ground_.east}) {
        const MapPoint at = map.forward({longitude, latitude});
        farthest = std::max(farthest, std::hypot(at.easting, at.northing));
      }
    }
    return !(farthest <= 0.5 * M_PI * problem_.ellipsoid.semi_major_axis_m) || problem_.goes_round;
  }

  [[nodiscard]] ProjectionChoice automatic() const {
    const ProjectionSpec flat = specify(Kind::kEquirectangular);
    const bool has_flat = fault_of_ground(flat).empty();
    const ScaleError flat_error =
        has_flat ? worst_scale_error(Projection(flat), ground_) : ScaleError{HUGE_VAL, middle_};
    const auto flat_because = [&](const std::string& why) { return ProjectionChoice{flat, flat_error, why}; };
    if (has_flat && flat_error.worst <= kEquirectangularError) {
      return flat_because(fmt::format("lengths err by no more than {:g} %", 100.0 * kEquirectangularError));
    }
    const double nearest = std::min(std::abs(ground_.south), std::abs(ground_.north));
    if (has_flat && problem_.goes_round && !(is_on_one_side(ground_) && nearest >= kCapLatitude)) {
      return flat_because("the input goes all the way round");
    }
    if (has_flat && problem_.wraps_x) {
      return flat_because("--wrap-x needs the input's rows to stay rows");  // NOLINT: as archives have recorded it
    }
    std::optional<ProjectionChoice> best;
    for (const Kind kind : {Kind::kLambertConformal, Kind::kTransverseMercator, Kind::kPolarStereographic}) {
      const ProjectionSpec spec = specify_freely(kind);
      if (!fault_of(spec).empty()) continue;
      const ScaleError error = worst_scale_error(Projection(spec), ground_);
      if (!best || error.worst < best->error.worst) best = {spec, error, ""};
    }
    if (!best || best->error.worst >= flat_error.worst) {
      if (has_flat) return flat_because("nothing else shows so large a ground");
      throw Error(ErrorCode::kInvalidArgument,
                  fmt::format("{}: no projection shows longitudes {:.6g} to {:.6g}, latitudes {:.6g} to {:.6g}; "
                              "give a part of it",
                              problem_.path, ground_.west, ground_.east, ground_.south, ground_.north));
    }
    best->why = fmt::format("errs least among the conformal kinds; equirectangular would err by {}",
                            std::isfinite(flat_error.worst) && flat_error.worst < 1e3
                                ? fmt::format("{:.3g} %", 100.0 * flat_error.worst)
                                : "any amount");
    return *best;
  }

  /// Without what was asked for of another kind.
  [[nodiscard]] ProjectionSpec specify_freely(Kind kind) const { return Choice({}, problem_).specify(kind); }

  ProjectionRequest request_;
  const ProjectionProblem& problem_;
  const GeoExtent& ground_;
  GeoPoint middle_;
};

}  // namespace

ProjectionChoice choose_projection(const ProjectionRequest& request, const ProjectionProblem& problem) {
  return Choice(request, problem).make();
}

}  // namespace isohf
