#pragma once

#include <sys/stat.h>

#include <cstdint>
#include <memory>
#include <string>

#include "options.h"
#include "paging/tile_source.h"

namespace isohf::view {

/// Tells one state of a file from another; all 0 where there is none.
struct FileStamp {
  std::uint64_t inode = 0;
  std::int64_t bytes = 0;
  std::int64_t seconds = 0;
  std::int64_t nanoseconds = 0;
  friend bool operator==(const FileStamp&, const FileStamp&) = default;
};
[[nodiscard]] FileStamp stamp_of(const std::string& path);

/// What a name on the command line, or dropped on the window, has become.
struct Opened {
  std::string name;
  FileStamp stamp;  ///< when it was opened
  std::unique_ptr<TileSource> source;
};

/// Opens an archive, or a raster, which is converted for as long as it is looked at. `second`: another one, by which
/// elevations are told to differ; or none. Throws Error naming the file.
[[nodiscard]] Opened open_shown(const std::string& name, const Options& options, const std::string& second = "");

}  // namespace isohf::view
