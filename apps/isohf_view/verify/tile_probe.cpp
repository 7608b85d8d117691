#include "verify/tile_probe.h"

#include <algorithm>

namespace isohf::view {
namespace {

int largest(const std::vector<PixelWindow>& windows, int PixelWindow::*side) {
  int size = 1;
  for (const PixelWindow& window : windows) size = std::max(size, window.*side);
  return size;
}

}  // namespace

TileProbe::TileProbe(const TileGrid& grid, const SharedGeometry& shared, double code_height)
    : grid_(grid),
      shared_(shared),
      height_("probe", probe_fragment_shader()),
      feedback_("capture", probe_fragment_shader(), {"gl_Position", "v_facing", "v_place"}),
      target_(largest(MeshOracle(grid.shape()).windows(), &PixelWindow::width),
              largest(MeshOracle(grid.shape()).windows(), &PixelWindow::height), GL_RGBA32F) {
  frame_.code_height = code_height;
}

void TileProbe::draw_level(const TileSlot& slot, int level, const PixelWindow& window, std::vector<float>& out) {
  // Straight down, North up: clip x and y from x and -z.
  Mat4 clip;
  clip.at(0, 0) = 2.0 * kPixelsPerX / (grid_.sigma_x() * target_.width());
  clip.at(0, 3) = -2.0 * window.x0 / target_.width() - 1.0;
  clip.at(1, 2) = -2.0 * kPixelsPerZ / (grid_.sigma_z() * target_.height());
  clip.at(1, 3) = 2.0 * (window.z0 + window.height) / target_.height() - 1.0;
  clip.at(3, 3) = 1.0;
  frame_.clip_from_eye = clip;
  target_.bind();
  glViewport(0, 0, target_.width(), target_.height());
  glClearColor(0.0F, 0.0F, 0.0F, 0.0F);
  glClear(GL_COLOR_BUFFER_BIT);
  glFrontFace(GL_CCW);
  glCullFace(GL_BACK);
  height_.begin(grid_, frame_);
  height_.set_tile(grid_, frame_, {0, 0});
  slot.bind();
  glDisable(GL_DEPTH_TEST);
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE);
  glEnable(GL_CULL_FACE);
  shared_.draw_strip(level);
  glDisable(GL_CULL_FACE);
  if (shared_.has_stitch(level)) shared_.draw_stitch(level);
  glDisable(GL_BLEND);
  target_.read_rgba32f(out);
}

void TileProbe::capture(const TileSlot& slot, TileIndex tile, std::vector<ProbedVertex>& out) {
  out.resize(static_cast<std::size_t>(grid_.shape().stored_vertex_count()));
  const auto bytes = static_cast<GLsizeiptr>(out.size() * sizeof(ProbedVertex));
  glBindBuffer(GL_TRANSFORM_FEEDBACK_BUFFER, captured_.get());
  glBufferData(GL_TRANSFORM_FEEDBACK_BUFFER, bytes, nullptr, GL_STREAM_READ);
  glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, captured_.get());
  frame_.clip_from_eye = Mat4::identity();  // clip positions are then the vertices' places
  feedback_.begin(grid_, frame_);
  feedback_.set_tile(grid_, frame_, tile);
  slot.bind();
  glEnable(GL_RASTERIZER_DISCARD);
  glBeginTransformFeedback(GL_POINTS);
  glDrawArrays(GL_POINTS, 0, static_cast<GLsizei>(out.size()));
  glEndTransformFeedback();
  glDisable(GL_RASTERIZER_DISCARD);
  glGetBufferSubData(GL_TRANSFORM_FEEDBACK_BUFFER, 0, bytes, out.data());
  glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, 0);
  check_gl("capturing vertices");
}

}  // namespace isohf::view
