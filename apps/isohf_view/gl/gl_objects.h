#pragma once

#include <epoxy/gl.h>

#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace isohf::view {

/// Owns one GL name; the context that made it must be current when it goes. Move-only. The functions' addresses stand
/// for those that epoxy finds when they are first called.
template <PFNGLGENBUFFERSPROC* kGenerate, PFNGLDELETEBUFFERSPROC* kDelete>
class GlName {
 public:
  GlName() { (*kGenerate)(1, &name_); }
  explicit GlName(std::nullptr_t) {}  ///< no name, 0
  GlName(GlName&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  GlName& operator=(GlName&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  GlName(const GlName&) = delete;
  GlName& operator=(const GlName&) = delete;
  ~GlName() {
    if (name_ != 0) (*kDelete)(1, &name_);
  }
  [[nodiscard]] GLuint get() const { return name_; }

 private:
  GLuint name_ = 0;
};

using Buffer = GlName<&glGenBuffers, &glDeleteBuffers>;
using Texture = GlName<&glGenTextures, &glDeleteTextures>;
using VertexArray = GlName<&glGenVertexArrays, &glDeleteVertexArrays>;
using Framebuffer = GlName<&glGenFramebuffers, &glDeleteFramebuffers>;
using Renderbuffer = GlName<&glGenRenderbuffers, &glDeleteRenderbuffers>;

/// A linked vertex and fragment shader with its uniforms' places.
class Program {
 public:
  /// `name` is for messages. `feedback` names vertex outputs to capture, interleaved; usually none.
  /// Throws Error{kUnsupported} with the compiler's words.
  Program(const std::string& name, const std::string& vertex_source, const std::string& fragment_source,
          const std::vector<std::string>& feedback = {});

  void use() const { glUseProgram(name_.value); }
  /// -1, which GL ignores, for a uniform that the linker dropped.
  [[nodiscard]] GLint uniform(const char* uniform_name) const;

 private:
  struct Name {
    Name() = default;
    Name(const Name&) = delete;
    Name& operator=(const Name&) = delete;
    ~Name() { glDeleteProgram(value); }
    GLuint value = glCreateProgram();
  };

  Name name_;
  mutable std::map<std::string, GLint, std::less<>> places_;
};

/// Throws Error{kUnsupported} in one line unless the current context is OpenGL 3.3 or newer and has GL_ARB_clip_control.
void require_gl();

/// Throws Error{kOutOfMemory, kUnsupported} where GL has an error to report; `doing` says what was tried.
void check_gl(const char* doing);

}  // namespace isohf::view
