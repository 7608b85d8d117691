#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <span>
#include <string>
#include <vector>

// libpng's own, which only png_decoder.cpp looks into.
struct png_struct_def;
struct png_info_def;

namespace isohf {

/// What the header says, after the reader's transformations.
struct PngHeader {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  int bit_depth = 0;
  bool has_palette = false;           ///< the numbers are colours of a table
  std::vector<const char*> channels;  ///< "Y", "A", or "R", "G", "B", "A"; of a palette, R, G, B
  bool interlaced = false;
  bool has_transparent_gray = false;
  std::uint16_t transparent_gray = 0;
  std::size_t row_bytes = 0;  ///< packed as in the file until the decoder is started
};

/// libpng's decoder, started once. Members return false on failure, and leave the reason in message(); after that, only
/// open() works.
class PngDecoder {
 public:
  PngDecoder() = default;
  PngDecoder(const PngDecoder&) = delete;
  PngDecoder& operator=(const PngDecoder&) = delete;
  ~PngDecoder() { close(); }

  /// Opens the file, from its beginning, and reads what stands before the first row.
  [[nodiscard]] bool open(const std::string& path, PngHeader& header);
  /// Numbers come as stored; of pictures, palettes and transparent colours are expanded into channels, and grey of
  /// fewer bits to 8.
  enum class For { kNumbers, kPicture };
  /// Allocates for rows of the header's size, in host byte order and a byte at least for every number.
  [[nodiscard]] bool start(PngHeader& header, For use = For::kNumbers);
  /// Decodes the next row, or all of an interlaced picture at once.
  [[nodiscard]] bool read_row(std::span<std::byte> row);
  [[nodiscard]] bool read_picture(std::span<std::byte> picture, const PngHeader& header);
  /// Checks what follows the last row: the last checksums.
  [[nodiscard]] bool finish();

  [[nodiscard]] bool has_file() const { return file_ != nullptr; }
  [[nodiscard]] const char* message() const { return message_.data(); }

 private:
  struct Callbacks;

  bool fail(const char* text);
  [[nodiscard]] bool read_header(PngHeader& header, int& color_type);
  [[nodiscard]] bool update(PngHeader& header, For use);
  [[nodiscard]] bool read_rows(unsigned char** rows);
  void close();

  std::FILE* file_ = nullptr;
  png_struct_def* png_ = nullptr;
  png_info_def* info_ = nullptr;
  std::array<char, 256> message_{};
};

}  // namespace isohf
