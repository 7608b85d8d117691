#include "isohf/convert/parts/part_file.h"

#include "isohf/archive/container/archive_directory.h"

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

bool is_own_member(const std::string& name) {
  return name == kMediaTypeName || name == kMetadataName || name == kIndexName;
}

}  // namespace isohf
