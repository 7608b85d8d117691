#include "isohf/convert/parts/residual_members.h"

namespace isohf {

std::optional<ResidualMembers::Found> ResidualMembers::find(const std::string& name, std::int64_t member) const {
  const TileIndex owner{0, member * tile_rows_ / members()};
  if (!tiles_.contains(owner)) return std::nullopt;
  for (auto input = inputs_.rbegin(); input != inputs_.rend(); ++input) {
    if (!input->tiles.contains(owner)) continue;
    const ArchiveReader& archive = input->file->archive();
    if (auto found = archive.find_member(name)) return Found{&archive, std::move(*found)};
  }
  return std::nullopt;
}

bool ResidualMembers::are_complete() const {
  bool all = true;
  for (std::int64_t member = 0; member < members() && all; ++member) all = find(member).has_value();
  for (const AssemblyInput& input : inputs_) input.file->close();
  return all;
}

void ResidualMembers::copy_to(ArchiveWriter& writer) {
  ReadAhead ahead;
  const auto copy = [&](const std::optional<Found>& found) {
    if (found) copy_member(*found->from, found->member, writer, ahead);
    return found ? found->member.compressed_bytes : 0;
  };
  copy(find(kNodesName, 0));
  record_.residual_bytes = 0;
  for (std::int64_t member = 0; member < members(); ++member) record_.residual_bytes += copy(find(member));
  for (const AssemblyInput& input : inputs_) input.file->close();
}

}  // namespace isohf
