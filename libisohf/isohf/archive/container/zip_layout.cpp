#include "isohf/archive/container/zip_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "isohf/base/bytes.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::uint32_t kLocalSignature = 0x04034b50;
constexpr std::uint32_t kEntrySignature = 0x02014b50;
constexpr std::uint32_t kEndSignature = 0x06054b50;
constexpr std::uint32_t kEnd64Signature = 0x06064b50;
constexpr std::uint32_t kLocator64Signature = 0x07064b50;
constexpr std::size_t kLocalBytes = 30;
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

/// What local header and directory entry have in common, from the version on.
void append_common(ByteWriter& writer, const ZipMember& member, bool large) {
  writer.write(large ? kVersion64 : kVersionPlain);
  writer.write(is_ascii(member.name) ? std::uint16_t{0} : kFlagUtf8);
  writer.write(static_cast<std::uint16_t>(member.method));
  writer.write(std::uint16_t{0});  // time
  writer.write(kDate);
  writer.write(member.crc32);
}

void append_text(ByteWriter& writer, const std::string& text) {
  writer.write_bytes(std::as_bytes(std::span<const char>(text)));
}

}  // namespace

std::string tile_name(TileIndex tile) {
  return fmt::format("tiles/{}/{}.tile", tile.row, tile.column);
}

std::optional<TileIndex> tile_from_name(std::string_view name) {
  constexpr std::string_view kFolder = "tiles/";
  if (name.substr(0, kFolder.size()) != kFolder) return std::nullopt;
  TileIndex tile{};
  const char* const end = name.data() + name.size();
  const auto row = std::from_chars(name.data() + kFolder.size(), end, tile.row);
  if (row.ec != std::errc{} || row.ptr == end || *row.ptr != '/') return std::nullopt;
  const auto column = std::from_chars(row.ptr + 1, end, tile.column);
  if (column.ec != std::errc{} || tile.row < 0 || tile.column < 0) return std::nullopt;
  if (tile_name(tile) != name) return std::nullopt;  // leading zeros, another ending
  return tile;
}

std::string why_bad_name(std::string_view name) {
  if (name.empty()) return "it is empty";
  if (name.size() > 65535) return "it is longer than 65535 bytes";
  if (name.front() == '/') return "it is absolute";
  if (name.back() == '/') return "it is a folder's";
  for (const char c : name) {
    if (c == '\\' || c == ':') return fmt::format("it holds '{}'", c);
    if (static_cast<unsigned char>(c) < 32 || c == 127) return "it holds a control character";
  }
  for (std::size_t start = 0; start <= name.size();) {
    const std::size_t end = std::min(name.find('/', start), name.size());
    const std::string_view part = name.substr(start, end - start);
    if (part.empty() || part == "." || part == "..") return fmt::format("it holds the part \"{}\"", part);
    start = end + 1;
  }
  return {};
}

std::uint64_t local_header_bytes(const ZipMember& member) {
  return kLocalBytes + member.name.size() + (is_large(member) ? 20 : 0);
}

void append_local_header(const ZipMember& member, std::vector<std::byte>& out) {
  ByteWriter writer(out);
  const bool large = is_large(member);
  writer.write(kLocalSignature);
  append_common(writer, member, large);
  writer.write(large ? kIn64 : static_cast<std::uint32_t>(member.compressed_bytes));
  writer.write(large ? kIn64 : static_cast<std::uint32_t>(member.bytes));
  writer.write(static_cast<std::uint16_t>(member.name.size()));
  writer.write(static_cast<std::uint16_t>(large ? 20 : 0));
  append_text(writer, member.name);
  if (large) {
    writer.write(kZip64Tag);
    writer.write(std::uint16_t{16});
    writer.write(member.bytes);
    writer.write(member.compressed_bytes);
  }
}

