#include "isohf/archive/attach.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <set>

#include "isohf/archive.h"
#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/container/member_tables.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/base/output_file.h"
#include "isohf/base/source_bytes.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::uint64_t kCopiedBytes = std::uint64_t{1} << 20U;

[[noreturn]] void refuse(const std::string& why) {
  throw Error(ErrorCode::kInvalidArgument, why);
}

/// The archive that is written, and its members behind those of the one that is read.
class Copy {
 public:
  Copy(const ArchiveReader& archive, OutputFile& out)
      : archive_(archive),
        file_(archive.source()),
        end_(find_archive_end(file_)),
        own_(find_own_entries(file_, end_)),
        out_(out) {}

  void write(const std::vector<Attachment>& files) {
    const std::string crc_text = stated_crc();
    if (!crc_text.empty()) std::from_chars(crc_text.data(), crc_text.data() + crc_text.size(), data_crc32_, 16);
    copy(0, own_.index->header_offset, [&](auto piece) { out_.append(piece); });
    add_from_behind();
    for (const Attachment& file : files) add_file(file);
    const ZipMember index = add_index();
    std::string json = archive_.metadata_json() + "\n";
    if (!crc_text.empty()) json.replace(crc_at_, crc_text.size(), fmt::format("{:08x}", data_crc32_));
    const auto text = std::as_bytes(std::span<const char>(json));
    const ZipMember metadata{kMetadataName, ZipMethod::kStored, crc32(text), text.size(), text.size(), out_.position()};
    append(metadata, text);
    add_directory(index, metadata);
  }

 private:
  template <typename To>
  void copy(std::uint64_t begin, std::uint64_t end, const To& to) const {
    for (std::uint64_t at = begin; at < end; at += kCopiedBytes)
      to(SourceBytes(file_, at, std::min(kCopiedBytes, end - at)).bytes());
  }

  /// The digits of the metadata's data_crc32, which stand at crc_at_; empty where they state none.
  std::string stated_crc() {
    const std::string& json = archive_.metadata_json();
    for (const auto& [name, text] : archive_.metadata().extensions) {
      if (name != kDataCrcName || text.size() != 10) continue;
      const std::size_t key = json.find("\"" + name + "\"");
      const std::size_t at = key == std::string::npos ? key : json.find(text, key);
      if (at == std::string::npos) break;
      crc_at_ = at + 1;
      return text.substr(1, 8);
    }
    return {};
  }

  void append(const ZipMember& member, std::span<const std::byte> data) {
    std::vector<std::byte> header;
    append_local_header(member, header);
    out_.append(header);
    out_.append(data);
  }

  void add(ZipMember member, std::span<const std::byte> data) {
    member.header_offset = out_.position();
    append(member, data);
    data_crc32_ = crc32_of_crc32(crc32(data), data_crc32_);
    append_directory_entry(member, entries_);
    ++added_;
  }

  /// Members that stand behind the index.
  void add_from_behind() {
    if (own_.are_last) return;
    for (ZipEntries entries(file_, end_); const auto entry = entries.next();) {
      if (entry->header_offset < own_.index->header_offset || entry->name == kMetadataName ||
          entry->name == kIndexName || entry->name.ends_with('/')) {
        continue;
      }
      const SourceBytes data(file_, checked_data_offset(file_, *entry), entry->compressed_bytes);
      add(*entry, data.bytes());
    }
  }

  void add_file(const Attachment& file) {
    std::error_code ignored;
    const auto kind = std::filesystem::status(file.path, ignored).type();
    if (kind != std::filesystem::file_type::not_found && kind != std::filesystem::file_type::regular) {
      refuse(file.path + ": is no regular file; copy what it gives into one");
    }
    const auto source = open_file_source(file.path);
    const std::vector<std::byte> bytes = SourceBytes(*source, 0, source->size_bytes()).take();
    const std::vector<std::byte> deflated = deflate_bytes(bytes);
    const bool is_smaller = deflated.size() < bytes.size();
    const std::span<const std::byte> data = is_smaller ? deflated : bytes;
    add({file.name, is_smaller ? ZipMethod::kDeflated : ZipMethod::kStored, crc32(bytes), data.size(), bytes.size(), 0},
        data);
  }

  /// The index as it was, with another footer.
  ZipMember add_index() {
    const std::uint64_t begin = own_.index->header_offset + local_header_bytes(*own_.index);
    const std::uint64_t footer_at = begin + own_.index->bytes - kTablesFooterBytes;
    TablesFooter footer = *parse_tables_footer(SourceBytes(file_, footer_at, kTablesFooterBytes).bytes());
    ZipMember member = *own_.index;
    member.header_offset = out_.position();
    footer.data_offset = member.header_offset + local_header_bytes(member);
    footer.members += added_;
    std::vector<std::byte> tail;
    append_tables_footer(footer, tail);
    member.crc32 = crc32(tail, crc32_in(file_, begin, own_.index->bytes - kTablesFooterBytes));
    append(member, {});
    copy(begin, footer_at, [&](auto piece) { out_.append(piece); });
    out_.append(tail);
    return member;
  }

  /// The entries of what was there before, then the new ones.
  void add_directory(const ZipMember& index, const ZipMember& metadata) {
    const std::uint64_t offset = out_.position();
    std::uint64_t count = 0;
    for (ZipEntries entries(file_, end_); const auto entry = entries.next();) {
      if (entry->header_offset >= own_.index->header_offset) continue;
      std::vector<std::byte> bytes;
      append_directory_entry(*entry, bytes);
      out_.append(bytes);
      ++count;
    }
    append_directory_entry(index, entries_);
    append_directory_entry(metadata, entries_);
    append_end_records(count + added_ + 2, offset, out_.position() + entries_.size() - offset, entries_);
    out_.append(entries_);
  }

  const ArchiveReader& archive_;
  const ByteSource& file_;
  ZipEnd end_;
  OwnEntries own_;
  OutputFile& out_;
  std::size_t crc_at_ = 0;
  std::uint32_t data_crc32_ = 0;
  std::vector<std::byte> entries_;
  std::uint64_t added_ = 0;
};

void check_names(const ArchiveReader& archive, const std::vector<Attachment>& files) {
  std::set<std::string> names;
  for (const Attachment& file : files) {
    const auto why = [&]() -> std::string {
      if (std::string bad = why_bad_name(file.name); !bad.empty()) return bad;
      if (is_in_tile_folder(file.name)) return "only tiles stand there";
      if (!names.insert(file.name).second) return "is given twice";
      return archive.find_member(file.name) ? "is there already" : "";
    }();
    if (!why.empty()) refuse(fmt::format("member \"{}\": {}", file.name, why));
  }
}

}  // namespace

std::uint64_t attach_members(const std::string& archive, const std::vector<Attachment>& files) {
  const ArchiveReader reader(archive);
  try {
    if (reader.metadata().version < 2)
      refuse("is of version 1 of the format, where nothing is attached; convert its source again");
    if (reader.reads_by_directory()) refuse("was repacked by another tool; add the files by that");
    check_names(reader, files);
    OutputFile out(archive, {.overwrite = true, .buffer_bytes = kCopiedBytes});
    Copy(reader, out).write(files);
    const std::uint64_t size = out.position();
    out.commit();
    return size;
  } catch (const Error& error) {
    throw error.within(archive);
  }
}

}  // namespace isohf
