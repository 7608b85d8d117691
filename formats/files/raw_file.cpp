#include "formats/files/raw_file.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <system_error>
#include <vector>

#include "formats/files/text.h"
#include "isohf/base/bytes.h"
#include "isohf/error.h"

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

constexpr std::uint32_t kEndSignature = 0x06054B50;
constexpr std::uint32_t kEntrySignature = 0x02014B50;
constexpr std::uint32_t kHeaderSignature = 0x04034B50;
constexpr std::size_t kEndBytes = 22;
constexpr std::size_t kHeaderBytes = 30;
constexpr std::uint32_t kEnd64Signature = 0x06064B50;
constexpr std::uint32_t kLocatorSignature = 0x07064B50;
constexpr std::size_t kEnd64Bytes = 56;
constexpr std::size_t kLocatorBytes = 20;
/// A field of these bits has its number in the Zip64 records instead.
constexpr std::uint16_t kElsewhere16 = 0xFFFF;
constexpr std::uint32_t kElsewhere32 = 0xFFFFFFFF;
constexpr std::uint16_t kZip64Field = 0x0001;
/// Millions of members: no raster's archive has so many, damaged sizes do.
constexpr std::uint64_t kMostDirectoryBytes = std::uint64_t{256} << 20U;
/// The comment after the end record has at most 65535 bytes.
constexpr std::uint64_t kLongestTail = kEndBytes + 65535;

[[noreturn]] void corrupt(const RawFile& file, const std::string& why) {
  throw Error(ErrorCode::kCorrupt, file.path() + ": " + why);
}

struct End {
  std::uint64_t entries = 0;
  std::uint64_t directory_bytes = 0;
  std::uint64_t directory_offset = 0;
};

/// The Zip64 end record, by the locator that lies right before the end record at `end_offset`; nullopt without one.
std::optional<End> find_end64(const RawFile& file, std::uint64_t end_offset) {
  if (end_offset < kLocatorBytes + kEnd64Bytes) return std::nullopt;
  std::vector<std::byte> bytes(kLocatorBytes);
  file.read(end_offset - kLocatorBytes, bytes);
  ByteReader locator(bytes);
  if (locator.read<std::uint32_t>() != kLocatorSignature) return std::nullopt;
  (void)locator.read_bytes(4);  // disk
  const auto offset = locator.read<std::uint64_t>();
  if (offset > end_offset - kLocatorBytes - kEnd64Bytes) corrupt(file, "its Zip64 directory's end lies outside");
  bytes.resize(kEnd64Bytes);
  file.read(offset, bytes);
  ByteReader in(bytes, offset);
  if (in.read<std::uint32_t>() != kEnd64Signature) corrupt(file, "its Zip64 directory's end is damaged");
  (void)in.read_bytes(28);  // size of this record, versions, disk numbers, entries on this disk
  End end;
  end.entries = in.read<std::uint64_t>();
  end.directory_bytes = in.read<std::uint64_t>();
  end.directory_offset = in.read<std::uint64_t>();
  return end;
}

End find_end(const RawFile& file) {
  std::vector<std::byte> tail(static_cast<std::size_t>(std::min(kLongestTail, file.size_bytes())));
  if (tail.size() < kEndBytes) corrupt(file, "is too short for a zip archive");
  file.read(file.size_bytes() - tail.size(), tail);
  for (std::size_t at = tail.size() - kEndBytes + 1; at-- > 0;) {
    ByteReader in(std::span<const std::byte>(tail).subspan(at));
    if (in.read<std::uint32_t>() != kEndSignature) continue;
    (void)in.read_bytes(6);  // disk numbers, entries on this disk
    End end;
    end.entries = in.read<std::uint16_t>();
    end.directory_bytes = in.read<std::uint32_t>();
    end.directory_offset = in.read<std::uint32_t>();
    // 65535 members are as good a number as any where there is no Zip64 record.
    const bool elsewhere = end.directory_bytes == kElsewhere32 || end.directory_offset == kElsewhere32;
    if (!elsewhere && end.entries != kElsewhere16) return end;
    if (const auto end64 = find_end64(file, file.size_bytes() - tail.size() + at)) return *end64;
    if (elsewhere) corrupt(file, "is damaged: its Zip64 directory's end is not there");
    return end;
  }
  corrupt(file, "is truncated or no zip archive: its directory's end is not there");
}

