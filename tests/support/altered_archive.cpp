#include "support/altered_archive.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <span>
#include <stdexcept>
#include <tuple>

#include "isohf/archive/archive_index_builder.h"
#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/tile_index.h"
#include "isohf/base/bytes.h"
#include "isohf/base/output_file.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

std::vector<std::byte> bytes_of(const std::string& text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

template <typename T>
void put(std::vector<std::byte>& out, std::size_t at, T value) {
  std::memcpy(out.data() + at, &value, sizeof value);
}

/// The footer of version 1.
void append_footer(std::vector<std::byte>& index, std::uint64_t stored, std::uint64_t entries,
                   std::span<const std::byte> directory) {
  const std::uint32_t records_crc = crc32(index);
  const std::size_t start = index.size();
  ByteWriter out(index);
  out.write(std::uint64_t{0x58444946484f5349});
  out.write(std::uint32_t{1});
  out.write(std::uint32_t{kIndexRecordBytes});
  out.write(std::uint64_t{start / kIndexRecordBytes});
  out.write(stored);
  out.write(entries);
  out.write(std::uint64_t{directory.size()});
  out.write(crc32(directory));
  out.write(records_crc);
  out.write(std::uint32_t{0});
  out.write(crc32(std::span<const std::byte>(index).subspan(start)));
}

}  // namespace

AlteredArchive::AlteredArchive(const std::string& path) : original_(path) {
  const std::vector<std::byte> file = read_bytes(path);
  const auto source = memory_source(file);
  for (ZipEntries entries(*source, find_archive_end(*source)); const auto entry = entries.next();) {
    const auto data = std::span(file).subspan(checked_data_offset(*source, *entry), entry->compressed_bytes);
    if (entry->name == kMetadataName) {
      metadata = nlohmann::json::parse(std::string(reinterpret_cast<const char*>(data.data()), data.size()));
      tile_columns_ = metadata.at("tiles").at("columns").get<std::int64_t>();
    } else if (entry->name == kIndexName) {
      if (is_first_version()) records_.assign(data.begin(), data.end() - kIndexFooterBytes);
    } else {
      members_.push_back(
          {entry->name, entry->method == ZipMethod::kDeflated, entry->crc32, entry->bytes, {data.begin(), data.end()}});
    }
  }
}

std::vector<std::string> AlteredArchive::names() const {
  std::vector<std::string> names;
  for (const Member& member : members_) names.push_back(member.name);
  return names;
}

const AlteredArchive::Member& AlteredArchive::member(const std::string& name) const {
  const auto found = std::find_if(members_.begin(), members_.end(), [&](const Member& m) { return m.name == name; });
  if (found == members_.end()) throw std::runtime_error("no member " + name);
  return *found;
}

std::vector<std::byte> AlteredArchive::bytes(const std::string& name) const {
  const Member& of = member(name);
  if (!of.deflated) return of.data;
  std::vector<std::byte> bytes(of.bytes);
  inflate_exactly(of.data, bytes);
  return bytes;
}

void AlteredArchive::set(const std::string& name, const std::vector<std::byte>& bytes) {
  auto& of = const_cast<Member&>(member(name));
  of = {name, of.deflated, crc32(bytes), bytes.size(), of.deflated ? deflate_bytes(bytes) : bytes};
}

void AlteredArchive::rename(const std::string& name, const std::string& to) {
  const_cast<Member&>(member(name)).name = to;
}

void AlteredArchive::remove(const std::string& name) {
  std::erase_if(members_, [&](const Member& m) { return m.name == name; });
}

std::uint64_t AlteredArchive::compressed_bytes(const std::string& start) const {
  std::uint64_t bytes = 0;
  for (const Member& member : members_) bytes += member.name.starts_with(start) ? member.data.size() : 0;
  return bytes;
}

bool AlteredArchive::is_first_version() const {
  return metadata.is_null() || metadata.at("version") == 1;
}

void AlteredArchive::write(const std::string& path) const {
  is_first_version() ? write_first_version(path) : write_now(path);
}

