#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "gl/gl_objects.h"
#include "gl/offscreen.h"
#include "gl_test.h"
#include "isohf/mesh.h"
#include "isohf/metadata.h"
#include "support/rasters/analytic_surface.h"

/// The vertex shader of docs/engine.md.
namespace isohf::view {
namespace {

class EnginePage : public test::GlTest {};

std::string vertex_shader() {
  std::ifstream file(ISOHF_SOURCE_DIR "/docs/engine.md");
  const std::string page{std::istreambuf_iterator<char>(file), {}};
  const std::string fence = "```glsl\n";
  const std::size_t begin = page.find(fence) + fence.size();
  return page.substr(begin, page.find("```", begin) - begin);
}

struct Captured {
  std::array<float, 3> position;
  std::array<float, 3> normal;
  float nodata;
};

/// What the shader makes of all vertices of a tile.
std::vector<Captured> captured(const TileGrid& grid, TileIndex tile, const std::vector<std::uint16_t>& codes,
                               double offset, double scale) {
  const TileShape& shape = grid.shape();
  const Program program("docs/engine.md", vertex_shader(),
                        "#version 330 core\nout vec4 colour;\nvoid main() { colour = vec4(1.0); }\n",
                        {"world_position", "world_normal", "nodata"});
  program.use();
  const Texture texture;
  glBindTexture(GL_TEXTURE_2D, texture.get());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_R16UI, shape.columns(), shape.rows(), 0, GL_RED_INTEGER, GL_UNSIGNED_SHORT,
               codes.data());
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  const WorldPoint corner = grid.world_from_object(tile, {0.0, 0.0});
  const std::array<float, 16> identity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  glUniform2i(program.uniform("shape"), shape.columns(), shape.rows());
  glUniform2f(program.uniform("tile_corner"), static_cast<float>(corner.x), static_cast<float>(corner.z));
  glUniform2f(program.uniform("sigma"), static_cast<float>(grid.sigma_x()), static_cast<float>(grid.sigma_z()));
  glUniform2f(program.uniform("elevation"), static_cast<float>(offset), static_cast<float>(scale));
  glUniformMatrix4fv(program.uniform("clip_from_world"), 1, GL_FALSE, identity.data());

  const Offscreen target(16, 16, GL_RGBA8);
  target.bind();
  std::vector<Captured> vertices(codes.size());
  const VertexArray array;
  const Buffer buffer;
  glBindVertexArray(array.get());
  glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, buffer.get());
  const auto bytes = static_cast<GLsizeiptr>(vertices.size() * sizeof(Captured));
  glBufferData(GL_TRANSFORM_FEEDBACK_BUFFER, bytes, nullptr, GL_STREAM_READ);
  glEnable(GL_RASTERIZER_DISCARD);
  glBeginTransformFeedback(GL_POINTS);
  glDrawArrays(GL_POINTS, 0, static_cast<GLsizei>(vertices.size()));
  glEndTransformFeedback();
  glDisable(GL_RASTERIZER_DISCARD);
  glGetBufferSubData(GL_TRANSFORM_FEEDBACK_BUFFER, 0, bytes, vertices.data());
  check_gl("capturing vertices");
  return vertices;
}

TEST_F(EnginePage, ShaderMakesTheVerticesOfTheLibrary) {
  for (const TileShape& shape : {TileShape::make(12, 11, 3), TileShape::make(5, 5, 1), TileShape::make(6, 7, 1)}) {
    const Metadata metadata(TileGrid::make(shape, 3, 2, 40.0 * shape.cell_columns(), 35.0 * shape.cell_rows()));
    const TileIndex tile{1, 1};
    std::vector<std::uint16_t> codes = test::analytic_tile(metadata.grid, tile);
    codes[static_cast<std::size_t>(3 + 3 * shape.columns())] = 65535;
    constexpr double kOffset = -20.0;
    constexpr double kScale = 0.002;
    std::vector<double> elevations;
    for (const std::uint16_t code : codes) elevations.push_back(code == 65535 ? NAN : kOffset + kScale * code);
    const auto expected = tile_vertices(metadata, tile, elevations);
    const auto found = captured(metadata.grid, tile, codes, kOffset, kScale);
    for (std::size_t i = 0; i < found.size(); ++i) {
      const GridVertex at{static_cast<int>(i) % shape.columns(), static_cast<int>(i) / shape.columns()};
      if (!is_visible(shape, at)) continue;
      EXPECT_EQ(found[i].nodata > 0.0F, codes[i] == 65535);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        // Floats of a few hundred world units, a handful of roundings.
        if (axis != 1 || codes[i] != 65535) {
          EXPECT_NEAR(found[i].position[axis], expected[i].position[axis], 2e-4) << at.column << "," << at.row;
        }
        EXPECT_NEAR(found[i].normal[axis], expected[i].normal[axis], 1e-5) << at.column << "," << at.row;
      }
    }
  }
}

}  // namespace
}  // namespace isohf::view
