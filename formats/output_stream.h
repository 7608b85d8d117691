#pragma once

#include <cstddef>
#include <cstdio>
#include <span>
#include <string>
#include <string_view>

namespace isohf {

/// A file written from its beginning to its end; every failure is an Error{kIo} without the path. Closes itself.
class OutputStream {
 public:
  explicit OutputStream(const std::string& path);
  OutputStream(const OutputStream&) = delete;
  OutputStream& operator=(const OutputStream&) = delete;
  ~OutputStream();

  void write(std::span<const std::byte> bytes);
  void write(std::string_view text) { write(std::as_bytes(std::span(text))); }
  /// Reports what the system could not write until now.
  void close();

 private:
  std::FILE* file_;
};

}  // namespace isohf
