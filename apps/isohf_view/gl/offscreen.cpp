#include "gl/offscreen.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <span>
#include <string_view>

#include "formats/write/raster_sink.h"
#include "isohf/error.h"

namespace isohf::view {

namespace {

bool has_word(const char* list, const char* word) {
  return list != nullptr && std::strstr(list, word) != nullptr;
}

Error refusal(const char* what) {
  return {ErrorCode::kUnsupported,
          fmt::format("no headless OpenGL 3.3: {} (EGL error 0x{:04x}); a GL driver with EGL is required, Mesa's "
                      "software driver will do",
                      what, eglGetError())};
}

bool software_is_wanted() {
  const char* said = std::getenv("LIBGL_ALWAYS_SOFTWARE");
  return said != nullptr && std::string_view(said) != "0" && std::string_view(said) != "false";
}

/// Where a context may be had, in order: GPUs, then no surface at all, then what EGL takes by default.
std::vector<EGLDisplay> possible_displays() {
  std::vector<EGLDisplay> displays;
  const char* client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  if (has_word(client, "EGL_EXT_platform_base")) {
    if (has_word(client, "EGL_EXT_device_enumeration") && has_word(client, "EGL_EXT_platform_device") &&
        !software_is_wanted()) {
      std::array<EGLDeviceEXT, 16> devices{};
      EGLint count = 0;
      if (eglQueryDevicesEXT(devices.size(), devices.data(), &count) != EGL_TRUE) count = 0;
      for (EGLDeviceEXT device : std::span(devices).first(static_cast<std::size_t>(count))) {
        if (has_word(eglQueryDeviceStringEXT(device, EGL_EXTENSIONS), "EGL_MESA_device_software")) continue;
        displays.push_back(eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, device, nullptr));
      }
    }
    if (has_word(client, "EGL_MESA_platform_surfaceless")) {
      displays.push_back(eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr));
    }
  }
  displays.push_back(eglGetDisplay(EGL_DEFAULT_DISPLAY));
  return displays;
}

}  // namespace

void HeadlessContext::close() {
  if (display_ == EGL_NO_DISPLAY) return;
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  if (context_ != EGL_NO_CONTEXT) eglDestroyContext(display_, context_);
  eglTerminate(display_);
  display_ = EGL_NO_DISPLAY;
  context_ = EGL_NO_CONTEXT;
}

void HeadlessContext::open(EGLDisplay where) {
  if (where == EGL_NO_DISPLAY || eglInitialize(where, nullptr, nullptr) != EGL_TRUE) {
    throw refusal("EGL offers no display");
  }
  display_ = where;
  if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) throw refusal("EGL does not offer desktop OpenGL");
  const std::array<EGLint, 5> wanted{EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
  EGLConfig config = nullptr;
  EGLint count = 0;
  if (eglChooseConfig(display_, wanted.data(), &config, 1, &count) != EGL_TRUE || count < 1) {
    throw refusal("EGL has no OpenGL configuration");
  }
  const std::array<EGLint, 7> version{
      EGL_CONTEXT_MAJOR_VERSION,           3,       EGL_CONTEXT_MINOR_VERSION, 3, EGL_CONTEXT_OPENGL_PROFILE_MASK,
      EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
  context_ = eglCreateContext(display_, config, EGL_NO_CONTEXT, version.data());
  if (context_ == EGL_NO_CONTEXT) throw refusal("the driver makes no OpenGL 3.3 core context");
  if (eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) != EGL_TRUE) {
    throw refusal("the context cannot be used without a surface");
  }
}

HeadlessContext::HeadlessContext() {
  const std::vector<EGLDisplay> displays = possible_displays();
  for (std::size_t i = 0; i < displays.size(); ++i) {
    try {
      open(displays[i]);
      return;
    } catch (const Error&) {
      close();
      if (i + 1 == displays.size()) throw;
    }
  }
}

HeadlessContext::~HeadlessContext() {
  close();
}

std::string driver_name() {
  const GLubyte* name = glGetString(GL_RENDERER);
  return name == nullptr ? "unknown" : reinterpret_cast<const char*>(name);
}

bool is_software_driver() {
  const std::string renderer = driver_name();
  return renderer.find("llvmpipe") != std::string::npos || renderer.find("softpipe") != std::string::npos ||
         renderer.find("swrast") != std::string::npos;
}

Offscreen::Offscreen(int width, int height, GLenum colour_format, int samples) : width_(width), height_(height) {
  GLint most = 1;
  glGetIntegerv(GL_MAX_SAMPLES, &most);
  samples = std::min(samples, most);
  const GLsizei stored = samples > 1 ? samples : 0;
  if (samples > 1) resolved_ = std::make_unique<Offscreen>(width, height, colour_format);
  GLint largest = 0;
  glGetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &largest);
  if (width > largest || height > largest) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("a picture of {} x {} pixels: this GL driver draws at most {} x {}", width, height, largest,
                            largest));
  }
  glBindRenderbuffer(GL_RENDERBUFFER, colour_.get());
  glRenderbufferStorageMultisample(GL_RENDERBUFFER, stored, colour_format, width, height);
  glBindRenderbuffer(GL_RENDERBUFFER, depth_.get());
  glRenderbufferStorageMultisample(GL_RENDERBUFFER, stored, GL_DEPTH_COMPONENT32F, width, height);
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

void Offscreen::show() const {
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer_.get());
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
  glBlitFramebuffer(0, 0, width_, height_, 0, 0, width_, height_, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  check_gl("showing a picture");
}

void Offscreen::bind_joined() const {
  bind();
  if (resolved_ == nullptr) return;
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, resolved_->framebuffer_.get());
  glBlitFramebuffer(0, 0, width_, height_, 0, 0, width_, height_, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  resolved_->bind();
}

void Offscreen::write_picture(const std::string& path, bool overwrite) const {
  bind_joined();
  view::write_picture(path, width_, height_, overwrite);
}

std::vector<std::uint8_t> Offscreen::read_rgba8() const {
  bind_joined();
  return read_pixels(width_, height_);
}

void Offscreen::read_rgba32f(std::vector<float>& out) const {
  bind_joined();
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

void write_picture(const std::string& path, int width, int height, bool overwrite) {
  const std::vector<std::uint8_t> rgba = read_pixels(width, height);
  std::vector<std::uint8_t> rgb;
  rgb.reserve(rgba.size() / 4 * 3);
  for (std::size_t i = 0; i < rgba.size(); i += 4) rgb.insert(rgb.end(), {rgba[i], rgba[i + 1], rgba[i + 2]});
  RasterSpec spec;
  spec.width = width;
  spec.height = height;
  spec.sample_type = SampleType::kUint8;
  spec.channels = 3;
  spec.overwrite = overwrite;
  const auto sink = create_raster(path, spec);
  sink->write_rows(std::as_bytes(std::span(rgb)));
  sink->finish();
}

}  // namespace isohf::view
