#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/geotiff/geotiff_keys.h"
#include "formats/geotiff/tiff_io.h"

struct tiff;  // libtiff's TIFF

namespace isohf {

/// How the samples of a TIFF directory are stored. "Block" is a strip or a tile.
struct TiffLayout {
  std::int64_t width = 0;
  std::int64_t height = 0;
  std::uint16_t bits_per_sample = 1;
  std::uint16_t samples_per_pixel = 1;
  std::uint16_t sample_format = 1;  ///< 1 unsigned, 2 signed, 3 floating, 4 undefined, 5 and 6 complex
  std::uint16_t compression = 1;
  std::uint16_t photometric = 1;
  std::uint16_t orientation = 1;
  int alpha_sample = -1;  ///< which sample is opacity; -1 if none is
  bool tiled = false;
  bool separate = false;  ///< one plane of blocks for each sample
  std::int64_t block_width = 0;
  std::int64_t block_height = 0;
  std::int64_t blocks_across = 0;
  std::int64_t blocks_down = 0;

  [[nodiscard]] std::uint64_t block_index(std::int64_t plane, std::int64_t across, std::int64_t down) const {
    return static_cast<std::uint64_t>((plane * blocks_down + down) * blocks_across + across);
  }
  [[nodiscard]] bool is_grey() const;
  /// RGB, or what libtiff decodes to it.
  [[nodiscard]] bool is_colour() const;
  /// Samples of one pixel in a block.
  [[nodiscard]] std::int64_t interleaved() const { return separate ? 1 : samples_per_pixel; }
  /// Rows stored in block row `down`: tiles are whole, the last strip is cut.
  [[nodiscard]] std::int64_t stored_rows(std::int64_t down) const {
    return tiled ? block_height : std::min(block_height, height - down * block_height);
  }
  /// Decoded bytes of a row of a block; samples of less than a byte fill the row's last byte.
  [[nodiscard]] double block_row_bytes() const;
};

/// Tags beside the layout.
struct TiffTags {
  GeoTags geo;
  std::string gdal_nodata;
  std::string gdal_metadata;
  std::vector<std::string> warnings;
};

/// Where a block lies in the file; 0 bytes: not stored (sparse file).
struct TiffBlockSpan {
  std::uint64_t offset_bytes = 0;
  std::uint64_t size_bytes = 0;
};

/// The directories (images) of a file.
struct TiffDirectories {
  std::uint32_t main = 0;             ///< the wanted one among those that are neither a reduced image nor a mask
  std::optional<std::uint32_t> mask;  ///< the main image's transparency mask, which follows it
  std::uint32_t images = 0;           ///< full-size ones
  std::uint32_t count = 0;            ///< of all kinds
  bool has_broken = false;            ///< the directory after the last one read is damaged
};

/// Makes libtiff know the tags of GeoTIFF and GDAL; for the whole process, once. Call it before a file is opened.
void define_geotiff_tags();

/// One libtiff handle on a directory; not thread-safe.
class TiffHandle {
 public:
  enum class PlainStrips { kChopped, kAsStored };

  /// libtiff chops one large uncompressed strip into small ones, unless it is left as stored.
  /// Throws Error{kCorrupt} if the directory cannot be read.
  explicit TiffHandle(const std::string& path, std::uint32_t directory = 0, PlainStrips plain = PlainStrips::kChopped);
  TiffHandle(const TiffHandle&) = delete;
  TiffHandle& operator=(const TiffHandle&) = delete;
  ~TiffHandle();

  /// Decodes block `index` into host byte order; `bytes` is exactly its decoded size. Throws Error{kCorrupt}.
  void decode_block(std::uint64_t index, std::span<std::byte> bytes);
  /// Throws Error{kCorrupt} if the table of blocks has no such entry.
  [[nodiscard]] TiffBlockSpan block_span(std::uint64_t index);

  [[nodiscard]] TiffLayout read_layout();
  [[nodiscard]] TiffTags read_tags();
  /// Red, green and blue of each value of a sample. Throws Error{kCorrupt} without a palette.
  [[nodiscard]] std::vector<std::array<std::uint8_t, 3>> read_palette();

  /// The kinds of images from the current directory on, as far as they can be read. Leaves the handle at the last one.
  [[nodiscard]] TiffDirectories walk(std::uint32_t wanted);

 private:
  /// Throws Error{kIo} if reading failed, else Error{kCorrupt} with libtiff's words for what went wrong, if it has any.
  [[noreturn]] void fail(const std::string& problem) const;
  template <typename T>
  [[nodiscard]] T field(std::uint32_t tag, T otherwise) const;
  template <typename T>
  [[nodiscard]] std::vector<T> array(std::uint32_t tag) const;
  [[nodiscard]] std::string text(std::uint32_t tag) const;

  std::string path_;
  TiffIo io_;
  struct Messages {
    std::string error;                  ///< the first one
    std::vector<std::string> warnings;  ///< the first few
  } messages_;
  tiff* tiff_ = nullptr;
};

/// What a file holds, and a handle on one of its images.
struct TiffMainImage {
  TiffDirectories directories;
  std::unique_ptr<TiffHandle> handle;
};

/// A handle on any directory of the file, as its main image. Throws Error{kIo, kCorrupt}.
[[nodiscard]] TiffMainImage open_image(const std::string& path, std::uint32_t directory);

/// Opens the full-size image of a number, from 0 on; a file of one image is opened once. Throws Error{kIo};
/// Error{kCorrupt} if not even the first directory can be read; Error{kInvalidArgument} without such an image.
[[nodiscard]] TiffMainImage open_main_image(const std::string& path, std::uint32_t wanted = 0);

/// "libtiff 4.5.0": the library as it runs.
[[nodiscard]] std::string tiff_library();

}  // namespace isohf
