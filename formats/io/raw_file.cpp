#include "formats/io/raw_file.h"

#include <fmt/core.h>
#include <sys/stat.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <vector>

#include "formats/io/text.h"
#include "isohf/base/bytes.h"
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

/// Of all bytes, in pieces.
std::uint32_t crc_of(const RawFile& file) {
  std::vector<std::byte> piece(std::size_t{1} << 16U);
  uLong crc = ::crc32(0, nullptr, 0);
  for (std::uint64_t at = 0; at < file.size_bytes();) {
    const std::size_t got = file.read_some(at, piece);
    if (got == 0) break;
    crc = ::crc32_z(crc, reinterpret_cast<const Bytef*>(piece.data()), got);
    at += got;
  }
  return static_cast<std::uint32_t>(crc);
}

/// Whoever leaves readers this much can spare what modest contents take as well.
constexpr std::uint64_t kRoomyBytes = std::uint64_t{4} << 20U;

bool may_hold(std::uint64_t contents_bytes, std::uint64_t limit) {
  return contents_bytes <= (limit >= kRoomyBytes ? std::max(limit, RawFile::kMostHeldBytes) : limit);
}

/// Millions of members: no raster's archive has so many, damaged sizes do.
constexpr std::uint64_t kMostDirectoryBytes = std::uint64_t{256} << 20U;

/// The file's bytes as zip.h reads them.
class FileBytes final : public ByteSource {
 public:
  explicit FileBytes(const RawFile& file) : file_(file) {}
  [[nodiscard]] std::uint64_t size_bytes() const override { return file_.size_bytes(); }
  [[nodiscard]] std::size_t read(std::uint64_t offset_bytes, std::span<std::byte> out) const override {
    return file_.read_some(offset_bytes, out);
  }

 private:
  const RawFile& file_;
};

}  // namespace

bool is_file(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(path, ignored);
}

bool is_gzip_name(const std::string& path) {
  const std::string end =
      lower_case(std::string_view(path).substr(path.size() - std::min<std::size_t>(path.size(), 4)));
  return path.size() > 3 && (end.ends_with(".gz") || (path.size() > 4 && end == ".tgz"));
}

std::string without_gzip(const std::string& path) {
  if (!is_gzip_name(path)) return path;
  const std::string name = path.substr(0, path.size() - 3);
  return name.back() == '.' ? name + "tar" : name;  // of .tgz
}

RawFile::RawFile(const std::string& path, std::uint64_t held_bytes)
    : path_(path), file_(path, File::Mode::kRead), size_bytes_(file_.size_bytes()) {
  struct stat status = {};
  if (::fstat(file_.descriptor(), &status) == 0 && !S_ISREG(status.st_mode)) {
    throw Error(ErrorCode::kIo, path + ": is not a regular file, which is required");
  }
  if (!is_gzip_name(path)) return;
  std::array<std::byte, 3> head = {};
  if (looks_like_gzip(std::span(head).first(file_.read_at(0, head)))) unpack_gzip(held_bytes);
}

RawFile::RawFile(const std::string& path, const ZipEntry& member, std::uint64_t held_bytes)
    : RawFile(path, held_bytes) {
  unpack_member(member, held_bytes);
}

void RawFile::unpack_gzip(std::uint64_t held_bytes) {
  packed_ = {0, size_bytes_, InflatedBytes::Kind::kGzip};
  held_bytes = std::min(held_bytes, kMostHeldBytes);
  if (packed_.stored_bytes <= held_bytes) held_ = UnpackedBytes::from_gzip(stored_bytes(), held_bytes);
  if (!held_) inflated_ = std::make_unique<InflatedBytes>(path_, packed_reader(), packed_.kind);
  size_bytes_ = held_ ? held_->bytes().size() : inflated_->size_bytes();
}

