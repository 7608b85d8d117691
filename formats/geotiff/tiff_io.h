#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "isohf/base/file.h"
#include "isohf/error.h"

struct tiff;
struct TIFFOpenOptions;

namespace isohf {

/// A file that libtiff reads and writes at a position of its own. Calls that were interrupted go on, and what fails is
/// kept: libtiff says only that something did.
class TiffIo {
 public:
  /// Throws Error{kIo}.
  TiffIo(const std::string& path, File::Mode mode) : file_(path, mode) {}

  /// What TIFFOpenExt returns; this lives as long as the handle.
  [[nodiscard]] tiff* open(const char* mode, TIFFOpenOptions* options);
  [[nodiscard]] const std::optional<Error>& failure() const { return failure_; }

  // What libtiff calls.
  std::int64_t read(void* bytes, std::int64_t count);
  std::int64_t write(const void* bytes, std::int64_t count);
  std::uint64_t seek(std::uint64_t offset, int whence);
  [[nodiscard]] std::uint64_t size_bytes() const { return file_.size_bytes(); }

 private:
  File file_;
  std::uint64_t at_ = 0;
  std::optional<Error> failure_;  ///< the first
};

}  // namespace isohf
