#include "isohf/projection.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "isohf/error.h"

namespace isohf {
namespace {

struct KindName {
  ProjectionKind kind;
  const char* name;
  const char* parameters;  ///< as in usage; empty where there are none
  std::size_t least;
  std::size_t most;
};

constexpr KindName kKinds[] = {
    {ProjectionKind::kNone, "none", "", 0, 0},
    {ProjectionKind::kEquirectangular, "equirectangular", "", 0, 0},
    {ProjectionKind::kLocal, "local", "LON,LAT", 2, 2},
    {ProjectionKind::kTransverseMercator, "transverse-mercator", "LON[,SCALE]", 1, 2},
    {ProjectionKind::kUtm, "utm", "32N", 0, 0},
    {ProjectionKind::kLambertConformal, "lambert-conformal", "LAT1,LAT2[,LON]", 2, 3},
    {ProjectionKind::kPolarStereographic, "polar-stereographic", "LAT[,LON]", 1, 2},
    {ProjectionKind::kSystem, "system", "", 0, 0},
};

const KindName& name_of(ProjectionKind kind) {
  for (const KindName& known : kKinds) {
    if (known.kind == kind) return known;
  }
  return kKinds[0];
}

std::string all_kinds() {
  std::string text = "auto";
  for (const KindName& known : kKinds) {
    if (known.kind != ProjectionKind::kSystem) text += fmt::format(", {}", known.name);
  }
  return text + ", or a reference system: EPSG:3035, WKT, a PROJ string";
}

/// A code of an authority in capitals, well-known text, a PROJ string or PROJJSON.
bool names_system(const std::string& text) {
  if (text.find_first_of("[{") != text.npos || text.find("+proj=") != text.npos || text.find("+init=") != text.npos)
    return true;
  const std::size_t colon = text.find(':');
  if (colon == text.npos || colon == 0) return false;
  if (text.starts_with("epsg:") || text.starts_with("esri:")) return true;
  return text.starts_with("urn:") || text.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ_0123456789") == colon;
}

[[noreturn]] void refuse(const std::string& found, const std::string& required) {
  throw Error(ErrorCode::kInvalidArgument, fmt::format("found '{}', must be {}", found, required));
}

std::vector<double> numbers_in(const std::string& text, const std::string& required) {
  std::vector<double> numbers;
  std::size_t at = 0;
  while (at <= text.size()) {
    const std::size_t comma = std::min(text.find(',', at), text.size());
    double value = 0.0;
    const auto [end, failed] = std::from_chars(text.data() + at, text.data() + comma, value);
    if (failed != std::errc() || end != text.data() + comma || !std::isfinite(value)) refuse(text, required);
    numbers.push_back(value);
    at = comma + 1;
  }
  return numbers;
}

int zone_in(const std::string& text) {
  constexpr const char* kRequired = "a zone from 1 to 60 and N or S, as in utm:32N";
  int zone = 0;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), zone);
  const std::string half(end, text.data() + text.size());
  const bool is_north = half == "N" || half == "n";
  if (failed != std::errc() || zone < 1 || zone > 60 || !(is_north || half == "S" || half == "s")) {
    refuse(text, kRequired);
  }
  return is_north ? zone : -zone;
}

void check_ranges(const ProjectionRequest& request, const std::string& text) {
  const std::vector<double>& p = request.parameters;
  const auto check = [&](std::size_t i, double most, const char* what) {
    if (i < p.size() && !(std::abs(p[i]) <= most)) refuse(text, fmt::format("{} within {:g} degrees", what, most));
  };
  constexpr double kAnyLongitude = 540.0;
  switch (request.kind) {
    case ProjectionKind::kLocal:
      check(0, kAnyLongitude, "a longitude");
      check(1, 90.0, "a latitude");
      return;
    case ProjectionKind::kTransverseMercator:
      check(0, kAnyLongitude, "a longitude");
      if (p.size() > 1 && !(p[1] > 0.5 && p[1] < 2.0)) refuse(text, "a scale between 0.5 and 2");
      return;
    case ProjectionKind::kLambertConformal:
      check(0, 89.0, "a latitude");
      check(1, 89.0, "a latitude");
      check(2, kAnyLongitude, "a longitude");
      return;
    case ProjectionKind::kPolarStereographic:
      check(0, 90.0, "a latitude");
      check(1, kAnyLongitude, "a longitude");
      if (p[0] == 0.0) refuse(text, "a latitude North or South of the equator, on the pole's side");
      return;
    default:
      return;
  }
}

}  // namespace

std::string to_string(ProjectionKind kind) {
  return name_of(kind).name;
}

ProjectionKind projection_kind_from_string(const std::string& text) {
  for (const KindName& known : kKinds) {
    if (text == known.name) return known.kind;
  }
  refuse(text, "one of " + all_kinds());
}

std::string ProjectionRequest::name() const {
  if (is_auto) return "auto";
  return kind == ProjectionKind::kSystem ? system : to_string(kind);
}

ProjectionRequest ProjectionRequest::parse(const std::string& text) {
  ProjectionRequest request;
  request.is_given = true;
  if (text == "auto") return request;
  if (names_system(text)) {
    request.is_auto = false;
    request.kind = ProjectionKind::kSystem;
    request.system = text;
    return request;
  }
  const std::size_t colon = std::min(text.find(':'), text.size());
  request.is_auto = false;
  request.kind = projection_kind_from_string(text.substr(0, colon));
  if (request.kind == ProjectionKind::kSystem) refuse(text, "one of " + all_kinds());
  if (colon == text.size()) return request;
  const KindName& known = name_of(request.kind);
  const std::string parameters = text.substr(colon + 1);
  if (request.kind == ProjectionKind::kUtm) {
    request.utm_zone = zone_in(parameters);
    return request;
  }
  if (known.most == 0) refuse(text, fmt::format("{} alone, it has no parameters", known.name));
  const std::string required = fmt::format("{}:{}", known.name, known.parameters);
  request.parameters = numbers_in(parameters, required);
  if (request.parameters.size() < known.least || request.parameters.size() > known.most) refuse(text, required);
  check_ranges(request, text);
  return request;
}

}  // namespace isohf
