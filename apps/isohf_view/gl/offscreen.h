#pragma once

#include <epoxy/egl.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "gl/gl_objects.h"

namespace isohf::view {

/// An OpenGL 3.3 core context without a window or a display server: on a GPU where EGL lists one (not with
/// LIBGL_ALWAYS_SOFTWARE=1), else EGL's surfaceless platform, else its default display. Current on the thread that made
/// it until it goes. One at a time.
class HeadlessContext {
 public:
  /// Throws Error{kUnsupported}, one line, where no such context can be had.
  HeadlessContext();
  ~HeadlessContext();
  HeadlessContext(const HeadlessContext&) = delete;
  HeadlessContext& operator=(const HeadlessContext&) = delete;

 private:
  /// Makes the context there and uses it.
  void open(EGLDisplay where);
  void close();

  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
};

/// Samples a pixel, of pictures and windows.
constexpr int kPictureSamples = 4;

/// The name that the driver gives itself.
[[nodiscard]] std::string driver_name();
/// True where no GPU draws.
[[nodiscard]] bool is_software_driver();

/// A framebuffer of our own with a depth buffer, bound on construction.
class Offscreen {
 public:
  /// colour_format  GL_RGBA8, GL_RGBA32F, ...      samples  of a pixel, >= 1; as many as the driver has at most
  Offscreen(int width, int height, GLenum colour_format, int samples = 1);

  void bind() const;
  /// Copies the picture to the window, whose framebuffer is then bound.
  void show() const;
  /// Binds the picture with each pixel's samples joined, to be read or written over.
  void bind_joined() const;
  /// As view::write_picture.
  void write_picture(const std::string& path, bool overwrite) const;
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
  std::unique_ptr<Offscreen> resolved_;  ///< where there is more than one sample: their means
};

/// The bound framebuffer's pixels, rows from the top, four channels a pixel.
[[nodiscard]] std::vector<std::uint8_t> read_pixels(int width, int height);

/// Writes the bound framebuffer as an opaque RGB PNG file, in place of one of that name or not. Throws Error{kIo}
/// naming it.
void write_picture(const std::string& path, int width, int height, bool overwrite);

}  // namespace isohf::view
