#pragma once

#include <cstdint>
#include <vector>

#include "gl/gl_objects.h"

namespace isohf::view {

/// A framebuffer of our own with a depth buffer, bound on construction.
class Offscreen {
 public:
  /// colour_format  GL_RGBA8, GL_RGBA32F, ...
  Offscreen(int width, int height, GLenum colour_format);

  void bind() const;
  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }

  /// Rows from the top, four channels a pixel.
  [[nodiscard]] std::vector<std::uint8_t> read_rgba8() const;
  /// Rows from the bottom, as GL has them, four channels a pixel; into `out`, which is resized.
  void read_rgba32f(std::vector<float>& out) const;

 private:
  int width_;
  int height_;
  Framebuffer framebuffer_;
  Renderbuffer colour_;
  Renderbuffer depth_;
};

/// The bound framebuffer's pixels, rows from the top, four channels a pixel.
[[nodiscard]] std::vector<std::uint8_t> read_pixels(int width, int height);

}  // namespace isohf::view