/// Takes the numbers that their own fields had no room for, in the order of the standard.
void read_zip64_field(std::span<const std::byte> extra, ZippedFile& member) {
  ByteReader in(extra);
  while (in.remaining() >= 4) {
    const auto kind = in.read<std::uint16_t>();
    const std::size_t bytes = in.read<std::uint16_t>();
    if (kind != kZip64Field) {
      (void)in.read_bytes(bytes);
      continue;
    }
    ByteReader numbers(in.read_bytes(bytes));
    for (std::uint64_t* const number : {&member.size_bytes, &member.stored_bytes, &member.header_offset_bytes}) {
      if (*number == kElsewhere32) *number = numbers.read<std::uint64_t>();
    }
    return;
  }
  throw Error(ErrorCode::kCorrupt, member.name + ": its Zip64 field is not there");
}

ZippedFile read_entry(const RawFile& file, ByteReader& in) {
  if (in.read<std::uint32_t>() != kEntrySignature) corrupt(file, "the zip directory is damaged");
  (void)in.read_bytes(4);  // versions
  ZippedFile member;
  member.encrypted = (in.read<std::uint16_t>() & 1U) != 0;
  member.method = in.read<std::uint16_t>();
  (void)in.read_bytes(4);  // time and date
  member.crc32 = in.read<std::uint32_t>();
  member.stored_bytes = in.read<std::uint32_t>();
  member.size_bytes = in.read<std::uint32_t>();
  const std::size_t name_bytes = in.read<std::uint16_t>();
  const std::size_t extra_bytes = in.read<std::uint16_t>();
  const std::size_t comment_bytes = in.read<std::uint16_t>();
  (void)in.read_bytes(8);  // disk, attributes
  member.header_offset_bytes = in.read<std::uint32_t>();
  const auto name = in.read_bytes(name_bytes);
  member.name = one_line({reinterpret_cast<const char*>(name.data()), name.size()});
  const auto extra = in.read_bytes(extra_bytes);
  (void)in.read_bytes(comment_bytes);
  if (member.size_bytes == kElsewhere32 || member.stored_bytes == kElsewhere32 ||
      member.header_offset_bytes == kElsewhere32) {
    read_zip64_field(extra, member);
  }
  return member;
}

}  // namespace

bool is_gzip_name(const std::string& path) {
  return path.size() > 3 && lower_case(std::string_view(path).substr(path.size() - 3)) == ".gz";
}

std::string without_gzip(const std::string& path) {
  return is_gzip_name(path) ? path.substr(0, path.size() - 3) : path;
}

RawFile::RawFile(const std::string& path, std::uint64_t held_bytes) : path_(path) {
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
  if (!is_gzip_name(path)) return;
  try {
    std::array<std::byte, 3> head = {};
    if (looks_like_gzip(std::span(head).first(read_stored(0, head)))) {
      unpack_gzip(held_bytes);
    }
  } catch (...) {
    ::close(descriptor_);
    throw;
  }
}

RawFile::RawFile(const std::string& path, const ZippedFile& member, std::uint64_t held_bytes)
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

void RawFile::unpack_member(const ZippedFile& member, std::uint64_t held_bytes) {
  const std::uint64_t begin = zipped_file_begin(*this, member);
  if (member.method == 0) {
    begin_bytes_ = begin;
    size_bytes_ = member.stored_bytes;
  } else {
    packed_ = {begin, member.stored_bytes, InflatedBytes::Kind::kRawDeflate};
    held_bytes = std::min(held_bytes, kMostHeldBytes);
    if (member.stored_bytes <= held_bytes && member.size_bytes <= held_bytes) {
      held_ = UnpackedBytes::from_deflated(stored_bytes(), member.size_bytes, member.crc32);
    }
    if (held_) {
      size_bytes_ = member.size_bytes;
      return;
    }
    inflated_ = std::make_unique<InflatedBytes>(path_, packed_reader(), packed_.kind);
    size_bytes_ = inflated_->size_bytes();
  }
  const std::uint32_t crc = inflated_ ? inflated_->crc32() : crc_of(*this);
  if (size_bytes_ != member.size_bytes || crc != member.crc32) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("{}: {} is damaged: its {} do not match", path_, member.name,
                            size_bytes_ != member.size_bytes ? "size and the zip directory's" : "CRC and bytes"));
  }
}

