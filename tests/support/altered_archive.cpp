#include "support/altered_archive.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <stdexcept>
#include <tuple>

#include "isohf/archive/archive_index_builder.h"
#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/base/output_file.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

std::vector<std::byte> bytes_of(const std::string& text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

}  // namespace

AlteredArchive::AlteredArchive(const std::string& path) : original_(path) {
  const std::vector<std::byte> file = read_bytes(path);
  const auto source = memory_source(file);
  for (ZipEntries entries(*source, find_archive_end(*source)); const auto entry = entries.next();) {
    const auto data = std::span(file).subspan(checked_data_offset(*source, *entry), entry->compressed_bytes);
    if (entry->name == kMetadataName) {
      metadata = nlohmann::json::parse(std::string(reinterpret_cast<const char*>(data.data()), data.size()));
    } else if (entry->name != kIndexName) {
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

nlohmann::json AlteredArchive::stated() const {
  nlohmann::json json = metadata;
  std::uint32_t data_crc = 0;
  for (const Member& member : members_) data_crc = crc32_of_crc32(crc32(member.data), data_crc);
  if (json.contains("data_crc32")) json["data_crc32"] = fmt::format("{:08x}", data_crc);
  return json;
}

void AlteredArchive::write(const std::string& path) const {
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

}  // namespace isohf::test
