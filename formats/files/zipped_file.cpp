#include "formats/files/zipped_file.h"

#include <fmt/core.h>

#include <algorithm>
#include <optional>

#include "formats/text_grids/text_tokens.h"
#include "isohf/base/bytes.h"
#include "isohf/error.h"

namespace isohf {
namespace {

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
