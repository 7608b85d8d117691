#pragma once

#include "isohf/archive.h"
#include "isohf/archive/container/archive_directory.h"

namespace isohf {

/// Compares the whole file with the profile of docs/archive_format.md in one pass over its directory: entries, names,
/// local headers, order, gaps and overlaps, and the index. Inflates each member that is not a tile once, in pieces.
/// Memory: 32 bytes a member.
///   file       the archive's
///   structure  takes what is wrong with the file
///   member     takes what is wrong with the data of a member
void check_structure(const ByteSource& file, const ArchiveReader& archive, const Complain& structure,
                     const Complain& member);

}  // namespace isohf
