#include "formats/geotiff/geotiff_keys.h"

#include <fmt/args.h>
#include <fmt/format.h>
#include <geo_normalize.h>
#include <geo_simpletags.h>
#include <geo_tiffp.h>
#include <geotiffio.h>
#include <xtiffio.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <memory>
#include <numbers>
#include <optional>
#include <string_view>

#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/projection/body.h"
#include "isohf/projection/crs/crs.h"
#include "isohf/projection/crs/proj.h"
#include "isohf/projection/crs/source_system.h"
#include "isohf/projection/length_unit.h"

namespace isohf {
namespace {

constexpr std::string_view kEsri = "ESRI PE String = ";
constexpr int kUserDefined = KvUserDefined;

/// One for each thread: libgeotiff would open PROJ's database for each file.
PJ_CONTEXT* proj_context() {
  thread_local const proj::Context context = proj::make_context();
  return context.get();
}

/// Without a handler libgeotiff prints its messages.
void keep_quiet(GTIF* /*keys*/, int /*level*/, const char* /*message*/, ...) {}

/// libgeotiff's view of tags in memory.
class Keys {
 public:
  explicit Keys(const GeoTags& tags = {}) : tags_(ST_Create(), ST_Destroy), keys_(nullptr, GTIFFree) {
    const auto set = [&](int tag, const auto& values, int type, std::size_t count) {
      // libgeotiff copies the values.
      if (count > 0)
        ST_SetKey(tags_.get(), tag, static_cast<int>(count), type,
                  const_cast<void*>(static_cast<const void*>(values.data())));
    };
    set(TIFFTAG_GEOKEYDIRECTORY, tags.directory, STT_SHORT, tags.directory.size());
    set(TIFFTAG_GEODOUBLEPARAMS, tags.doubles, STT_DOUBLE, tags.doubles.size());
    set(TIFFTAG_GEOASCIIPARAMS, tags.ascii, STT_ASCII, tags.ascii.empty() ? 0 : tags.ascii.size() + 1);
    TIFFMethod in_memory{};
    GTIFSetSimpleTagsMethods(&in_memory);
    keys_.reset(GTIFNewWithMethodsEx(tags_.get(), &in_memory, keep_quiet, nullptr));
    if (keys_) GTIFAttachPROJContext(keys_.get(), proj_context());
  }

  /// False: the directory is damaged.
  [[nodiscard]] bool are_readable() const { return keys_ != nullptr; }
  [[nodiscard]] GTIF* get() const { return keys_.get(); }

  [[nodiscard]] std::optional<int> number(geokey_t key) const {
    unsigned short value = 0;
    return keys_ && GTIFKeyGetSHORT(keys_.get(), key, &value, 0, 1) == 1 ? std::optional<int>(value) : std::nullopt;
  }
  /// Absent if undefined (0) or user-defined.
  [[nodiscard]] std::optional<int> code(geokey_t key) const {
    const std::optional<int> value = number(key);
    return value && *value != 0 && *value != kUserDefined ? value : std::nullopt;
  }
  [[nodiscard]] std::optional<double> real(geokey_t key) const {
    double value = 0.0;
    const bool is_there = keys_ && GTIFKeyGetDOUBLE(keys_.get(), key, &value, 0, 1) == 1 && std::isfinite(value);
    return is_there ? std::optional<double>(value) : std::nullopt;
  }
  /// Without the bar at its end.
  [[nodiscard]] std::string text(geokey_t key) const {
    int size = 0;
    tagtype_t type = TYPE_UNKNOWN;
    const int count = keys_ ? GTIFKeyInfo(keys_.get(), key, &size, &type) : 0;
    if (count <= 0 || type != TYPE_ASCII) return {};
    std::string value(static_cast<std::size_t>(count) + 1, '\0');
    if (GTIFKeyGetASCII(keys_.get(), key, value.data(), count + 1) == 0) return {};
    value.resize(std::min(value.find('\0'), value.size()));
    while (value.ends_with('|') || value.ends_with(' ')) value.pop_back();
    return value;
  }

  void set(geokey_t key, int value) { GTIFKeySet(keys_.get(), key, TYPE_SHORT, 1, value); }
  void set(geokey_t key, double value) { GTIFKeySet(keys_.get(), key, TYPE_DOUBLE, 1, value); }
  /// A bar ends each text, so that none may contain one; offsets have 16 bits.
  void set(geokey_t key, std::string value) {
    constexpr std::size_t kLongestText = 30000;
    if (value.empty() || value.size() > kLongestText) return;
    std::replace(value.begin(), value.end(), '|', '/');
    GTIFKeySet(keys_.get(), key, TYPE_ASCII, 0, value.c_str());
  }
  void set_parts(geokey_t key, const std::string& value) { GTIFKeySet(keys_.get(), key, TYPE_ASCII, 0, value.c_str()); }

