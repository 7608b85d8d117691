#pragma once

#include <cstdint>

#include "session.h"

namespace isohf::view {

/// The same picture's triangles, drawn twice.
struct MeshSpeed {
  std::int64_t triangles = 0;  ///< a frame
  struct Time {
    double wall_ms = 0.0;
    double processor_ms = 0.0;  ///< of all threads: hardly depends on what else the machine does
  };
  Time ours;   ///< a whole frame of the session, nothing left to load
  Time plain;  ///< the same meshes from float positions, in one plain colour, without sky or fading
};

/// What a plain static mesh costs the same driver: every mesh that the session's frame draws, strip by strip and at the
/// same places, but with its vertices' positions laid out beforehand, and no light. Loads all tiles in reach first.
/// Medians of a few frames.
[[nodiscard]] MeshSpeed measure_static_mesh(Session& session);

}  // namespace isohf::view
