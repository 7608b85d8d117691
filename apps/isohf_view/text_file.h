#pragma once

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>

#include "isohf/error.h"

namespace isohf::view {

/// A text file that is checked to the last byte and has its name once it is complete: NAME.part until then. With an
/// empty path nothing is written. Throws Error{kIo}.
class TextFile {
 public:
  explicit TextFile(const std::string& path) : path_(path) {
    if (path.empty()) return;
    file_ = std::fopen(part().c_str(), "w");
    if (file_ == nullptr) fail();
  }
  ~TextFile() {
    if (file_ == nullptr) return;
    std::fclose(file_);
    std::remove(part().c_str());
  }
  TextFile(const TextFile&) = delete;
  TextFile& operator=(const TextFile&) = delete;
  void line(const std::string& text) {
    if (file_ == nullptr) return;
    if (std::fputs((text + "\n").c_str(), file_) < 0) fail();
  }
  /// Without it the file's last bytes go unchecked.
  void close() {
    if (file_ == nullptr) return;
    std::FILE* file = file_;
    file_ = nullptr;
    if (std::fclose(file) != 0 || std::rename(part().c_str(), path_.c_str()) != 0) fail();
  }

 private:
  [[nodiscard]] std::string part() const { return path_ + ".part"; }
  [[noreturn]] void fail() const {
    throw Error(ErrorCode::kIo, path_ + ": could not be written: " + std::strerror(errno));
  }
  std::string path_;
  std::FILE* file_ = nullptr;
};

}  // namespace isohf::view
