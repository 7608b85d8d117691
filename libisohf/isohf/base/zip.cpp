#include "isohf/base/zip.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <span>
#include <string_view>

#include "isohf/base/bytes.h"
#include "isohf/base/source_bytes.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::uint32_t kLocalSignature = 0x04034b50;
constexpr std::uint32_t kEntrySignature = 0x02014b50;
constexpr std::uint32_t kEndSignature = 0x06054b50;
constexpr std::uint32_t kEnd64Signature = 0x06064b50;
constexpr std::uint32_t kLocator64Signature = 0x07064b50;
constexpr std::size_t kLocalBytes = 30;
constexpr std::size_t kEntryBytes = 46;
constexpr std::size_t kEndBytes = 22;
constexpr std::size_t kLocator64Bytes = 20;
constexpr std::uint64_t kEnd64Bytes = 56;
constexpr std::uint16_t kZip64Tag = 1;
constexpr std::uint32_t kIn64 = 0xffffffff;  // "see the ZIP64 field"
constexpr std::uint16_t kVersionPlain = 20;
constexpr std::uint16_t kVersion64 = 45;
constexpr std::uint16_t kMadeOnUnix = 3 << 8;
constexpr std::uint16_t kDate = 0x0021;  // 1 January 1980, 00:00
constexpr std::uint32_t kRegularFile = 0100644U << 16U;
constexpr std::uint16_t kFlagEncrypted = 1;
constexpr std::uint16_t kFlagSizesFollow = 8;
constexpr std::uint16_t kFlagUtf8 = 1 << 11;

bool is_ascii(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 128; });
}

std::uint32_t low32(std::uint64_t value) {
  return value >= kIn64 ? kIn64 : static_cast<std::uint32_t>(value);
}

/// The sizes do not fit a local header.
bool is_large(const ZipMember& member) {
  return member.bytes >= kIn64 || member.compressed_bytes >= kIn64;
}

[[noreturn]] void refuse(std::uint64_t offset, const std::string& why) {
  throw Error(ErrorCode::kCorrupt, {fmt::format("at byte {}", offset), why, "", ""});
}

std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Fills room that was made at the end of a vector, which a million headers would else grow field by field.
class RoomWriter {
 public:
  RoomWriter(std::vector<std::byte>& out, std::uint64_t bytes) {
    out.resize(out.size() + bytes);
    at_ = out.data() + (out.size() - bytes);
  }

  template <typename T>
  void write(T value) {
    store_little(at_, value);
    at_ += sizeof value;
  }
  void write(const std::string& text) {
    std::memcpy(at_, text.data(), text.size());
    at_ += text.size();
  }

 private:
  std::byte* at_;
};

/// What local header and directory entry have in common, from the version on.
void append_common(RoomWriter& writer, const ZipMember& member, bool large) {
  writer.write(large ? kVersion64 : kVersionPlain);
  writer.write(is_ascii(member.name) ? std::uint16_t{0} : kFlagUtf8);
  writer.write(static_cast<std::uint16_t>(member.method));
  writer.write(std::uint16_t{0});  // time
  writer.write(kDate);
  writer.write(member.crc32);
}

}  // namespace

std::uint64_t local_header_bytes(const ZipMember& member) {
  return kLocalBytes + member.name.size() + (is_large(member) ? 20 : 0);
}

void append_local_header(const ZipMember& member, std::vector<std::byte>& out) {
  RoomWriter writer(out, local_header_bytes(member));
  const bool large = is_large(member);
  writer.write(kLocalSignature);
  append_common(writer, member, large);
  writer.write(large ? kIn64 : static_cast<std::uint32_t>(member.compressed_bytes));
  writer.write(large ? kIn64 : static_cast<std::uint32_t>(member.bytes));
  writer.write(static_cast<std::uint16_t>(member.name.size()));
  writer.write(static_cast<std::uint16_t>(large ? 20 : 0));
  writer.write(member.name);
  if (large) {
    writer.write(kZip64Tag);
    writer.write(std::uint16_t{16});
    writer.write(member.bytes);
    writer.write(member.compressed_bytes);
  }
}