void RawFile::unpack_member(const ZipEntry& member, std::uint64_t held_bytes) {
  const std::uint64_t begin = zipped_file_begin(*this, member);
  if (member.method == ZipMethod::kStored) {
    begin_bytes_ = begin;
    size_bytes_ = member.compressed_bytes;
  } else {
    packed_ = {begin, member.compressed_bytes, InflatedBytes::Kind::kRawDeflate};
    held_bytes = std::min(held_bytes, kMostHeldBytes);
    if (member.compressed_bytes <= held_bytes && member.bytes <= held_bytes) {
      held_ = UnpackedBytes::from_deflated(stored_bytes(), member.bytes, member.crc32);
    }
    if (held_) {
      size_bytes_ = member.bytes;
      return;
    }
    inflated_ = std::make_unique<InflatedBytes>(path_, packed_reader(), packed_.kind);
    size_bytes_ = inflated_->size_bytes();
  }
  const std::uint32_t crc = inflated_ ? inflated_->crc32() : crc_of(*this);
  if (size_bytes_ != member.bytes || crc != member.crc32) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("{}: {} is damaged: its {} do not match", path_, member.name,
                            size_bytes_ != member.bytes ? "size and the zip directory's" : "CRC and bytes"));
  }
}

std::vector<std::byte> RawFile::stored_bytes() const {
  std::vector<std::byte> stored(static_cast<std::size_t>(packed_.stored_bytes));
  stored.resize(file_.read_at(packed_.begin_bytes, stored));
  return stored;
}

InflatedBytes::ReadStored RawFile::packed_reader() const {
  return [this](std::uint64_t offset, std::span<std::byte> bytes) {
    if (offset >= packed_.stored_bytes) return std::size_t{0};
    const std::uint64_t most = std::min<std::uint64_t>(bytes.size(), packed_.stored_bytes - offset);
    return file_.read_at(packed_.begin_bytes + offset, bytes.first(static_cast<std::size_t>(most)));
  };
}

void RawFile::limit_buffers(std::uint64_t limit) {
  if (!held_ || may_hold(size_bytes_, limit)) return;
  inflated_ = std::make_unique<InflatedBytes>(path_, packed_reader(), packed_.kind, size_bytes_);
  held_.reset();
}

std::uint64_t RawFile::buffer_bytes(std::uint64_t limit) const {
  if (held_ && may_hold(size_bytes_, limit)) return size_bytes_;
  return held_ || inflated_ ? InflatedBytes::memory_bytes(size_bytes_) : 0;
}

std::size_t RawFile::read_some(std::uint64_t offset_bytes, std::span<std::byte> bytes) const {
  if (offset_bytes >= size_bytes_) return 0;
  bytes = bytes.first(static_cast<std::size_t>(std::min<std::uint64_t>(bytes.size(), size_bytes_ - offset_bytes)));
  if (held_) {
    std::memcpy(bytes.data(), held_->bytes().data() + offset_bytes, bytes.size());
    return bytes.size();
  }
  if (!inflated_) return file_.read_at(begin_bytes_ + offset_bytes, bytes);
  const std::lock_guard lock(one_inflates_);
  return inflated_->read_some(offset_bytes, bytes);
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

std::vector<ZipEntry> zipped_files(const RawFile& file) {
  const FileBytes bytes(file);
  try {
    const std::optional<ZipEnd> end = find_zip_end(bytes);
    if (!end) {
      throw Error(ErrorCode::kCorrupt, "is truncated or no zip archive: its directory's end is not there");
    }
    if (end->directory_bytes > kMostDirectoryBytes) {
      throw Error(ErrorCode::kUnsupported, fmt::format("the zip directory has {} bytes, at most {} are read",
                                                       end->directory_bytes, kMostDirectoryBytes));
    }
    std::vector<ZipEntry> members;
    for (ZipEntries all(bytes, *end); std::optional<ZipEntry> entry = all.next();) {
      entry->name = one_line(entry->name);
      members.push_back(std::move(*entry));
    }
    return members;
  } catch (const Error& error) {
    throw error.within(file.path());
  }
}

std::uint64_t zipped_file_begin(const RawFile& file, const ZipEntry& member) {
  if (member.is_encrypted || (member.method != ZipMethod::kStored && member.method != ZipMethod::kDeflated)) {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("{}: {} is {}; stored and deflated members are read", file.path(), member.name,
                            member.is_encrypted ? std::string("encrypted")
                                                : fmt::format("packed by method {}", static_cast<int>(member.method))));
  }
  try {
    return read_local_header(FileBytes(file), member).data_offset;
  } catch (const Error& error) {
    throw error.within(file.path());
  }
}

}  // namespace isohf