  /// The three tags of the keys that were set. GDAL reads codes of vertical systems in version 1.1.1 alone.
  void write_to(GeoTags& tags) {
    GTIFSetVersionNumbers(keys_.get(), 1, 1, number(VerticalCSTypeGeoKey) ? 1 : 0);
    GTIFWriteKeys(keys_.get());
    const auto get = [&](int tag, auto& values) {
      int count = 0;
      int type = 0;
      void* data = nullptr;
      if (ST_GetKey(tags_.get(), tag, &count, &type, &data) == 0) return;
      const auto* begin = static_cast<decltype(values.data())>(data);
      values.assign(begin, begin + count);
    };
    get(TIFFTAG_GEOKEYDIRECTORY, tags.directory);
    get(TIFFTAG_GEODOUBLEPARAMS, tags.doubles);
    get(TIFFTAG_GEOASCIIPARAMS, tags.ascii);
    tags.ascii.resize(std::min(tags.ascii.find('\0'), tags.ascii.size()));
  }

 private:
  std::unique_ptr<ST_TIFF, decltype(&ST_Destroy)> tags_;
  std::unique_ptr<GTIF, decltype(&GTIFFree)> keys_;
};

/// x = x0 + dx * column, y = y0 + dy * row in raster space, where PixelIsArea puts sample (0, 0) at (0.5, 0.5).
struct AxisAligned {
  double x0 = 0.0;
  double y0 = 0.0;
  double dx = 0.0;
  double dy = 0.0;
  bool has_origin = false;
  double z_scale = 0.0;  ///< 0: none
  double z_offset = 0.0;
};

void require_usable(const AxisAligned& map) {
  const bool finite = std::isfinite(map.dx) && std::isfinite(map.dy) && std::isfinite(map.x0) && std::isfinite(map.y0);
  if (!finite || map.dx == 0.0 || map.dy == 0.0) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("the georeference has spacing {} x {}, must be finite and not 0", map.dx, map.dy));
  }
  if (map.dx < 0.0) {
    throw Error(ErrorCode::kUnsupported,
                "the georeference runs the columns from East to West; isohf reads rasters whose "
                "columns run from West to East (gdalwarp turns it)");
  }
}

AxisAligned map_from_transformation(const std::vector<double>& m) {
  if (m.size() < 16) {
    throw Error(ErrorCode::kCorrupt, fmt::format("ModelTransformationTag has {} values, must have 16", m.size()));
  }
  // A millionth of a sample across the largest raster is the most that a rounded zero may turn it.
  const double across = 1e-9 * std::max(std::abs(m[0]), std::abs(m[5]));
  if (std::abs(m[1]) > across || std::abs(m[4]) > across) {
    throw Error(
        ErrorCode::kUnsupported,
        fmt::format("the georeference is rotated or sheared (ModelTransformationTag {}, {}, {}, {}); isohf reads "
                    "north-up rasters (gdalwarp makes one)",
                    m[0], m[1], m[4], m[5]));
  }
  return {m[3], m[7], m[0], m[5], true, m[10], m[11]};
}

std::optional<AxisAligned> map_from_tags(const GeoTags& tags, std::vector<Warning>& warnings) {
  const auto& scale = tags.pixel_scale;
  const auto& tie = tags.tiepoints;
  if (scale.size() >= 2) {
    // Files with a negative scale are as a rule north-up ones whose writer erred; GDAL reads them so as well.
    if (scale[1] < 0.0) warnings.push_back("ModelPixelScaleTag has a negative y; its sign is ignored");
    AxisAligned map{0.0, 0.0, scale[0], -std::abs(scale[1]), false};
    if (tie.size() >= 6) {
      map.x0 = tie[3] - tie[0] * map.dx;
      map.y0 = tie[4] - tie[1] * map.dy;
      map.has_origin = true;
      map.z_scale = scale.size() > 2 ? scale[2] : 0.0;
      map.z_offset = tie[5] - tie[2] * map.z_scale;
    } else {
      warnings.push_back(loss("the georeference has a pixel scale but no tie point: the position is unknown"));
    }
    return map;
  }
  if (!tags.transformation.empty()) return map_from_transformation(tags.transformation);
  if (!tie.empty()) {
    warnings.push_back(
        loss("the georeference has tie points only (ground control points), which are not used: spacing and "
             "position are unknown"));
  }
  return std::nullopt;
}

