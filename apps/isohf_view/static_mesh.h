#pragma once

#include <cstdint>

#include "session.h"

namespace isohf::view {

/// What a plain static mesh costs the same driver: float positions, one plain colour, one strip drawn over and over.
struct StaticMeshSpeed {
  double frame_ms = 0.0;
  std::int64_t triangles = 0;  ///< a frame
  [[nodiscard]] double triangles_per_s() const { return 1e3 * static_cast<double>(triangles) / frame_ms; }
};

/// Draws about `triangles` a frame: copies of one full-detail tile, spread over the picture as the session's view
/// spreads the heightfield. Median of a few frames.
[[nodiscard]] StaticMeshSpeed measure_static_mesh(const Session& session, std::int64_t triangles);

}  // namespace isohf::view