RawFile::~RawFile() {
  ::close(descriptor_);
}

std::vector<std::byte> RawFile::stored_bytes() const {
  std::vector<std::byte> stored(static_cast<std::size_t>(packed_.stored_bytes));
  stored.resize(read_stored(packed_.begin_bytes, stored));
  return stored;
}

InflatedBytes::ReadStored RawFile::packed_reader() const {
  return [this](std::uint64_t offset, std::span<std::byte> bytes) {
    if (offset >= packed_.stored_bytes) return std::size_t{0};
    const std::uint64_t most = std::min<std::uint64_t>(bytes.size(), packed_.stored_bytes - offset);
    return read_stored(packed_.begin_bytes + offset, bytes.first(static_cast<std::size_t>(most)));
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
  if (!inflated_) return read_stored(begin_bytes_ + offset_bytes, bytes);
  const std::lock_guard lock(one_inflates_);
  return inflated_->read_some(offset_bytes, bytes);
}

std::size_t RawFile::read_stored(std::uint64_t offset_bytes, std::span<std::byte> bytes) const {
  std::size_t done = 0;
  while (done < bytes.size()) {
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

std::vector<ZippedFile> zipped_files(const RawFile& file) {
  const End end = find_end(file);
  if (end.directory_offset > file.size_bytes() || end.directory_bytes > file.size_bytes() - end.directory_offset) {
    corrupt(file, "the zip directory lies outside the file");
  }
  if (end.directory_bytes > kMostDirectoryBytes) {
    throw Error(ErrorCode::kUnsupported, fmt::format("{}: the zip directory has {} bytes, at most {} are read",
                                                     file.path(), end.directory_bytes, kMostDirectoryBytes));
  }
  std::vector<std::byte> directory(static_cast<std::size_t>(end.directory_bytes));
  file.read(end.directory_offset, directory);
  std::vector<ZippedFile> members;
  try {
    ByteReader in(directory, end.directory_offset);
    for (std::uint64_t i = 0; i < end.entries; ++i) members.push_back(read_entry(file, in));
  } catch (const Error& error) {
    throw error.within(file.path() + ": zip directory");
  }
  return members;
}

std::uint64_t zipped_file_begin(const RawFile& file, const ZippedFile& member) {
  if (member.encrypted || (member.method != 0 && member.method != 8)) {
    throw Error(
        ErrorCode::kUnsupported,
        fmt::format("{}: {} is {}; stored and deflated members are read", file.path(), member.name,
                    member.encrypted ? std::string("encrypted") : fmt::format("packed by method {}", member.method)));
  }
  if (member.header_offset_bytes > file.size_bytes()) corrupt(file, member.name + " lies outside the file");
  std::vector<std::byte> header(kHeaderBytes);
  file.read(member.header_offset_bytes, header);
  ByteReader fields(header);
  if (fields.read<std::uint32_t>() != kHeaderSignature) corrupt(file, member.name + ": the zip header is damaged");
  (void)fields.read_bytes(22);
  const std::uint64_t name_bytes = fields.read<std::uint16_t>();
  const std::uint64_t extra_bytes = fields.read<std::uint16_t>();
  const std::uint64_t begin = member.header_offset_bytes + kHeaderBytes + name_bytes + extra_bytes;
  if (begin > file.size_bytes() || member.stored_bytes > file.size_bytes() - begin) {
    corrupt(file, member.name + " lies outside the file");
  }
  return begin;
}

}  // namespace isohf
