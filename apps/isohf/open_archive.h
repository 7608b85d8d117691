#pragma once

#include <string>

#include "isohf/archive.h"

namespace isohf::cli {

/// Opens an archive. The error for another file names its kind, and the command that would help.
[[nodiscard]] ArchiveReader open_archive(const std::string& path,
                                         ArchiveReader::Shards shards = ArchiveReader::Shards::kRefused);

/// The same; if the source was projected from a map, that is understood: what is made of the archive ends with it.
[[nodiscard]] ArchiveReader open_with_source(const std::string& path);

/// What a file is instead of an archive, and what would help; empty if it may be a damaged archive. Throws Error{kIo}.
[[nodiscard]] std::string what_else(const std::string& path);

}  // namespace isohf::cli
