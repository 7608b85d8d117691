#include "shaders.h"

namespace isohf::view {
namespace {

std::string header(bool voids) {
  return voids ? "#version 330 core\n#define VOIDS\n" : "#version 330 core\n";
}

// Positions: a vertex's place in the whole heightfield is an integer (LatticeVertex). Only its distance from an anchor
// near the eye becomes a float, by the same operations for every tile, so that two tiles put a shared vertex in exactly
// one place and no crack can open between them.
//
// Normals: paper Eqs. 10-11 with errata E5-E10, for the four kinds of fan of isohf/surface/normals.h. Differences of
// codes are exact in integers, so both tiles of an edge also get the same normal, bit for bit. Neighbours (s is 1 on
// odd rows):
//
//      NW = v-C-1+s   NE = v-C+s          West edge, odd row:  N = v-C    NW = v-C-1
//   W = v-1     v     E = v+1             East edge, odd row:  N = v-C+1  NE = v-C+2
//      SW = v+C-1+s   SE = v+C+s          edge, even row:      N = v-C (West), v-C-1 (East)
constexpr const char* kTerrainVertex = R"glsl(
layout(location = 0) in ivec2 object_xz;
layout(location = 1) in uint elevation_code;
layout(location = 2) in uint shadow_code;

uniform usamplerBuffer tile_codes;
uniform ivec2 tile_shape;       // C, R
uniform ivec2 tile_lattice;     // the tile's North-West corner, lattice steps from the anchor
uniform vec2 sigma;             // world units of one object-space step in x and z
uniform vec3 anchor;            // the anchor's place, seen from the eye; y: elevation of code 0
uniform float code_height;      // world units of one code, exaggeration included
uniform float code_slope;       // the same for normals
uniform mat4 clip_from_eye;
uniform vec4 covered;           // West, North, East, South of what is shown, seen from the eye

out gl_PerVertex {
  vec4 gl_Position;
  float gl_ClipDistance[4];     // only looked at where the renderer asks for it
};
out vec3 v_eye;                 // world axes, seen from the eye
out vec3 v_normal;
out vec2 v_object;
out float v_code;
out float v_shadow;             // world units that the shadow lies above the ground
#ifdef VOIDS
out float v_void;
#endif

int code_at(int vertex) { return int(texelFetch(tile_codes, vertex).r); }

vec3 vertex_normal(int vertex) {
  int columns = tile_shape.x;
  int column = vertex % columns;
  int row = vertex / columns;
  int odd = row & 1;
  bool west = column == 1;
  bool east = column == columns - 3 + (1 - odd);
  int w = code_at(vertex - 1);
  int e = code_at(vertex + 1);
  if (odd == 0 && (west || east)) {
    int shift = east ? -1 : 0;
    int n = code_at(vertex - columns + shift);
    int s = code_at(vertex + columns + shift);
    if (max(max(w, e), max(n, s)) == 65535 || code_at(vertex) == 65535) return vec3(0.0, 1.0, 0.0);
    return normalize(vec3(float(w - e) * code_slope / (2.0 * sigma.x), 1.0,
                          float(n - s) * code_slope / (2.0 * sigma.y)));
  }
  int north = vertex - columns + odd;
  int south = vertex + columns + odd;
  int nw = code_at(north - 1);
  int sw = code_at(south - 1);
  int ne = code_at(north);
  int se = code_at(south);
  int worst = max(max(max(w, e), code_at(vertex)), max(max(nw, ne), max(sw, se)));
  int rise_z = (ne - se) + (nw - sw);
  float steps_x = 12.0;
  float steps_z = 4.0;
  if (odd == 1 && (west || east)) {
    // What was read as NW (NE at the East edge) is the slid vertex straight North; the true one lies beyond.
    int beyond_n = code_at(west ? north - 2 : north + 1);
    int beyond_s = code_at(west ? south - 2 : south + 1);
    worst = max(worst, max(beyond_n, beyond_s));
    rise_z += beyond_n - beyond_s;
    steps_z = 6.0;
    if (west) {
      nw = beyond_n;
      sw = beyond_s;
    } else {
      ne = beyond_n;
      se = beyond_s;
    }
  } else if (odd == 0 && (column == 2 || column == columns - 3)) {
    // Beside an edge the slid vertex is half as far away as an ordinary neighbour.
    int west_share = column == 2 ? 2 : 3;
    int east_share = column == columns - 3 ? 2 : 3;
    rise_z = east_share * (ne - se) + west_share * (nw - sw);
    steps_x = float(2 * (west_share + east_share));
    steps_z = steps_x;
  }
  if (worst == 65535) return vec3(0.0, 1.0, 0.0);
  int rise_x = 2 * (w - e) + (sw - se) + (nw - ne);
  return normalize(vec3(float(rise_x) * code_slope / (steps_x * sigma.x), 1.0,
                        float(rise_z) * code_slope / (steps_z * sigma.y)));
}

void main() {
  ivec2 lattice = tile_lattice + object_xz;
  float height = float(elevation_code) * code_height;
  v_eye = anchor + vec3(float(lattice.x) * sigma.x, height, float(lattice.y) * sigma.y);
  v_normal = vertex_normal(gl_VertexID);
  v_object = vec2(object_xz);
  v_code = float(elevation_code);
  v_shadow = max(float(shadow_code) - float(elevation_code), 0.0) * code_height;
#ifdef VOIDS
  v_void = elevation_code == 65535u ? 1.0 : 0.0;
#endif
  gl_Position = clip_from_eye * vec4(v_eye, 1.0);
  gl_ClipDistance[0] = v_eye.x - covered.x;
  gl_ClipDistance[1] = v_eye.z - covered.y;
  gl_ClipDistance[2] = covered.z - v_eye.x;
  gl_ClipDistance[3] = covered.w - v_eye.z;
}
)glsl";

constexpr const char* kDiscardVoid = R"glsl(
#ifdef VOIDS
in float v_void;
#define DISCARD_VOID if (v_void > 0.0) discard
#else
#define DISCARD_VOID
#endif
)glsl";

