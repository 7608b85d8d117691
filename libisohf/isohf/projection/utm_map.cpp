#include "isohf/projection/projection.h"
#include "isohf/projection/reference_map.h"

namespace isohf {
namespace {

class UtmMap final : public ReferenceMap {
 public:
  UtmMap(const ProjectionSpec& spec, double metres_per_unit) : map_(spec), metres_per_unit_(metres_per_unit) {}

  [[nodiscard]] GeoPoint geo_from_map(MapPoint place) const override {
    return map_.inverse({place.easting * metres_per_unit_, place.northing * metres_per_unit_});
  }
  [[nodiscard]] MapPoint map_from_geo(GeoPoint place) const override {
    const MapPoint metres = map_.forward(place);
    return {metres.easting / metres_per_unit_, metres.northing / metres_per_unit_};
  }
  [[nodiscard]] double metres_per_unit() const override { return metres_per_unit_; }
  [[nodiscard]] const Ellipsoid& ellipsoid() const override { return map_.spec().ellipsoid; }

 private:
  Projection map_;
  double metres_per_unit_;
};

}  // namespace

std::shared_ptr<const ReferenceMap> utm_map(const std::string& text, std::optional<double> metres_per_unit) {
  if (!text.starts_with("EPSG:32") || text.size() != 10 || text.find_first_not_of("0123456789", 5) != text.npos) {
    return nullptr;
  }
  const bool is_south = text[7] == '7';
  const int zone = 10 * (text[8] - '0') + text[9] - '0';
  if (!(is_south || text[7] == '6') || zone < 1 || zone > 60) return nullptr;
  ProjectionSpec spec;
  spec.kind = ProjectionKind::kUtm;
  spec.utm_zone = is_south ? -zone : zone;
  spec.longitude_0 = 6.0 * zone - 183.0;
  spec.scale_0 = 0.9996;
  spec.false_easting = 500000.0;
  spec.false_northing = is_south ? 10000000.0 : 0.0;
  return std::make_shared<UtmMap>(spec, metres_per_unit.value_or(1.0));
}

}  // namespace isohf
