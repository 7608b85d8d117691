#include "isohf/archive/structure_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "isohf/archive/container/paged_index.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/base/source_bytes.h"
#include "isohf/error.h"

namespace isohf {
namespace {

class StructureCheck {
 public:
  StructureCheck(const ByteSource& file, const ArchiveReader& archive, const Complain& structure,
                 const Complain& member)
      : file_(file),
        structure_(structure),
        member_(member),
        grids_(plane_grids(archive.metadata())),
        end_(find_archive_end(file_)),
        own_(find_own_entries(file_, end_)) {
    if (archive.reads_by_directory()) return;
    index_ = PagedIndex::open(file_, *own_.index);
    if (!index_) throw Error(ErrorCode::kCorrupt, fmt::format("member \"{}\": cannot be read again", kIndexName));
    tables_.resize(index_->tables().size());
    // An archive to which another tool added something is compared with the rules of ZIP alone.
    is_ours_ = own_.are_last;
  }

  void run() {
    ZipEntry entry;
    for (ZipEntries all(file_, end_); all.read(entry); ++entries_) {
      if (is_ours_) check_profile(entry);
      const auto data_offset = check_entry(file_, entry, structure_);
      if (!data_offset) continue;
      places_.add(entry, *data_offset);
      if (is_folder(entry)) continue;
      const auto slot = slot_of(entry);
      if (slot) compare(slot->first, slot->second, entry, *data_offset);
      if (!is_in_tile_folder(entry.name)) check_data(entry, *data_offset);
    }
    if (is_ours_) check_ends();
    places_.check(file_, end_, structure_);
    for (std::size_t table = 0; table < tables_.size(); ++table) check_table(table);
  }

 private:
  struct Table {
    std::int64_t found = 0;  ///< members that both index and directory have
    bool is_damaged = false;
  };

  /// Whether `ours_` is what the file has at a byte.
  [[nodiscard]] bool stands_at(std::uint64_t offset) const {
    if (offset > file_.size_bytes() || ours_.size() > file_.size_bytes() - offset) return false;
    const SourceBytes theirs(file_, offset, ours_.size());
    return std::equal(ours_.begin(), ours_.end(), theirs.bytes().begin());
  }

  /// Compares an entry with what the writer makes: members back to back from byte 0 on, in the directory's order, the
  /// media type first, index and metadata last.
  void check_profile(const ZipEntry& entry) {
    ours_.clear();
    append_directory_entry(entry, ours_);
    if (!stands_at(entry.entry_offset)) {
      structure_(fmt::format("{}: its directory entry at byte {} is not as the profile has it", describe(entry),
                             entry.entry_offset));
    }
    if (entry.header_offset != next_offset_)
      structure_(fmt::format("{}: the member before it ends at byte {}", describe(entry), next_offset_));
    const std::array<std::pair<std::uint64_t, std::string_view>, 3> places = {
        {{0, kMediaTypeName}, {end_.entries - 2, kIndexName}, {end_.entries - 1, kMetadataName}}};
    for (const auto& [place, name] : places) {
      if (entries_ == place && entry.name != name)
        structure_(fmt::format("{}: stands where \"{}\" belongs", describe(entry), name));
    }
    if (entry.name == kMediaTypeName &&
        (entry.method != ZipMethod::kStored || entry.crc32 != crc32(std::as_bytes(std::span(kMediaType)))))
      structure_(fmt::format("{}: must hold \"{}\", stored", describe(entry), kMediaType));
    ours_.clear();
    append_local_header(entry, ours_);
    if (!stands_at(entry.header_offset))
      structure_(fmt::format("{}: its local header is not as the profile has it", describe(entry)));
    next_offset_ = entry.header_offset + ours_.size() + entry.compressed_bytes;
  }

  void check_ends() {
    ours_.clear();
    append_end_records(end_.entries, end_.directory_offset, end_.directory_bytes, ours_);
    if (ours_.size() != file_.size_bytes() - end_.records_offset || !stands_at(end_.records_offset))
      structure_(fmt::format("the end records at byte {} are not as the profile has them", end_.records_offset));
    if (next_offset_ != end_.directory_offset) {
      structure_(fmt::format("the directory begins at byte {}, the last member ends at byte {}", end_.directory_offset,
                             next_offset_));
    }
  }

