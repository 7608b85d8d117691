#pragma once

#include <string>

#include "isohf/archive.h"

namespace isohf::cli {

/// Opens an archive. Of a file that is none the error says what it is instead, and which command would help.
[[nodiscard]] ArchiveReader open_archive(const std::string& path,
                                         ArchiveReader::Shards shards = ArchiveReader::Shards::kRefused);

/// The same, and has the map understood that its source lies on where it was projected from one: what is made of the
/// archive then ends with the source.
[[nodiscard]] ArchiveReader open_with_source(const std::string& path);

/// What a file is that is no archive, and what would help; empty where it may be an archive that is damaged. Throws
/// Error{kIo}.
[[nodiscard]] std::string what_else(const std::string& path);

}  // namespace isohf::cli
