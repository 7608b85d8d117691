#include "renderer.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <string>

#include "isohf/light/shadow_sweep.h"
#include "reading/hud.h"

namespace isohf::view {
namespace {

constexpr const char* kSkyVertex = R"glsl(#version 330 core
out vec2 v_ndc;
void main() {
  v_ndc = vec2(float((gl_VertexID & 1) * 4 - 1), float((gl_VertexID & 2) * 2 - 1));
  gl_Position = vec4(v_ndc, 0.0, 1.0);
}
)glsl";

constexpr const char* kSkyFragment = R"glsl(#version 330 core
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
  sky *= 0.5 + 0.5 * exp(min(1.3 * ray.y, 0.0));
  if (sun.y > -0.1) {
    float near_sun = max(dot(ray, sun), 0.0);
    sky += vec3(1.0, 0.75, 0.45) * (0.25 * pow(near_sun, 24.0) + 0.6 * smoothstep(0.99993, 0.99997, near_sun));
  }
  colour = vec4(pow(sky, vec3(1.0 / 1.6)), 1.0);
}
)glsl";

/// Of the Earth, and where the body is not known; of Mars, whose dust scatters; of bodies without air.
constexpr Air kEarthAir{{0.62, 0.70, 0.78}, {0.16, 0.30, 0.55}, {0.33, 0.39, 0.48}};
constexpr Air kDust{{0.72, 0.60, 0.47}, {0.47, 0.36, 0.28}, {0.42, 0.38, 0.35}};
constexpr Air kNoAir{{0.07, 0.08, 0.10}, {0.03, 0.03, 0.04}, {0.34, 0.34, 0.36}, false};

Air air_of(const Metadata* metadata) {
  if (metadata == nullptr) return kEarthAir;
  if (metadata->source.body == "Mars") return kDust;
  return has_air(*metadata) ? kEarthAir : kNoAir;
}

void set_vec3(GLint place, Vec3 value) {
  glUniform3f(place, static_cast<float>(value.x), static_cast<float>(value.y), static_cast<float>(value.z));
}

Vec3 level_colour(int level) {
  constexpr std::array<Vec3, 6> kColours{Vec3{0.85, 0.33, 0.28}, {0.93, 0.66, 0.25}, {0.60, 0.76, 0.32},
                                         {0.25, 0.64, 0.62},     {0.30, 0.45, 0.80}, {0.55, 0.35, 0.70}};
  return kColours[static_cast<std::size_t>(level) % kColours.size()];
}

/// A sky that dims with the sun.
Vec3 by_day(Vec3 colour, Vec3 sun) {
  return std::clamp(sun.y * 5.0 + 0.35, 0.08, 1.0) * colour;
}

/// The part of the sun that a triangle hides by one unit of slope towards it, over the cosine of the sun's elevation.
double facet_gain(Vec3 sun, const std::string& body) {
  const double elevation_deg = std::asin(std::clamp(sun.y, -1.0, 1.0)) * 180.0 / std::numbers::pi;
  if (elevation_deg <= 0.0 || elevation_deg >= 90.0) return 0.0;
  const SweptSun edges = swept_sun(0.0, elevation_deg, sun_radius_deg(body), 1.0, 1.0);
  return 1.0 / ((edges.upper_fall - edges.lower_fall) * std::hypot(sun.x, sun.z));
}

/// The uniforms of light and haze.
void set_light(const TerrainProgram& program, const ViewState& view, const Air& air, const std::string& body) {
  const Vec3 sun = normalised(view.sun);
  set_vec3(program.uniform("sun"), sun);
  glUniform1f(program.uniform("facet_gain"), static_cast<float>(facet_gain(sun, body)));
  const double height = std::clamp(sun.y * 2.5, 0.0, 1.0);
  const Vec3 warm = air.reddens ? Vec3{1.0, 0.62 + height * 0.34, 0.36 + height * 0.52} : Vec3{0.95, 0.95, 0.95};
  set_vec3(program.uniform("sun_light"), (sun.y > 0.0 ? 0.95 : 0.0) * warm);
  set_vec3(program.uniform("sky_light"), std::clamp(sun.y * 6.0 + 0.25, 0.12, 1.0) * air.light);
  set_vec3(program.uniform("horizon"), by_day(air.horizon, sun));
  const double haze_begin = 0.55 * view.far_distance;
  const double haze_rise = 1.0 / (view.far_distance - haze_begin);
  glUniform2f(program.uniform("haze"), static_cast<float>(haze_begin), static_cast<float>(haze_rise));
}

