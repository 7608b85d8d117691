#include "measure/static_mesh.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <map>
#include <vector>

#include "gl/gl_objects.h"
#include "gl/offscreen.h"
#include "isohf/lattice.h"

namespace isohf::view {
namespace {

constexpr int kRuns = 5;

constexpr const char* kVertex = R"glsl(#version 330 core
layout(location = 0) in vec3 place;
uniform mat4 clip_from_eye;
void main() { gl_Position = clip_from_eye * vec4(place, 1.0); }
)glsl";

constexpr const char* kFragment = R"glsl(#version 330 core
out vec4 colour;
void main() { colour = vec4(0.6, 0.6, 0.6, 1.0); }
)glsl";

/// One tile's positions, seen from the eye.
class StaticTile {
 public:
  StaticTile(const Session& session, TileIndex tile) {
    const TileGrid& grid = session.source().grid();
    const TileShape& shape = grid.shape();
    const ViewScale scale = session.source().scale();
    std::vector<std::uint16_t> codes(static_cast<std::size_t>(shape.stored_vertex_count()));
    session.source().read(tile, codes);
    std::vector<float> places;
    places.reserve(3 * codes.size());
    for (int row = 0; row < shape.rows(); ++row) {
      for (int column = 0; column < shape.columns(); ++column) {
        const ObjectVertex at = object_from_grid(shape, GridVertex{column, row});
        const std::uint16_t code = codes[static_cast<std::size_t>(row * shape.columns() + column)];
        const WorldPoint world = grid.world_from_object(tile, {static_cast<double>(at.x), static_cast<double>(at.z)});
        const double y = (scale.offset + scale.scale * code) * session.view.exaggeration;
        places.push_back(static_cast<float>(world.x - session.view.eye.x));
        places.push_back(static_cast<float>(y - session.view.eye.y));
        places.push_back(static_cast<float>(world.z - session.view.eye.z));
      }
    }
    glBindVertexArray(array_.get());
    glBindBuffer(GL_ARRAY_BUFFER, places_.get());
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(places.size() * sizeof(float)), places.data(),
                 GL_STATIC_DRAW);
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
    glEnableVertexAttribArray(0);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, session.shared().indices());
    glBindVertexArray(0);
  }
  void bind() const { glBindVertexArray(array_.get()); }

 private:
  VertexArray array_;
  Buffer places_;
};

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

template <typename Draw>
MeshSpeed::Time median_time(const Draw& draw) {
  std::vector<double> wall_ms;
  std::vector<double> processor_ms;
  for (int run = 0; run < kRuns; ++run) {
    const auto begin = std::chrono::steady_clock::now();
    const std::clock_t begin_clock = std::clock();
    draw();
    glFinish();
    processor_ms.push_back(1e3 * static_cast<double>(std::clock() - begin_clock) / CLOCKS_PER_SEC);
    wall_ms.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
  }
  return {median(wall_ms), median(processor_ms)};
}

}  // namespace

MeshSpeed measure_static_mesh(Session& session) {
  const Offscreen target(session.view.width, session.view.height, GL_RGBA8);
  target.bind();
  session.complete_frame();
  MeshSpeed speed;
  speed.triangles = session.figures().triangles;
  speed.ours = median_time([&] { session.frame(); });

  const std::vector<DrawnMesh> meshes = session.renderer().drawn();
  std::map<std::int64_t, StaticTile> tiles;
  for (const DrawnMesh& mesh : meshes) {
    tiles.try_emplace(session.source().grid().flat_index(mesh.tile), session, mesh.tile);
  }
  const Program program("static mesh", kVertex, kFragment);
  const TerrainFrame frame = terrain_frame(session.source(), session.view);
  const SharedGeometry& shared = session.shared();
  speed.plain = median_time([&] {
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    begin_opaque_pass();
    program.use();
    glUniformMatrix4fv(program.uniform("clip_from_eye"), 1, GL_FALSE, frame.clip_from_eye.floats().data());
    for (const DrawnMesh& mesh : meshes) {
      tiles.at(session.source().grid().flat_index(mesh.tile)).bind();
      glEnable(GL_CULL_FACE);
      shared.draw_strip(mesh.level);
      if (!shared.has_stitch(mesh.level)) continue;
      glDisable(GL_CULL_FACE);
      shared.draw_stitch(mesh.level);
    }
  });
  glBindVertexArray(0);
  return speed;
}

}  // namespace isohf::view
