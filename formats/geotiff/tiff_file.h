#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/geotiff/geotiff_keys.h"
#include "formats/io/raw_file.h"

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
  int alpha_sample = -1;  ///< which sample is opacity; -1 where none is
  bool tiled = false;
  bool separate = false;  ///< one plane of blocks for each sample
  bool big_endian = false;
  bool bits_reversed = false;  ///< FillOrder 2
  std::int64_t block_width = 0;
  std::int64_t block_height = 0;
  std::int64_t blocks_across = 0;
  std::int64_t blocks_down = 0;
  std::uint64_t table_entries = 0;  ///< in the shorter of the tables of the blocks' offsets and sizes

  [[nodiscard]] std::uint64_t block_index(std::int64_t plane, std::int64_t across, std::int64_t down) const {
    return static_cast<std::uint64_t>((plane * blocks_down + down) * blocks_across + across);
  }
  /// Samples of one pixel that a block holds.
  [[nodiscard]] std::int64_t interleaved() const { return separate ? 1 : samples_per_pixel; }
  [[nodiscard]] std::int64_t sample_bytes() const { return bits_per_sample / 8; }
  /// Rows that block row `down` really holds: tiles are whole, the last strip is cut.
  [[nodiscard]] std::int64_t stored_rows(std::int64_t down) const;
  /// Whether the bytes in the file are the samples, but for their byte order.
  [[nodiscard]] bool plain() const { return compression == 1 && !bits_reversed; }
};

/// The name of a compression scheme, for messages.
[[nodiscard]] std::string tiff_compression_name(std::uint16_t compression);

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
  std::uint32_t main = 0;             ///< the one wanted of those that are neither a reduced image nor a mask
  std::optional<std::uint32_t> mask;  ///< the main image's transparency mask, which follows it
  std::uint32_t images = 0;           ///< that are full-size ones
  bool has_broken = false;            ///< one behind the last that was read is broken
};

struct TiffMainImage;

/// One libtiff handle on a directory; not thread-safe. Nothing of libtiff shows outside its source file.
class TiffHandle {
 public:
  /// `mapped`: compressed bytes are mapped instead of read, for strips too large to buffer.
  TiffHandle(const RawFile& file, std::uint32_t directory, bool mapped);
  TiffHandle(const TiffHandle&) = delete;
  TiffHandle& operator=(const TiffHandle&) = delete;
  ~TiffHandle();

  /// Decodes block `index` into host byte order; `bytes` is exactly its decoded size. Throws Error{kCorrupt, kIo}.
  void decode_block(std::uint64_t index, bool tiled, std::span<std::byte> bytes);

  /// Decodes one row of a stripped image. Rows of one strip must be asked for in order, from its first.
  void decode_row(std::int64_t row, std::int64_t plane, std::span<std::byte> bytes);

  /// Gives mapped pages that were read back to the system.
  void forget_mapped();

  /// Throws Error{kCorrupt} where the table of blocks has no such entry.
  [[nodiscard]] TiffBlockSpan block_span(std::uint64_t index);

  [[nodiscard]] TiffLayout read_layout();
  [[nodiscard]] TiffTags read_tags();
  /// Red, green and blue of every value that a sample of the image can have. Throws Error{kCorrupt} without a palette.
  [[nodiscard]] std::vector<std::array<std::uint8_t, 3>> read_palette();

  /// Room that the user of the handle may use while he holds it.
  std::vector<std::byte> scratch;

 private:
  friend TiffMainImage open_main_image(const RawFile& file, std::uint32_t wanted);
  struct Impl;
  explicit TiffHandle(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// What a file holds, and a handle on its main image.
struct TiffMainImage {
  TiffDirectories directories;
  std::unique_ptr<TiffHandle> handle;
};

/// A handle on another directory of the file, as its main image. Throws Error{kCorrupt} where it cannot be read.
[[nodiscard]] TiffMainImage open_image(const RawFile& file, std::uint32_t directory);

/// Opens the full-size image of a number, from 0 on, and the file once where it holds one alone: of ten thousand small files in a mosaic, opening is most of the work.
/// Throws Error{kCorrupt} where not even the first directory can be read; Error{kInvalidArgument} without such an image.
[[nodiscard]] TiffMainImage open_main_image(const RawFile& file, std::uint32_t wanted = 0);

}  // namespace isohf
