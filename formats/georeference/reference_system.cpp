#include "formats/georeference/reference_system.h"

#include <fmt/format.h>

#include <cmath>

#include "formats/georeference/proj_module.h"
#include "formats/module_loader.h"
#include "isohf/convert.h"
#include "isohf/error.h"

namespace isohf {
namespace {

const IsohfProjModule& proj_module() {
  return *static_cast<const IsohfProjModule*>(
      load_module({"isohf_proj.so", ISOHF_PROJ_SYMBOL, ISOHF_PROJ_ABI, "reference systems need the PROJ module",
                   "ISOHF_BUILD_PROJ_MODULE"}));
}

class ProjSystem final : public UnderstoodSystem {
 public:
  ProjSystem(const std::string& text, std::optional<double> metres_per_unit) : module_(proj_module()) {
    IsohfProjInfo info{};
    IsohfProjMessage message{};
    const int result = module_.open(text.c_str(), &system_, &info, &message);
    if (result != 0) {
      const std::string shown = text.size() > 60 ? text.substr(0, 60) + "..." : text;
      throw Error(module_error_code(result), fmt::format("the reference system {}: {}", shown, message.text));
    }
    description_.name = info.name;
    description_.authority = info.authority;
    description_.code = info.code;
    description_.datum = info.datum;
    description_.is_projected = info.is_projected != 0;
    description_.is_compound = info.is_compound != 0;
    // PROJ's database has 15 digits of it.
    constexpr double kUsFoot = 1200.0 / 3937.0;
    description_.unit = std::abs(info.metres_per_unit - kUsFoot) < 1e-14 ? kUsFoot : info.metres_per_unit;
    description_.ellipsoid = {info.semi_major_axis_m, info.inverse_flattening};
    description_.wkt2.resize(info.wkt_bytes);
    module_.wkt(system_, description_.wkt2.data());
    description_.wkt2.pop_back();
    metres_per_unit_ = description_.is_projected ? metres_per_unit.value_or(description_.unit) : 1.0;
    scale_ = description_.is_projected ? metres_per_unit_ / description_.unit : 1.0;
  }
  ~ProjSystem() override { module_.close(system_); }

  [[nodiscard]] const Description& description() const override { return description_; }
  [[nodiscard]] double metres_per_unit() const override { return metres_per_unit_; }
  [[nodiscard]] const Ellipsoid& ellipsoid() const override { return description_.ellipsoid; }
  /// libproj, SQLite and what they read of proj.db.
  [[nodiscard]] std::uint64_t memory_bytes() const override { return 14'000'000; }

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
  const IsohfProjModule& module_;
  IsohfProjSystem* system_ = nullptr;
  Description description_;
  double metres_per_unit_ = 1.0;
  double scale_ = 1.0;  ///< units of the system in one of the coordinates
};

}  // namespace

std::shared_ptr<const UnderstoodSystem> understand_system(const std::string& text,
                                                          std::optional<double> metres_per_unit) {
  return std::make_shared<ProjSystem>(text, metres_per_unit);
}

std::shared_ptr<const ReferenceMap> understand_map(const std::string& text, std::optional<double> metres_per_unit) {
  if (auto utm = utm_map(text, metres_per_unit)) return utm;
  return understand_system(text, metres_per_unit);
}

std::string system_text(const ReferenceSystem& system) {
  return system.epsg ? fmt::format("EPSG:{}", *system.epsg) : system.wkt;
}

void understand_ground(const SourceInfo& info, GroundRequest& request) {
  const Georeference& place = info.georeference;
  const std::string text = system_text(place.system);
  if (place.unit != HorizontalUnit::kMetre || !place.has_origin || text.empty()) return;
  try {
    request.source_map = understand_map(text, place.metres_per_unit);
  } catch (const Error& error) {
    request.why_no_map = error.what();
  }
}

}  // namespace isohf
