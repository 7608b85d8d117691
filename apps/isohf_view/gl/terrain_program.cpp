#include "gl/terrain_program.h"

#include <algorithm>

namespace isohf::view {
namespace {

constexpr const char* kHeader = "#version 330 core\n";

// Positions: a vertex's place in the whole heightfield is an integer (LatticeVertex). Only its distance from an anchor
// near the eye becomes a float, by the same operations for every tile, so that two tiles put a shared vertex in exactly
// one place and no crack can open between them.
//
// Normals: paper Eqs. 10-11 with errata E5-E10, for the four kinds of fan of isohf/light/normals.h. Differences of
// codes are exact in integers, so both tiles of an edge also get the same normal, bit for bit. Codes are fetched by the
// vertex's number v:
//
//   north   v-C-1  v-C  v-C+1  v-C+2       even row: NW = x, NE = y; on the West edge N = y, on the East edge N = x
//   here      v-1   v    v+1               odd row:  NW = y, NE = z; on the West edge NW = x, N = y, NE = z,
//   south   v+C-1  v+C  v+C+1  v+C+2                                 on the East edge NW = y, N = z, NE = w
constexpr const char* kTerrainVertex = R"glsl(
layout(location = 0) in ivec2 object_xz;
layout(location = 1) in float shadow;

uniform usamplerBuffer codes;   // of the tile, with a row and two vertices of nothing before and behind
uniform ivec2 last_xz;          // 2(C-4), R-3: the East and South edges
uniform ivec2 tile_lattice;     // the tile's North-West corner, lattice steps from the anchor
uniform int stride;             // lattice steps of one of the tile's: of its plane
uniform ivec4 world;            // the heightfield's first and last place, lattice steps from the anchor
uniform vec2 sigma;             // world units of one object-space step in x and z
uniform vec3 anchor;            // the anchor's place, seen from the eye; y: elevation of code 0
uniform float code_height;      // world units of one code, exaggeration included
uniform mat4 clip_from_eye;
invariant gl_Position;          // all programs put a vertex in the same place
// Few slots: a software rasteriser pays for each slot and triangle.
out vec4 v_facing;              // unit normal, distance from the eye
out vec4 v_place;               // object space x and z, elevation code, depth in the shadow
out vec3 v_eye;                 // place seen from the eye
uniform vec4 covered;           // West, North, East, South of what is shown, seen from the eye
out float gl_ClipDistance[4];   // only looked at where the renderer asks for it
centroid out float v_void;       // not beyond the triangle, where a pixel of several samples only touches it

int code(int v) { return int(texelFetch(codes, v).r); }

// Those of a row that the normal takes, below or above vertex v; 0 else.
ivec4 around(int v, bool odd, bool west, bool east) {
  return ivec4(odd && !west ? 0 : code(v - 1), code(v), odd ? code(v + 1) : 0, odd && east ? code(v + 2) : 0);
}

vec3 vertex_normal(int v, int own) {
  int columns = last_xz.x / 2 + 4;
  bool odd = (object_xz.y & 1) == 0;  // the grid row is z + 1
  bool west = object_xz.x == 0;
  bool east = object_xz.x == last_xz.x;
  int north = v - columns;
  int south = v + columns;
  int before = code(v - 1);
  int behind = code(v + 1);
  ivec4 n = around(north, odd, west, east);
  ivec4 s = around(south, odd, west, east);
  ivec4 fall = n - s;
  int across = 2 * (before - behind);
  int rise_x;
  int rise_z;
  int steps_x = 12;
  int steps_z;
  if (odd) {
    ivec2 nws = west ? ivec2(n.x, s.x) : ivec2(n.y, s.y);
    ivec2 nes = east ? ivec2(n.w, s.w) : ivec2(n.z, s.z);
    rise_x = across + (nws.y - nes.y) + (nws.x - nes.x);
    rise_z = fall.y + fall.z + (west ? fall.x : 0) + (east ? fall.w : 0);
    steps_z = west || east ? 6 : 4;
  } else {
    // Beside an edge the slid vertex is half as far away as an ordinary neighbour; on it, one side is the edge's own.
    bool edge = west || east;
    int west_share = west ? 0 : object_xz.x == 1 ? 2 : 3;
    int east_share = east ? 0 : object_xz.x == last_xz.x - 1 ? 2 : 3;
    rise_x = across + (edge ? 0 : (s.x - s.y) + (n.x - n.y));
    rise_z = west_share * fall.x + east_share * fall.y;
    steps_z = 2 * (west_share + east_share);
    steps_x = edge ? 4 : steps_z;
  }
  int worst = max(max(before, own), behind);
  ivec4 either = max(n, s);
  if (odd) {
    worst = max(worst, max(either.y, either.z));
    worst = max(worst, max(west ? either.x : 0, east ? either.w : 0));
  } else {
    worst = max(worst, max(west ? 0 : either.x, east ? 0 : either.y));
  }
  if (worst == 65535) return vec3(0.0, 1.0, 0.0);
  return normalize(vec3(float(rise_x) * code_height / (float(steps_x * stride) * sigma.x), 1.0,
                        float(rise_z) * code_height / (float(steps_z * stride) * sigma.y)));
}

void main() {
  // Tiles of coarse planes end with the heightfield.
  ivec2 lattice = clamp(tile_lattice + object_xz * stride, world.xy, world.zw);
  int v = gl_VertexID + last_xz.x / 2 + 6;
  int own = code(v);
  float height = float(own) * code_height;
  vec3 eye = anchor + vec3(float(lattice.x) * sigma.x, height, float(lattice.y) * sigma.y);
  v_facing = vec4(vertex_normal(v, own), length(eye));
  v_eye = eye;
  v_place = vec4(vec2(lattice - tile_lattice) / float(stride), float(own), shadow);
  gl_Position = clip_from_eye * vec4(eye, 1.0);
  v_void = own == 65535 ? 1.0 : 0.0;
  gl_ClipDistance[0] = eye.x - covered.x;
  gl_ClipDistance[1] = eye.z - covered.y;
  gl_ClipDistance[2] = covered.z - eye.x;
  gl_ClipDistance[3] = covered.w - eye.z;
}
)glsl";

constexpr const char* kDiscardVoid = R"glsl(
centroid in float v_void;
#define DISCARD_VOID if (v_void > 0.0) discard
)glsl";

