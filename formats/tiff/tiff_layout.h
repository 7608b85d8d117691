#pragma once

#include <cstdint>
#include <string>

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

}  // namespace isohf
