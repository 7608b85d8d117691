#include "gl/headless_context.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <fmt/format.h>

#include <array>
#include <cstring>

#include "isohf/error.h"

namespace isohf::view {

struct HeadlessContext::State {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;

  ~State() {
    if (display == EGL_NO_DISPLAY) return;
    eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (context != EGL_NO_CONTEXT) eglDestroyContext(display, context);
    eglTerminate(display);
  }
};

namespace {

bool has_word(const char* list, const char* word) {
  return list != nullptr && std::strstr(list, word) != nullptr;
}

[[noreturn]] void refuse(const char* what) {
  throw Error(ErrorCode::kUnsupported,
              fmt::format("no headless OpenGL 3.3: {} (EGL error 0x{:04x}); a GL driver with EGL is required, Mesa's "
                          "software driver will do",
                          what, eglGetError()));
}

EGLDisplay open_display() {
  const char* client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  if (has_word(client, "EGL_EXT_platform_base") && has_word(client, "EGL_MESA_platform_surfaceless")) {
    EGLDisplay display = eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    if (display != EGL_NO_DISPLAY && eglInitialize(display, nullptr, nullptr) == EGL_TRUE) return display;
  }
  EGLDisplay display = eglGetDisplay(EGL_DEFAULT_DISPLAY);
  if (display == EGL_NO_DISPLAY || eglInitialize(display, nullptr, nullptr) != EGL_TRUE) {
    refuse("EGL offers no display");
  }
  return display;
}

}  // namespace

HeadlessContext::HeadlessContext() : state_(std::make_unique<State>()) {
  state_->display = open_display();
  if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) refuse("EGL does not offer desktop OpenGL");
  const std::array<EGLint, 5> wanted{EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
  EGLConfig config = nullptr;
  EGLint count = 0;
  if (eglChooseConfig(state_->display, wanted.data(), &config, 1, &count) != EGL_TRUE || count < 1) {
    refuse("EGL has no OpenGL configuration");
  }
  const std::array<EGLint, 7> version{
      EGL_CONTEXT_MAJOR_VERSION,           3,       EGL_CONTEXT_MINOR_VERSION, 3, EGL_CONTEXT_OPENGL_PROFILE_MASK,
      EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
  state_->context = eglCreateContext(state_->display, config, EGL_NO_CONTEXT, version.data());
  if (state_->context == EGL_NO_CONTEXT) refuse("the driver makes no OpenGL 3.3 core context");
  if (eglMakeCurrent(state_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, state_->context) != EGL_TRUE) {
    refuse("the context cannot be used without a surface");
  }
}

HeadlessContext::~HeadlessContext() = default;

}  // namespace isohf::view
