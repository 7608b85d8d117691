#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "gl/gl_objects.h"

namespace isohf::view {

/// An OpenGL 3.3 core context without a window or a display server: EGL's surfaceless platform, else its default
/// display. Current on the thread that made it until it goes.
class HeadlessContext {
 public:
  /// Throws Error{kUnsupported}, one line, where no such context can be had.
  HeadlessContext();
  ~HeadlessContext();
  HeadlessContext(const HeadlessContext&) = delete;
  HeadlessContext& operator=(const HeadlessContext&) = delete;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

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

/// Writes the bound framebuffer as an opaque RGB PNG file, in place of one of that name. Throws Error{kIo} naming it.
void write_picture(const std::string& path, int width, int height);

}  // namespace isohf::view
