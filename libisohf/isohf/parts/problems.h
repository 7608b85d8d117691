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
  /// What to do, once for all of them.
  void set_remedy(const std::string& remedy) { remedy_ = remedy; }
  void throw_if_any() const {
    if (!all_.empty()) throw Error(code_, remedy_.empty() ? all_ : all_ + "; " + remedy_);
  }

 private:
  ErrorCode code_ = ErrorCode::kInvalidArgument;
  std::string all_;
  std::string remedy_;
};

}  // namespace isohf
