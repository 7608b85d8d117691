#include "formats/georeference/reference_system.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <utility>

#include "formats/georeference/proj_module.h"
#include "formats/georeference/units.h"
#include "formats/io/text.h"
#include "formats/module_loader.h"
#include "isohf/base/handed_in.h"
#include "isohf/convert.h"
#include "isohf/error.h"

namespace isohf {
namespace {

const IsohfProjModule& proj_module() {
  return *static_cast<const IsohfProjModule*>(
      load_module({"isohf_proj.so", ISOHF_PROJ_SYMBOL, ISOHF_PROJ_ABI, "reference systems need the PROJ module",
                   "ISOHF_BUILD_PROJ_MODULE"}));
}

/// For messages, of what may be a WKT of any length.
std::string shortened(const std::string& text) {
  return one_line(text.size() > 60 ? text.substr(0, 60) + "..." : text);
}

/// For messages: PROJ strings have no name of their own.
std::string shown_name(const std::string& name, const std::string& text) {
  return name.empty() || name == "unknown" ? shortened(text) : name;
}

/// Radii are written with more or fewer digits.
bool are_alike(const Ellipsoid& a, const Ellipsoid& b) {
  return std::abs(a.semi_major_axis_m / b.semi_major_axis_m - 1.0) < 1e-9 &&
         std::abs(a.inverse_flattening - b.inverse_flattening) < 1e-6;
}

/// libproj, SQLite and what they read of proj.db.
constexpr std::uint64_t kProjBytes = 14'000'000;

class ProjSystem final : public UnderstoodSystem {
 public:
  ProjSystem(const std::string& text, std::optional<double> metres_per_unit, std::optional<int> vertical_epsg)
      : module_(proj_module()) {
    IsohfProjInfo info{};
    IsohfProjMessage message{};
    const std::string vertical = vertical_epsg ? fmt::format("EPSG:{}", *vertical_epsg) : "";
    const int result = module_.open(text.c_str(), vertical.c_str(), &system_, &info, &message);
    if (result != 0) {
      throw Error(module_error_code(result), fmt::format("the reference system {}: {}", shortened(text), message.text));
    }
    description_.name = info.name;
    description_.authority = info.authority;
    description_.code = info.code;
    description_.datum = info.datum;
    const std::string datum = lower_case(description_.datum);
    description_.is_datum_known =
        std::ranges::none_of(std::array{"unknown", "not specified", "not_specified", "undefined"},
                             [&](const char* word) { return datum.find(word) != std::string::npos; });
    description_.is_projected = info.is_projected != 0;
    description_.is_compound = info.is_compound != 0;
    description_.unit = exact(info.metres_per_unit);
    description_.prime_meridian_deg = info.prime_meridian_deg;
    description_.ellipsoid = {info.semi_major_axis_m, info.inverse_flattening};
    description_.wkt2 = wkt(info, ISOHF_WKT2);
    description_.wkt1 = wkt(info, ISOHF_WKT1);
    description_.esri = wkt(info, ISOHF_WKT_ESRI);
    description_.vertical_name = info.vertical_name;
    if (info.vertical_epsg > 0) description_.vertical_epsg = info.vertical_epsg;
    description_.vertical_unit = info.vertical_unit;
    if (!description_.vertical_name.empty())
      description_.metres_per_vertical_unit = exact(info.metres_per_vertical_unit);
    metres_per_unit_ = description_.is_projected ? metres_per_unit.value_or(description_.unit) : 1.0;
    scale_ = description_.is_projected ? metres_per_unit_ / description_.unit : 1.0;
  }
  ~ProjSystem() override { module_.close(system_); }

  [[nodiscard]] const Description& description() const override { return description_; }
  [[nodiscard]] double metres_per_unit() const override { return metres_per_unit_; }
  [[nodiscard]] const Ellipsoid& ellipsoid() const override { return description_.ellipsoid; }
  [[nodiscard]] bool is_same(const UnderstoodSystem& other) const override {
    return is_same(static_cast<const ProjSystem&>(other), false);
  }
  [[nodiscard]] bool may_be(const UnderstoodSystem& other) const override {
    const auto& theirs = static_cast<const ProjSystem&>(other);
    return is_same(theirs, !description_.is_datum_known || !theirs.description_.is_datum_known);
  }
  [[nodiscard]] std::uint64_t memory_bytes() const override { return kProjBytes; }

