#pragma once

#include <string>

#include "view_state.h"

namespace isohf::view {

/// The terrain's vertex shader: every picture and every check draws through it. Vertex attributes: 0 the shared
/// object-space (x, z); 1, 2, 3 the tile's elevation codes around the vertex; 4 the tile's shadow heights in codes
/// (constant 0 without them).
/// `rim` is the variant for tiles with voids, or that reach beyond what the source covers: it adds what fragment
/// shaders discard by, and clip distances.
[[nodiscard]] std::string terrain_vertex_shader(bool rim);

/// Light, colours, haze, and tile borders where wanted. A program for each mode.
[[nodiscard]] std::string terrain_fragment_shader(bool rim, ColourMode mode, bool borders);

/// (elevation code, normal x, normal z, 1): what verifying reads back.
[[nodiscard]] std::string probe_fragment_shader(bool rim);

/// (share of the sun, shadow height above the ground in codes, 0, 1): what verifying reads back of shadows.
[[nodiscard]] std::string shadow_probe_fragment_shader(bool rim);

/// One flat colour: wireframes.
[[nodiscard]] std::string flat_fragment_shader(bool rim);

[[nodiscard]] std::string sky_vertex_shader();
[[nodiscard]] std::string sky_fragment_shader();

[[nodiscard]] std::string overlay_vertex_shader();
[[nodiscard]] std::string overlay_fragment_shader();

}  // namespace isohf::view
