#pragma once

#include "paging/tile_source.h"

namespace isohf::view {

/// The sun whose shadows are drawn.
struct ShadowSun {
  enum class State {
    kNoSeeds,  ///< the source has none
    kNone,     ///< nothing is shaded: it is night, or light travels along the columns
    kExact,    ///< `sun` is the one asked for
    kNearest,  ///< the seeds do not hold for that one: `sun` is the nearest that they hold for
  };
  State state = State::kNoSeeds;
  RowSun sun;
  double seen_deg = 0.0;  ///< kExact, kNearest: elevation of `sun` as it is drawn, exaggeration included
};

/// Shadows are those of light along the rows (paper section 3.13). The sun is taken as it is seen in the rows' plane:
/// in the East or West as its azimuth has it, at the elevation whose tangent is tan(elevation) / |sin(azimuth)|, as
/// high as the real one in the due East and West, where this is `isohf shade`'s sun, and overhead due North and South.
/// Exaggerated heights cast what true ones cast under the sun of tan(elevation) / exaggeration.
/// seeds  may be nullptr      azimuth_deg  clockwise from North     elevation_deg  of the sun that shines
[[nodiscard]] ShadowSun shadow_sun(const ShadowSeedInfo* seeds, double azimuth_deg, double elevation_deg,
                                   double exaggeration);

}  // namespace isohf::view