/// The least near distance, of the far distance.
constexpr double kLeastNear = 1e-7;

/// True where all corners of the box lie beyond one and the same plane of the clip volume.
bool outside_view(const Mat4& clip, const TileVolume& box) {
  std::array<int, 5> beyond{};
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 at = box_corner(box.low, box.high, corner);
    const auto along = [&](int row) { return clip.along(row, at) + clip.at(row, 3); };
    const double w = along(3);
    const std::array<bool, 5> is_beyond{along(0) < -w, along(0) > w, along(1) < -w, along(1) > w, along(2) < 0.0};
    for (std::size_t plane = 0; plane < 5; ++plane) beyond[plane] += is_beyond[plane] ? 1 : 0;
  }
  return std::find(beyond.begin(), beyond.end(), 8) != beyond.end();
}

void set_cutting(bool on) {
  for (GLenum plane = GL_CLIP_DISTANCE0; plane < GL_CLIP_DISTANCE0 + 4; ++plane) {
    if (on) {
      glEnable(plane);
    } else {
      glDisable(plane);
    }
  }
}

bool reaches_beyond(const TileGrid& grid, TileIndex tile, const WorldBounds& covered) {
  const WorldPoint west_north = grid.world_from_object(tile, {0.0, 0.0});
  return west_north.x < covered.x0 || west_north.z < covered.z0 || west_north.x + grid.extent_x() > covered.x1 ||
         west_north.z + grid.extent_z() > covered.z1;
}

/// The frame's uniforms for a view: positions are relative to an anchor tile under the eye, in floats near the eye.
/// nearest  distance from the eye within which nothing is drawn; a least share of the far distance if that is larger
TerrainFrame terrain_frame(const TileSource& source, const ViewState& view, double nearest) {
  const TileGrid& grid = source.grid();
  const double aspect = static_cast<double>(view.width) / view.height;
  TerrainFrame frame;
  const double near_distance = std::clamp(nearest, view.far_distance * kLeastNear, 0.5 * view.far_distance);
  frame.clip_from_eye =
      perspective(view.fov_y_rad, aspect, near_distance, view.far_distance) * look_along(view.forward);
  frame.anchor_tile = grid.locate({view.eye.x, view.eye.z}).tile;
  frame.anchor = {static_cast<double>(frame.anchor_tile.column) * grid.extent_x() - view.eye.x,
                  source.scale().offset * view.exaggeration - view.eye.y,
                  static_cast<double>(frame.anchor_tile.row) * grid.extent_z() - view.eye.z};
  frame.code_height = source.scale().scale * view.exaggeration;
  const WorldBounds covered = source.covered();
  frame.covered = {covered.x0 - view.eye.x, covered.z0 - view.eye.z, covered.x1 - view.eye.x, covered.z1 - view.eye.z};
  return frame;
}

// Depth runs from 1 near to 0 far.
void begin_opaque_pass() {
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_GREATER);
  glDepthMask(GL_TRUE);
  glDisable(GL_BLEND);
}

// The paper has depth writes off here. Within a tile triangles come in the order of the strip, though, so that the far
// side of a hill may be drawn over the near one; the picture would then jump at β = ½, where the second mesh becomes
// the first and is drawn with depth. With depth writes the nearest one stays in front in both stages.
void begin_fading_pass(bool write_depth) {
  glDepthMask(write_depth ? GL_TRUE : GL_FALSE);
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);  // alpha stays 1
  glEnable(GL_POLYGON_OFFSET_FILL);
}

// The second mesh shows only where it lies in front of the first. Where both lie in one plane (water, a plain), fading
// in and then switching to the coarse mesh at β = ½ is only seamless if the coarse mesh counts as in front there in
// both stages: nearer by eight depth steps while it fades in over the fine one, and the fine one farther by eight while
// it fades out over the coarse one.
void order_fading(const LodBlend& blend) {
  glPolygonOffset(0.0F, blend.second > blend.first ? 8.0F : -8.0F);
}

void end_fading_pass() {
  glDisable(GL_POLYGON_OFFSET_FILL);
  glDepthMask(GL_TRUE);
  glDisable(GL_BLEND);
}

}  // namespace

