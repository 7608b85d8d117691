#include <epoxy/gl.h>
// After epoxy, which replaces GL's own header.
#include <GLFW/glfw3.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "actions.h"
#include "gl/offscreen.h"
#include "interrupt.h"
#include "isohf/error.h"
#include "opening.h"
#include "output/report.h"
#include "output/standard_output.h"
#include "reading/place.h"
#include "session.h"
#include "steering.h"

namespace isohf::view {
namespace {

/// How long an idle window sleeps at most: workers that have failed are then seen.
constexpr double kIdle_s = 0.5;

std::string glfw_error() {
  const char* text = nullptr;
  glfwGetError(&text);
  return text == nullptr ? "unknown reason" : text;
}

const std::vector<std::string> kHelpLines{"left drag    move the ground         wheel         zoom",
                                          "right drag   orbit                   double click  fly there",
                                          "W A S D      fly, arrows too         Q E           down, up",
                                          "Shift, Ctrl  faster, slower          [ ]           far distance",
                                          "Home         the whole terrain       R             first view",
                                          "J L          turn the sun            I K           raise, lower it",
                                          "O            sun of a day            , .           earlier, later",
                                          "U            shadows                 X             wireframe",
                                          "M            colours                 + -           exaggeration",
                                          "Y            measure from, to        F             more, no figures",
                                          "P            save a picture          H, Esc        help, quit"};

constexpr const char* kWithoutWindow = "; --screenshot PICTURE.png draws without one";

/// GLFW and one window with a current OpenGL 3.3 core context.
class Window {
 public:
  Window(int width, int height, const std::string& title) {
    if (glfwInit() != GLFW_TRUE) throw Error(ErrorCode::kUnsupported, "no window: " + glfw_error() + kWithoutWindow);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
    glfwWindowHint(GLFW_DEPTH_BITS, 24);
    window_ = glfwCreateWindow(width, height, title.c_str(), nullptr, nullptr);
    if (window_ == nullptr) {
      const std::string reason = glfw_error();
      glfwTerminate();
      throw Error(ErrorCode::kUnsupported, "no window with OpenGL 3.3: " + reason + kWithoutWindow);
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

/// Keys and mouse onto a session. All comes by callback, so that no click is lost between two slow frames.
class Controls {
 public:
  Controls(GLFWwindow* window, Session& session, const cli::Common& common)
      : window_(window),
        common_(common),
        session_(session),
        ground_(session.source()),
        steering_(session.source(), ground_, session.camera, session.view),
        start_(session.camera) {
    glfwSetWindowUserPointer(window_, this);
    glfwSetKeyCallback(window, [](GLFWwindow* w, int key, int, int action, int) {
      of(w).changed_ = true;
      if (action == GLFW_PRESS) of(w).tapped_.insert(key);
      if (action != GLFW_RELEASE) of(w).press(key);
    });
    glfwSetMouseButtonCallback(window, [](GLFWwindow* w, int button, int action, int) { of(w).click(button, action); });
    glfwSetCursorPosCallback(window, [](GLFWwindow* w, double x, double y) { of(w).move(x, y); });
    glfwSetScrollCallback(window, [](GLFWwindow* w, double, double steps) {
      of(w).changed_ = true;
      of(w).steering_.wheel(steps, of(w).cursor_);
    });
    glfwSetWindowRefreshCallback(window, [](GLFWwindow* w) { of(w).touched_ = true; });
    glfwSetCursorEnterCallback(window, [](GLFWwindow* w, int inside) {
      of(w).touched_ = true;
      of(w).inside_ = inside == GLFW_TRUE;
    });
  }

  enum class Change { kNone, kReading, kPicture };  ///< kReading: of what is read over the picture alone
  /// Held keys and what goes on by itself, `seconds` since the last call: what has changed since.
  Change update(double seconds) {
    const bool reading = std::exchange(touched_, false);
    const bool moves = std::exchange(changed_, false) || steering_.is_flying();
    const double hurry = held(GLFW_KEY_LEFT_SHIFT) || held(GLFW_KEY_RIGHT_SHIFT)       ? 4.0
                         : held(GLFW_KEY_LEFT_CONTROL) || held(GLFW_KEY_RIGHT_CONTROL) ? 0.2
                                                                                       : 1.0;
    const Vec3 walk{axis(GLFW_KEY_D, GLFW_KEY_RIGHT, GLFW_KEY_A, GLFW_KEY_LEFT),
                    axis(GLFW_KEY_E, GLFW_KEY_PAGE_UP, GLFW_KEY_Q, GLFW_KEY_PAGE_DOWN),
                    axis(GLFW_KEY_W, GLFW_KEY_UP, GLFW_KEY_S, GLFW_KEY_DOWN)};
    steering_.update(seconds, walk, hurry);
    const double round = axis(GLFW_KEY_L, GLFW_KEY_L, GLFW_KEY_J, GLFW_KEY_J);
    const double up = axis(GLFW_KEY_I, GLFW_KEY_I, GLFW_KEY_K, GLFW_KEY_K);
    const double later = axis(GLFW_KEY_PERIOD, GLFW_KEY_PERIOD, GLFW_KEY_COMMA, GLFW_KEY_COMMA);
    if (later != 0.0 && session_.hours()) session_.set_hours(*session_.hours() + 2.0 * seconds * later);
    if (round != 0.0 || up != 0.0) session_.end_day();
    session_.sun_azimuth_deg += 40.0 * seconds * round;
    if (up != 0.0) {
      session_.sun_elevation_deg = std::clamp(session_.sun_elevation_deg + 25.0 * seconds * up, -10.0, 90.0);
    }
    tapped_.clear();
    if (moves || !(walk == Vec3{}) || round != 0.0 || up != 0.0 || later != 0.0) return Change::kPicture;
    return reading ? Change::kReading : Change::kNone;
  }

  /// With what is under the cursor, and what is measured.
  [[nodiscard]] Reading reading(double frames_per_second) {
    Reading reading = session_.reading(show_figures, steering_.middle(), frames_per_second);
    if (show_help) reading.help = kHelpLines;
    std::vector<std::string> lines;
    if (!message.empty()) lines.push_back(message);
    const auto there = inside_ ? steering_.pick(cursor_) : std::nullopt;
    if (there) {
      for (std::string& line : lines_of(describe(*there))) lines.push_back(std::move(line));
    }
    const std::optional<Vec3> end = measured_to_ ? measured_to_ : there ? std::optional(true_place(*there)) : there;
    if (measured_from_ && end) {
      const TileSource& source = session_.source();
      const Vec3 way = *end - *measured_from_;
      const double rise = way.y / source.world_per_elevation();
      const std::string unit = source.height_unit().empty() ? "" : fmt::format(" {}", short_unit(source.height_unit()));
      lines.push_back(fmt::format(
          "{} away, {:.{}f}{} {}",
          describe_length(distance_between(source, {measured_from_->x, measured_from_->z}, {end->x, end->z}),
                          source.ground_unit()),
          std::abs(rise), source.describe({end->x, end->z}, end->y).decimals, unit, rise < 0.0 ? "lower" : "higher"));
    }
    if (measured_from_) {
      for (const Vec3 at : measured_way(end)) reading.way.push_back(project(session_.camera, session_.view, at));
    }
    if (show_figures != Session::Figures::kNone) {
      reading.figures.insert(reading.figures.end(), lines.begin(), lines.end());
    }
    reading.profile = profile_;
    return reading;
  }

  /// As drawn: over the ground once both ends stand.
  [[nodiscard]] std::vector<Vec3> measured_way(const std::optional<Vec3>& end) const {
    const auto drawn = [this](Vec3 at) { return Vec3{at.x, at.y * session_.view.exaggeration, at.z}; };
    std::vector<Vec3> way{drawn(*measured_from_)};
    if (profile_ && measured_to_) {
      const double last = static_cast<double>(profile_->heights.size() - 1);
      for (std::size_t i = 1; i + 1 < profile_->heights.size(); ++i) {
        const double height = profile_->heights[i] * session_.source().world_per_elevation();
        if (std::isnan(height)) continue;
        const double share = static_cast<double>(i) / last;
        way.push_back(drawn({std::lerp(measured_from_->x, measured_to_->x, share), height,
                             std::lerp(measured_from_->z, measured_to_->z, share)}));
      }
    }
    if (end) way.push_back(drawn(*end));
    return way;
  }

  [[nodiscard]] double screen_scale() const {
    float x = 1.0F;
    float y = 1.0F;
    glfwGetWindowContentScale(window_, &x, &y);
    return std::max(1.0F, y);
  }
  /// nullopt: no ground.
  [[nodiscard]] std::optional<Place> under_cursor() {
    const auto there = inside_ ? steering_.pick(cursor_) : std::nullopt;
    return there ? std::optional(describe(*there)) : std::nullopt;
  }

  /// As drawn, without exaggeration.
  [[nodiscard]] double height_above_ground() { return steering_.height_above_ground() / session_.view.exaggeration; }

  Session::Figures show_figures = Session::Figures::kPlace;
  bool show_help = false;
  bool wants_picture = false;
  std::string message;  ///< stands among the figures

 private:
  static Controls& of(GLFWwindow* window) { return *static_cast<Controls*>(glfwGetWindowUserPointer(window)); }
  [[nodiscard]] bool held(int key) const { return glfwGetKey(window_, key) == GLFW_PRESS || tapped_.count(key) != 0; }
  [[nodiscard]] double axis(int plus, int plus_too, int minus, int minus_too) const {
    return (held(plus) || held(plus_too) ? 1.0 : 0.0) - (held(minus) || held(minus_too) ? 1.0 : 0.0);
  }

  /// Of a place as drawn: without exaggeration.
  [[nodiscard]] Vec3 true_place(Vec3 drawn) const { return {drawn.x, drawn.y / session_.view.exaggeration, drawn.z}; }
  [[nodiscard]] Place describe(Vec3 at) const {
    const Vec3 place = true_place(at);
    return session_.source().describe({place.x, place.z}, place.y);
  }

  void move(double x, double y) {
    // From the window's coordinates to pixels, which on some screens are finer.
    int width = 1;
    int height = 1;
    glfwGetWindowSize(window_, &width, &height);
    cursor_ = {x * session_.view.width / std::max(width, 1), y * session_.view.height / std::max(height, 1)};
    inside_ = touched_ = true;
    if (slides_ || steering_.is_dragging()) changed_ = true;
    if (!slides_) return steering_.move(cursor_);
    if (const auto hours = slider_hours()) session_.set_hours(*hours);
  }

  void click(int button, int action) {
    touched_ = true;
    if (action == GLFW_RELEASE) return slides_ = false, steering_.release();
    if (const auto hours = slider_hours(); hours && button == GLFW_MOUSE_BUTTON_LEFT) {
      slides_ = changed_ = true;
      return session_.set_hours(*hours);
    }
    const double now = glfwGetTime();
    const bool twice = button == GLFW_MOUSE_BUTTON_LEFT && now - last_click_s_ < kDoubleClick_s &&
                       std::hypot(cursor_.x - last_click_.x, cursor_.y - last_click_.y) < 6.0;
    last_click_s_ = button == GLFW_MOUSE_BUTTON_LEFT && !twice ? now : -1.0;
    last_click_ = cursor_;
    if (twice) return steering_.approach(cursor_);
    steering_.press(button == GLFW_MOUSE_BUTTON_LEFT ? Steering::Drag::kPan : Steering::Drag::kOrbit, cursor_);
  }

  /// Under the cursor; nullopt beside the slider, or where there is none.
  [[nodiscard]] std::optional<double> slider_hours() const {
    if (!session_.hours()) return std::nullopt;
    return Hud::slider_hours(cursor_.x, cursor_.y, session_.view.width, session_.view.height, screen_scale());
  }

  void press(int key) {
    ViewState& view = session_.view;
    const auto toggle = [](bool& what) { what = !what; };
    switch (key) {
      case GLFW_KEY_ESCAPE:
        return glfwSetWindowShouldClose(window_, GLFW_TRUE);
      case GLFW_KEY_R:
        return steering_.go_to(start_);
      case GLFW_KEY_HOME:
        return steering_.go_to(overview_camera(session_.source(), view));
      case GLFW_KEY_Y:
        return measure();
      case GLFW_KEY_O:
        return toggle_day();
      case GLFW_KEY_M:
        return next_mode();
      case GLFW_KEY_X:
        return toggle(view.wireframe);
      case GLFW_KEY_U:
        return toggle(session_.shadows);
      case GLFW_KEY_H:
      case GLFW_KEY_F1:
        return toggle(show_help);
      case GLFW_KEY_F:
        show_figures = show_figures == Session::Figures::kPlace ? Session::Figures::kAll
                       : show_figures == Session::Figures::kAll ? Session::Figures::kNone
                                                                : Session::Figures::kPlace;
        return;
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

  /// From here, to here, no more.
  void measure() {
    profile_.reset();
    if (measured_to_) return measured_from_.reset(), measured_to_.reset();
    auto here = steering_.pick(cursor_);
    if (here) here = true_place(*here);
    if (!measured_from_) return static_cast<void>(measured_from_ = here);
    measured_to_ = here;
    if (here) {
      profile_ =
          profile_between(session_.source(), ground_, {measured_from_->x, measured_from_->z}, {here->x, here->z});
    }
  }

  /// The sun of today, where its way is known.
  void toggle_day() {
    if (session_.hours()) return session_.leave_day();
    const std::chrono::year_month_day today{std::chrono::floor<std::chrono::days>(std::chrono::system_clock::now())};
    try {
      session_.begin_day({static_cast<int>(today.year()), static_cast<int>(static_cast<unsigned>(today.month())),
                          static_cast<int>(static_cast<unsigned>(today.day()))});
    } catch (const Error& error) {
      message = error.what();
      cli::print_note(common_, message);
    }
  }

  void next_mode() {
    const std::vector<ColourMode> order = session_.modes();
    const auto at = std::find(order.begin(), order.end(), session_.view.mode);
    session_.view.mode = at == order.end() || at + 1 == order.end() ? order.front() : *(at + 1);
  }

  /// The eye stays at the same height above the ground under the middle of the picture.
  void exaggerate(double factor) {
    const Vec3 middle = steering_.hold({0.5 * session_.view.width, 0.5 * session_.view.height});
    session_.view.exaggeration *= factor;
    session_.camera.eye.y += middle.y * (factor - 1.0);
    steering_.update(0.0, {}, 1.0);
  }

  static constexpr double kDoubleClick_s = 0.35;

  GLFWwindow* window_;
  const cli::Common& common_;
  Session& session_;
  Ground ground_;
  Steering steering_;
  Camera start_;
  PicturePoint cursor_;
  bool inside_ = false;                ///< the cursor, the window
  bool changed_ = true;                ///< what the picture shows
  bool touched_ = false;               ///< what is read over it
  std::set<int> tapped_;               ///< keys pressed since the last frame
  bool slides_ = false;                ///< the left button holds the time slider
  std::optional<Vec3> measured_from_;  ///< without exaggeration
  std::optional<Vec3> measured_to_;
  std::optional<Profile> profile_;
  double last_click_s_ = -1.0;
  PicturePoint last_click_;
};

/// isohf-0001.png and so on, the first name that is free.
std::string next_picture_name() {
  for (int number = 1;; ++number) {
    std::string name = fmt::format("isohf-{:04}.png", number);
    if (!std::filesystem::exists(name)) return name;
  }
}

}  // namespace

void run_window(const Options& options) {
  const std::unique_ptr<TileSource> source = open_shown(options);
  const Window window(options.view.width, options.view.height, fmt::format("isohf-view - {}", options.archive));
  require_gl();
  Session session(*source, options);
  Controls controls(window.get(), session, options.common);
  std::optional<Offscreen> picture;  // the last one
  using Clock = std::chrono::steady_clock;
  auto last = Clock::now();
  double smooth_s = 1.0 / 60.0;
  const std::atomic<bool>& interrupted = cli::watch_interrupts();
  std::int64_t drawn = 0;
  while (glfwWindowShouldClose(window.get()) == GLFW_FALSE) {
    if (interrupted) throw Error(ErrorCode::kCancelled, "interrupted");
    glfwPollEvents();
    const auto now = Clock::now();
    const double seconds = std::chrono::duration<double>(now - last).count();
    last = now;
    const Controls::Change change = controls.update(std::min(seconds, 0.1));
    const bool moves = change == Controls::Change::kPicture;
    int width = 0;
    int height = 0;
    glfwGetFramebufferSize(window.get(), &width, &height);
    const bool iconified = width < 1 || height < 1;
    // Where nothing moves and nothing is to come the picture stays; an event wakes us.
    const bool fits = picture && picture->width() == width && picture->height() == height;
    const bool stays = fits && !moves && session.is_settled();
    if (iconified || (stays && change == Controls::Change::kNone)) {
      glfwWaitEventsTimeout(kIdle_s);
      last = Clock::now();
      continue;
    }
    smooth_s += 0.1 * (seconds - smooth_s);
    if (!stays) {
      session.view.width = width;
      session.view.height = height;
      if (!fits) picture.emplace(width, height, GL_RGBA8, kPictureSamples);
      picture->bind();
      session.frame();
      ++drawn;
    }
    if (controls.wants_picture) {
      controls.wants_picture = false;
      const std::string name = std::filesystem::absolute(next_picture_name()).string();
      try {
        picture->write_picture(name, false);
        controls.message = "wrote " + name;
      } catch (const Error& error) {
        controls.message = error.what();
      }
      if (!options.common.quiet) cli::print_note(options.common, controls.message);
    }
    picture->show();
    session.draw_overlay(controls.reading(1.0 / smooth_s), controls.screen_scale());
    glfwSwapBuffers(window.get());
  }
  if (!options.common.json) return;
  const Camera& camera = session.camera;
  const Vec3 eye = session.eye_in_archive();
  const std::optional<Place> place = controls.under_cursor();
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  cli::Report({{"archive", options.archive},
               {"eye", {eye.x, eye.y, eye.z}},
               {"heading_deg", camera.heading_rad * kDegrees},
               {"pitch_deg", camera.pitch_rad * kDegrees},
               {"exaggeration", session.view.exaggeration},
               {"under_cursor", place ? json_of(*place) : nlohmann::ordered_json()},
               {"height_above_ground", controls.height_above_ground()},
               {"sun_azimuth_deg", session.sun_azimuth_deg},
               {"sun_elevation_deg", session.sun_elevation_deg},
               {"triangles", session.figures().triangles},
               {"frames", drawn}})
      .print(options.common);
}

}  // namespace isohf::view