/// The WKT in one of the citations, as ArcGIS and GDAL write it; empty if none has any.
std::string esri_wkt(const Keys& keys) {
  for (const geokey_t key : {PCSCitationGeoKey, GTCitationGeoKey, GeogCitationGeoKey}) {
    if (const std::string text = keys.text(key); text.starts_with(kEsri)) return text.substr(kEsri.size());
  }
  return {};
}

/// The value after `what` in "GCS Name = A|Datum = B|Ellipsoid = C|Primem = D"; else `otherwise`.
std::string part_of_citation(const std::string& citation, const std::string& what, const std::string& otherwise) {
  const std::string wanted = what + " = ";
  const std::size_t at = citation.find(wanted);
  if (at == std::string::npos) return otherwise;
  const std::size_t begin = at + wanted.size();
  return citation.substr(begin, std::min(citation.find('|', begin), citation.size()) - begin);
}

std::string name_in_citations(const Keys& keys, bool projected) {
  std::string name = keys.text(projected ? PCSCitationGeoKey : GeogCitationGeoKey);
  if (name.empty()) name = keys.text(GTCitationGeoKey);
  if (name.empty()) name = keys.text(GeogCitationGeoKey);
  name = name.substr(0, name.find('|'));
  const std::size_t equals = name.find(" Name = ");
  return equals == std::string::npos ? name : name.substr(equals + 8);
}

/// Metres in the unit of length with a code; nullopt for an unknown one.
std::optional<double> metres_of_unit(int code) {
  double metres = 0.0;
  const bool is_known = GTIFGetUOMLengthInfoEx(proj_context(), code, nullptr, &metres) != 0 && metres > 0.0;
  return is_known ? std::optional(length_unit(metres).metres) : std::nullopt;
}

/// Degrees in a unit of angles.
std::optional<double> degrees_of_unit(int code) {
  double degrees = 0.0;
  const bool is_known = GTIFGetUOMAngleInfoEx(proj_context(), code, nullptr, &degrees) != 0 && degrees > 0.0;
  return is_known ? std::optional(degrees) : std::nullopt;
}

/// The system of longitudes and latitudes that keys spell out, in degrees; null if they do not say its size.
proj::Object geographic_of(const Keys& keys, const GTIFDefn& defn) {
  if (defn.GCS != kUserDefined && defn.GCS > 0) {
    return proj::Object(proj_create(proj_context(), fmt::format("EPSG:{}", defn.GCS).c_str()));
  }
  // Axes are in GeogLinearUnits by the standard; writers that did not know it gave metres.
  const std::optional<int> unit = keys.code(GeogLinearUnitsGeoKey);
  double metres = keys.real(GeogLinearUnitSizeGeoKey).value_or(unit ? metres_of_unit(*unit).value_or(1.0) : 1.0);
  if (!keys.real(GeogSemiMajorAxisGeoKey) || body_of("", defn.SemiMajor * metres).empty()) metres = 1.0;
  const double major = defn.SemiMajor * metres;
  const double minor = defn.SemiMinor > 0.0 ? defn.SemiMinor * metres : major;
  if (!(major > 0.0)) return nullptr;
  const std::string citation = keys.text(GeogCitationGeoKey);
  char* datum = nullptr;
  if (defn.Datum != kUserDefined) GTIFGetDatumInfoEx(proj_context(), defn.Datum, &datum, nullptr);
  const std::string datum_name = part_of_citation(citation, "Datum", datum != nullptr ? datum : "unknown");
  GTIFFreeMemory(datum);
  // PROJ and GDAL call the meridian of other bodies so.
  const bool is_earth = body_of("", major) == "Earth";
  const std::string meridian = part_of_citation(citation, "Primem",
                                                defn.PMLongToGreenwich != 0.0 ? "unknown"
                                                : is_earth                    ? "Greenwich"
                                                                              : "Reference_Meridian");
  const std::string name = citation.empty() ? "unknown" : citation.substr(0, citation.find('|'));
  const proj::Object axes =
      proj::Object(proj_create_ellipsoidal_2D_cs(proj_context(), PJ_ELLPS2D_LONGITUDE_LATITUDE, nullptr, 0));
  return proj::Object(proj_create_geographic_crs(
      proj_context(), part_of_citation(citation, "GCS Name", name).c_str(), datum_name.c_str(),
      part_of_citation(citation, "Ellipsoid", "unknown").c_str(), major, minor == major ? 0.0 : major / (major - minor),
      meridian.c_str(), defn.PMLongToGreenwich, nullptr, 0, axes.get()));
}

/// A method by its number in GeoTIFF's keys, and how PROJ spells it.
struct Method {
  int code;
  std::string_view proj;
};

