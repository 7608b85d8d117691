#pragma once

#include <memory>

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

}  // namespace isohf::view
