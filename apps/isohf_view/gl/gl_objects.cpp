#include "gl/gl_objects.h"

#include <fmt/format.h>

#include <algorithm>

#include "isohf/error.h"

namespace isohf::view {
namespace {

/// What the driver says of a shader or a program.
template <typename Get, typename GetLog>
std::string log_of(GLuint name, const Get& get, const GetLog& get_log) {
  GLint size = 0;
  get(name, GL_INFO_LOG_LENGTH, &size);
  std::string log(static_cast<std::size_t>(std::max(size, 0)), '\0');
  if (size > 0) get_log(name, size, nullptr, log.data());
  return log;
}

void attach(GLuint program, const std::string& name, GLenum stage, const std::string& source) {
  const GLuint shader = glCreateShader(stage);
  const char* text = source.c_str();
  glShaderSource(shader, 1, &text, nullptr);
  glCompileShader(shader);
  GLint done = GL_FALSE;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &done);
  const std::string log = done == GL_TRUE ? std::string() : log_of(shader, glGetShaderiv, glGetShaderInfoLog);
  glAttachShader(program, shader);
  glDeleteShader(shader);  // lives on with the program
  if (done != GL_TRUE) {
    throw Error(ErrorCode::kUnsupported, fmt::format("the GL driver refused the {} {} shader: {}", name,
                                                     stage == GL_VERTEX_SHADER ? "vertex" : "fragment", log));
  }
}

}  // namespace

Program::Program(const std::string& name, const std::string& vertex_source, const std::string& fragment_source,
                 const std::vector<std::string>& feedback) {
  const GLuint program = name_.value;
  attach(program, name, GL_VERTEX_SHADER, vertex_source);
  attach(program, name, GL_FRAGMENT_SHADER, fragment_source);
  if (!feedback.empty()) {
    std::vector<const char*> outputs;
    for (const std::string& output : feedback) outputs.push_back(output.c_str());
    glTransformFeedbackVaryings(program, static_cast<GLsizei>(outputs.size()), outputs.data(), GL_INTERLEAVED_ATTRIBS);
  }
  glLinkProgram(program);
  GLint done = GL_FALSE;
  glGetProgramiv(program, GL_LINK_STATUS, &done);
  if (done != GL_TRUE) {
    throw Error(ErrorCode::kUnsupported, fmt::format("the GL driver could not link the {} shaders: {}", name,
                                                     log_of(program, glGetProgramiv, glGetProgramInfoLog)));
  }
}

GLint Program::uniform(const char* uniform_name) const {
  auto found = places_.find(uniform_name);
  if (found == places_.end()) {
    found = places_.emplace(uniform_name, glGetUniformLocation(name_.value, uniform_name)).first;
  }
  return found->second;
}

void require_gl() {
  const int version = epoxy_gl_version();
  if (version < 33 || !epoxy_is_desktop_gl()) {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("OpenGL 3.3 is required, this machine offers {}.{}", version / 10, version % 10));
  }
  if (version < 45 && !epoxy_has_gl_extension("GL_ARB_clip_control")) {
    throw Error(ErrorCode::kUnsupported, "this machine's OpenGL has no GL_ARB_clip_control, which is required");
  }
}

void check_gl(const char* doing) {
  const GLenum error = glGetError();
  if (error == GL_NO_ERROR) return;
  if (error == GL_OUT_OF_MEMORY) {
    throw Error(ErrorCode::kOutOfMemory, fmt::format("{}: the GL driver is out of memory", doing));
  }
  throw Error(ErrorCode::kUnsupported, fmt::format("{}: GL error 0x{:04x}", doing, error));
}

}  // namespace isohf::view
