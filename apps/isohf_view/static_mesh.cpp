#include "static_mesh.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "isohf/lattice/strip.h"
#include "isohf/lattice/tile_mapping.h"
#include "offscreen.h"

namespace isohf::view {
namespace {

constexpr const char* kVertex = R"glsl(#version 330 core
layout(location = 0) in vec3 place;
uniform vec3 shift;
uniform mat4 clip_from_eye;
void main() { gl_Position = clip_from_eye * vec4(place + shift, 1.0); }
)glsl";

constexpr const char* kFragment = R"glsl(#version 330 core
out vec4 colour;
void main() { colour = vec4(0.6, 0.6, 0.6, 1.0); }
)glsl";

}  // namespace

StaticMeshSpeed measure_static_mesh(const Session& session, std::int64_t triangles) {
  const TileGrid& grid = session.source().grid();
  const TileShape& shape = grid.shape();
  std::vector<float> places;
  for (int row = 0; row < shape.rows(); ++row) {
    for (int column = 0; column < shape.columns(); ++column) {
      const ObjectVertex at = object_from_grid(shape, GridVertex{column, row});
      const double x = at.x * grid.sigma_x();
      const double z = at.z * grid.sigma_z();
      const double y = 0.02 * grid.extent_x() * std::sin(0.11 * at.x) * std::cos(0.13 * at.z);
      places.insert(places.end(), {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
    }
  }
  const std::vector<std::uint32_t> indices = strip_indices(shape, 0);
  const VertexArray array;
  const Buffer vertex_buffer;
  const Buffer index_buffer;
  glBindVertexArray(array.get());
  glBindBuffer(GL_ARRAY_BUFFER, vertex_buffer.get());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(places.size() * sizeof(float)), places.data(), GL_STATIC_DRAW);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
  glEnableVertexAttribArray(0);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, index_buffer.get());
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(indices.size() * sizeof(std::uint32_t)), indices.data(),
               GL_STATIC_DRAW);

  const Program program("static mesh", kVertex, kFragment);
  const Offscreen target(session.view.width, session.view.height, GL_RGBA8);
  const TerrainFrame frame = terrain_frame(session.source(), session.view);
  const std::int64_t copies = std::max<std::int64_t>(1, triangles / shape.triangle_count());
  const auto side = static_cast<std::int64_t>(std::ceil(std::sqrt(static_cast<double>(copies))));
  std::vector<double> times_ms;
  for (int run = 0; run < 5; ++run) {
    const auto begin = std::chrono::steady_clock::now();
    target.bind();
    glViewport(0, 0, target.width(), target.height());
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LESS);
    glEnable(GL_CULL_FACE);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    program.use();
    glUniformMatrix4fv(program.uniform("clip_from_eye"), 1, GL_FALSE, frame.clip_from_eye.floats().data());
    // Ahead of the eye, as many tiles as needed, from near to far.
    const Vec3 ahead = normalised({session.view.forward.x, 0.0, session.view.forward.z});
    for (std::int64_t i = 0; i < copies; ++i) {
      const double forward = (static_cast<double>(i / side) + 0.5) * grid.extent_z();
      const double aside = (static_cast<double>(i % side) - 0.5 * static_cast<double>(side)) * grid.extent_x();
      glUniform3f(program.uniform("shift"), static_cast<float>(forward * ahead.x - aside * ahead.z),
                  static_cast<float>(-0.5 * grid.extent_x()), static_cast<float>(forward * ahead.z + aside * ahead.x));
      glDrawElements(GL_TRIANGLE_STRIP, static_cast<GLsizei>(indices.size()), GL_UNSIGNED_INT, nullptr);
    }
    glFinish();
    times_ms.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
  }
  glBindVertexArray(0);
  std::nth_element(times_ms.begin(), times_ms.begin() + 2, times_ms.end());
  return {times_ms[2], copies * shape.triangle_count()};
}

}  // namespace isohf::view