nlohmann::json AlteredArchive::stated() const {
  nlohmann::json json = metadata;
  std::uint32_t data_crc = 0;
  for (const Member& member : members_) data_crc = crc32_of_crc32(crc32(member.data), data_crc);
  if (json.contains("data_crc32")) json["data_crc32"] = fmt::format("{:08x}", data_crc);
  return json;
}

void AlteredArchive::write_now(const std::string& path) const {
  const ArchiveReader was(original_);
  OutputFile file(path, {.overwrite = true});
  ArchiveIndexBuilder contents(was.grid(), was.metadata().planes, folder_of(path));
  std::vector<std::byte> header;
  const auto append = [&](const ZipMember& member, std::span<const std::byte> data) {
    header.clear();
    append_local_header(member, header);
    file.append(header);
    file.append(data);
  };
  for (const Member& member : members_) {
    JournalRecord record;
    record.kind = JournalRecord::Kind::kMember;
    record.member = {member.name,  member.deflated ? ZipMethod::kDeflated : ZipMethod::kStored,
                     member.crc32, member.data.size(),
                     member.bytes, file.position()};
    record.data_crc32 = crc32(member.data);
    if (const auto tile = tile_from_name(member.name)) {
      record.kind = tile->plane == 0 ? JournalRecord::Kind::kTile : JournalRecord::Kind::kPlaneTile;
      const TileEntry entry = was.tile_entry(tile->tile, tile->plane);
      record.code_min = entry.code_min;
      record.code_max = entry.code_max;
      if (const auto range = ranges.find(member.name); range != ranges.end()) {
        std::tie(record.code_min, record.code_max) = range->second;
      }
      record.has_voids = entry.has_voids;
      record.digest = was.tile_digest(tile->tile, tile->plane).value_or(Digest{});
    }
    append(record.member, member.data);
    contents.add(record);
  }
  const ZipMember index = contents.append_index(file);
  const std::vector<std::byte> json = bytes_of(stated().dump(1) + "\n");
  const ZipMember member{kMetadataName, ZipMethod::kStored, crc32(json), json.size(), json.size(), file.position()};
  append(member, json);
  contents.append_directory(index, member, file);
  file.commit();
}

void AlteredArchive::write_first_version(const std::string& path) const {
  std::vector<std::byte> file;
  std::vector<std::byte> directory;
  const auto append = [&](const Member& member) {
    const ZipMember entry{member.name,  member.deflated ? ZipMethod::kDeflated : ZipMethod::kStored,
                          member.crc32, member.data.size(),
                          member.bytes, file.size()};
    append_local_header(entry, file);
    const std::uint64_t at = file.size();
    file.insert(file.end(), member.data.begin(), member.data.end());
    append_directory_entry(entry, directory);
    return at;
  };
  const std::vector<std::byte> json = bytes_of(stated().dump(1) + "\n");
  append({kMetadataName, false, crc32(json), json.size(), json});
  std::vector<std::byte> index = records_;
  std::uint64_t stored = 0;
  for (const Member& member : members_) {
    const std::uint64_t at = append(member);
    const auto tile = tile_from_name(member.name);
    if (!tile) continue;
    ++stored;
    const auto record =
        static_cast<std::size_t>(tile->tile.row * tile_columns_ + tile->tile.column) * kIndexRecordBytes;
    put(index, record, at);
    put(index, record + 8, static_cast<std::uint32_t>(member.data.size()));
    put(index, record + 12, static_cast<std::uint32_t>(member.bytes));
    put(index, record + 16, member.crc32);
  }
  append_footer(index, stored_count.value_or(stored), members_.size() + 1, directory);
  append({kIndexName, false, crc32(index), index.size(), index});
  const std::uint64_t directory_offset = file.size();
  file.insert(file.end(), directory.begin(), directory.end());
  append_end_records(members_.size() + 2, directory_offset, directory.size(), file);
  write_file(path, file);
}

}  // namespace isohf::test