  [[nodiscard]] GeoPoint geo_from_map(MapPoint place) const override {
    double at[2] = {place.easting * scale_, place.northing * scale_};
    module_.to_geo(system_, at, 1);
    return {at[0], at[1]};
  }
  [[nodiscard]] MapPoint map_from_geo(GeoPoint place) const override {
    double at[2] = {place.longitude, place.latitude};
    module_.from_geo(system_, at, 1);
    return {at[0] / scale_, at[1] / scale_};
  }

 private:
  /// any_datum: whatever the datums' names, their ellipsoid makes them one.
  [[nodiscard]] bool is_same(const ProjSystem& theirs, bool any_datum) const {
    if (module_.same(system_, theirs.system_) != 0) return true;
    // PROJ does not hold one method's variants against each other (polar stereographic by its scale, or by a parallel).
    const Description& other_one = theirs.description_;
    const bool is_earth = std::abs(description_.ellipsoid.semi_major_axis_m / 6378137.0 - 1.0) < 0.01;
    constexpr double kSameUnit = 1e-12;
    if (description_.is_projected != other_one.is_projected ||
        std::abs(description_.unit / other_one.unit - 1.0) > kSameUnit ||
        !are_alike(description_.ellipsoid, other_one.ellipsoid)) {
      return false;
    }
    // On other bodies an equal ellipsoid is the same datum, whatever its name.
    any_datum = any_datum || !is_earth;
    if (!any_datum && description_.datum != other_one.datum) return false;
    if (!description_.is_projected) return any_datum && description_.prime_meridian_deg == other_one.prime_meridian_deg;
    constexpr double kSameMetres = 1e-6;
    int compared = 0;
    for (double latitude = -80.0; latitude <= 80.0; latitude += 20.0) {
      for (double longitude = -170.0; longitude < 180.0; longitude += 20.0) {
        const MapPoint ours = map_from_geo({longitude, latitude});
        const MapPoint there = theirs.map_from_geo({longitude, latitude});
        if (std::isnan(ours.easting) != std::isnan(there.easting)) return false;
        if (std::isnan(ours.easting)) continue;
        const double apart = std::hypot(ours.easting - there.easting, ours.northing - there.northing);
        if (!(apart * description_.unit <= kSameMetres)) return false;
        ++compared;
      }
    }
    return compared > 4;
  }
  /// PROJ's database has 15 digits of it.
  static double exact(double metres) {
    constexpr double kUsFoot = 1200.0 / 3937.0;
    return std::abs(metres - kUsFoot) < 1e-14 ? kUsFoot : metres;
  }
  [[nodiscard]] std::string wkt(const IsohfProjInfo& info, int dialect) const {
    std::string text(info.wkt_bytes[dialect], '\0');
    module_.wkt(system_, dialect, text.data());
    text.pop_back();
    return text;
  }

  const IsohfProjModule& module_;
  IsohfProjSystem* system_ = nullptr;
  Description description_;
  double metres_per_unit_ = 1.0;
  double scale_ = 1.0;  ///< units of the system in one of the coordinates
};

/// A reference system's coordinates, metres, and longitudes and latitudes on another datum.
class PipelineMap final : public ReferenceMap {
 public:
  PipelineMap(const MappedSystem& system, const Ellipsoid& ellipsoid)
      : module_(proj_module()), metres_(system.metres_per_unit), ellipsoid_(ellipsoid) {
    IsohfProjMessage message{};
    const int result = module_.open_pipeline(system.operation.c_str(), &system_, &message);
    if (result != 0) {
      throw Error(
          module_error_code(result),
          fmt::format("the way to the map {}: {}", system.name.empty() ? system.text : system.name, message.text));
    }
  }
  ~PipelineMap() override { module_.close(system_); }

