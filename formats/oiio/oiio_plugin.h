#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "isohf/raster.h"

namespace isohf {

/// One channel of a picture that OpenImageIO has open, and all of them. Errors name the file.
class OiioPicture : public HeightSource {
 public:
  int channels = 1;
  int alpha = -1;          ///< which channel is opacity; -1: none
  bool is_linear = false;  ///< the numbers are light, not coded as sRGB

  /// Reads whole rows of all channels, interleaved. The first row is that of a block, and the last one too, but for the
  /// picture's.
  virtual void read_pixels(std::int64_t row, std::int64_t rows, std::byte* out) = 0;
};

/// What the plug-in isohf_oiio.so hands out. It is loaded only for files that no native reader knows, because
/// OpenImageIO brings some hundred libraries with it. Both sides are built in one tree; they share headers, no code.
struct OiioPlugin {
  enum class For { kNumbers, kPhoto };

  std::int32_t abi;  ///< load_module() compares it
  /// nullptr if OpenImageIO knows no such format. `channel`  name or number. Of a photo, samples may be spread over the
  /// range of their type. `complete`  adds to the info what the plug-in does not know.
  std::unique_ptr<OiioPicture> (*open)(const std::string& path, For use, const std::string& channel,
                                       const std::function<void(SourceInfo& info)>& complete);
  std::string (*library)();                  ///< "OpenImageIO 2.4.7"
  std::vector<std::string> (*extensions)();  ///< ".bmp", ...: of all formats that it reads
};

/// Raised whenever anything above changes.
inline constexpr std::int32_t kOiioAbi = 8;
inline constexpr const char* kOiioSymbol = "isohf_oiio_plugin";

}  // namespace isohf
