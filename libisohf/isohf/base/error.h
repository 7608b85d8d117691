#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace isohf {

/// What kind of thing went wrong; programs map it to an exit code.
enum class ErrorCode {
  kInvalidArgument,  ///< a parameter or option is out of its range or contradicts another
  kIo,               ///< the operating system refused to read or write
  kUnsupported,      ///< well-formed, but not something that isohf reads
  kCorrupt,          ///< the bytes contradict themselves or their format
  kOutOfMemory,      ///< an allocation failed or would exceed the stated bound
  kCancelled,        ///< the caller asked to stop
};

/// The one exception type that isohf throws. A message says where, what was found, what was required, and the remedy.
class Error : public std::runtime_error {
 public:
  Error(ErrorCode code, const std::string& message) : std::runtime_error(message), code_(code) {}

  [[nodiscard]] ErrorCode code() const noexcept { return code_; }

  /// The same error seen from one level further out: "where: message".
  [[nodiscard]] Error within(std::string_view where) const { return {code_, std::string(where) + ": " + what()}; }

 private:
  ErrorCode code_;
};

}  // namespace isohf
