#include "gl/offscreen.h"

#include <fmt/format.h>

#include <algorithm>

#include "isohf/error.h"

namespace isohf::view {

Offscreen::Offscreen(int width, int height, GLenum colour_format) : width_(width), height_(height) {
  GLint largest = 0;
  glGetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &largest);
  if (width > largest || height > largest) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("a picture of {} x {} pixels: this GL driver draws at most {} x {}", width, height, largest,
                            largest));
  }
  glBindRenderbuffer(GL_RENDERBUFFER, colour_.get());
  glRenderbufferStorage(GL_RENDERBUFFER, colour_format, width, height);
  glBindRenderbuffer(GL_RENDERBUFFER, depth_.get());
  glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT32F, width, height);
  bind();
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, colour_.get());
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth_.get());
  check_gl("making an offscreen picture");
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    throw Error(ErrorCode::kUnsupported, "this GL driver cannot draw into an offscreen picture of the format wanted");
  }
}

void Offscreen::bind() const {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.get());
}

std::vector<std::uint8_t> Offscreen::read_rgba8() const {
  bind();
  return read_pixels(width_, height_);
}

void Offscreen::read_rgba32f(std::vector<float>& out) const {
  bind();
  out.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) * 4);
  glReadPixels(0, 0, width_, height_, GL_RGBA, GL_FLOAT, out.data());
  check_gl("reading pixels");
}

std::vector<std::uint8_t> read_pixels(int width, int height) {
  const std::size_t row_bytes = static_cast<std::size_t>(width) * 4;
  std::vector<std::uint8_t> pixels(row_bytes * static_cast<std::size_t>(height));
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data());
  check_gl("reading pixels");
  for (int top = 0, bottom = height - 1; top < bottom; ++top, --bottom) {
    const auto a = pixels.begin() + static_cast<std::ptrdiff_t>(row_bytes) * top;
    const auto b = pixels.begin() + static_cast<std::ptrdiff_t>(row_bytes) * bottom;
    std::swap_ranges(a, a + static_cast<std::ptrdiff_t>(row_bytes), b);
  }
  return pixels;
}

}  // namespace isohf::view
