#pragma once

#include <optional>
#include <string>
#include <utility>

#include "formats/io/raw_file.h"
#include "isohf/base/assert.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {

/// Whether `window` lies in a raster and its samples have `bytes`.
[[nodiscard]] inline bool is_window_of(const SourceInfo& info, const Window& window, std::size_t bytes) {
  return window.column >= 0 && window.row >= 0 && window.columns >= 0 && window.rows >= 0 &&
         window.column + window.columns <= info.width && window.row + window.rows <= info.height &&
         bytes == static_cast<std::size_t>(window.columns * window.rows) * size_bytes(info.sample_type);
}

/// A raster whose samples lie in one file.
class FileSource : public HeightSource {
 public:
  [[nodiscard]] const SourceInfo& info() const final { return info_; }

 protected:
  /// Opens the file; whoever derives from this opens another where the samples lie in one.
  FileSource(const std::string& path, std::string format) : file_(path) {
    info_.path = path;
    info_.format = std::move(format);
  }

  [[noreturn]] void fail(ErrorCode code, const std::string& what) const { throw Error(code, info_.path + ": " + what); }

  SourceInfo info_;
  std::optional<RawFile> file_;  ///< never empty
};

}  // namespace isohf
