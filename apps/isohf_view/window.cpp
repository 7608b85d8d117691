#include <epoxy/gl.h>
// After epoxy, which replaces GL's own header.
#include <GLFW/glfw3.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "actions.h"
#include "gl/offscreen.h"
#include "isohf/error.h"
#include "output/standard_output.h"
#include "session.h"

namespace isohf::view {
namespace {

std::string glfw_error() {
  const char* text = nullptr;
  glfwGetError(&text);
  return text == nullptr ? "unknown reason" : text;
}

/// GLFW and one window with a current OpenGL 3.3 core context.
class Window {
 public:
  Window(int width, int height, const std::string& title) {
    if (glfwInit() != GLFW_TRUE) throw Error(ErrorCode::kUnsupported, "no window: " + glfw_error());
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
    glfwWindowHint(GLFW_DEPTH_BITS, 24);
    window_ = glfwCreateWindow(width, height, title.c_str(), nullptr, nullptr);
    if (window_ == nullptr) {
      const std::string reason = glfw_error();
      glfwTerminate();
      throw Error(ErrorCode::kUnsupported, "no window with OpenGL 3.3: " + reason);
    }
    glfwMakeContextCurrent(window_);
    glfwSwapInterval(1);
  }
  ~Window() {
    glfwDestroyWindow(window_);
    glfwTerminate();
  }
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;
  [[nodiscard]] GLFWwindow* get() const { return window_; }

 private:
  GLFWwindow* window_ = nullptr;
};

/// Keys and mouse onto a session.
class Controls {
 public:
  Controls(GLFWwindow* window, Session& session) : window_(window), session_(session), start_(session.camera) {
    glfwSetWindowUserPointer(window, this);
    glfwSetKeyCallback(window, [](GLFWwindow* w, int key, int, int action, int) {
      if (action != GLFW_RELEASE) of(w).press(key);
    });
    glfwSetScrollCallback(
        window, [](GLFWwindow* w, double, double steps) { of(w).session_.camera.zoom(std::pow(0.88, steps)); });
    glfwGetCursorPos(window, &mouse_x_, &mouse_y_);
  }

  /// Held keys and drags, `seconds` since the last call.
  void update(double seconds) {
    Camera& camera = session_.camera;
    double speed = 0.6 * camera.distance * seconds;
    if (held(GLFW_KEY_LEFT_SHIFT) || held(GLFW_KEY_RIGHT_SHIFT)) speed *= 4.0;
    if (held(GLFW_KEY_LEFT_CONTROL) || held(GLFW_KEY_RIGHT_CONTROL)) speed *= 0.2;
    camera.move(speed * axis(GLFW_KEY_D, GLFW_KEY_RIGHT, GLFW_KEY_A, GLFW_KEY_LEFT),
                speed * axis(GLFW_KEY_E, GLFW_KEY_PAGE_UP, GLFW_KEY_Q, GLFW_KEY_PAGE_DOWN),
                speed * axis(GLFW_KEY_W, GLFW_KEY_UP, GLFW_KEY_S, GLFW_KEY_DOWN));
    session_.sun_azimuth_deg += 40.0 * seconds * axis(GLFW_KEY_L, GLFW_KEY_L, GLFW_KEY_J, GLFW_KEY_J);
    session_.sun_elevation_deg =
        std::clamp(session_.sun_elevation_deg + 25.0 * seconds * axis(GLFW_KEY_I, GLFW_KEY_I, GLFW_KEY_K, GLFW_KEY_K),
                   -10.0, 90.0);
    double x = 0.0;
    double y = 0.0;
    glfwGetCursorPos(window_, &x, &y);
    const double dx = (x - mouse_x_) / session_.view.height;
    const double dy = (y - mouse_y_) / session_.view.height;
    mouse_x_ = x;
    mouse_y_ = y;
    if (glfwGetMouseButton(window_, GLFW_MOUSE_BUTTON_LEFT) == GLFW_PRESS) {
      // Flying turns the head towards the mouse; orbiting drags the ground along.
      const double sense = camera.kind == Camera::Kind::kFly ? 1.0 : -1.0;
      camera.turn(sense * 2.5 * dx, -sense * 2.5 * dy);
    }
    if (glfwGetMouseButton(window_, GLFW_MOUSE_BUTTON_RIGHT) == GLFW_PRESS) {
      camera.move(-dx * camera.distance, 0.0, dy * camera.distance);
    }
  }

  bool show_figures = true;
  bool show_help = false;
  bool wants_picture = false;

