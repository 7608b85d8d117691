#include "isohf/lattice/lod.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace isohf {

double triangle_area(const TileGrid& grid, double slope) {
  // Side 2σx on a row, height σz: an area of σx·σz on the ground.
  return grid.sigma_x() * grid.sigma_z() * std::sqrt(1.0 + slope * slope);
}

double projected_area_px(double world_area, double focal_px, double distance) {
  if (!(distance > 0.0)) return std::numeric_limits<double>::infinity();
  const double scale = focal_px / distance;
  return world_area * scale * scale;
}

double fractional_level(double area_px, int levels, double target_px) {
  const double level = 0.5 * std::log2(target_px / area_px);
  if (std::isnan(level)) return 0.0;
  return std::clamp(level, 0.0, static_cast<double>(levels - 1));
}

LodBlend lod_blend(double level, int levels) {
  const double kept = std::isnan(level) ? 0.0 : std::clamp(level, 0.0, static_cast<double>(levels - 1));
  const int fine = static_cast<int>(kept);
  const int coarse = std::min(fine + 1, levels - 1);
  const double beta = kept - fine;
  if (beta < 0.5) return {fine, coarse, 2.0 * beta};
  return {coarse, fine, 2.0 - 2.0 * beta};
}

}  // namespace isohf