// Modes, as in view_state.h: 0 elevation colours, 1 plain, 2 levels of detail, 3 strip order, 4 texture, 5 normals.
constexpr const char* kTerrainFragment = R"glsl(
in vec3 v_eye;
in vec3 v_normal;
in vec2 v_object;
in float v_code;
in float v_shadow;
out vec4 colour;

uniform int mode;
uniform int level;              // of the mesh in hand
uniform bool is_stitch;
uniform float alpha;
uniform bool borders;
uniform vec2 object_size;       // 2(C-4), R-3
uniform vec2 ramp;              // code at the ramp's foot, 1/codes of its height
uniform vec3 sun;               // towards the sun
uniform float penumbra;         // k of Eq. 16, world units
uniform vec2 haze;              // distances where it begins and is complete; x >= y: none
uniform vec3 horizon;
uniform sampler2D tile_texture;

vec3 hypsometric(float t) {
  const int kCount = 8;
  vec3 stops[8] = vec3[8](vec3(0.17, 0.36, 0.30), vec3(0.30, 0.48, 0.27), vec3(0.53, 0.60, 0.34),
                          vec3(0.74, 0.69, 0.45), vec3(0.67, 0.53, 0.36), vec3(0.54, 0.42, 0.34),
                          vec3(0.66, 0.63, 0.61), vec3(0.95, 0.96, 0.98));
  float at = clamp(t, 0.0, 1.0) * float(kCount - 1);
  int i = min(int(at), kCount - 2);
  return mix(stops[i], stops[i + 1], at - float(i));
}

vec3 level_colour(int l) {
  vec3 colours[6] = vec3[6](vec3(0.85, 0.33, 0.28), vec3(0.93, 0.66, 0.25), vec3(0.60, 0.76, 0.32),
                            vec3(0.25, 0.64, 0.62), vec3(0.30, 0.45, 0.80), vec3(0.55, 0.35, 0.70));
  return colours[l % 6];
}

// The paper's Fig. 6: even rows of triangles red, drawn from East to West, odd rows blue, from West to East; the
// colour deepens along the way and every second triangle is lighter.
vec3 strip_colour() {
  if (is_stitch) return vec3(0.95, 0.85, 0.25);
  float row = floor(v_object.y / exp2(float(level)));
  bool red = mod(row, 2.0) < 0.5;
  float way = clamp(v_object.x / object_size.x, 0.0, 1.0);
  if (red) way = 1.0 - way;
  vec3 base = red ? mix(vec3(1.0, 0.75, 0.65), vec3(0.75, 0.10, 0.10), way)
                  : mix(vec3(0.70, 0.82, 1.0), vec3(0.10, 0.20, 0.75), way);
  return (gl_PrimitiveID & 1) == 0 ? base : mix(base, vec3(1.0), 0.18);
}