  /// Table and slot that a member of the archive has in the index by its name; nullopt where it has none.
  [[nodiscard]] std::optional<std::pair<std::size_t, TablePlace>> slot_of(const ZipEntry& entry) const {
    std::optional<TablePlace> place;
    if (is_in_tile_folder(entry.name)) {
      if (const std::string why = why_bad_tile(entry, grids_); !why.empty()) {
        structure_(fmt::format("{}: {}", describe(entry), why));
        return std::nullopt;
      }
      const auto [plane, tile] = *tile_from_name(entry.name);
      place = {tile_table_name(plane), tile.row, tile.column};
    } else if (index_ && entry.header_offset < own_.index->header_offset) {  // behind the index another tool added it
      place = table_place(entry.name);
    }
    const auto table = index_ && place ? index_->find_table(place->table) : std::nullopt;
    if (!table) return std::nullopt;
    return std::pair(*table, *std::move(place));
  }

  void compare(std::size_t table, const TablePlace& place, const ZipEntry& entry, std::uint64_t data_offset) {
    Table& of = tables_[table];
    if (of.is_damaged) return;
    try {
      const MemberTable& members = index_->tables()[table].members;
      const bool has_slot = place.row < members.rows && place.column < members.columns;
      const auto record = has_slot ? index_->record(table, place.row, place.column) : std::nullopt;
      if (!record) {
        structure_(fmt::format("{}: the directory has it, the index has not", describe(entry)));
        return;
      }
      ++of.found;
      const TileEntry& stated = record->entry;
      if (stated.offset_bytes != data_offset || stated.compressed_bytes != entry.compressed_bytes ||
          stated.payload_bytes != entry.bytes || stated.payload_crc32 != entry.crc32 ||
          record->deflated != (entry.method == ZipMethod::kDeflated)) {
        structure_(fmt::format("{}: index and directory do not agree", describe(entry)));
      }
    } catch (const Error& error) {
      if (error.code() == ErrorCode::kIo) throw;
      of.is_damaged = true;
      structure_(error.what());
    }
  }

  void check_data(const ZipEntry& entry, std::uint64_t data_offset) const {
    try {
      check_member(file_, entry, data_offset);
    } catch (const Error& error) {
      if (error.code() == ErrorCode::kIo) throw;
      member_(error.what());
    }
  }

  /// Compares a table's records with its root and its description, and counts them.
  void check_table(std::size_t table) {
    if (tables_[table].is_damaged) return;
    std::int64_t stored = 0;
    try {
      index_->for_each(
          table, [&](std::uint64_t, const TableRecord&) { ++stored; }, structure_);
    } catch (const Error& error) {
      if (error.code() == ErrorCode::kIo) throw;
      structure_(error.what());
      return;
    }
    if (stored != tables_[table].found) name_missing(table);
  }

  /// Names what the index has and the directory has not.
  void name_missing(std::size_t table) const {
    const MemberTable& of = index_->tables()[table].members;
    const auto columns = static_cast<std::uint64_t>(of.columns);
    std::vector<std::uint64_t> listed;
    ZipEntry entry;
    for (ZipEntries all(file_, end_); all.read(entry);) {
      const auto tile = tile_from_name(entry.name);
      const auto place = tile ? TablePlace{tile_table_name(tile->plane), tile->tile.row, tile->tile.column}
                              : table_place(entry.name).value_or(TablePlace{});
      if (place.table == of.name && place.column < of.columns)
        listed.push_back(static_cast<std::uint64_t>(place.row) * columns + static_cast<std::uint64_t>(place.column));
    }
    std::ranges::sort(listed);
    const auto look = [&](std::uint64_t slot, const TableRecord&) {
      if (std::ranges::binary_search(listed, slot)) return;
      structure_(fmt::format(
          "member \"{}\": the index has it, the directory has not",
          member_name(of.name, static_cast<std::int64_t>(slot / columns), static_cast<std::int64_t>(slot % columns))));
    };
    index_->for_each(table, look, [](const std::string&) {});
  }

  const ByteSource& file_;
  const Complain& structure_;
  const Complain& member_;
  std::vector<TileGrid> grids_;
  ZipEnd end_;
  OwnEntries own_;
  std::unique_ptr<PagedIndex> index_;
  bool is_ours_ = false;
  MemberPlaces places_;
  std::vector<Table> tables_;
  std::vector<std::byte> ours_;
  std::uint64_t entries_ = 0;
  std::uint64_t next_offset_ = 0;
};

}  // namespace

void check_structure(const ByteSource& file, const ArchiveReader& archive, const Complain& structure,
                     const Complain& member) {
  try {
    StructureCheck(file, archive, structure, member).run();
  } catch (const Error& error) {
    structure(error.what());
  }
}

}  // namespace isohf