// Numbers: GeoTIFF 1.0, section 6.3.3.3. {lat} and {lon} are of the origin or centre, {p1} and {p2} standard parallels.
constexpr std::array<Method, 29> kMethods = {{
    {CT_TransverseMercator, "tmerc +lat_0={lat} +lon_0={lon} +k_0={k}"},
    {CT_ObliqueMercator, "omerc +lat_0={lat} +lonc={lon} +alpha={alpha} +gamma={gamma} +k_0={k}"},
    {9812, "omerc +no_uoff +lat_0={lat} +lonc={lon} +alpha={alpha} +gamma={gamma} +k_0={k}"},
    {9815, "omerc +lat_0={lat} +lonc={lon} +alpha={alpha} +gamma={gamma} +k_0={k}"},
    {CT_ObliqueMercator_Rosenmund, "somerc +lat_0={lat} +lon_0={lon} +k_0={k}"},
    {CT_Mercator, "merc +lon_0={lon} +k_0={k}"},
    {CT_LambertConfConic_2SP, "lcc +lat_0={lat} +lon_0={lon} +lat_1={p1} +lat_2={p2}"},
    {CT_LambertConfConic_Helmert, "lcc +lat_1={lat} +lat_0={lat} +lon_0={lon} +k_0={k}"},
    {CT_LambertAzimEqualArea, "laea +lat_0={lat} +lon_0={lon}"},
    {CT_AlbersEqualArea, "aea +lat_0={lat} +lon_0={lon} +lat_1={p1} +lat_2={p2}"},
    {CT_AzimuthalEquidistant, "aeqd +lat_0={lat} +lon_0={lon}"},
    {CT_EquidistantConic, "eqdc +lat_0={lat} +lon_0={lon} +lat_1={p1} +lat_2={p2}"},
    {CT_Stereographic, "stere +lat_0={lat} +lon_0={lon} +k_0={k}"},
    {CT_PolarStereographic, "stere +lat_0={lat} +lon_0={lon} +k_0={k}"},
    {CT_ObliqueStereographic, "sterea +lat_0={lat} +lon_0={lon} +k_0={k}"},
    {CT_Equirectangular, "eqc +lat_ts={p1} +lat_0={lat} +lon_0={lon}"},
    {CT_CassiniSoldner, "cass +lat_0={lat} +lon_0={lon}"},
    {CT_Gnomonic, "gnom +lat_0={lat} +lon_0={lon}"},
    {CT_MillerCylindrical, "mill +lon_0={lon}"},
    {CT_Orthographic, "ortho +lat_0={lat} +lon_0={lon}"},
    {CT_Polyconic, "poly +lat_0={lat} +lon_0={lon}"},
    {CT_Robinson, "robin +lon_0={lon}"},
    {CT_Sinusoidal, "sinu +lon_0={lon}"},
    {CT_VanDerGrinten, "vandg +lon_0={lon}"},
    {CT_NewZealandMapGrid, "nzmg +lat_0={lat} +lon_0={lon}"},
    {CT_TransvMercator_SouthOriented, "tmerc +axis=wsu +lat_0={lat} +lon_0={lon} +k_0={k}"},
    {CT_CylindricalEqualArea, "cea +lat_ts={p1} +lon_0={lon}"},
    // Two methods of one number: by a standard parallel.
    {-CT_Mercator, "merc +lat_ts={p1} +lon_0={lon}"},
    {-CT_PolarStereographic, "stere +lat_0={pole} +lat_ts={lat} +lon_0={lon}"},
}};

