#include "isohf/archive/part_file.h"

#include <fmt/format.h>

#include "isohf/base/error.h"

namespace isohf {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{4} << 20U;

/// Opens and locks a file, again where it was renamed between the two.
File open_locked(const std::string& path) {
  for (int attempt = 0; attempt < 8; ++attempt) {
    File file(path, File::Mode::kReadWrite);
    if (!file.try_lock()) break;
    if (file.is_at_path()) return file;
  }
  throw Error(ErrorCode::kIo,
              fmt::format("{}: another process is writing it; wait for it, or name another target", path));
}

std::vector<std::byte> room_for(std::size_t bytes) {
  std::vector<std::byte> buffer;
  buffer.reserve(bytes);
  return buffer;
}

}  // namespace

// The buffer before the file: where there is no memory for it, no file must be left.
PartFile::PartFile(const std::string& path) : buffer_(room_for(kBufferBytes)), file_(open_locked(path)) {}

void PartFile::append(std::span<const std::byte> bytes) {
  if (buffer_.size() + bytes.size() > kBufferBytes) flush();
  if (bytes.size() >= kBufferBytes) {
    file_.write_at(flushed_, bytes);
    flushed_ += bytes.size();
    return;
  }
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

void PartFile::flush() {
  if (buffer_.empty()) return;
  file_.write_at(flushed_, buffer_);
  // The disk starts at once, so that the last flush does not wait for all of it.
  file_.start_writeback(flushed_, buffer_.size());
  flushed_ += buffer_.size();
  buffer_.clear();
}

void PartFile::truncate(std::uint64_t size_bytes) {
  file_.truncate(size_bytes);
  flushed_ = size_bytes;
}

void PartFile::sync() {
  flush();
  file_.sync();
}

}  // namespace isohf
