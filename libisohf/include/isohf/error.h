// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace isohf {

/// What kind of thing went wrong; programs map it to an exit code.
enum class ErrorCode {
  kInvalidArgument,  ///< a parameter or option is out of its range or contradicts another
  kIo,               ///< the operating system refused to read or write
  kUnsupported,      ///< well-formed, but not something that isohf reads
  kCorrupt,          ///< the bytes contradict themselves or their format
  kOutOfMemory,      ///< an allocation failed or would exceed the stated bound
  kCancelled,        ///< the caller asked to stop
  kWarning,          ///< a warning, where the caller asked for none
  kNoElevation,      ///< every sample is nodata
};

/// An error in parts, for programs that read it; empty where not known. A setting goes by its name ("filter"), not by
/// the option of some program.
struct ErrorParts {
  std::string where;     ///< file, member, byte, or setting, from the outside in
  std::string found;     ///< 'found 7, must be even' has 7 here
  std::string required;  ///< and 'even' here
  std::string remedy;    ///< what to do

  /// "where: found 7, must be even; remedy"; "where: found; remedy" where nothing is required.
  [[nodiscard]] std::string text() const {
    std::string all = where.empty() ? std::string() : where + ": ";
    all += required.empty() ? found : "found " + found + ", must be " + required;
    return remedy.empty() ? all : all + "; " + remedy;
  }
};

/// The one exception type that isohf throws. A message says where, what was found, what was required, and the remedy.
/// Messages and warnings name a setting by its member in the options, between backticks, as in "`overwrite` replaces it":
/// how a user sets it is known to the program alone.
class Error : public std::runtime_error {
 public:
  Error(ErrorCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
  Error(ErrorCode code, const ErrorParts& parts) : Error(code, parts.text(), parts) {}
  /// For messages that are no plain sequence of their parts.
  Error(ErrorCode code, const std::string& message, ErrorParts parts)
      : std::runtime_error(message), code_(code), parts_(std::make_shared<ErrorParts>(std::move(parts))) {}

  [[nodiscard]] ErrorCode code() const noexcept { return code_; }
  [[nodiscard]] ErrorParts parts() const { return parts_ ? *parts_ : ErrorParts{}; }

  /// The same error seen from one level further out: "where: message".
  [[nodiscard]] Error within(std::string_view where) const {
    ErrorParts parts = this->parts();
    parts.where = std::string(where) + (parts.where.empty() ? "" : ": " + parts.where);
    return {code_, std::string(where) + ": " + what(), std::move(parts)};
  }
  /// The same error and message where the message says `where` already, or that goes without saying.
  [[nodiscard]] Error at(std::string_view where) const {
    ErrorParts parts = this->parts();
    if (parts.where.empty()) parts.where = where;
    return {code_, what(), std::move(parts)};
  }

 private:
  ErrorCode code_;
  std::shared_ptr<const ErrorParts> parts_;  ///< shared: exceptions are copied, which must not throw
};

/// One line for the user about a result that was made nevertheless, and what kind of news it is.
struct Warning : std::string {
  enum class Kind {
    kNote,              ///< how something was understood, or what looks odd
    kLoss,              ///< samples, their meaning or their position were lost: clamped, made void, cut off, dropped
    kUndeclaredNodata,  ///< a note that samples hold what looks like nodata
  };

  /// One line: texts that come from a file have blanks in place of control characters.
  Warning(std::string text, Kind its_kind = Kind::kNote) : std::string(std::move(text)), kind(its_kind) {
    for (char& c : *this) {
      if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = ' ';
    }
  }
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