/// The projection that keys spell out as a PROJ string without a body, in metres; empty if its method is unknown.
std::string projection_of(const Keys& keys, const GTIFDefn& defn) {
  const auto parameter = [&](std::initializer_list<int> names) -> std::optional<double> {
    for (int i = 0; i < std::min(defn.nParms, MAX_GTIF_PROJPARMS); ++i) {
      if (std::ranges::find(names, defn.ProjParmId[i]) != names.end()) return defn.ProjParm[i];
    }
    return std::nullopt;
  };
  const double latitude =
      parameter({ProjNatOriginLatGeoKey, ProjFalseOriginLatGeoKey, ProjCenterLatGeoKey}).value_or(0.0);
  const std::optional<double> parallel = parameter({ProjStdParallel1GeoKey});
  const double azimuth = parameter({ProjAzimuthAngleGeoKey}).value_or(0.0);
  int code = defn.CTProjection;
  if (code == CT_Mercator && parallel) code = -code;
  if (code == CT_PolarStereographic && std::abs(latitude) != 90.0) code = -code;
  const auto* const method = std::ranges::find(kMethods, code, &Method::code);
  if (method == kMethods.end()) return {};
  fmt::dynamic_format_arg_store<fmt::format_context> values;
  const auto give = [&](const char* name, double value) { values.push_back(fmt::arg(name, value)); };
  give("lat", latitude);
  give("pole", std::copysign(90.0, latitude));
  give("lon", parameter({ProjNatOriginLongGeoKey, ProjFalseOriginLongGeoKey, ProjCenterLongGeoKey,
                         ProjStraightVertPoleLongGeoKey})
                  .value_or(0.0));
  give("p1", parallel.value_or(0.0));
  give("p2", parameter({ProjStdParallel2GeoKey}).value_or(0.0));
  give("k", parameter({ProjScaleAtNatOriginGeoKey, ProjScaleAtCenterGeoKey}).value_or(1.0));
  give("alpha", azimuth);
  give("gamma", keys.real(ProjRectifiedGridAngleGeoKey).value_or(azimuth));
  const double easting =
      parameter({ProjFalseEastingGeoKey, ProjFalseOriginEastingGeoKey, ProjCenterEastingGeoKey}).value_or(0.0);
  const double northing =
      parameter({ProjFalseNorthingGeoKey, ProjFalseOriginNorthingGeoKey, ProjCenterNorthingGeoKey}).value_or(0.0);
  return fmt::format("+proj={} +x_0={} +y_0={} +to_meter={} +type=crs", fmt::vformat(method->proj, values), easting,
                     northing, defn.UOMLengthInMeters);
}

/// The system that keys spell out instead of naming it by a code, as WKT; empty, with a warning for a map, if it cannot
/// be understood.
std::string spelled_out(const Keys& keys, bool projected, const std::string& name, GeoTiffPlace& place) {
  const std::optional<int> angle = keys.code(GeogAngularUnitsGeoKey);
  if (angle && !degrees_of_unit(*angle)) return {};  // libgeotiff would have PROJ print that
  const std::unique_ptr<GTIFDefn, decltype(&GTIFFreeDefn)> defn(GTIFAllocDefn(), GTIFFreeDefn);
  if (GTIFGetDefn(keys.get(), defn.get()) == 0) return {};
  const bool has_method = keys.code(ProjectionGeoKey) || keys.code(ProjCoordTransGeoKey);
  if (projected && !has_method) return {};
  proj::Object system = geographic_of(keys, *defn);
  if (projected) {
    const std::string projection = projection_of(keys, *defn);
    if (projection.empty() || !system) {
      place.warnings.push_back(loss(
          projection.empty()
              ? fmt::format("its map is of the kind {} (GeoTIFF's code), which is not known: where it lies on the "
                            "ground is not kept",
                            keys.code(ProjCoordTransGeoKey).value_or(keys.code(ProjectionGeoKey).value_or(0)))
              : "its map lies on a geographic system that is not understood: where it lies on the ground is not kept"));
      return {};
    }
    const proj::Object map = proj::Object(proj_create(proj_context(), projection.c_str()));
    const proj::Object conversion =
        proj::Object(map ? proj_crs_get_coordoperation(proj_context(), map.get()) : nullptr);
    const proj::Object axes = proj::Object(map ? proj_crs_get_coordinate_system(proj_context(), map.get()) : nullptr);
    if (!conversion || !axes) return {};
    system = proj::Object(proj_create_projected_crs(proj_context(), name.empty() ? "unknown" : name.c_str(),
                                                    system.get(), conversion.get(), axes.get()));
  }
  return system ? proj::wkt_of(proj_context(), system.get(), PJ_WKT2_2019) : "";
}

/// Takes a system that PROJ understands; any other is left out with a warning. Throws for one that isohf cannot use.
void take_if_understood(const std::string& text, SourceInfo& info) {
  try {
    take_system(text, info);
  } catch (const Error& error) {
    if (error.code() == ErrorCode::kUnsupported) throw;
    info.warnings.push_back(loss(fmt::format("{}: it is left out (`reference_system` names another)", error.what())));
  }
}

/// A key's own unit of length goes before that of the system: coordinates may be in another.
void read_linear_unit(const Keys& keys, SourceInfo& info) {
  const std::optional<int> code = keys.code(ProjLinearUnitsGeoKey);
  const std::optional<double> size = keys.real(ProjLinearUnitSizeGeoKey);
  Georeference& geo = info.georeference;
  if (size && *size > 0.0) {
    geo.metres_per_unit = *size;
  } else if (const auto metres = code ? metres_of_unit(*code) : std::nullopt) {
    geo.metres_per_unit = *metres;
  } else if (code) {
    geo.unit = HorizontalUnit::kUnknown;
    info.warnings.push_back(loss(fmt::format("linear unit {} is not known: the spacing has no unit", *code)));
  }
}

