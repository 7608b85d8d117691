#include "isohf/convert/parts/part_file.h"

#include "isohf/archive/container/archive_directory.h"
#include "isohf/error.h"

namespace isohf {

const std::vector<std::string>& PartFile::tile_tables() {
  if (knows_tables_) return tables_;
  for (const MemberTable& table : archive().tables()) {
    const bool is_by_tile = table.name.find("{column}") != std::string::npos;
    if (is_by_tile && !table.name.starts_with("seeds/") && !is_in_tile_folder(table.name))
      tables_.push_back(table.name);
  }
  knows_tables_ = true;
  return tables_;
}

std::vector<PartFile::Stored> PartFile::stored(const std::string& table, std::int64_t row,
                                               std::pair<std::int64_t, std::int64_t> columns) {
  std::vector<Stored> all;
  try {
    const ByteSource& file = archive().source();
    if (!index_) index_ = PagedIndex::open(file, find_own_entries(file, find_archive_end(file)).index.value());
    const auto at = index_->find_table(table);
    if (!at) return all;
    index_->for_row(*at, row, columns.first, columns.second,
                    [&](std::int64_t column, const TableRecord& record, const Digest* digest) {
                      all.push_back({column, record, digest == nullptr ? Digest{} : *digest});
                    });
  } catch (const Error& error) {
    throw error.within(archive().path());
  }
  return all;
}

bool is_own_member(const std::string& name) {
  return name == kMediaTypeName || name == kMetadataName || name == kIndexName;
}

}  // namespace isohf