 private:
  static Controls& of(GLFWwindow* window) { return *static_cast<Controls*>(glfwGetWindowUserPointer(window)); }
  [[nodiscard]] bool held(int key) const { return glfwGetKey(window_, key) == GLFW_PRESS; }
  [[nodiscard]] double axis(int plus, int plus_too, int minus, int minus_too) const {
    return (held(plus) || held(plus_too) ? 1.0 : 0.0) - (held(minus) || held(minus_too) ? 1.0 : 0.0);
  }

  void press(int key) {
    ViewState& view = session_.view;
    const auto toggle = [](bool& what) { what = !what; };
    switch (key) {
      case GLFW_KEY_ESCAPE:
        return glfwSetWindowShouldClose(window_, GLFW_TRUE);
      case GLFW_KEY_C:
        return session_.camera.switch_kind();
      case GLFW_KEY_R:
        session_.camera = start_;
        return;
      case GLFW_KEY_M:
        return next_mode();
      case GLFW_KEY_X:
        return toggle(view.wireframe);
      case GLFW_KEY_B:
        return toggle(view.borders);
      case GLFW_KEY_T:
        return toggle(view.plain_switching);
      case GLFW_KEY_U:
        return toggle(session_.shadows);
      case GLFW_KEY_V:
        return toggle(view.beyond);
      case GLFW_KEY_Z:
        return toggle(view.haze);
      case GLFW_KEY_H:
      case GLFW_KEY_F1:
        return toggle(show_help);
      case GLFW_KEY_F:
        return toggle(show_figures);
      case GLFW_KEY_P:
        wants_picture = true;
        return;
      case GLFW_KEY_EQUAL:
      case GLFW_KEY_KP_ADD:
        return exaggerate(1.1);
      case GLFW_KEY_MINUS:
      case GLFW_KEY_KP_SUBTRACT:
        return exaggerate(1.0 / 1.1);
      case GLFW_KEY_LEFT_BRACKET:
        return session_.scale_far(1.0 / 1.15);
      case GLFW_KEY_RIGHT_BRACKET:
        return session_.scale_far(1.15);
      default:
        return;
    }
  }

  void next_mode() {
    std::vector<ColourMode> order{ColourMode::kElevation, ColourMode::kPlain, ColourMode::kLevels, ColourMode::kStrips,
                                  ColourMode::kNormals};
    if (session_.textures() != nullptr) order.insert(order.begin(), ColourMode::kTexture);
    const auto at = std::find(order.begin(), order.end(), session_.view.mode);
    session_.view.mode = at == order.end() || at + 1 == order.end() ? order.front() : *(at + 1);
  }

  /// The pivot stays on the same ground, the eye at the same height above it.
  void exaggerate(double factor) {
    session_.view.exaggeration *= factor;
    const double rise = session_.camera.pivot.y * (factor - 1.0);
    session_.camera.pivot.y += rise;
    session_.camera.eye.y += rise;
  }

  GLFWwindow* window_;
  Session& session_;
  Camera start_;
  double mouse_x_ = 0.0;
  double mouse_y_ = 0.0;
};

/// isohf-0001.png and so on, the first name that is free.
std::string next_picture_name() {
  for (int number = 1;; ++number) {
    std::string name = fmt::format("isohf-{:04}.png", number);
    if (!std::filesystem::exists(name)) return name;
  }
}

}  // namespace

void run_window(const TileSource& source, const Options& options) {
  const Window window(options.view.width, options.view.height, "isohf-view - " + options.archive);
  require_gl();
  Session session(source, options);
  Controls controls(window.get(), session);
  controls.show_figures = options.overlay;
  using Clock = std::chrono::steady_clock;
  auto last = Clock::now();
  double smooth_s = 1.0 / 60.0;
  for (int frame = 1; glfwWindowShouldClose(window.get()) == GLFW_FALSE; ++frame) {
    glfwPollEvents();
    const auto now = Clock::now();
    const double seconds = std::chrono::duration<double>(now - last).count();
    last = now;
    smooth_s += 0.1 * (seconds - smooth_s);
    controls.update(std::min(seconds, 0.1));
    glfwGetFramebufferSize(window.get(), &session.view.width, &session.view.height);
    if (session.view.width < 1 || session.view.height < 1) {
      glfwWaitEventsTimeout(0.1);  // iconified
      continue;
    }
    session.frame();
    session.draw_overlay(1.0 / smooth_s, controls.show_figures, controls.show_help);
    const bool is_last = options.frames > 0 && frame >= options.frames;
    if (is_last && !options.screenshot.empty())
      write_picture(options.screenshot, session.view.width, session.view.height);
    if (controls.wants_picture) {
      controls.wants_picture = false;
      const std::string name = next_picture_name();
      write_picture(name, session.view.width, session.view.height);
      if (!options.common.quiet) cli::print_note("wrote " + name);
    }
    glfwSwapBuffers(window.get());
    if (is_last) break;
  }
}

}  // namespace isohf::view