/// Degrees in a unit of the coordinates.
double read_angular_unit(const Keys& keys, SourceInfo& info) {
  const std::optional<int> code = keys.code(GeogAngularUnitsGeoKey);
  const std::optional<double> radians = keys.real(GeogAngularUnitSizeGeoKey);
  if (!code && !radians) return 1.0;
  if (const std::optional<double> degrees = code ? degrees_of_unit(*code) : std::nullopt) return *degrees;
  if (radians && *radians > 0.0) return *radians * 180.0 / std::numbers::pi;
  info.georeference.unit = HorizontalUnit::kUnknown;
  info.warnings.push_back(loss(fmt::format("angular unit {} is not known: the spacing has no unit", code.value_or(0))));
  return 1.0;
}

void read_vertical(const Keys& keys, SourceInfo& info) {
  ReferenceSystem& system = info.georeference.system;
  const std::optional<int> code = keys.code(VerticalCSTypeGeoKey);
  const std::string citation = keys.text(VerticalCitationGeoKey);
  // GeoTIFF 1.0 had codes for heights above ellipsoids, which EPSG has no systems of.
  if (code && *code >= 5001 && *code <= 5033) {
    system.vertical_datum = kAboveEllipsoid;
  } else if (code) {
    system.vertical_epsg = code;
    system.vertical_datum = citation;
    take_heights(*code, info);
  } else if (!citation.empty()) {
    system.vertical_datum = citation;
  }
  const std::optional<int> unit = keys.code(VerticalUnitsGeoKey);
  if (!unit) return;
  if (const std::optional<double> metres = metres_of_unit(*unit)) {
    info.vertical_unit = length_unit(*metres).name;
    info.metres_per_vertical_unit = *metres;
  } else {
    info.warnings.push_back(loss(fmt::format("vertical unit {} is not known", *unit)));
  }
}

/// Returns the degrees in a unit of the coordinates.
double read_system(const Keys& keys, GeoTiffPlace& place, SourceInfo& info) {
  Georeference& geo = info.georeference;
  const std::optional<int> model = keys.code(GTModelTypeGeoKey);  // none comes with ESRI's strings
  const std::string esri = esri_wkt(keys);
  const bool projected = model ? *model == ModelTypeProjected : keys.number(ProjectedCSTypeGeoKey).has_value();
  const bool geographic = !projected && (model ? *model == ModelTypeGeographic
                                               : esri.empty() && keys.number(GeographicTypeGeoKey).has_value());
  const std::string name = name_in_citations(keys, projected);
  if (projected) geo.unit = HorizontalUnit::kMetre;
  if (geographic) geo.unit = HorizontalUnit::kDegree;
  const std::optional<int> code = projected    ? keys.code(ProjectedCSTypeGeoKey)
                                  : geographic ? keys.code(GeographicTypeGeoKey)
                                               : std::nullopt;
  std::string text = code ? fmt::format("EPSG:{}", *code) : esri;
  if (text.empty() && (projected || geographic)) text = spelled_out(keys, projected, name, place);
  if (!text.empty()) {
    take_if_understood(text, info);
  } else if (!projected && !geographic && !name.empty()) {
    info.warnings.push_back(
        loss(fmt::format("the reference system \"{}\" is neither a map nor degrees, but a local one, or one of three "
                         "dimensions: it is left out (`reference_system` names what it is)",
                         printable(name))));
  }
  ReferenceSystem& system = geo.system;
  if (system.name.empty() || system.name == "unknown") system.name = name.starts_with(kEsri) ? "" : name;
  if (const auto major = keys.real(GeogSemiMajorAxisGeoKey); major && *major > 0.0 && !system.semi_major_axis_m) {
    // A map without a method still says which body it is of.
    system.semi_major_axis_m = major;
    system.inverse_flattening = keys.real(GeogInvFlatteningGeoKey).value_or(0.0);
  }
  if (system.body.empty()) system.body = body_of(name + ' ' + keys.text(GeogCitationGeoKey), system.semi_major_axis_m);
  read_vertical(keys, info);
  if (geo.unit == HorizontalUnit::kMetre) read_linear_unit(keys, info);
  return geo.unit == HorizontalUnit::kDegree ? read_angular_unit(keys, info) : 1.0;
}