// MODE as in view_state.h: 0 elevation colours, 1 levels of detail, 2 strip order, 3 texture, 4 normals. Each
// mode is a program of its own, and what does not change from pixel to pixel comes as a uniform: a software rasteriser
// takes every branch and repeats every sum in every pixel.
constexpr const char* kTerrainFragment = R"glsl(
in vec4 v_facing;
in vec4 v_place;
in vec3 v_eye;
out vec4 colour;

uniform int level;              // of the mesh in hand
uniform bool is_stitch;
uniform vec3 level_colour;
uniform float alpha;
uniform float row_length;       // 2(C-4)
uniform vec2 ramp;              // code at the ramp's foot, 1/codes of its height
uniform vec3 sun;               // towards the sun
uniform vec3 sun_light;         // on ground that faces it
uniform vec3 sky_light;         // on level ground
uniform vec2 haze;              // distance where it begins, 1/distance to where it is complete
uniform vec3 horizon;
uniform sampler2D palette;      // colours along the ramp, to the power of 1.6
uniform sampler2D tile_texture; // colours as coded, multiplied by alpha
uniform vec4 texture_place;     // texture coordinates = object space * xy + zw
uniform float shadow_gain;      // part of the sun that 1 hides; 0: no shadows
uniform float facet_gain;       // part of the sun that a triangle hides from itself, by dot(its normal, sun) / normal.y

// The part of the sun that is hidden. At vertices it goes beyond 0 and 1, so that a border lies between two of them
// (shadow_front.h). A triangle of full detail that faces away is dark up to its sides, whatever its vertices are.
float hidden_part() {
  float by_vertices = v_place.w * shadow_gain;
  if (level > 0) return by_vertices;
  vec3 facing = cross(dFdx(v_eye), dFdy(v_eye));
  float by_itself = facing.y != 0.0 ? 0.5 - facet_gain * dot(facing, sun) / facing.y : 0.0;
  return max(by_vertices, by_itself);
}

#if MODE == 0 || MODE == 3
vec3 hypsometric() { return texture(palette, vec2((v_place.z - ramp.x) * ramp.y, 0.5)).rgb; }
#endif

#if MODE == 2
// The paper's Fig. 6: even rows of triangles red, drawn from East to West, odd rows blue, from West to East; the
// colour deepens along the way and every second triangle is lighter.
vec3 strip_colour() {
  if (is_stitch) return vec3(0.95, 0.85, 0.25);
  float row = floor(v_place.y / exp2(float(level)));
  bool red = mod(row, 2.0) < 0.5;
  float way = clamp(v_place.x / row_length, 0.0, 1.0);
  if (red) way = 1.0 - way;
  vec3 base = red ? mix(vec3(1.0, 0.75, 0.65), vec3(0.75, 0.10, 0.10), way)
                  : mix(vec3(0.70, 0.82, 1.0), vec3(0.10, 0.20, 0.75), way);
  return (gl_PrimitiveID & 1) == 0 ? base : mix(base, vec3(1.0), 0.18);
}
#endif

#if MODE != 4
vec3 base_colour() {
#if MODE == 0
  return hypsometric();
#elif MODE == 1
  return level_colour;
#elif MODE == 2
  return strip_colour();
#else
  // Under full light a photo shows its own colours: the power of 1/1.6 below is undone. Where there is no photo the
  // texture has no alpha.
  vec4 photo = texture(tile_texture, v_place.xy * texture_place.xy + texture_place.zw);
  vec3 own = pow(min(photo.rgb / max(photo.a, 0.004), 1.0), vec3(1.6));
  return mix(hypsometric(), own, photo.a);
#endif
}
#endif