Renderer::Renderer(const TileSource& source, const SharedGeometry& shared)
    : source_(source),
      shared_(shared),
      planes_(planes_of(source)),
      whole_(whole_bounds(source)),
      air_(air_of(source.metadata())),
      flat_("wire", flat_fragment_shader()),
      sky_("sky", kSkyVertex, kSkyFragment) {
  const std::array<std::uint8_t, 4> nothing{};
  glBindTexture(GL_TEXTURE_2D, no_texture_.get());
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, 1, 1, 0, GL_RGBA, GL_UNSIGNED_BYTE, nothing.data());
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, 0);
  glBindTexture(GL_TEXTURE_2D, 0);
}

void Renderer::set_palette(const std::vector<ColourStop>& stops, double low, double high) {
  constexpr int kColours = 4096;
  std::vector<std::uint16_t> texels;
  for (int i = 0; i < kColours; ++i) {
    // The colour at the texel's lower edge: a doubled stop within it begins above, so that the sea is sea at 0.
    const OverlayColour colour = colour_at(stops, low + static_cast<double>(i) / kColours * (high - low));
    for (const float value : {colour.red, colour.green, colour.blue}) {
      texels.push_back(static_cast<std::uint16_t>(65535.0F * std::pow(value, 1.6F) + 0.5F));
    }
  }
  glBindTexture(GL_TEXTURE_2D, palette_.get());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB16, kColours, 1, 0, GL_RGB, GL_UNSIGNED_SHORT, texels.data());
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, 0);
  glBindTexture(GL_TEXTURE_2D, 0);
}

const TerrainProgram& Renderer::shading(ColourMode mode) {
  const auto found = shading_.find(mode);
  if (found != shading_.end()) return found->second;
  return shading_.try_emplace(mode, "terrain", terrain_fragment_shader(mode)).first->second;
}

double Renderer::level_of(const ViewState& view, PlaneTile at) const {
  const TileGrid& grid = planes_.grid(at.plane);
  const int levels = planes_.levels();
  if (view.fixed_level) return std::clamp(*view.fixed_level, 0.0, static_cast<double>(levels - 1));
  // Section 3.9, with the straight distance in place of camera-space depth: turning the head changes no mesh.
  const TileVolume box = tile_volume(grid, at.tile, source_.plane(at.plane).bounds(at.tile), view);
  const double distance = at.plane == 0 ? length(0.5 * (box.low + box.high)) : box.distance();
  return fractional_level(projected_area_px(triangle_area(source_.grid(), 1.0), view.focal_px(), distance), levels,
                          view.triangle_px);
}

void Renderer::find_visible(Frame& frame, const TileRange& top, const ResidentTile& resident) const {
  const ViewState& view = frame.view;
  const int step = std::countr_zero(static_cast<unsigned>(planes_.scale(planes_.count() > 0 ? 1 : 0)));
  const auto own_level = [&](PlaneTile at) { return level_of(view, at) - at.plane * step; };
  const auto bounds_of = [&](PlaneTile at) { return source_.plane(at.plane).bounds(at.tile); };
  const PlaneWishes wishes{[&](PlaneTile at) { return bounds_of(at).stored; },
                           [&](PlaneTile at) { return own_level(at) < 0.0; },
                           [&](PlaneTile at) { return resident(at) != nullptr; }};
  for (const ChosenTile& chosen : choose_tiles(planes_, top, wishes)) {
    const PlaneTile at = chosen.at;
    const TileGrid& grid = planes_.grid(at.plane);
    const TileBounds bounds = bounds_of(at);
    const TileVolume box = tile_volume(grid, at.tile, bounds, view);
    if (outside_view(frame.terrain.clip_from_eye, box)) continue;
    const TileSlot* slot = resident(at);
    if (slot == nullptr) {
      ++frame.figures.absent_tiles;
      continue;
    }
    const bool is_cut = reaches_beyond(grid, at.tile, source_.covered());
    const LodBlend blend = lod_blend(own_level(at), planes_.mesh_shape().levels());
    GLuint texture = 0;
    if (view.mode == ColourMode::kTexture) {
      if (textures_) texture = textures_(at);
      if (texture == 0) texture = no_texture_.get();
    }
    frame.items.push_back(
        {at, chosen.coarser_sides, slot, is_cut, length(0.5 * (box.low + box.high)), box.distance(), blend, texture});
  }
  std::sort(frame.items.begin(), frame.items.end(),
            [](const Item& a, const Item& b) { return a.distance < b.distance; });
  frame.figures.visible_tiles = static_cast<std::int64_t>(frame.items.size());
}