void main() {
  DISCARD_VOID;
  vec3 normal = normalize(v_normal);
  vec3 base = vec3(0.80, 0.79, 0.76);
  if (mode == 0) base = hypsometric((v_code - ramp.x) * ramp.y);
  if (mode == 2) base = is_stitch ? level_colour(level) * 0.8 : level_colour(level);
  if (mode == 3) base = strip_colour();
  if (mode == 4) base = texture(tile_texture, v_object / object_size).rgb;
  if (borders) {
    vec2 inside = min(v_object, object_size - v_object);
    vec2 width = max(fwidth(v_object), vec2(1e-6));
    float edge = min(inside.x / width.x, inside.y / width.y);
    base = mix(vec3(0.05, 0.05, 0.08), base, clamp(edge - 0.5, 0.25, 1.0));
  }
  // Eq. 16 with S >= y on the ground: fully lit where the ground itself is S, dark where S lies k above it.
  float lit = clamp(1.0 - v_shadow / penumbra, 0.0, 1.0);
  float direct = max(dot(normal, sun), 0.0) * lit;
  float sky = 0.5 + 0.5 * normal.y;
  float day = clamp(sun.y * 6.0 + 0.25, 0.05, 1.0);
  vec3 warm = mix(vec3(1.0, 0.62, 0.36), vec3(1.0, 0.96, 0.88), clamp(sun.y * 2.5, 0.0, 1.0));
  vec3 light = vec3(0.33, 0.39, 0.48) * sky * day + warm * 0.95 * direct * (sun.y > 0.0 ? 1.0 : 0.0);
  vec3 shown = mode == 5 ? normal * 0.5 + 0.5 : base * light;
  if (haze.x < haze.y) {
    float amount = smoothstep(haze.x, haze.y, length(v_eye));
    shown = mix(shown, horizon, amount);
  }
  colour = vec4(pow(shown, vec3(1.0 / 1.6)), alpha);
}
)glsl";

constexpr const char* kProbeFragment = R"glsl(
in vec3 v_normal;
in float v_code;
out vec4 probe;
uniform float alpha;
void main() {
  DISCARD_VOID;
  probe = vec4(v_code, v_normal.x, v_normal.z, alpha);
}
)glsl";

constexpr const char* kFlatFragment = R"glsl(
in vec3 v_eye;
out vec4 colour;
uniform vec4 flat_colour;
uniform float fade_distance;    // where lines begin to vanish; gone at three times as far; 0: never
void main() {
  DISCARD_VOID;
  colour = flat_colour;
  if (fade_distance > 0.0) colour.a *= clamp(1.5 - 0.5 * length(v_eye) / fade_distance, 0.0, 1.0);
}
)glsl";

}  // namespace

std::string terrain_vertex_shader(bool voids) {
  return header(voids) + kTerrainVertex;
}
std::string terrain_fragment_shader(bool voids) {
  return header(voids) + kDiscardVoid + kTerrainFragment;
}
std::string probe_fragment_shader(bool voids) {
  return header(voids) + kDiscardVoid + kProbeFragment;
}
std::string flat_fragment_shader(bool voids) {
  return header(voids) + kDiscardVoid + kFlatFragment;
}

std::string sky_vertex_shader() {
  return header(false) + R"glsl(
out vec2 v_ndc;
void main() {
  v_ndc = vec2(float((gl_VertexID & 1) * 4 - 1), float((gl_VertexID & 2) * 2 - 1));
  gl_Position = vec4(v_ndc, 1.0, 1.0);
}
)glsl";
}

std::string sky_fragment_shader() {
  return header(false) + R"glsl(
in vec2 v_ndc;
out vec4 colour;
uniform mat3 world_from_camera;
uniform vec2 half_view;         // tangents of half the fields of view
uniform vec3 sun;
uniform vec3 horizon;
uniform vec3 zenith;
void main() {
  vec3 ray = normalize(world_from_camera * vec3(v_ndc * half_view, -1.0));
  vec3 sky = mix(horizon, zenith, 1.0 - exp(-2.2 * max(ray.y, 0.0)));
  if (sun.y > -0.1) {
    float near_sun = max(dot(ray, sun), 0.0);
    sky += vec3(1.0, 0.75, 0.45) * (0.25 * pow(near_sun, 24.0) + 0.6 * smoothstep(0.9995, 0.9998, near_sun));
  }
  colour = vec4(pow(sky, vec3(1.0 / 1.6)), 1.0);
}
)glsl";
}

std::string overlay_vertex_shader() {
  return header(false) + R"glsl(
layout(location = 0) in vec2 pixel;
layout(location = 1) in vec2 glyph;
uniform vec2 view_size;
out vec2 v_glyph;
void main() {
  v_glyph = glyph;
  gl_Position = vec4(pixel.x / view_size.x * 2.0 - 1.0, 1.0 - pixel.y / view_size.y * 2.0, 0.0, 1.0);
}
)glsl";
}

std::string overlay_fragment_shader() {
  return header(false) + R"glsl(
in vec2 v_glyph;
out vec4 colour;
uniform sampler2D font;
void main() {
  // A negative x marks the panel behind the text.
  if (v_glyph.x < 0.0) {
    colour = vec4(0.04, 0.05, 0.08, 0.62);
    return;
  }
  if (texelFetch(font, ivec2(v_glyph), 0).r < 0.5) discard;
  colour = vec4(0.96, 0.96, 0.92, 1.0);
}
)glsl";
}

}  // namespace isohf::view
