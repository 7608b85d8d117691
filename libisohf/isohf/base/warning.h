#pragma once

#include <string>
#include <utility>
#include <vector>

namespace isohf {

class Error;

/// One line for the user about a result that was made nevertheless, and what kind of news it is.
struct Warning : std::string {
  enum class Kind {
    kNote,  ///< how something was understood, or what looks odd
    kLoss,  ///< samples, their meaning or their place were lost: clamped, made void, cut off, dropped
  };

  Warning(std::string text, Kind its_kind = Kind::kNote) : std::string(std::move(text)), kind(its_kind) {}
  Warning(const char* text) : Warning(std::string(text)) {}

  /// The same kind of news in other words.
  [[nodiscard]] Warning reworded(std::string text) const { return {std::move(text), kind}; }

  Kind kind;
};

/// A warning that says what was lost.
[[nodiscard]] inline Warning loss(std::string text) {
  return {std::move(text), Warning::Kind::kLoss};
}

/// Error{kWarning}: what these are to a caller that wants none.
[[nodiscard]] Error error_from(const std::vector<Warning>& warnings);

}  // namespace isohf