void Renderer::begin_shading(const Frame& frame, const TerrainProgram& program) const {
  const ViewState& view = frame.view;
  program.begin(source_.grid(), frame.terrain);
  glActiveTexture(GL_TEXTURE1);
  glBindTexture(GL_TEXTURE_2D, palette_.get());
  glActiveTexture(GL_TEXTURE0);
  const ViewScale scale = source_.scale();
  const double codes = std::max(whole_.high - whole_.low, 1e-9) / scale.scale;
  glUniform2f(program.uniform("ramp"), static_cast<float>((whole_.low - scale.offset) / scale.scale),
              static_cast<float>(1.0 / codes));
  const Metadata* const metadata = source_.metadata();
  set_light(program, view, air_, metadata != nullptr ? metadata->source.body : std::string());
}

void Renderer::place_texture(const TerrainProgram& program, PlaneTile at) const {
  const TileGrid& grid = source_.grid();
  // Texel centres lie on the tile's edges (docs/archive_format.md, "Textures").
  const double size = source_.textures()->size;
  double x0 = 0.5 / size;
  double z0 = x0;
  double across = (size - 1.0) / size;
  double down = across;
  if (at.plane > 0) {
    const auto tiles = static_cast<double>(planes_.scale(at.plane));
    across = tiles / static_cast<double>(grid.tile_columns());
    down = tiles / static_cast<double>(grid.tile_rows());
    x0 = across * static_cast<double>(at.tile.column);
    z0 = down * static_cast<double>(at.tile.row);
  }
  glUniform4f(program.uniform("texture_place"), static_cast<float>(across / (2.0 * grid.shape().cell_columns())),
              static_cast<float>(down / grid.shape().cell_rows()), static_cast<float>(x0), static_cast<float>(z0));
}

void Renderer::draw_mesh(Frame& frame, const TerrainProgram& program, const Item& item, int level) const {
  const TileShape& shape = planes_.mesh_shape();
  program.set_tile(source_.grid(), frame.terrain, item.at.tile, planes_.scale(item.at.plane));
  glUniform1i(program.uniform("level"), level);
  glUniform1i(program.uniform("is_stitch"), 0);
  set_vec3(program.uniform("level_colour"), level_colour(level));
  glUniform1f(program.uniform("shadow_gain"), frame.view.shadows ? item.slot->shadow_gain() : 0.0F);
  item.slot->bind();
  if (item.texture != 0) {
    glBindTexture(GL_TEXTURE_2D, item.texture);
    if (source_.textures() != nullptr) place_texture(program, item.at);
  }
  if (item.is_cut) set_cutting(true);
  glEnable(GL_CULL_FACE);
  shared_.draw_strip(level);
  frame.figures.triangles += shape.strip_triangle_count(level);
  if (shared_.has_stitch(level)) {
    // Stitch triangles stand upright and are seen from either side.
    glUniform1i(program.uniform("is_stitch"), 1);
    set_vec3(program.uniform("level_colour"), 0.8 * level_colour(level));
    glDisable(GL_CULL_FACE);
    shared_.draw_stitch(level);
    frame.figures.triangles += shape.stitch_triangle_count(level);
  }
  if (item.coarser_sides != 0) {
    glUniform1i(program.uniform("is_stitch"), 1);
    glDisable(GL_CULL_FACE);
    for (int side = 0; side < 4; ++side) {
      if ((item.coarser_sides >> static_cast<unsigned>(side) & 1U) == 0) continue;
      frame.figures.triangles += shared_.draw_side(side);
    }
  }
  if (item.is_cut) set_cutting(false);
}

void Renderer::draw_opaque(Frame& frame) {
  begin_opaque_pass();
  const TerrainProgram& program = shading(frame.view.mode);
  begin_shading(frame, program);
  glUniform1f(program.uniform("alpha"), 1.0F);
  for (const Item& item : frame.items) {
    draw_mesh(frame, program, item, item.blend.first);
    drawn_.push_back(item.at);
  }
}