void main() {
  DISCARD_VOID;
  vec3 normal = normalize(v_facing.xyz);
#if MODE == 4
  vec3 shown = normal * 0.5 + 0.5;
#else
  vec3 base = base_colour();
  float direct = max(dot(normal, sun), 0.0);
  if (shadow_gain > 0.0) direct *= clamp(1.0 - hidden_part(), 0.0, 1.0);
  vec3 shown = base * (sky_light * (0.5 + 0.5 * normal.y) + sun_light * direct);
#endif
  float far = clamp((v_facing.w - haze.x) * haze.y, 0.0, 1.0);
  shown = mix(shown, horizon, far * far * (3.0 - 2.0 * far));
  colour = vec4(sqrt(shown * sqrt(sqrt(shown))), alpha);  // to the power of 1/1.6
}
)glsl";

constexpr const char* kProbeFragment = R"glsl(
in vec4 v_place;
out vec4 probe;
void main() {
  DISCARD_VOID;
  probe = vec4(v_place.z, 0.0, 0.0, 1.0);
}
)glsl";

constexpr const char* kFlatFragment = R"glsl(
in vec4 v_facing;
out vec4 colour;
uniform vec4 flat_colour;
uniform float fade_distance;    // where lines begin to vanish; gone at three times as far; 0: never
void main() {
  DISCARD_VOID;
  colour = flat_colour;
  if (fade_distance > 0.0) colour.a *= clamp(1.5 - 0.5 * v_facing.w / fade_distance, 0.0, 1.0);
}
)glsl";

}  // namespace

std::string terrain_fragment_shader(ColourMode mode) {
  return kHeader + std::string("#define MODE ") + std::to_string(static_cast<int>(mode)) + "\n" + kDiscardVoid +
         kTerrainFragment;
}
std::string probe_fragment_shader() {
  return kHeader + std::string(kDiscardVoid) + kProbeFragment;
}
std::string flat_fragment_shader() {
  return kHeader + std::string(kDiscardVoid) + kFlatFragment;
}

TerrainProgram::TerrainProgram(const std::string& name, const std::string& fragment_source,
                               const std::vector<std::string>& feedback)
    : program_(name, kHeader + std::string(kTerrainVertex), fragment_source, feedback) {}

void TerrainProgram::begin(const TileGrid& grid, const TerrainFrame& frame) const {
  program_.use();
  const auto set_vec2 = [this](const char* name, double x, double y) {
    glUniform2f(uniform(name), static_cast<float>(x), static_cast<float>(y));
  };
  glUniform1i(uniform("tile_texture"), 0);
  glUniform1i(uniform("palette"), 1);
  glUniform1i(uniform("codes"), 2);
  glUniform2i(uniform("last_xz"), 2 * grid.shape().cell_columns(), grid.shape().cell_rows());
  set_vec2("sigma", grid.sigma_x(), grid.sigma_z());
  glUniform1f(uniform("row_length"), static_cast<float>(2 * grid.shape().cell_columns()));
  glUniform3f(uniform("anchor"), static_cast<float>(frame.anchor.x), static_cast<float>(frame.anchor.y),
              static_cast<float>(frame.anchor.z));
  glUniform1f(uniform("code_height"), static_cast<float>(frame.code_height));
  glUniform4f(uniform("covered"), static_cast<float>(frame.covered.x0), static_cast<float>(frame.covered.z0),
              static_cast<float>(frame.covered.x1), static_cast<float>(frame.covered.z1));
  glUniformMatrix4fv(uniform("clip_from_eye"), 1, GL_FALSE, frame.clip_from_eye.floats().data());
}

void TerrainProgram::set_tile(const TileGrid& grid, const TerrainFrame& frame, TileIndex tile,
                              std::int64_t stride) const {
  constexpr std::int64_t kFarthest = std::int64_t{1} << 30;
  const auto x = [&](std::int64_t column) {
    return static_cast<GLint>(
        std::clamp((column - frame.anchor_tile.column) * 2 * grid.shape().cell_columns(), -kFarthest, kFarthest));
  };
  const auto z = [&](std::int64_t row) {
    return static_cast<GLint>(
        std::clamp((row - frame.anchor_tile.row) * grid.shape().cell_rows(), -kFarthest, kFarthest));
  };
  glUniform2i(uniform("tile_lattice"), x(tile.column * stride), z(tile.row * stride));
  glUniform1i(uniform("stride"), static_cast<GLint>(stride));
  glUniform4i(uniform("world"), x(0), z(0), x(grid.tile_columns()), z(grid.tile_rows()));
}

}  // namespace isohf::view
