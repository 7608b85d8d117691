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
  bool is_lossy = false;  ///< the numbers are only about those that were stored
  bool has_transparent_gray = false;
  std::uint16_t transparent_gray = 0;
  std::size_t row_bytes = 0;  ///< packed as in the file until the decoder is started
};

/// Decodes a PNG or WebP picture, started once. Members return false on failure, and leave the reason in message(); after
/// that, only open() works.
class PictureDecoder {
 public:
  PictureDecoder() = default;
  PictureDecoder(const PictureDecoder&) = delete;
  PictureDecoder& operator=(const PictureDecoder&) = delete;
  virtual ~PictureDecoder() = default;

  /// Opens the file, from its beginning, and reads what stands before the first row.
  [[nodiscard]] virtual bool open(const std::string& path, PngHeader& header) = 0;
  /// The same of a picture in memory, which stays there.
  [[nodiscard]] virtual bool open(std::span<const std::byte> stored, PngHeader& header) = 0;
  /// Numbers come as stored; of pictures, palettes and transparent colours are expanded into channels, and grey of
  /// fewer bits to 8.
  enum class For { kNumbers, kPicture };
  /// Allocates for rows of the header's size, in host byte order and a byte at least for every number.
  [[nodiscard]] virtual bool start(PngHeader& header, For use) = 0;
  [[nodiscard]] bool start(PngHeader& header) { return start(header, For::kNumbers); }
  /// Decodes the next row, or all of an interlaced picture at once.
  [[nodiscard]] virtual bool read_row(std::span<std::byte> row) = 0;
  [[nodiscard]] virtual bool read_picture(std::span<std::byte> picture, const PngHeader& header) = 0;
  /// Checks what follows the last row: the last checksums.
  [[nodiscard]] virtual bool finish() = 0;
  [[nodiscard]] virtual bool has_file() const = 0;
  [[nodiscard]] const char* message() const { return message_.data(); }

 protected:
  bool fail(const char* text);

 private:
  std::array<char, 256> message_{};
};

/// libpng's.
class PngDecoder final : public PictureDecoder {
 public:
  ~PngDecoder() override { close(); }

  using PictureDecoder::start;
  [[nodiscard]] bool open(const std::string& path, PngHeader& header) override;
  [[nodiscard]] bool open(std::span<const std::byte> stored, PngHeader& header) override;
  [[nodiscard]] bool start(PngHeader& header, For use) override;
  [[nodiscard]] bool read_row(std::span<std::byte> row) override;
  [[nodiscard]] bool read_picture(std::span<std::byte> picture, const PngHeader& header) override;
  [[nodiscard]] bool finish() override;
  [[nodiscard]] bool has_file() const override { return file_ != nullptr; }

 private:
  struct Callbacks;

  [[nodiscard]] bool begin(PngHeader& header);
  [[nodiscard]] bool read_header(PngHeader& header, int& color_type);
  [[nodiscard]] bool update(PngHeader& header, For use);
  [[nodiscard]] bool read_rows(unsigned char** rows);
  void close();

  std::FILE* file_ = nullptr;
  png_struct_def* png_ = nullptr;
  png_info_def* info_ = nullptr;
};

/// libwebp's, which knows no rows: all pictures are as if interlaced.
class WebpDecoder final : public PictureDecoder {
 public:
  using PictureDecoder::start;
  [[nodiscard]] bool open(const std::string& path, PngHeader& header) override;
  [[nodiscard]] bool open(std::span<const std::byte> stored, PngHeader& header) override;
  [[nodiscard]] bool start(PngHeader& /*header*/, For /*use*/) override { return true; }
  [[nodiscard]] bool read_row(std::span<std::byte> /*row*/) override { return false; }
  [[nodiscard]] bool read_picture(std::span<std::byte> picture, const PngHeader& header) override;
  [[nodiscard]] bool finish() override { return true; }
  [[nodiscard]] bool has_file() const override { return is_open_; }

 private:
  std::vector<std::byte> file_;
  std::span<const std::byte> stored_;
  bool is_open_ = false;
};

}  // namespace isohf
