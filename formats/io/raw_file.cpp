#include "formats/io/raw_file.h"

#include <fmt/core.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstring>

#include "isohf/base/text/text.h"
#include "isohf/error.h"

namespace isohf {
namespace {

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

bool is_file(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(path, ignored);
}

RawFile::RawFile(const std::string& path) : file_(path, File::Mode::kRead), size_bytes_(file_.size_bytes()) {
  struct stat status = {};
  if (::fstat(file_.descriptor(), &status) == 0 && !S_ISREG(status.st_mode)) {
    throw Error(ErrorCode::kIo, path + ": is not a regular file, which is required");
  }
}

void RawFile::read(std::uint64_t offset_bytes, std::span<std::byte> bytes) const {
  const std::size_t got = read_some(offset_bytes, bytes);
  if (got == bytes.size()) return;
  throw Error(ErrorCode::kCorrupt, fmt::format("{}: ends early: {} bytes wanted at byte {}, {} there", path(),
                                               bytes.size(), offset_bytes, got));
}

std::string first_bytes(const RawFile& file, std::uint64_t most_bytes) {
  std::string bytes(static_cast<std::size_t>(std::min(file.size_bytes(), most_bytes)), '\0');
  bytes.resize(file.read_some(0, std::as_writable_bytes(std::span(bytes))));
  return bytes;
}

std::string extension_of(const std::string& path) {
  return lower_case(std::filesystem::path(path).extension().string());
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
