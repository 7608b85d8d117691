#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "isohf/error.h"

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
  bool is_lossy = false;                            ///< the numbers are only about those that were stored
  std::optional<std::uint16_t> transparent_number;  ///< of grey, or of red, green and blue alike
  std::size_t row_bytes = 0;                        ///< packed as in the file until the decoder is started
};

/// Decodes a PNG, WebP or JPEG picture, started once. Members return false on failure, and leave the reason in
/// message(); after that, only open() works.
class PictureDecoder {
 public:
  PictureDecoder() = default;
  PictureDecoder(const PictureDecoder&) = delete;
  PictureDecoder& operator=(const PictureDecoder&) = delete;
  virtual ~PictureDecoder() = default;

  /// Opens the file, from its beginning, and reads what is before the first row.
  [[nodiscard]] bool open(const std::string& path, PngHeader& header);
  /// The same of a picture in memory, which stays there.
  [[nodiscard]] bool open(std::span<const std::byte> stored, PngHeader& header);
  /// Numbers come as stored; of pictures, palettes and transparent colours are expanded into channels, and grey of
  /// fewer bits to 8.
  enum class For { kNumbers, kPicture };
  /// Allocates for rows of the header's size, in host byte order and a byte at least for every number.
  [[nodiscard]] virtual bool start(PngHeader& header, For use) = 0;
  /// Decodes the next row, or all of an interlaced picture at once.
  [[nodiscard]] virtual bool read_row(std::span<std::byte> row) = 0;
  [[nodiscard]] virtual bool read_picture(std::span<std::byte> picture, const PngHeader& header) = 0;
  /// Checks what follows the last row: the last checksums.
  [[nodiscard]] virtual bool finish() = 0;
  [[nodiscard]] bool has_file() const { return file_ != nullptr; }
  [[nodiscard]] const char* message() const { return message_.data(); }

 protected:
  [[nodiscard]] virtual bool read_header(PngHeader& header) = 0;
  [[nodiscard]] std::FILE* file() const { return file_.get(); }
  bool fail(const char* text);

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  [[nodiscard]] bool open(std::FILE* file, PngHeader& header);

  std::unique_ptr<std::FILE, Close> file_;
  std::array<char, 256> message_{};
};

/// libpng's.
class PngDecoder final : public PictureDecoder {
 public:
  ~PngDecoder() override;

  [[nodiscard]] bool start(PngHeader& header, For use) override;
  [[nodiscard]] bool read_row(std::span<std::byte> row) override;
  [[nodiscard]] bool read_picture(std::span<std::byte> picture, const PngHeader& header) override;
  [[nodiscard]] bool finish() override;

 private:
  [[nodiscard]] bool read_header(PngHeader& header) override;
  template <typename Calls>
  [[nodiscard]] bool run(Calls calls);

  png_struct_def* png_ = nullptr;
  png_info_def* info_ = nullptr;
};

/// libwebp's, which knows no rows: all pictures are as if interlaced.
class WebpDecoder final : public PictureDecoder {
 public:
  [[nodiscard]] bool start(PngHeader& /*header*/, For /*use*/) override { return true; }
  [[nodiscard]] bool read_row(std::span<std::byte> /*row*/) override { return false; }
  [[nodiscard]] bool read_picture(std::span<std::byte> picture, const PngHeader& header) override;
  [[nodiscard]] bool finish() override { return true; }

 private:
  [[nodiscard]] bool read_header(PngHeader& header) override;

  std::vector<std::uint8_t> stored_;
};

/// The rows of a picture file. Decodes them in order, and an interlaced picture whole at the first row. Errors carry no
/// path: kIo; kCorrupt; kUnsupported for an interlaced picture of more than kMaxInterlacedBytes.
class PictureRows {
 public:
  /// `format`  "PNG", "WebP" or "JPEG", for messages.
  PictureRows(std::string path, std::string format, std::unique_ptr<PictureDecoder> decoder, PictureDecoder::For use);

  [[nodiscard]] const PngHeader& header() const { return header_; }
  /// Valid until the next call. Begins again from the first row to go back, but in an interlaced picture.
  [[nodiscard]] std::span<const std::byte> row(std::int64_t row);
  /// Of the rows that are held here and in the decoder.
  [[nodiscard]] std::uint64_t buffer_bytes() const;

 private:
  void restart();
  [[noreturn]] void fail(const std::string& where);

  std::string path_;
  std::string format_;
  std::unique_ptr<PictureDecoder> decoder_;
  PictureDecoder::For use_;
  PngHeader header_;
  std::int64_t next_row_ = 0;           ///< that the decoder delivers next
  std::unique_ptr<std::byte[]> bytes_;  ///< the last row; of an interlaced picture all
};

/// The same error, naming the file if it does not yet.
[[nodiscard]] Error naming(const std::string& path, const Error& error);

/// "libpng 1.6.39": the library as it runs.
[[nodiscard]] std::string png_library();
/// The same of libwebp.
[[nodiscard]] std::string webp_library();
/// Whether a file begins as a WebP picture does.
[[nodiscard]] bool looks_like_webp(std::span<const std::byte> head);

}  // namespace isohf
