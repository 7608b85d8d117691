#pragma once

#include <functional>
#include <string>
#include <vector>

#include "isohf/archive.h"
#include "isohf/archive/tile/tile_codes.h"

namespace isohf {

/// What an archive's metadata say twice and differently, members of another type than they must have, and names that
/// stand for nothing: one line each, naming the member. Reading has refused what cannot be worked with; this is what
/// other readers would stumble on, and what was altered.
[[nodiscard]] std::vector<std::string> contradictions_in(const ArchiveReader& archive);

/// How the bytes of the members, as they stand in the file, differ from those that were written; empty where they do
/// not, or where nothing is stated of them. Reads the whole file. Throws as reading does.
[[nodiscard]] std::string why_other_data(const ArchiveReader& archive);

/// Members of a table of this name and their compressed bytes, and those in no table whose name is one.
[[nodiscard]] MemberTotals members_in(const ArchiveReader& archive, const std::string& table,
                                      const std::function<bool(const std::string& name)>& is_one);

}  // namespace isohf
