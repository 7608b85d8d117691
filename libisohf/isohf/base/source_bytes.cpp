#include "isohf/base/source_bytes.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "isohf/base/file.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// Reads, and maps nothing: the system kills a process that looks at mapped bytes which another program has cut off.
class FileSource final : public ByteSource {
 public:
  explicit FileSource(const std::string& path) : file_(path, File::Mode::kRead), size_(file_.size_bytes()) {
    file_.leave_path_to_caller();
  }

  [[nodiscard]] std::uint64_t size_bytes() const override { return size_; }

  [[nodiscard]] std::size_t read(std::uint64_t offset_bytes, std::span<std::byte> out) const override {
    const std::size_t count = file_.read_at(offset_bytes, out);
    if (count == out.size()) return count;
    const std::uint64_t now = file_.size_bytes();
    if (now >= size_) return count;
    throw Error(ErrorCode::kIo,
                fmt::format("has {} bytes, had {} when it was opened: another program cut it; no file may be changed "
                            "while it is read",
                            now, size_),
                {"", fmt::format("{} bytes", now), fmt::format("{} bytes", size_), ""});
  }

 private:
  File file_;
  std::uint64_t size_;
};

class MemorySource final : public ByteSource {
 public:
  explicit MemorySource(std::vector<std::byte> bytes) : bytes_(std::move(bytes)) {}

  [[nodiscard]] std::uint64_t size_bytes() const override { return bytes_.size(); }
  [[nodiscard]] std::size_t read(std::uint64_t offset_bytes, std::span<std::byte> out) const override {
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(offset_bytes), out.size(), out.begin());
    return out.size();
  }
  [[nodiscard]] std::span<const std::byte> view(std::uint64_t offset_bytes, std::size_t size_bytes) const override {
    return std::span(bytes_).subspan(offset_bytes, size_bytes);
  }

 private:
  std::vector<std::byte> bytes_;
};

}  // namespace

void require_range(const ByteSource& source, std::uint64_t offset_bytes, std::uint64_t size_bytes) {
  const std::uint64_t all = source.size_bytes();
  if (offset_bytes > all || size_bytes > all - offset_bytes) {
    throw Error(ErrorCode::kIo,
                fmt::format("ends at byte {}, before the end of {} bytes at byte {}", all, size_bytes, offset_bytes));
  }
}

std::shared_ptr<const ByteSource> open_file_source(const std::string& path) {
  return std::make_shared<FileSource>(path);
}

std::shared_ptr<const ByteSource> memory_source(std::vector<std::byte> bytes) {
  return std::make_shared<MemorySource>(std::move(bytes));
}

void read_exactly(const ByteSource& source, std::uint64_t offset_bytes, std::span<std::byte> out) {
  require_range(source, offset_bytes, out.size());
  while (!out.empty()) {
    const std::size_t count = source.read(offset_bytes, out);
    if (count == 0 || count > out.size()) {
      throw Error(ErrorCode::kIo, fmt::format("{} of {} bytes were read at byte {}", count, out.size(), offset_bytes));
    }
    offset_bytes += count;
    out = out.subspan(count);
  }
}

SourceBytes::SourceBytes(const ByteSource& source, std::uint64_t offset_bytes, std::uint64_t size_bytes) {
  if (size_bytes == 0) return;
  require_range(source, offset_bytes, size_bytes);
  view_ = source.view(offset_bytes, size_bytes);
  if (view_.size() == size_bytes) return;
  view_ = {};
  copy_.resize(size_bytes);
  read_exactly(source, offset_bytes, copy_);
}

std::vector<std::byte> SourceBytes::take() && {
  if (copy_.empty()) return {view_.begin(), view_.end()};
  return std::move(copy_);
}

}  // namespace isohf
