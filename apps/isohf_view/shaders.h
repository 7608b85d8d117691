#pragma once

#include <string>

namespace isohf::view {

/// The terrain's vertex shader: every picture and every check draws through it. Vertex attributes: 0 the shared
/// object-space (x, z), 1 the tile's elevation codes, 2 the tile's shadow heights in codes (constant 0 without them).
/// `voids` adds the varying that fragment shaders discard by.
[[nodiscard]] std::string terrain_vertex_shader(bool voids);

/// Light, colours, borders, haze.
[[nodiscard]] std::string terrain_fragment_shader(bool voids);

/// (elevation code, normal x, normal z, 1): what verifying reads back.
[[nodiscard]] std::string probe_fragment_shader(bool voids);

/// One flat colour: wireframes.
[[nodiscard]] std::string flat_fragment_shader(bool voids);

[[nodiscard]] std::string sky_vertex_shader();
[[nodiscard]] std::string sky_fragment_shader();

[[nodiscard]] std::string overlay_vertex_shader();
[[nodiscard]] std::string overlay_fragment_shader();

}  // namespace isohf::view
