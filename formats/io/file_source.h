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

/// A raster whose samples lie in one file, which may be packed.
class FileSource : public HeightSource {
 public:
  [[nodiscard]] const SourceInfo& info() const final { return info_; }
  void limit_buffers(std::uint64_t bytes) override { file_->limit_buffers(bytes); }
  [[nodiscard]] std::uint64_t buffer_bytes(std::uint64_t limit) const override { return file_->buffer_bytes(limit); }

 protected:
  /// The file is opened by whoever derives from this.
  FileSource(std::string path, std::string format) {
    info_.path = std::move(path);
    info_.format = std::move(format);
  }
  FileSource(const std::string& path, std::string format, const OpenOptions& options)
      : FileSource(path, std::move(format)) {
    file_.emplace(path, options.unpacked_bytes);
  }

  [[noreturn]] void fail(ErrorCode code, const std::string& what) const { throw Error(code, info_.path + ": " + what); }

  SourceInfo info_;
  std::optional<RawFile> file_;
};

}  // namespace isohf
