#include "gl/block.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "ground.h"

namespace isohf::view {
namespace {

constexpr const char* kBlockVertex = R"glsl(#version 330 core
layout(location = 0) in vec4 place;   // x, z, height, 1 at the ground or 0 at the floor
uniform mat4 clip_from_eye;
uniform vec3 corner;                  // of what is covered, seen from the eye; y: height 0
uniform float exaggeration;
uniform float floor_height;
out vec4 v_place;                     // x, z, distance from the eye, share of the way up
void main() {
  vec3 eye = corner + vec3(place.x, mix(floor_height, place.z * exaggeration, place.w), place.y);
  v_place = vec4(place.xy, length(eye), place.w);
  gl_Position = clip_from_eye * vec4(eye, 1.0);
}
)glsl";

constexpr const char* kBlockFragment = R"glsl(#version 330 core
in vec4 v_place;
out vec4 colour;
uniform vec3 outwards;
uniform vec3 sun;
uniform vec3 sun_light;
uniform vec3 sky_light;
uniform vec2 haze;
uniform vec3 horizon;
float hatch(float across, float wide) {
  float at = across / wide;
  return clamp((abs(fract(at) - 0.5) - 0.25) / fwidth(at) + 0.5, 0.0, 1.0);
}
void main() {
  vec3 base = vec3(0.60, 0.53, 0.46) * (0.75 + 0.25 * v_place.w);
  float direct = max(dot(outwards, sun), 0.0);
  if (outwards.y > 0.5) {
    // As wide on the screen from everywhere: a pattern gives way to one twice as wide.
    float across = v_place.x + v_place.y;
    float wide = log2(max(fwidth(across), 1e-30)) + 3.0;
    float line = mix(hatch(across, exp2(floor(wide))), hatch(across, exp2(floor(wide) + 1.0)),
                     smoothstep(0.3, 0.7, fract(wide)));
    base = mix(vec3(0.50), vec3(0.30), line);
    direct = 0.3;
  }
  vec3 shown = base * (sky_light * (0.8 + 0.2 * outwards.y) + sun_light * direct);
  float far = clamp((v_place.z - haze.x) * haze.y, 0.0, 1.0);
  shown = mix(shown, horizon, far * far * (3.0 - 2.0 * far));
  colour = vec4(sqrt(shown * sqrt(sqrt(shown))), 1.0);
}
)glsl";

/// Vertices around the ground.
constexpr double kMostVertices = 20000.0;
/// Depth of the floor below the lowest ground: shares of the range of heights and of the ground's shorter side.
constexpr double kRangeShare = 0.1;
constexpr double kSideShare = 0.03;

}  // namespace

double Block::floor(const TileSource& source, const ViewState& view) {
  const TileBounds whole = whole_bounds(source);
  const WorldBounds covered = source.covered();
  const double side = std::min(covered.x1 - covered.x0, covered.z1 - covered.z0);
  return whole.low * view.exaggeration -
         std::max(kRangeShare * (whole.high - whole.low) * view.exaggeration, kSideShare * side);
}

Block::Block(const TileSource& source)
    : source_(source), covered_(source.covered()), program_("block", kBlockVertex, kBlockFragment) {
  const Planes planes = planes_of(source);
  const auto around = [&](int plane) {
    const TileGrid& grid = planes.grid(plane);
    return 2.0 * (grid.world_width() / grid.sigma_x() + grid.world_height() / grid.sigma_z());
  };
  int plane = 0;
  while (plane < planes.count() && around(plane) > kMostVertices) ++plane;
  const TileSource& edge = source.plane(plane);
  const auto x = static_cast<float>(covered_.x1 - covered_.x0);
  const auto z = static_cast<float>(covered_.z1 - covered_.z0);
  for (const auto& [at_x, at_z] : {std::pair{0.0F, 0.0F}, {x, 0.0F}, {0.0F, z}, {x, 0.0F}, {x, z}, {0.0F, z}}) {
    places_.insert(places_.end(), {at_x, at_z, 0.0F, 0.0F});
  }
  sides_.push_back({{0.0, 1.0, 0.0}, 0, 6});
  const auto& [x0, z0, x1, z1] = covered_;
  const double step_x = edge.grid().sigma_x();
  const double step_z = edge.grid().sigma_z();
  add_side(edge, {x0, z0}, {x1, z0}, step_x, {0.0, 0.0, -1.0});
  add_side(edge, {x0, z1}, {x1, z1}, step_x, {0.0, 0.0, 1.0});
  add_side(edge, {x0, z0}, {x0, z1}, step_z, {-1.0, 0.0, 0.0});
  add_side(edge, {x1, z0}, {x1, z1}, step_z, {1.0, 0.0, 0.0});
  glBindVertexArray(array_.get());
  glBindBuffer(GL_ARRAY_BUFFER, vertices_.get());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(places_.size() * sizeof(float)), places_.data(),
               GL_STATIC_DRAW);
  glEnableVertexAttribArray(0);
  glVertexAttribPointer(0, 4, GL_FLOAT, GL_FALSE, 0, nullptr);
  glBindVertexArray(0);
  places_ = {};
}

void Block::add_side(const TileSource& plane, WorldPoint from, WorldPoint to, double step, Vec3 outwards) {
  Ground ground(plane);
  const double way = std::hypot(to.x - from.x, to.z - from.z);
  const int count = std::max(1, static_cast<int>(std::lround(way / step)));
  const auto first = static_cast<GLint>(places_.size() / 4);
  std::optional<std::array<float, 3>> before;
  for (int i = 0; i <= count; ++i) {
    const double share = static_cast<double>(i) / count;
    const WorldPoint at{from.x + share * (to.x - from.x), from.z + share * (to.z - from.z)};
    const auto height = ground.height(at, covered_);
    std::optional<std::array<float, 3>> here;
    if (height) {
      here = {static_cast<float>(at.x - covered_.x0), static_cast<float>(at.z - covered_.z0),
              static_cast<float>(*height)};
    }
    if (here && before) {
      const auto add = [this](const std::array<float, 3>& place, float top) {
        places_.insert(places_.end(), {place[0], place[1], place[2], top});
      };
      add(*before, 1.0F);
      add(*before, 0.0F);
      add(*here, 1.0F);
      add(*here, 1.0F);
      add(*before, 0.0F);
      add(*here, 0.0F);
    }
    before = here;
  }
  sides_.push_back({outwards, first, static_cast<GLsizei>(places_.size() / 4) - first});
}

const Program& Block::begin(const ViewState& view, const TerrainFrame& frame) const {
  program_.use();
  glUniformMatrix4fv(program_.uniform("clip_from_eye"), 1, GL_FALSE, frame.clip_from_eye.floats().data());
  glUniform3f(program_.uniform("corner"), static_cast<float>(covered_.x0 - view.eye.x), static_cast<float>(-view.eye.y),
              static_cast<float>(covered_.z0 - view.eye.z));
  glUniform1f(program_.uniform("exaggeration"), static_cast<float>(view.exaggeration));
  glUniform1f(program_.uniform("floor_height"), static_cast<float>(floor(source_, view)));
  return program_;
}

void Block::draw() const {
  glDisable(GL_CULL_FACE);
  glBindVertexArray(array_.get());
  for (const Side& side : sides_) {
    glUniform3f(program_.uniform("outwards"), static_cast<float>(side.outwards.x), static_cast<float>(side.outwards.y),
                static_cast<float>(side.outwards.z));
    glDrawArrays(GL_TRIANGLES, side.first, side.count);
  }
  glBindVertexArray(0);
  glEnable(GL_CULL_FACE);
}

}  // namespace isohf::view
