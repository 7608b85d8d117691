#include <fmt/format.h>

#include <algorithm>

#include "formats/write/encoders.h"
#include "formats/write/raster_sink.h"
#include "isohf/projection/crs/source_system.h"

namespace isohf {

std::vector<Warning> losses_of(const std::string& path, const RasterSpec& spec) {
  const RasterTraits traits = raster_traits(path);
  std::vector<Warning> lost;
  const auto add = [&](const std::string& what) { lost.push_back(loss(path + ": " + what)); };
  if ((spec.z_scale != 1.0 || spec.z_offset != 0.0) && !traits.states_scale) {
    add(fmt::format("has no place for what its raw numbers mean: elevation = raw * {} + {}", spec.z_scale,
                    spec.z_offset));
  }
  const auto has_statistics = [&] {
    return std::ranges::any_of(sidecars_of(path, spec),
                               [](const Sidecar& file) { return file.path.ends_with(".aux.xml"); });
  };
  if (spec.metres_per_vertical_unit != 1.0 && !traits.states_scale && !has_statistics()) {
    add(fmt::format("has no place for the unit of its elevations, {}: readers take them for metres",
                    spec.vertical_unit));
  }
  if (!traits.is_srtm) return lost;
  const ReferenceSystem system = spec.georeference ? spec.georeference->system : ReferenceSystem{};
  const bool is_in_degrees = spec.georeference && spec.georeference->unit == HorizontalUnit::kDegree;
  constexpr int kWgs84 = 4326;
  constexpr int kWgs84WithHeights = 4979;
  const int code = system.epsg.value_or(kWgs84);
  if (!(system.body.empty() || system.body == "Earth") ||
      (is_in_degrees && code != kWgs84 && code != kWgs84WithHeights))
    add("readers take it for degrees of WGS 84, which its samples do not lie on");
  if (system.vertical_datum.find("llipsoid") != std::string::npos ||
      (is_in_degrees && system.epsg && system.vertical_datum.empty() && gives_heights_above_ellipsoid(*system.epsg)))
    add("readers take it for heights above the geoid, and these are above the ellipsoid");
  return lost;
}

}  // namespace isohf
