#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "isohf/raster.h"

namespace isohf {

/// A format of rasters. Each reader has one of these beside it, which formats/registry.cpp lists.
struct Format {
  const char* name;                     ///< "OpenEXR"
  std::vector<const char*> extensions;  ///< ".exr"; lower case
  std::string (*library)() = nullptr;   ///< "libpng 1.6.39": who reads or writes it; nullptr: isohf's own code
  std::string note = {};                ///< what is special: an option that it takes or needs, samples that it holds

  // Of formats that are read.

  /// Throws Error naming the path: kIo; kCorrupt (truncated, contradictory or absurdly large); kUnsupported (what the
  /// format can hold and isohf does not read); kInvalidArgument (no such channel, options out of range). What it keeps
  /// in memory is within options.buffer_bytes where a row of blocks is.
  std::unique_ptr<HeightSource> (*open)(const std::string& path, const OpenOptions& options) = nullptr;
  /// Whether a file is one, by its first 512 bytes; nullptr: the format has no signature.
  bool (*recognises)(std::span<const std::byte> head) = nullptr;
  /// Whether `path` is one by what stands inside or beside it, whatever its name; nullptr: that is not looked for.
  bool (*described)(const std::string& path) = nullptr;
  bool goes_by_name = false;    ///< the extension is enough
  bool takes_part = false;      ///< has parts that options.part chooses from
  bool takes_encoding = false;  ///< may hold elevations packed into colours
};

}  // namespace isohf