/// GeoTIFF's annex B: pixel scale and tie point make elevations out of samples, if the file says what heights are above.
void read_vertical_scale(const AxisAligned& map, GeoTiffPlace& place) {
  if ((map.z_scale == 0.0 || map.z_scale == 1.0) && map.z_offset == 0.0) return;
  const ReferenceSystem& system = place.georeference.system;
  const bool has_heights = system.vertical_epsg || !system.vertical_datum.empty();
  if (has_heights && map.z_scale != 0.0 && std::isfinite(map.z_scale) && std::isfinite(map.z_offset)) {
    place.z_scale = map.z_scale;
    place.z_offset = map.z_offset;
    return;
  }
  place.warnings.push_back(
      fmt::format("the georeference has a scale of {} and an offset of {} in z, which are not applied: {}; `z_scale` "
                  "and `z_offset` "
                  "apply them",
                  map.z_scale, map.z_offset,
                  has_heights ? "such a scale makes all elevations equal" : "no system says what heights are above"));
}

/// EPSG codes of the units of length that have one.
std::optional<int> linear_unit_code(double metres) {
  if (metres == 1.0) return Linear_Meter;
  if (metres == 0.3048) return Linear_Foot;
  if (metres == 1200.0 / 3937.0) return Linear_Foot_US_Survey;
  if (metres == 1000.0) return 9036;
  return std::nullopt;
}

int code_or_user_defined(const std::optional<int>& epsg) {
  return epsg && *epsg > 0 && *epsg < kUserDefined ? *epsg : kUserDefined;
}

void write_linear_unit(double metres, Keys& keys) {
  const std::optional<int> code = linear_unit_code(metres);
  keys.set(ProjLinearUnitsGeoKey, code.value_or(kUserDefined));
  if (!code) keys.set(ProjLinearUnitSizeGeoKey, metres);
}

/// The names of longitudes and latitudes without a code, as GDAL writes and reads them.
void write_datum(const ReferenceSystem& system, Keys& keys) {
  const proj::Object found =
      proj::Object(system.wkt.empty() ? nullptr : proj_create(proj_context(), system.wkt.c_str()));
  const proj::Object base = proj::Object(found ? proj_crs_get_geodetic_crs(proj_context(), found.get()) : nullptr);
  if (!base) return keys.set(GeogCitationGeoKey, system.name);
  const auto name = [](const proj::Object& part) {
    std::string text = part && proj_get_name(part.get()) != nullptr ? proj_get_name(part.get()) : "unknown";
    std::replace(text.begin(), text.end(), '|', '/');
    return text;
  };
  keys.set_parts(GeogCitationGeoKey,
                 fmt::format("GCS Name = {}|Datum = {}|Ellipsoid = {}|Primem = {}", name(base),
                             name(proj::Object(proj_crs_get_datum_forced(proj_context(), base.get()))),
                             name(proj::Object(proj_get_ellipsoid(proj_context(), base.get()))),
                             name(proj::Object(proj_get_prime_meridian(proj_context(), base.get())))));
}

/// A system by its code, or, if it counts degrees, by its ellipsoid.
void write_system(const Georeference& geo, Keys& keys) {
  const ReferenceSystem& system = geo.system;
  const bool projected = geo.unit == HorizontalUnit::kMetre;
  keys.set(GTModelTypeGeoKey, projected ? ModelTypeProjected : ModelTypeGeographic);
  keys.set(projected ? ProjectedCSTypeGeoKey : GeographicTypeGeoKey, code_or_user_defined(system.epsg));
  keys.set(GTCitationGeoKey, system.name);
  if (projected) {
    write_linear_unit(geo.metres_per_unit, keys);
  } else {
    keys.set(GeogAngularUnitsGeoKey, Angular_Degree);
    system.epsg ? keys.set(GeogCitationGeoKey, system.name) : write_datum(system, keys);
  }
  if (!system.semi_major_axis_m) return;
  if (projected && !system.epsg) keys.set(GeographicTypeGeoKey, kUserDefined);
  keys.set(GeogSemiMajorAxisGeoKey, *system.semi_major_axis_m);
  if (!system.inverse_flattening) return;
  const bool is_sphere = *system.inverse_flattening == 0.0;
  keys.set(is_sphere ? GeogSemiMinorAxisGeoKey : GeogInvFlatteningGeoKey,
           is_sphere ? *system.semi_major_axis_m : *system.inverse_flattening);
}

/// A map without a code, as ArcGIS and GDAL write what keys cannot say: user-defined, and its WKT.
void write_wkt(const Georeference& geo, Keys& keys) {
  constexpr std::size_t kLongestForGdal = 2300;  // it reads this much of a citation
  std::string wkt = wkt_of(geo.system, WktDialect::kGdal);
  if (wkt.size() > kLongestForGdal) wkt = wkt_of(geo.system, WktDialect::kEsri);
  keys.set(GTModelTypeGeoKey, kUserDefined);
  keys.set(GTCitationGeoKey, geo.system.name);
  keys.set(PCSCitationGeoKey, std::string(kEsri) + wkt);
  write_linear_unit(geo.metres_per_unit, keys);
}

