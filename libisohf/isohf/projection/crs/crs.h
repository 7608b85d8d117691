#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "isohf/projection.h"
#include "isohf/projection/crs/proj.h"
#include "isohf/projection/crs/proj_operation.h"
#include "isohf/raster.h"

namespace isohf {

/// What heights are called that are the third coordinate of longitudes and latitudes, or of a map.
inline constexpr const char* kAboveEllipsoid = "the ellipsoid";

/// Dialects of well-known text: ISO 19162:2019, version 1 as GDAL writes it, version 1 as ESRI has it in a .prj.
enum class WktDialect { kWkt2, kGdal, kEsri };

/// A coordinate reference system, as PROJ understands it: its horizontal part, whose coordinates are East before North
/// whatever the order of its axes, and what it says of heights. Immutable and thread-safe.
class Crs final : public ReferenceMap {
 public:
  struct Description {
    std::string name;                 ///< of the horizontal part: "WGS 84 / UTM zone 32N"
    std::string authority;            ///< "EPSG", "ESRI", "IAU_2015", ...; empty where the text gives none
    std::string code;                 ///< "32632"
    std::optional<int> epsg;          ///< the code, if it is EPSG's
    std::string datum;                ///< of the geographic system, where that has but an ensemble
    bool is_datum_known = true;       ///< false: nothing but an ellipsoid is named
    bool is_projected = false;        ///< else longitudes and latitudes
    bool is_compound = false;         ///< heights belong to it
    double unit = 1.0;                ///< of its axes: metres, or degrees where it is not projected
    double prime_meridian_deg = 0.0;  ///< East of Greenwich
    Ellipsoid ellipsoid;
    std::string vertical_name;  ///< "NAVD88 height (ftUS)", or kAboveEllipsoid; empty: nothing is said of heights
    std::optional<int> vertical_epsg;
    std::string vertical_unit;              ///< "US survey foot"
    double metres_per_vertical_unit = 1.0;  ///< negative: depths
  };

  /// Understands "EPSG:2154", WKT of any version and dialect, PROJJSON, PROJ strings, and the whole name of a system.
  /// The last few systems are remembered.
  /// metres_per_unit  of the coordinates that are asked for; nullopt: as the system has it
  /// vertical_epsg    of the heights, where the text says nothing of them
  /// Throws Error, in one line: kInvalidArgument where PROJ does not understand the text, or it is of no system of places
  /// on the ground; kUnsupported for axes that no raster has (counted westwards, about a rotated pole, in two units);
  /// kIo where PROJ's database is missing.
  [[nodiscard]] static std::shared_ptr<const Crs> parse(const std::string& text,
                                                        std::optional<double> metres_per_unit = std::nullopt,
                                                        std::optional<int> vertical_epsg = std::nullopt);

  [[nodiscard]] const Description& description() const { return description_; }
  /// All of it on one line, heights included; empty where the dialect has no words for it.
  [[nodiscard]] std::string wkt(WktDialect dialect) const;
  /// The code of EPSG's system that this is, however it is spelled; nullopt where there is none for certain.
  [[nodiscard]] std::optional<int> identified() const;

  /// Whether both are one system, however they are spelled and named.
  [[nodiscard]] bool is_same(const Crs& other) const { return is_same(other, false); }
  /// The same, but a datum that one of them leaves unknown may be the other's.
  [[nodiscard]] bool may_be(const Crs& other) const;

  [[nodiscard]] GeoPoint geo_from_map(MapPoint place) const override;
  [[nodiscard]] MapPoint map_from_geo(GeoPoint place) const override;
  [[nodiscard]] double metres_per_unit() const override { return metres_per_unit_; }
  [[nodiscard]] const Ellipsoid& ellipsoid() const override { return description_.ellipsoid; }

  /// What PROJ holds of its database for one more system; the first is part of the program.
  static constexpr std::uint64_t kProjBytes = 5'000'000;

 private:
  friend class CrsParts;  // crs_operation.cpp: what operations are looked for with

  Crs(const std::string& text, std::optional<double> metres_per_unit, std::optional<int> vertical_epsg);
  void describe();
  void describe_datum();
  void describe_heights();
  [[nodiscard]] std::optional<int> find_code() const;
  [[nodiscard]] bool is_same(const Crs& other, bool any_datum) const;
  [[nodiscard]] bool is_equivalent(const Crs& other) const;
  [[nodiscard]] bool has_same_places(const Crs& other) const;

  mutable std::mutex mutex_;  ///< of what is made with context_ later
  /// PROJ looks through its database for a tenth of a second; nullopt: not yet.
  mutable std::optional<std::optional<int>> identified_;
  proj::Context context_;
  proj::Object whole_;             ///< all of it
  proj::Object horizontal_;        ///< without heights, and without its binding to another datum
  double degrees_per_unit_ = 1.0;  ///< of the longitudes and latitudes beneath
  Description description_;
  std::optional<ProjOperation> to_geo_;
  double metres_per_unit_ = 1.0;
  double scale_ = 1.0;  ///< units of the system in one of the coordinates
};

/// What names a file's system to Crs::parse: "EPSG:n", or the WKT; empty where a file has neither.
[[nodiscard]] std::string system_text(const ReferenceSystem& system);

/// Text that other programs read, heights included; where `dialect` has no words for it, GDAL's, else WKT 2. Where PROJ
/// does not understand the system: the WKT as it was found.
[[nodiscard]] std::string wkt_of(const ReferenceSystem& system, WktDialect dialect);

/// Whether two systems are one, as far as it can be told: by their codes, their texts, else by PROJ. nullopt where one
/// of them says nothing, or neither can be understood.
[[nodiscard]] std::optional<bool> are_same(const ReferenceSystem& a, const ReferenceSystem& b);

/// Crs::parse where coordinates and places are all that is wanted: PROJ is left alone where utm_map() knows the system.
[[nodiscard]] std::shared_ptr<const ReferenceMap> understand_map(const std::string& text,
                                                                 std::optional<double> metres_per_unit);

/// For messages: a system's name, or its text where that is a PROJ string, which has none.
[[nodiscard]] std::string shown_name(const std::string& name, const std::string& text);

}  // namespace isohf
