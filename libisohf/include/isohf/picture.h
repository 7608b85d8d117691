// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "isohf/raster.h"

namespace isohf {

/// A picture of 8-bit sRGB samples, row by row from the top, channels interleaved: 1 grey, 3 RGB, 4 RGBA with straight
/// alpha.
struct Picture {
  int width = 0;
  int height = 0;
  int channels = 0;
  std::vector<std::uint8_t> samples;  ///< [width * height * channels]

  Picture() = default;
  Picture(int columns, int rows, int channel_count)
      : width(columns),
        height(rows),
        channels(channel_count),
        samples(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows) *
                static_cast<std::size_t>(channel_count)) {}

  [[nodiscard]] std::size_t row_bytes() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(channels);
  }
  [[nodiscard]] const std::uint8_t* row(int r) const {
    return samples.data() + static_cast<std::size_t>(r) * row_bytes();
  }
  [[nodiscard]] std::uint8_t* row(int r) { return samples.data() + static_cast<std::size_t>(r) * row_bytes(); }
  /// The first channel of a pixel.
  [[nodiscard]] const std::uint8_t* pixel(int column, int r) const {
    return row(r) + static_cast<std::size_t>(column) * static_cast<std::size_t>(channels);
  }
  friend bool operator==(const Picture&, const Picture&) = default;
};

/// How a texture is coded.
enum class TextureFormat { kPng, kJpeg };

[[nodiscard]] std::string to_string(TextureFormat format);                        ///< "png", "jpeg"
[[nodiscard]] TextureFormat texture_format_from_string(const std::string& text);  ///< throws Error{kInvalidArgument}

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

/// Opens a picture of the ground: PNG, JPEG and TIFF natively, other formats through OpenImageIO. Grey,
/// RGB or RGBA of 8 or 16 bits or floats, and palettes of 8 bits, are delivered as 8-bit sRGB. Light (OpenEXR, PFM) is
/// coded as sRGB, any other numbers are taken to be so. Four channels of which the fourth is no alpha lose it, with a
/// warning. The georeference is that of GeoTIFF tags, else of a world file and a .prj beside the picture.
/// Memory: what set_cache_bytes allows, one row of blocks at least; interlaced PNG and progressive JPEG are decoded
/// whole by their libraries.
/// Throws Error naming the path: kIo (missing), kUnsupported (no module, unknown format, 2 or more than 4 channels, a
/// rotated or South-up georeference), kCorrupt.
[[nodiscard]] std::unique_ptr<PhotoSource> open_photo(const std::string& path);

}  // namespace isohf