void append_directory_entry(const ZipMember& member, std::vector<std::byte>& out) {
  ByteWriter writer(out);
  const bool large = is_large(member);
  const bool far = member.header_offset >= kIn64;
  const unsigned extra = 8U * ((large ? 2U : 0U) + (far ? 1U : 0U));
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
  append_text(writer, member.name);
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

/// Offset of the end record: the last one whose comment ends with the file.
std::uint64_t find_end_record(std::span<const std::byte> file) {
  if (file.size() >= kEndBytes) {
    const std::uint64_t latest = file.size() - kEndBytes;
    const std::uint64_t earliest = latest > 0xffff ? latest - 0xffff : 0;
    for (std::uint64_t at = latest + 1; at-- > earliest;) {
      ByteReader reader(file.subspan(at), at);
      if (reader.read<std::uint32_t>() != kEndSignature) continue;
      static_cast<void>(reader.read_bytes(16));
      if (reader.read<std::uint16_t>() == latest - at) return at;
    }
  }
  throw Error(ErrorCode::kCorrupt,
              fmt::format("is no isohf archive, or is cut off: no ZIP end record in its {} bytes", file.size()));
}

/// Completes `end` from the ZIP64 end record that a locator at `locator_offset` names.
void read_end64(std::span<const std::byte> file, std::uint64_t locator_offset, ZipEnd& end) {
  ByteReader locator(file.subspan(locator_offset), locator_offset);
  if (locator.read<std::uint32_t>() != kLocator64Signature) return;
  static_cast<void>(locator.read<std::uint32_t>());
  const auto at = locator.read<std::uint64_t>();
  if (at > locator_offset || locator_offset - at < kEnd64Bytes) {
    refuse(locator_offset, fmt::format("the ZIP64 locator names byte {} for the end record", at));
  }
  ByteReader reader(file.subspan(at), at);
  if (reader.read<std::uint32_t>() != kEnd64Signature) refuse(at, "no ZIP64 end record, where the locator says so");
  const auto size = reader.read<std::uint64_t>();
  if (size != locator_offset - at - 12) refuse(at, fmt::format("the ZIP64 end record states {} bytes", size));
  static_cast<void>(reader.read<std::uint32_t>());
  const auto disk = reader.read<std::uint64_t>();
  end.entries = reader.read<std::uint64_t>();
  const auto entries = reader.read<std::uint64_t>();
  end.directory_bytes = reader.read<std::uint64_t>();
  end.directory_offset = reader.read<std::uint64_t>();
  end.records_offset = at;
  if (disk != 0 || entries != end.entries) refuse(at, "the archive is split over several files");
}

}  // namespace

ZipEnd find_zip_end(std::span<const std::byte> file) {
  const std::uint64_t at = find_end_record(file);
  ByteReader reader(file.subspan(at), at);
  static_cast<void>(reader.read<std::uint32_t>());
  const auto disks = reader.read<std::uint32_t>();
  ZipEnd end;
  end.entries = reader.read<std::uint16_t>();
  const auto entries = reader.read<std::uint16_t>();
  end.directory_bytes = reader.read<std::uint32_t>();
  end.directory_offset = reader.read<std::uint32_t>();
  end.records_offset = at;
  if (disks != 0 || entries != end.entries) refuse(at, "the archive is split over several files");
  if (at >= kLocator64Bytes) read_end64(file, at - kLocator64Bytes, end);
  if (end.directory_offset > end.records_offset || end.directory_bytes != end.records_offset - end.directory_offset) {
    refuse(at, fmt::format("the end record places {} bytes of directory at byte {}, where it ends at byte {}",
                           end.directory_bytes, end.directory_offset, end.records_offset));
  }
  return end;
}