  [[nodiscard]] GeoPoint geo_from_map(MapPoint place) const override {
    double at[2] = {place.easting / metres_, place.northing / metres_};
    module_.to_geo(system_, at, 1);
    return {at[0], at[1]};
  }
  [[nodiscard]] MapPoint map_from_geo(GeoPoint place) const override {
    double at[2] = {place.longitude, place.latitude};
    module_.from_geo(system_, at, 1);
    return {at[0] * metres_, at[1] * metres_};
  }
  [[nodiscard]] double metres_per_unit() const override { return 1.0; }
  [[nodiscard]] const Ellipsoid& ellipsoid() const override { return ellipsoid_; }
  [[nodiscard]] std::uint64_t memory_bytes() const override { return kProjBytes; }

 private:
  const IsohfProjModule& module_;
  IsohfProjSystem* system_ = nullptr;
  double metres_;
  Ellipsoid ellipsoid_;
};

}  // namespace

std::shared_ptr<const UnderstoodSystem> understand_system(const std::string& text,
                                                          std::optional<double> metres_per_unit,
                                                          std::optional<int> vertical_epsg) {
  // The files of a mosaic name one system thousands of times, or theirs and the user's in turn.
  static std::mutex mutex;
  static std::array<std::pair<std::string, std::shared_ptr<const UnderstoodSystem>>, 2> known;
  const std::string asked = fmt::format("{} {} {}", metres_per_unit.value_or(0.0), vertical_epsg.value_or(0), text);
  const std::lock_guard lock(mutex);
  if (!known[0].second || known[0].first != asked) {
    std::swap(known[0], known[1]);
    if (!known[0].second || known[0].first != asked) {
      known[0] = {asked, std::make_shared<ProjSystem>(text, metres_per_unit, vertical_epsg)};
    }
  }
  return known[0].second;
}

std::shared_ptr<const ReferenceMap> understand_map(const std::string& text, std::optional<double> metres_per_unit) {
  if (auto utm = utm_map(text, metres_per_unit)) return utm;
  return understand_system(text, metres_per_unit);
}

std::string system_text(const ReferenceSystem& system) {
  return system.epsg ? fmt::format("EPSG:{}", *system.epsg) : system.wkt;
}

std::string unit_name(const Georeference& place) {
  if (place.unit == HorizontalUnit::kUnknown) return "an unknown unit";
  if (place.unit == HorizontalUnit::kDegree) return "degrees";
  return place.metres_per_unit == 1.0 ? "metres" : fmt::format("units of {} m", place.metres_per_unit);
}

std::string name_of(const Georeference& place) {
  const ReferenceSystem& system = place.system;
  if (system.epsg) return fmt::format("EPSG:{}", *system.epsg);
  return system.name.empty() ? unit_name(place) : "\"" + shown_name(system.name, system.wkt) + "\"";
}

namespace {

[[noreturn]] void refuse(const std::string& name, const char* why, const char* remedy) {
  throw Error(ErrorCode::kUnsupported, fmt::format("the reference system \"{}\" {}; {}", name, why, remedy));
}

void take_vertical(const UnderstoodSystem::Description& found, SourceInfo& info) {
  if (found.vertical_name.empty()) return;
  if (found.metres_per_vertical_unit < 0.0) {
    refuse(found.vertical_name, "counts depths downwards",
           "isohf reads heights; name the system without it, and give `z_scale` -1");
  }
  info.georeference.system.vertical_datum = found.vertical_name;
  info.georeference.system.vertical_epsg = found.vertical_epsg;
  info.vertical_unit = found.vertical_unit;
  info.metres_per_vertical_unit = found.metres_per_vertical_unit;
}

}  // namespace

void take_system(const std::string& text, SourceInfo& info) {
  const auto understood = understand_system(text);
  const UnderstoodSystem::Description& found = understood->description();
  constexpr double kSame = 1e-12;
  if (!found.is_projected && (std::abs(found.unit - 1.0) > kSame || std::abs(found.prime_meridian_deg) > kSame)) {
    refuse(shown_name(found.name, text), "counts no degrees from Greenwich",
           "gdalwarp brings the raster to one that does");
  }
  Georeference& place = info.georeference;
  place.unit = found.is_projected ? HorizontalUnit::kMetre : HorizontalUnit::kDegree;
  place.metres_per_unit = found.is_projected ? found.unit : 1.0;
  ReferenceSystem system;
  system.name = found.name;
  system.semi_major_axis_m = found.ellipsoid.semi_major_axis_m;
  system.inverse_flattening = found.ellipsoid.inverse_flattening;
  system.body = body_of(found.name + ' ' + found.datum, system.semi_major_axis_m);
  system.vertical_datum = place.system.vertical_datum;
  system.vertical_epsg = place.system.vertical_epsg;
  if (found.authority == "EPSG") {
    system.epsg = std::stoi(found.code);
  } else {
    system.wkt = found.wkt2;
  }
  place.system = system;
  take_vertical(found, info);
}

namespace {

/// The system of a file; null where it names none, or PROJ does not understand it.
std::shared_ptr<const UnderstoodSystem> understood_if(const std::string& text) {
  try {
    return text.empty() ? nullptr : understand_system(text);
  } catch (const Error&) {
    return nullptr;
  }
}

/// Whether the coordinates of a file, in the system or unit that it names, can be those of `theirs` as well.
bool may_lie_in(const Georeference& own, const Georeference& theirs, const UnderstoodSystem& understood) {
  if (own.unit != HorizontalUnit::kUnknown && own.unit != theirs.unit) return false;
  const std::string said = system_text(own.system);
  if (said == system_text(theirs.system)) return true;
  if (const auto system = understood_if(said)) return understood.may_be(*system);
  constexpr double kSameUnit = 1e-5;  // feet of either kind go by one name
  constexpr double kSameRadius = 1e-6;
  const auto apart = [](double a, double b) { return std::abs(a / b - 1.0); };
  if (own.unit == HorizontalUnit::kMetre && apart(own.metres_per_unit, theirs.metres_per_unit) > kSameUnit)
    return false;
  return !own.system.semi_major_axis_m ||
         apart(*own.system.semi_major_axis_m, theirs.system.semi_major_axis_m.value_or(1.0)) < kSameRadius;
}

/// Whether heights of one system are above something else than those of the other. Names differ from format to format:
/// "EGM96", "EGM96 height", "NAVD88 height (ftUS)"; those that are no name of a surface contradict nothing.
bool have_other_heights(const ReferenceSystem& own, const ReferenceSystem& theirs) {
  const auto surface = [](const std::string& name) {
    const std::string word = lower_case(name.substr(0, name.find(' ')));
    for (const char* const known : {"egm84", "egm96", "egm2008", "navd88", "the"}) {
      if (word == known) return word;
    }
    return std::string();
  };
  const std::string ours = surface(own.vertical_datum);
  const std::string other = surface(theirs.vertical_datum);
  if (!ours.empty() && ours == other) return false;
  if (own.vertical_epsg && theirs.vertical_epsg) return *own.vertical_epsg != *theirs.vertical_epsg;
  const bool is_one_ellipsoidal = own.vertical_datum == kAboveEllipsoid || theirs.vertical_datum == kAboveEllipsoid;
  return !own.vertical_datum.empty() && (is_one_ellipsoidal || (!ours.empty() && !other.empty()));
}

/// Whether a file's words for a system say as much as the user's.
bool keeps_words(const ReferenceSystem& own, const ReferenceSystem& theirs) {
  if (!own.epsg && theirs.epsg) return false;
  const auto system = own.epsg == theirs.epsg ? nullptr : understood_if(system_text(own));
  return !system || system->description().is_datum_known;
}

/// Degrees that none are: what the file says is no system of its coordinates.
bool is_impossible(const SourceInfo& info) {
  if (info.georeference.unit != HorizontalUnit::kDegree) return false;
  try {
    require_source(info);
    return false;
  } catch (const Error&) {
    return true;
  }
}

}  // namespace

void complete_system(const std::string& text, SourceInfo& info) {
  const auto understood = understand_system(text);
  SourceInfo there = info;
  take_system(text, there);
  const Georeference& own = info.georeference;
  Georeference& theirs = there.georeference;
  const std::string said = system_text(own.system);
  const bool is_wrong = is_impossible(info);
  const std::string given = shortened(text);
  const std::string word = given.find_first_of(" \"") == std::string::npos ? given : "'" + given + "'";
  const std::string way_out = "if the file is wrong, correct a copy with gdal_translate -a_srs " + word;
  if (!is_wrong && !may_lie_in(own, theirs, *understood)) {
    const bool can_project =
        theirs.unit == HorizontalUnit::kMetre && (!said.empty() || own.unit == HorizontalUnit::kDegree);
    const std::string project =
        can_project ? fmt::format("`projection` {} projects it; ", theirs.system.epsg ? name_of(theirs) : word) : "";
    throw Error(ErrorCode::kInvalidArgument,
                {"", fmt::format("is in {}, which `reference_system` {} contradicts", name_of(own), given), "",
                 project + way_out});
  }
  const std::string& heights = understood->description().vertical_name;
  if (!heights.empty() && have_other_heights(own.system, theirs.system)) {
    throw Error(ErrorCode::kInvalidArgument,
                {"",
                 fmt::format("has heights above {}, which `reference_system` contradicts with {}",
                             own.system.vertical_datum, heights),
                 "", "name the system without heights; " + way_out});
  }
  // The same system: in the file's words, unless these lack its datum or code. Coordinates may be in a unit of their own.
  if (!said.empty() && !is_wrong) {
    theirs.metres_per_unit = own.metres_per_unit;
    if (keeps_words(own.system, theirs.system)) {
      ReferenceSystem system = own.system;
      system.vertical_datum = theirs.system.vertical_datum;
      system.vertical_epsg = theirs.system.vertical_epsg;
      theirs.system = std::move(system);
    }
  }
  info = std::move(there);
}

void take_heights(int vertical_epsg, SourceInfo& info) {
  constexpr const char* kAny = "EPSG:4326";
  try {
    take_vertical(understand_system(kAny, std::nullopt, vertical_epsg)->description(), info);
  } catch (const Error& error) {
    info.warnings.push_back(
        fmt::format("the unit of heights in EPSG:{} is not known: {}", vertical_epsg, error.what()));
  }
}

bool gives_heights_above_ellipsoid(int epsg) {
  // EPSG keeps these ranges for systems of two dimensions: WGS 84, ETRS89, NAD83 and most others.
  if ((epsg >= 4120 && epsg <= 4326) || (epsg >= 4600 && epsg <= 4826)) return false;
  try {
    return understand_system(fmt::format("EPSG:{}", epsg))->description().vertical_name == kAboveEllipsoid;
  } catch (const Error&) {
    return false;
  }
}

std::string wkt_of(const ReferenceSystem& system, WktDialect dialect) {
  const std::string text = system_text(system);
  if (text.empty()) return {};
  try {
    const auto& found = understand_system(text, std::nullopt, system.vertical_epsg)->description();
    const std::string& wanted = dialect == WktDialect::kEsri ? found.esri : found.wkt1;
    if (!wanted.empty()) return wanted;
    return dialect == WktDialect::kEsri && !found.wkt1.empty() ? found.wkt1 : found.wkt2;
  } catch (const Error&) {
    return system.wkt;
  }
}

std::optional<bool> are_same(const ReferenceSystem& a, const ReferenceSystem& b) {
  if (a.epsg && b.epsg) return *a.epsg == *b.epsg;
  const std::string ours = system_text(a);
  const std::string theirs = system_text(b);
  if (ours.empty() || theirs.empty()) return std::nullopt;
  if (ours == theirs) return true;
  try {
    const auto first = understand_system(ours);
    return first->is_same(*understand_system(theirs));
  } catch (const Error&) {
    return std::nullopt;
  }
}

std::shared_ptr<const ReferenceMap> understand_way(const MappedSystem& system, const Ellipsoid& ellipsoid) {
  return std::make_shared<PipelineMap>(system, ellipsoid);
}

namespace {

/// What names the datum of a source's longitudes and latitudes: its system, else its ellipsoid, else WGS 84.
std::string datum_text(const ReferenceSystem& system, const std::optional<Ellipsoid>& ellipsoid = std::nullopt) {
  if (std::string text = system_text(system); !text.empty()) {
    // PROJ takes unknown datums of two ellipsoids for one, silently, where their meridians have one name.
    for (const std::string_view of_bodies : {"PRIMEM[\"Reference_Meridian\"", "PRIMEM[\"Reference meridian\""}) {
      const std::size_t at = text.find(of_bodies);
      if (at != std::string::npos) text.replace(at, of_bodies.size(), "PRIMEM[\"Greenwich\"");
    }
    return text;
  }
  if (!system.semi_major_axis_m && !ellipsoid) return "EPSG:4326";
  const double radius = system.semi_major_axis_m ? *system.semi_major_axis_m : ellipsoid->semi_major_axis_m;
  const double inverse =
      system.semi_major_axis_m ? system.inverse_flattening.value_or(0.0) : ellipsoid->inverse_flattening;
  return inverse > 0.0 ? fmt::format("+proj=longlat +a={} +rf={}", radius, inverse)
                       : fmt::format("+proj=longlat +R={}", radius);
}

/// The ground of a source that says where it lies, for the choice among ways between datums.
GeoExtent rough_ground(const SourceInfo& info, const ReferenceMap* map) {
  const Georeference& place = info.georeference;
  GeoExtent ground{-180.0, -90.0, 180.0, 90.0};
  if (!place.has_origin) return ground;
  const MapBounds bounds{place.origin_x, place.origin_y - static_cast<double>(info.height - 1) * place.spacing_y,
                         place.origin_x + static_cast<double>(info.width - 1) * place.spacing_x, place.origin_y};
  if (map != nullptr) {
    const auto found = ground_under(*map, bounds);
    if (!found) return ground;
    ground = found->extent;
  } else {
    ground = {bounds.west, bounds.south, bounds.east, bounds.north};
  }
  if (ground.east - ground.west >= 360.0) return {-180.0, ground.south, 180.0, ground.north};
  return {std::remainder(ground.west, 360.0), ground.south, std::remainder(ground.east, 360.0), ground.north};
}

}  // namespace

namespace {

/// Heights are moved by nobody: a system that speaks of others is not what the raster would be in.
void require_same_heights(const ReferenceSystem& from, const UnderstoodSystem::Description& target,
                          const std::string& name) {
  if (target.vertical_name.empty() || target.vertical_name == from.vertical_datum) return;
  if (target.vertical_epsg && target.vertical_epsg == from.vertical_epsg) return;
  throw Error(ErrorCode::kInvalidArgument,
              fmt::format("\"{}\" speaks of heights, \"{}\", and the input's stay what they are; name the system "
                          "without its heights",
                          name, target.vertical_name));
}

}  // namespace

SystemOnBody on_body_of(const ReferenceSystem& raster, const Ellipsoid& ellipsoid, const std::string& text) {
  constexpr double kSameBody = 0.01;  // of radii
  constexpr double kEarthRadius = 6378137.0;
  const auto understood = understand_system(text);
  const UnderstoodSystem::Description& map = understood->description();
  const auto is_near = [](double radius, double other) { return std::abs(radius / other - 1.0) < kSameBody; };
  if (is_near(map.ellipsoid.semi_major_axis_m, ellipsoid.semi_major_axis_m)) return {text};
  const auto name_of = [](const std::string& name, double radius) {
    return name.empty() ? fmt::format("a body of radius {:.8g} m", radius) : name;
  };
  const std::string body = name_of(raster.body.empty() ? body_of("", ellipsoid.semi_major_axis_m) : raster.body,
                                   ellipsoid.semi_major_axis_m);
  // UTM zones are the Earth's.
  bool states_body = !is_near(map.ellipsoid.semi_major_axis_m, kEarthRadius) || map.authority.starts_with("IAU") ||
                     map.name.find("UTM zone") != std::string::npos;
  for (const char* parameter : {"+R=", "+a=", "+b=", "+rf=", "+ellps=", "+datum="})
    states_body = states_body || text.find(parameter) != std::string::npos;
  const std::string name = shown_name(map.name, text);
  if (!map.is_projected || states_body) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("\"{}\" is of {}, the input of {}; name a map of that body, or a projection without a body "
                            "(ESRI:54009, +proj=moll)",
                            name,
                            name_of(body_of(map.name + ' ' + map.datum, map.ellipsoid.semi_major_axis_m),
                                    map.ellipsoid.semi_major_axis_m),
                            body));
  }
  IsohfProjText wkt{};
  IsohfProjMessage message{};
  const int result = proj_module().on_body(text.c_str(), datum_text(raster, ellipsoid).c_str(),
                                           fmt::format("{} on {}", name, body).c_str(), &wkt, &message);
  if (result != 0) throw Error(module_error_code(result), fmt::format("\"{}\" {}", name, message.text));
  return {wkt.text, body};
}