void append_directory_entry(const ZipMember& member, std::vector<std::byte>& out) {
  const bool large = is_large(member);
  const bool far = member.header_offset >= kIn64;
  const unsigned extra = 8U * ((large ? 2U : 0U) + (far ? 1U : 0U));
  RoomWriter writer(out, kEntryBytes + member.name.size() + (extra == 0 ? 0 : extra + 4));
  writer.write(kEntrySignature);
  writer.write(static_cast<std::uint16_t>(kMadeOnUnix | kVersion64));
  append_common(writer, member, large || far);
  writer.write(large ? kIn64 : static_cast<std::uint32_t>(member.compressed_bytes));
  writer.write(large ? kIn64 : static_cast<std::uint32_t>(member.bytes));
  writer.write(static_cast<std::uint16_t>(member.name.size()));
  writer.write(static_cast<std::uint16_t>(extra == 0 ? 0 : extra + 4));
  writer.write(std::uint16_t{0});  // comment
  writer.write(std::uint16_t{0});  // disk
  writer.write(std::uint16_t{0});  // internal attributes
  writer.write(kRegularFile);
  writer.write(low32(member.header_offset));
  writer.write(member.name);
  if (extra == 0) return;
  writer.write(kZip64Tag);
  writer.write(static_cast<std::uint16_t>(extra));
  if (large) {
    writer.write(member.bytes);
    writer.write(member.compressed_bytes);
  }
  if (far) writer.write(member.header_offset);
}

void append_end_records(std::uint64_t entries, std::uint64_t directory_offset, std::uint64_t directory_bytes,
                        std::vector<std::byte>& out) {
  ByteWriter writer(out);
  writer.write(kEnd64Signature);
  writer.write(kEnd64Bytes - 12);
  writer.write(static_cast<std::uint16_t>(kMadeOnUnix | kVersion64));
  writer.write(kVersion64);
  writer.write(std::uint32_t{0});  // this disk
  writer.write(std::uint32_t{0});  // disk of the directory
  writer.write(entries);
  writer.write(entries);
  writer.write(directory_bytes);
  writer.write(directory_offset);
  writer.write(kLocator64Signature);
  writer.write(std::uint32_t{0});
  writer.write(directory_offset + directory_bytes);
  writer.write(std::uint32_t{1});  // disks
  writer.write(kEndSignature);
  writer.write(std::uint16_t{0});
  writer.write(std::uint16_t{0});
  const auto few = static_cast<std::uint16_t>(std::min<std::uint64_t>(entries, 0xffff));
  writer.write(few);
  writer.write(few);
  writer.write(low32(directory_bytes));
  writer.write(low32(directory_offset));
  writer.write(std::uint16_t{0});  // comment
}

namespace {

/// Offset of the end record in the file's tail: the last one whose comment ends with the file, or else the last one.
std::optional<std::size_t> find_end_record(std::span<const std::byte> tail) {
  std::optional<std::size_t> last;
  for (std::size_t at = tail.size() < kEndBytes ? 0 : tail.size() - kEndBytes + 1; at-- > 0;) {
    ByteReader reader(tail.subspan(at));
    if (reader.read<std::uint32_t>() != kEndSignature) continue;
    static_cast<void>(reader.read_bytes(16));
    if (reader.read<std::uint16_t>() == reader.remaining()) return at;
    if (!last) last = at;
  }
  return last;
}

/// Completes `end` from the ZIP64 end record, where a locator stands right before the other one.
void read_end64(const ByteSource& file, ZipEnd& end) {
  if (end.records_offset < kLocator64Bytes) return;
  const std::uint64_t locator_offset = end.records_offset - kLocator64Bytes;
  const SourceBytes locator_bytes(file, locator_offset, kLocator64Bytes);
  ByteReader locator(locator_bytes.bytes());
  if (locator.read<std::uint32_t>() != kLocator64Signature) return;
  static_cast<void>(locator.read<std::uint32_t>());
  const auto at = locator.read<std::uint64_t>();
  if (at > locator_offset || locator_offset - at < kEnd64Bytes) {
    refuse(locator_offset, fmt::format("the ZIP64 locator names byte {} for the end record", at));
  }
  const SourceBytes bytes(file, at, kEnd64Bytes);
  ByteReader reader(bytes.bytes());
  if (reader.read<std::uint32_t>() != kEnd64Signature) refuse(at, "no ZIP64 end record, where the locator says so");
  const auto size = reader.read<std::uint64_t>();
  if (size != locator_offset - at - 12) refuse(at, fmt::format("the ZIP64 end record states {} bytes", size));
  static_cast<void>(reader.read<std::uint32_t>());
  const auto disk = reader.read<std::uint64_t>();
  const ZipEnd plain = end;
  end.entries = reader.read<std::uint64_t>();
  const auto entries = reader.read<std::uint64_t>();
  end.directory_bytes = reader.read<std::uint64_t>();
  end.directory_offset = reader.read<std::uint64_t>();
  end.records_offset = at;
  if (disk != 0 || entries != end.entries) refuse(at, "the archive is split over several files");
  const auto agree = [](std::uint64_t plain_one, std::uint64_t in_64, std::uint64_t see_64) {
    return plain_one == in_64 || plain_one == see_64;
  };
  if (!agree(plain.entries, end.entries, 0xffff) || !agree(plain.directory_bytes, end.directory_bytes, kIn64) ||
      !agree(plain.directory_offset, end.directory_offset, kIn64)) {
    refuse(at, "the two end records state different directories");
  }
}

}  // namespace