void Renderer::draw_fading(Frame& frame) {
  begin_fading_pass(!frame.view.wireframe);  // wires are those of the first mesh, and shown through the second
  const TerrainProgram& program = shading(frame.view.mode);
  begin_shading(frame, program);
  for (auto item = frame.items.rbegin(); item != frame.items.rend(); ++item) {
    if (!fades(*item)) continue;
    order_fading(item->blend);
    glUniform1f(program.uniform("alpha"), static_cast<float>(item->blend.alpha));
    draw_mesh(frame, program, *item, item->blend.second);
  }
  end_fading_pass();
}

void Renderer::draw_wires(Frame& frame) const {
  glPolygonMode(GL_FRONT_AND_BACK, GL_LINE);
  glEnable(GL_POLYGON_OFFSET_LINE);
  glPolygonOffset(1.0F, 2.0F);
  glEnable(GL_BLEND);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  flat_.begin(source_.grid(), frame.terrain);
  glUniform4f(flat_.uniform("flat_colour"), 0.05F, 0.06F, 0.09F, 0.7F);
  for (const Item& item : frame.items) {
    // Lines vanish where a triangle's side falls below eight pixels.
    const double side = 2.0 * planes_.grid(item.at.plane).sigma_x() * (1 << item.blend.first);
    glUniform1f(flat_.uniform("fade_distance"), static_cast<float>(side * frame.view.focal_px() / 8.0));
    draw_mesh(frame, flat_, item, item.blend.first);
  }
  glDisable(GL_BLEND);
  glDisable(GL_POLYGON_OFFSET_LINE);
  glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
}

void Renderer::draw_sky(const ViewState& view) const {
  sky_.use();
  const Mat4 camera = look_along(view.forward);
  std::array<float, 9> world_from_camera{};  // column-major: the columns are the camera's axes in the world
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      world_from_camera[static_cast<std::size_t>(column * 3 + row)] = static_cast<float>(camera.at(column, row));
    }
  }
  const double half = std::tan(view.fov_y_rad / 2.0);
  const Vec3 sun = normalised(view.sun);
  glUniformMatrix3fv(sky_.uniform("world_from_camera"), 1, GL_FALSE, world_from_camera.data());
  glUniform2f(sky_.uniform("half_view"), static_cast<float>(half * view.width / view.height), static_cast<float>(half));
  set_vec3(sky_.uniform("sun"), sun);
  set_vec3(sky_.uniform("horizon"), by_day(air_.horizon, sun));
  set_vec3(sky_.uniform("zenith"), by_day(air_.zenith, sun));
  // At the far end of depth: only where no ground is.
  glDepthFunc(GL_GEQUAL);
  glDepthMask(GL_FALSE);
  glBindVertexArray(nothing_.get());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glDepthMask(GL_TRUE);
  glDepthFunc(GL_GREATER);
}

FrameFigures Renderer::draw(const ViewState& view, const TileRange& top, const ResidentTile& resident) {
  drawn_.clear();
  Frame frame{view, terrain_frame(source_, view, 0.0), {}, {}};
  find_visible(frame, top, resident);
  // Depth is fine only near the eye: begin it where the ground begins, or two meshes of one hill cannot be told apart.
  double nearest = view.far_distance;
  for (const Item& item : frame.items) nearest = std::min(nearest, item.nearest);
  // In the corners of the view depth is the least part of distance.
  const double half_y = std::tan(view.fov_y_rad / 2.0);
  const double half_x = half_y * view.width / view.height;
  nearest *= 0.95 / std::sqrt(1.0 + half_x * half_x + half_y * half_y);
  frame.terrain = terrain_frame(source_, view, nearest);
  glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
  glClearDepth(0.0);
  glViewport(0, 0, view.width, view.height);
  glDepthMask(GL_TRUE);
  glFrontFace(GL_CCW);
  glCullFace(GL_BACK);
  glClear(GL_DEPTH_BUFFER_BIT);
  glActiveTexture(GL_TEXTURE0);
  draw_opaque(frame);
  draw_sky(view);
  if (std::any_of(frame.items.begin(), frame.items.end(), fades)) draw_fading(frame);
  if (view.wireframe) draw_wires(frame);
  glBindVertexArray(0);
  return frame.figures;
}

}  // namespace isohf::view
