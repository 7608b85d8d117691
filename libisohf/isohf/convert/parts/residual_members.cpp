#include "isohf/convert/parts/residual_members.h"

namespace isohf {

std::optional<ResidualMembers::Found> ResidualMembers::find(const std::string& name, std::int64_t member) const {
  const TileIndex owner{0, member * tile_rows_ / members()};
  if (!tiles_.contains(owner)) return std::nullopt;
  for (auto input = inputs_.rbegin(); input != inputs_.rend(); ++input) {
    if (!input->tiles.contains(owner)) continue;
    if (auto found = input->archive->find_member(name)) return Found{input->archive, std::move(*found)};
  }
  return std::nullopt;
}

bool ResidualMembers::are_complete() const {
  for (std::int64_t member = 0; member < members(); ++member) {
    if (!find(member)) return false;
  }
  return true;
}

void ResidualMembers::copy_to(ArchiveWriter& writer) {
  const auto copy = [&](const std::optional<Found>& found) {
    if (found) copy_member(*found->from, found->member, writer);
    return found ? found->member.compressed_bytes : 0;
  };
  for (const char* const name : {kNodesName, kPositionsName}) copy(find(name, 0));
  record_.residual_bytes = 0;
  for (std::int64_t member = 0; member < members(); ++member) record_.residual_bytes += copy(find(member));
}

}  // namespace isohf
