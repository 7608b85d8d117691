#pragma once

#include <epoxy/gl.h>

#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace isohf::view {

/// Owns one GL name; the context that made it must be current when it goes. Move-only.
template <GLuint (*kCreate)(), void (*kDestroy)(GLuint)>
class GlName {
 public:
  GlName() : name_(kCreate()) {}
  GlName(GlName&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  GlName& operator=(GlName&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  GlName(const GlName&) = delete;
  GlName& operator=(const GlName&) = delete;
  ~GlName() {
    if (name_ != 0) kDestroy(name_);
  }
  [[nodiscard]] GLuint get() const { return name_; }

 private:
  GLuint name_;
};

namespace detail {
inline GLuint create_buffer() {
  GLuint name = 0;
  glGenBuffers(1, &name);
  return name;
}
inline void destroy_buffer(GLuint name) {
  glDeleteBuffers(1, &name);
}
inline GLuint create_texture() {
  GLuint name = 0;
  glGenTextures(1, &name);
  return name;
}
inline void destroy_texture(GLuint name) {
  glDeleteTextures(1, &name);
}
inline GLuint create_vertex_array() {
  GLuint name = 0;
  glGenVertexArrays(1, &name);
  return name;
}
inline void destroy_vertex_array(GLuint name) {
  glDeleteVertexArrays(1, &name);
}
inline GLuint create_framebuffer() {
  GLuint name = 0;
  glGenFramebuffers(1, &name);
  return name;
}
inline void destroy_framebuffer(GLuint name) {
  glDeleteFramebuffers(1, &name);
}
inline GLuint create_renderbuffer() {
  GLuint name = 0;
  glGenRenderbuffers(1, &name);
  return name;
}
inline void destroy_renderbuffer(GLuint name) {
  glDeleteRenderbuffers(1, &name);
}
inline GLuint create_program() {
  return glCreateProgram();
}
inline void destroy_program(GLuint name) {
  glDeleteProgram(name);
}
}  // namespace detail

using Buffer = GlName<detail::create_buffer, detail::destroy_buffer>;
using Texture = GlName<detail::create_texture, detail::destroy_texture>;
using VertexArray = GlName<detail::create_vertex_array, detail::destroy_vertex_array>;
using Framebuffer = GlName<detail::create_framebuffer, detail::destroy_framebuffer>;
using Renderbuffer = GlName<detail::create_renderbuffer, detail::destroy_renderbuffer>;

/// A linked vertex and fragment shader with its uniforms' places.
class Program {
 public:
  /// `name` is for messages. `feedback` names vertex outputs to capture, interleaved; usually none.
  /// Throws Error{kUnsupported} with the compiler's words.
  Program(const std::string& name, const std::string& vertex_source, const std::string& fragment_source,
          const std::vector<std::string>& feedback = {});

  void use() const { glUseProgram(name_.get()); }
  /// -1, which GL ignores, for a uniform that the linker dropped.
  [[nodiscard]] GLint uniform(const char* uniform_name) const;

 private:
  GlName<detail::create_program, detail::destroy_program> name_;
  mutable std::map<std::string, GLint, std::less<>> places_;
};

/// Throws Error{kUnsupported} in one line unless the current context is OpenGL 3.3 or newer.
void require_gl();

/// "llvmpipe (LLVM 15.0.6, 256 bits), OpenGL 4.5": the renderer in use.
[[nodiscard]] std::string gl_description();

/// Throws Error{kOutOfMemory, kUnsupported} where GL has an error to report; `doing` says what was tried.
void check_gl(const char* doing);

}  // namespace isohf::view