void write_vertical(const ReferenceSystem& system, double metres_per_unit, const std::string& unit, Keys& keys) {
  if (system.vertical_epsg) keys.set(VerticalCSTypeGeoKey, code_or_user_defined(system.vertical_epsg));
  // A datum that the code of three coordinates implies, or a unit alone, GDAL would take as a system of heights.
  const bool is_implied = system.epsg && system.vertical_datum == kAboveEllipsoid;
  if (!is_implied) keys.set(VerticalCitationGeoKey, system.vertical_datum);
  if (unit.empty() || (!system.vertical_epsg && (system.vertical_datum.empty() || is_implied))) return;
  if (const auto code = linear_unit_code(metres_per_unit)) keys.set(VerticalUnitsGeoKey, *code);
}

}  // namespace

GeoTiffPlace place_from_geotiff(const GeoTags& tags, std::int64_t rows) {
  GeoTiffPlace place;
  if (tags.empty()) return place;
  const Keys keys(tags);
  double degrees = 1.0;
  SourceInfo info;
  if (!keys.are_readable()) {
    place.warnings.push_back(loss("the GeoTIFF keys are malformed and are ignored"));
  } else if (!tags.directory.empty()) {
    degrees = read_system(keys, place, info);
  }
  Georeference& geo = place.georeference = info.georeference;
  place.vertical_unit = info.vertical_unit;
  place.metres_per_vertical_unit = info.metres_per_vertical_unit;
  place.warnings.insert(place.warnings.end(), info.warnings.begin(), info.warnings.end());
  const std::optional<AxisAligned> map = map_from_tags(tags, place.warnings);
  if (!map && tags.directory.empty()) return place;
  const bool is_point = keys.number(GTRasterTypeGeoKey) == RasterPixelIsPoint;
  geo.registration = is_point ? Registration::kPoint : Registration::kArea;
  if (!map) return place;
  require_usable(*map);
  const double to_sample = is_point ? 0.0 : 0.5;
  place.rows_from_south = map->dy > 0.0;
  const double first_row = place.rows_from_south ? static_cast<double>(rows - 1) : 0.0;
  geo.spacing_x = map->dx * degrees;
  geo.spacing_y = std::abs(map->dy) * degrees;
  geo.has_origin = map->has_origin;
  if (geo.has_origin) {
    geo.origin_x = (map->x0 + to_sample * map->dx) * degrees;
    geo.origin_y = (map->y0 + (first_row + to_sample) * map->dy) * degrees;
  }
  read_vertical_scale(*map, place);
  return place;
}

GeoTags geotiff_tags(const Georeference& georeference, double metres_per_vertical_unit,
                     const std::string& vertical_unit) {
  GeoTags tags;
  const bool has_unit = georeference.unit != HorizontalUnit::kUnknown;
  const bool has_spacing = georeference.spacing_x != 1.0 || georeference.spacing_y != 1.0;
  const bool is_area = georeference.registration == Registration::kArea;
  if (!has_unit && !has_spacing && !georeference.has_origin && !is_area) return tags;
  if (has_spacing || georeference.has_origin) tags.pixel_scale = {georeference.spacing_x, georeference.spacing_y, 0.0};
  if (georeference.has_origin) {
    const double to_corner = georeference.registration == Registration::kPoint ? 0.0 : 0.5;
    tags.tiepoints = {0.0,
                      0.0,
                      0.0,
                      georeference.origin_x - to_corner * georeference.spacing_x,
                      georeference.origin_y + to_corner * georeference.spacing_y,
                      0.0};
  }
  const ReferenceSystem& system = georeference.system;
  // Areas are what a georeference without keys stands for, and GDAL makes a system of its own out of any key.
  if (!has_unit && is_area && !tags.pixel_scale.empty() && vertical_unit.empty() && system.vertical_datum.empty() &&
      !system.vertical_epsg) {
    return tags;
  }
  Keys keys;
  keys.set(GTRasterTypeGeoKey,
           georeference.registration == Registration::kPoint ? RasterPixelIsPoint : RasterPixelIsArea);
  if (georeference.unit == HorizontalUnit::kMetre && !system.epsg && !system.wkt.empty()) {
    write_wkt(georeference, keys);
  } else if (has_unit) {
    write_system(georeference, keys);
  }
  write_vertical(system, metres_per_vertical_unit, vertical_unit, keys);
  keys.write_to(tags);
  return tags;
}

}  // namespace isohf