namespace {

/// Replaces the sizes that say "see the ZIP64 field".
void read_zip64_field(ByteReader& extra, ZipEntry& entry) {
  while (extra.remaining() >= 4) {
    const auto tag = extra.read<std::uint16_t>();
    const auto field = extra.read_bytes(extra.read<std::uint16_t>());
    if (tag != kZip64Tag) continue;
    ByteReader reader(field, entry.entry_offset);
    for (std::uint64_t* value : {&entry.bytes, &entry.compressed_bytes, &entry.header_offset}) {
      if (*value == kIn64) *value = reader.read<std::uint64_t>();
    }
    return;
  }
}

ZipEntry read_entry(ByteReader& reader, std::uint64_t at) {
  ZipEntry entry;
  entry.entry_offset = at;
  if (reader.read<std::uint32_t>() != kEntrySignature) refuse(at, "no directory entry, where one must stand");
  static_cast<void>(reader.read<std::uint32_t>());
  entry.flags = reader.read<std::uint16_t>();
  entry.method = reader.read<std::uint16_t>();
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
  ByteReader extra(reader.read_bytes(extra_bytes), at);
  read_zip64_field(extra, entry);
  static_cast<void>(reader.read_bytes(comment_bytes));
  return entry;
}

}  // namespace

void for_each_entry(std::span<const std::byte> file, const ZipEnd& end,
                    const std::function<void(const ZipEntry&)>& at) {
  ByteReader reader(file.subspan(end.directory_offset, end.directory_bytes), end.directory_offset);
  std::uint64_t entries = 0;
  for (; reader.remaining() != 0; ++entries) at(read_entry(reader, end.directory_offset + reader.position()));
  if (entries != end.entries) {
    refuse(end.directory_offset,
           fmt::format("the directory holds {} entries, its end record says {}", entries, end.entries));
  }
}

ZipEntry first_entry(std::span<const std::byte> file, const ZipEnd& end) {
  ByteReader reader(file.subspan(end.directory_offset, end.directory_bytes), end.directory_offset);
  return read_entry(reader, end.directory_offset);
}

std::uint64_t checked_data_offset(std::span<const std::byte> file, const ZipEntry& entry) {
  const std::uint64_t at = entry.header_offset;
  const auto fail = [&](const std::string& why) { refuse(at, fmt::format("member \"{}\": {}", entry.name, why)); };
  if (at > file.size() || file.size() - at < kLocalBytes) fail("its local header lies outside the file");
  ByteReader reader(file.subspan(at), at);
  if (reader.read<std::uint32_t>() != kLocalSignature) fail("no local header, where the directory says so");
  static_cast<void>(reader.read<std::uint16_t>());
  const auto flags = reader.read<std::uint16_t>();
  const auto method = reader.read<std::uint16_t>();
  static_cast<void>(reader.read<std::uint32_t>());
  if (((flags | entry.flags) & kFlagEncrypted) != 0) {
    throw Error(ErrorCode::kUnsupported, fmt::format("member \"{}\" at byte {} is encrypted", entry.name, at));
  }
  if (method != entry.method)
    fail(fmt::format("its local header says method {}, the directory {}", method, entry.method));
  ZipEntry local = entry;
  local.crc32 = reader.read<std::uint32_t>();
  local.compressed_bytes = reader.read<std::uint32_t>();
  local.bytes = reader.read<std::uint32_t>();
  const std::size_t name_bytes = reader.read<std::uint16_t>();
  const std::size_t extra_bytes = reader.read<std::uint16_t>();
  if (text_of(reader.read_bytes(name_bytes)) != entry.name)
    fail("its local header has another name than the directory");
  local.header_offset = 0;
  ByteReader extra(reader.read_bytes(extra_bytes), at);
  read_zip64_field(extra, local);
  // Archivers that write a stream leave the local sizes out; isohf never does.
  if ((flags & kFlagSizesFollow) == 0 &&
      (local.crc32 != entry.crc32 || local.compressed_bytes != entry.compressed_bytes || local.bytes != entry.bytes)) {
    fail(fmt::format("its local header states {} of {} bytes and CRC {:08x}, the directory {} of {} and {:08x}",
                     local.compressed_bytes, local.bytes, local.crc32, entry.compressed_bytes, entry.bytes,
                     entry.crc32));
  }
  const std::uint64_t data = at + reader.position();
  if (entry.compressed_bytes > file.size() - data) {
    fail(fmt::format("its {} bytes of data reach past the end of the file", entry.compressed_bytes));
  }
  return data;
}

}  // namespace isohf