std::optional<ZipEnd> find_zip_end(const ByteSource& file) {
  const std::uint64_t tail_bytes = std::min<std::uint64_t>(file.size_bytes(), kEndBytes + 0xffff);
  const std::uint64_t tail_offset = file.size_bytes() - tail_bytes;
  const SourceBytes tail(file, tail_offset, tail_bytes);
  const auto found = find_end_record(tail.bytes());
  if (!found) return std::nullopt;
  const std::uint64_t at = tail_offset + *found;
  ByteReader reader(tail.bytes().subspan(*found + 4));
  const auto disks = reader.read<std::uint32_t>();
  ZipEnd end;
  end.entries = reader.read<std::uint16_t>();
  const auto entries = reader.read<std::uint16_t>();
  end.directory_bytes = reader.read<std::uint32_t>();
  end.directory_offset = reader.read<std::uint32_t>();
  end.records_offset = at;
  end.end_offset = at + kEndBytes + reader.read<std::uint16_t>();
  if (disks != 0 || entries != end.entries) refuse(at, "the archive is split over several files");
  read_end64(file, end);
  if (end.directory_offset > end.records_offset || end.directory_bytes > end.records_offset - end.directory_offset) {
    refuse(at, fmt::format("the end record places {} bytes of directory at byte {}, where it ends at byte {}",
                           end.directory_bytes, end.directory_offset, end.records_offset));
  }
  return end;
}

namespace {

/// Replaces the sizes that say "see the ZIP64 field".
void read_zip64_field(std::span<const std::byte> fields, std::uint64_t at, ZipMember& member) {
  ByteReader extra(fields, at);
  while (extra.remaining() >= 4) {
    const auto tag = extra.read<std::uint16_t>();
    const auto field = extra.read_bytes(extra.read<std::uint16_t>());
    if (tag != kZip64Tag) continue;
    ByteReader reader(field, at);
    for (std::uint64_t* value : {&member.bytes, &member.compressed_bytes, &member.header_offset}) {
      if (*value == kIn64) *value = reader.read<std::uint64_t>();
    }
    return;
  }
}

/// Bytes of an entry, by its lengths of name, extra fields and comment; its first ones must be there.
std::size_t entry_bytes(std::span<const std::byte> entry) {
  ByteReader lengths(entry.subspan(28));
  return kEntryBytes + lengths.read<std::uint16_t>() + lengths.read<std::uint16_t>() + lengths.read<std::uint16_t>();
}

void read_entry(ByteReader& reader, std::uint64_t at, ZipEntry& entry) {
  entry.entry_offset = at;
  if (reader.read<std::uint32_t>() != kEntrySignature) refuse(at, "no directory entry, where one must stand");
  static_cast<void>(reader.read<std::uint32_t>());
  entry.is_encrypted = (reader.read<std::uint16_t>() & kFlagEncrypted) != 0;
  entry.method = static_cast<ZipMethod>(reader.read<std::uint16_t>());
  static_cast<void>(reader.read<std::uint32_t>());
  entry.crc32 = reader.read<std::uint32_t>();
  entry.compressed_bytes = reader.read<std::uint32_t>();
  entry.bytes = reader.read<std::uint32_t>();
  const std::size_t name_bytes = reader.read<std::uint16_t>();
  const std::size_t extra_bytes = reader.read<std::uint16_t>();
  const std::size_t comment_bytes = reader.read<std::uint16_t>();
  static_cast<void>(reader.read_bytes(8));
  entry.header_offset = reader.read<std::uint32_t>();
  entry.name = text_of(reader.read_bytes(name_bytes));
  read_zip64_field(reader.read_bytes(extra_bytes), at, entry);
  static_cast<void>(reader.read_bytes(comment_bytes));
}

}  // namespace

