#pragma once

#include <string>
#include <vector>

#include "isohf/error.h"

namespace isohf {

/// What is wrong with several files, all of it.
class Problems {
 public:
  void add(const Error& error) { add(error.what(), error.code()); }
  void add(const std::string& what, ErrorCode code = ErrorCode::kInvalidArgument) {
    if (all_.empty()) code_ = code;
    all_ += (all_.empty() ? "" : "; ") + what;
  }
  void throw_if_any() const {
    if (!all_.empty()) throw Error(code_, all_);
  }

 private:
  ErrorCode code_ = ErrorCode::kInvalidArgument;
  std::string all_;
};

}  // namespace isohf
