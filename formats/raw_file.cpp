#include "formats/raw_file.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "isohf/base/error.h"

namespace isohf {
namespace {

[[noreturn]] void fail(const std::string& path, const char* what, int error) {
  throw Error(ErrorCode::kIo, fmt::format("{}: {}: {}", path, what, std::generic_category().message(error)));
}

/// Written as shifts on whole words so that the loop vectorises.
template <typename Word, typename Swap>
void swap_words(std::span<std::byte> samples, Swap swap) {
  std::byte* at = samples.data();
  for (std::size_t i = 0; i < samples.size() / sizeof(Word); ++i) {
    Word word;
    std::memcpy(&word, at + i * sizeof(Word), sizeof(Word));
    word = swap(word);
    std::memcpy(at + i * sizeof(Word), &word, sizeof(Word));
  }
}

}  // namespace

RawFile::RawFile(const std::string& path) : path_(path) {
  descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor_ < 0) fail(path, "cannot open", errno);
  struct stat status = {};
  if (::fstat(descriptor_, &status) != 0) {
    const int error = errno;
    ::close(descriptor_);
    fail(path, "cannot open", error);
  }
  if (!S_ISREG(status.st_mode)) {
    ::close(descriptor_);
    throw Error(ErrorCode::kIo, path + (S_ISDIR(status.st_mode) ? ": is a folder, must be a file"
                                                                : ": is not a regular file, which is required"));
  }
  size_bytes_ = static_cast<std::uint64_t>(status.st_size);
}

RawFile::~RawFile() {
  ::close(descriptor_);
}

std::size_t RawFile::read_some(std::uint64_t offset_bytes, std::span<std::byte> bytes) const {
  std::size_t done = 0;
  while (done < bytes.size() && offset_bytes + done < size_bytes_) {
    const ssize_t got =
        ::pread(descriptor_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(offset_bytes + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail(path_, "cannot read", errno);
    if (got == 0) break;
    done += static_cast<std::size_t>(got);
  }
  return done;
}

void RawFile::read(std::uint64_t offset_bytes, std::span<std::byte> bytes) const {
  const std::size_t got = read_some(offset_bytes, bytes);
  if (got == bytes.size()) return;
  throw Error(ErrorCode::kCorrupt, fmt::format("{}: ends early: {} bytes wanted at byte {}, {} there", path_,
                                               bytes.size(), offset_bytes, got));
}

void swap_byte_order(std::span<std::byte> samples, std::size_t sample_bytes) {
  switch (sample_bytes) {
    case 2:
      return swap_words<std::uint16_t>(samples, [](std::uint16_t w) { return __builtin_bswap16(w); });
    case 4:
      return swap_words<std::uint32_t>(samples, [](std::uint32_t w) { return __builtin_bswap32(w); });
    case 8:
      return swap_words<std::uint64_t>(samples, [](std::uint64_t w) { return __builtin_bswap64(w); });
    default:
      return;
  }
}

}  // namespace isohf