WayToSystem find_way(const ReferenceSystem& from, const std::string& to, const GeoExtent& ground,
                     const Ellipsoid& ellipsoid) {
  const auto understood = understand_system(to);
  const UnderstoodSystem::Description& target = understood->description();
  const std::string name = shown_name(target.name, to);
  require_same_heights(from, target, name);
  const double area[4] = {ground.west, ground.south, ground.east, ground.north};
  IsohfProjOperation operation{};
  IsohfProjMessage message{};
  const int result = proj_module().find_operation(datum_text(from).c_str(), to.c_str(), area, &operation, &message);
  if (result != 0) throw Error(module_error_code(result), fmt::format("\"{}\" {}", name, message.text));
  WayToSystem way;
  way.system = {target.authority == "EPSG" ? "EPSG:" + target.code : target.wkt2, name, operation.pipeline,
                target.is_projected ? target.unit : 1.0};
  way.is_projected = target.is_projected;
  MappedSystem in_units = way.system;
  in_units.metres_per_unit = 1.0;
  way.map = std::make_shared<PipelineMap>(in_units, ellipsoid);
  way.is_ballpark = operation.is_ballpark != 0;
  return way;
}

namespace {

void understand_projection(const SourceInfo& info, const ReferenceMap* source_map, ProjectionRequest& request) {
  try {
    ProjectionSpec& spec = request.system_map;
    spec.kind = ProjectionKind::kSystem;
    const ReferenceSystem& own = info.georeference.system;
    if (own.semi_major_axis_m) {
      spec.ellipsoid = {*own.semi_major_axis_m, own.inverse_flattening.value_or(0.0)};
    } else if (source_map != nullptr) {
      spec.ellipsoid = source_map->ellipsoid();
    }
    const SystemOnBody on = on_body_of(own, spec.ellipsoid, request.system);
    request.system_body = on.body;
    const WayToSystem way = find_way(own, on.text, rough_ground(info, source_map), spec.ellipsoid);
    spec.system = way.system;
    if (!way.is_projected) {
      throw Error(ErrorCode::kInvalidArgument,
                  fmt::format("\"{}\" counts degrees and is no map; `projection` none leaves degrees as they are",
                              spec.system.name));
    }
    spec.map = understand_way(spec.system, spec.ellipsoid);
    if (way.is_ballpark) {
      request.system_note = fmt::format(
          "{}: PROJ knows no way from its datum to that of \"{}\": they are taken for one, which may be off by some "
          "hundred metres",
          info.path, spec.system.name);
    }
  } catch (const Error& error) {
    throw Error(error.code(), fmt::format("{}: `projection`: {}", info.path, error.what()));
  }
}

void understand_source_map(const SourceInfo& info, GroundRequest& request) {
  const Georeference& place = info.georeference;
  const std::string text = system_text(place.system);
  if (place.unit != HorizontalUnit::kMetre || !place.has_origin || text.empty()) return;
  try {
    request.source_map = understand_map(text, place.metres_per_unit);
  } catch (const Error& error) {
    request.why_no_map = error.what();
  }
}

}  // namespace

void understand_ground(const SourceInfo& info, GroundRequest& request) {
  understand_source_map(info, request);
  ProjectionRequest& projection = request.projection;
  if (projection.kind != ProjectionKind::kSystem) return;
  // Without a place of its own the input is refused later, with the remedy.
  if (!info.georeference.has_origin || info.georeference.unit == HorizontalUnit::kUnknown) return;
  if (info.georeference.unit == HorizontalUnit::kMetre && !request.source_map) return;
  understand_projection(info, request.source_map.get(), projection);
}

}  // namespace isohf
