#include "open_archive.h"

#include <fmt/format.h>

#include "formats/io/foreign_file.h"
#include "formats/registry.h"
#include "isohf/error.h"
#include "isohf/surface.h"

namespace isohf::cli {

std::string what_else(const std::string& path) {
  if (const Format* const format = native_format_of(path, {}); format != nullptr) {
    return fmt::format("is not an isohf archive but a raster ({0}). Convert it first: isohf convert {1} OUT.isohf",
                       format->name, path);
  }
  const ForeignFile found = foreign_file(path);
  if (found.is.empty() || found.is == "an isohf archive") return {};
  return "is not an isohf archive but " + found.is;
}

ArchiveReader open_archive(const std::string& path, ArchiveReader::Shards shards) {
  try {
    ArchiveReader archive(path, shards);
    try {
      understand_world(archive);
    } catch (const Error&) {
      // Reported by whatever needs a place.
    }
    return archive;
  } catch (const Error& error) {
    const std::string found = error.code() == ErrorCode::kCorrupt ? what_else(path) : "";
    if (found.empty()) throw;
    throw Error(ErrorCode::kUnsupported, path + ": " + found);
  }
}

ArchiveReader open_with_source(const std::string& path) {
  ArchiveReader archive = open_archive(path);
  try {
    if (is_warped(archive.metadata())) understand_source(archive);
  } catch (const Error&) {
    // As above.
  }
  return archive;
}

}  // namespace isohf::cli