bool ZipEntries::read(ZipEntry& entry) {
  constexpr std::uint64_t kFirstPieceBytes = 4096;                // what is looked for is mostly the first
  constexpr std::uint64_t kPieceBytes = std::uint64_t{1} << 18U;  // no entry is longer
  if (position_ == end_.directory_bytes) {
    if (entries_ == end_.entries) return false;
    refuse(end_.directory_offset,
           fmt::format("the directory holds {} entries, its end record says {}", entries_, end_.entries));
  }
  const auto rest = [&] { return std::span<const std::byte>(piece_).subspan(position_ - piece_offset_); };
  while ((rest().size() < kEntryBytes || rest().size() < entry_bytes(rest())) &&
         piece_offset_ + piece_.size() < end_.directory_bytes) {
    const std::uint64_t most = piece_.empty() ? kFirstPieceBytes : kPieceBytes;
    piece_.resize(std::min(most, end_.directory_bytes - position_));
    piece_offset_ = position_;
    read_exactly(file_, end_.directory_offset + position_, piece_);
  }
  const std::uint64_t at = end_.directory_offset + position_;
  ByteReader reader(rest(), at);
  read_entry(reader, at, entry);
  position_ += reader.position();
  ++entries_;
  return true;
}

ZipLocal read_local_header(const ByteSource& file, const ZipEntry& entry) {
  constexpr std::uint64_t kExtraBytes = 64;  // most that extra fields mostly take
  const std::uint64_t at = entry.header_offset;
  const auto fail = [&](const std::string& why) { refuse(at, fmt::format("member \"{}\": {}", entry.name, why)); };
  if (at > file.size_bytes() || file.size_bytes() - at < kLocalBytes) fail("its local header lies outside the file");
  const std::uint64_t left = file.size_bytes() - at;
  SourceBytes bytes(file, at, std::min(left, kLocalBytes + entry.name.size() + kExtraBytes));
  ByteReader lengths(bytes.bytes().subspan(26));
  const std::uint64_t header_bytes = kLocalBytes + lengths.read<std::uint16_t>() + lengths.read<std::uint16_t>();
  if (header_bytes > bytes.bytes().size()) bytes = SourceBytes(file, at, std::min(left, header_bytes));
  ByteReader reader(bytes.bytes(), at);
  ZipLocal local;
  if (reader.read<std::uint32_t>() != kLocalSignature) fail("no local header, where the directory says so");
  static_cast<void>(reader.read<std::uint16_t>());
  const auto flags = reader.read<std::uint16_t>();
  local.sizes_follow = (flags & kFlagSizesFollow) != 0;
  if (entry.is_encrypted || (flags & kFlagEncrypted) != 0) {
    throw Error(ErrorCode::kUnsupported, fmt::format("member \"{}\" at byte {} is encrypted", entry.name, at));
  }
  local.member.method = static_cast<ZipMethod>(reader.read<std::uint16_t>());
  static_cast<void>(reader.read<std::uint32_t>());
  local.member.crc32 = reader.read<std::uint32_t>();
  local.member.compressed_bytes = reader.read<std::uint32_t>();
  local.member.bytes = reader.read<std::uint32_t>();
  const std::size_t name_bytes = reader.read<std::uint16_t>();
  const std::size_t extra_bytes = reader.read<std::uint16_t>();
  local.member.name = text_of(reader.read_bytes(name_bytes));
  read_zip64_field(reader.read_bytes(extra_bytes), at, local.member);
  local.data_offset = at + header_bytes;
  if (entry.compressed_bytes > file.size_bytes() - local.data_offset) {
    fail(fmt::format("its {} bytes of data reach past the end of the file", entry.compressed_bytes));
  }
  return local;
}

}  // namespace isohf
