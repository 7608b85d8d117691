#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "isohf/raster.h"

namespace isohf {

/// All that is known of a photo before a pixel is read.
struct PhotoInfo {
  std::string path;         ///< for messages
  std::string format;       ///< "tiff", "jpeg", ...
  std::int64_t width = 0;   ///< pixels
  std::int64_t height = 0;  ///< pixels
  int channels = 3;         ///< as delivered: 1 grey, 3 RGB, 4 RGBA with straight alpha
  /// Rows that are decoded together, and whether any of them can be had without those before.
  std::int64_t block_height = 1;
  bool random_access = false;
  std::uint64_t pixel_bytes = 3;             ///< of one pixel in the reader's cache
  std::optional<Georeference> georeference;  ///< has_origin is true; the origin is the middle of pixel (0, 0)
  std::vector<Warning> warnings;             ///< for the user
};

/// A picture of the ground that is read in windows and may be larger than memory. Any number of threads at once.
class PhotoSource {
 public:
  PhotoSource() = default;
  PhotoSource(const PhotoSource&) = delete;
  PhotoSource& operator=(const PhotoSource&) = delete;
  virtual ~PhotoSource() = default;

  [[nodiscard]] virtual const PhotoInfo& info() const = 0;

  /// How many bytes of decoded pixels may be kept for windows to come; never less than a reader needs for one.
  virtual void set_cache_bytes(std::uint64_t bytes) = 0;

  /// Reads a window as 8-bit sRGB, row by row, channels interleaved.
  /// samples [window.columns * window.rows * info().channels] out.
  /// Throws Error{kIo, kCorrupt}.
  virtual void read_window(const Window& window, std::span<std::uint8_t> samples) = 0;
};

}  // namespace isohf
