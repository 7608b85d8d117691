#include "formats/readers.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "formats/adapters/masked_source.h"
#include "formats/georeference/files_beside.h"
#include "formats/georeference/raster_description.h"
#include "formats/io/file_source.h"
#include "formats/open_options.h"
#include "formats/png/packed_elevations.h"
#include "formats/png/png_decoder.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

constexpr std::array<unsigned char, 8> kMagic = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};

/// Deflate's highest compression: 258 bytes from two bits and a little.
constexpr std::uint64_t kMaxCompressionRatio = 1032;

/// Decoded rows of the channel that are kept for a reader whose windows overlap.
constexpr std::size_t kKeptBytes = std::size_t{8} << 20U;
constexpr std::size_t kMaxKeptRows = 1024;

/// Rows of one channel of a PNG or WebP picture, decoded in order.
class PngSource final : public HeightSource {
 public:
  PngSource(const std::string& path, const char* format, std::unique_ptr<PictureDecoder> decoder,
            const OpenOptions& options)
      : decoder_(std::move(decoder)) {
    info_.path = path;
    info_.format = format;
    wants_packed_ = packing_from_string(options.channel).has_value();
    restart();
    info_.width = info_.block_width = header_.width;
    info_.height = header_.height;
    info_.block_height = header_.interlaced ? info_.height : 1;
    info_.sample_type = header_.bit_depth == 16 ? SampleType::kUint16 : SampleType::kUint8;
    if (header_.has_transparent_gray) info_.void_values = {static_cast<double>(header_.transparent_gray)};
    sample_bytes_ = size_bytes(info_.sample_type);
    choose_channel(options.channel);
    if (channels_ > 2 && options.channel.empty()) decide_on_colours();
    if (header_.is_lossy) info_.warnings.emplace_back("lossy WebP: elevations are only about those that were stored");
    read_beside();
    apply_open_options(info_, options);
    kept_rows_ = rows_within(kKeptBytes);
  }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  /// Whether the picture's other channel says which of the grey samples are transparent.
  [[nodiscard]] bool is_beside_opacity() const { return channels_ == 2 && channel_ == 0; }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    ISOHF_ASSERT(is_window_of(info_, window, samples.size()));
    const std::size_t out_bytes = static_cast<std::size_t>(window.columns) * sample_bytes_;
    if (samples.empty()) return;
    const auto first = static_cast<std::size_t>(window.row);
    const std::size_t end = first + static_cast<std::size_t>(window.rows);
    if (first + kept_rows_ < next_row_) restart();
    std::byte* out = samples.data();
    for (std::size_t row = first; row < end; ++row, out += out_bytes) {
      while (next_row_ <= row) decode_next();
      std::memcpy(out, kept_row(row) + static_cast<std::size_t>(window.column) * sample_bytes_, out_bytes);
    }
  }

  void limit_buffers(std::uint64_t bytes) override {
    const std::size_t rows = rows_within(bytes);
    if (rows >= kept_rows_) return;
    if (next_row_ > 0) restart();
    kept_rows_ = rows;
    kept_ = std::vector<std::byte>();
  }
  /// The kept rows, and a decoded one here and in libpng; of an interlaced picture all rows twice while it is decoded.
  [[nodiscard]] std::uint64_t buffer_bytes(std::uint64_t limit) const override {
    const std::uint64_t rows = rows_within(limit);
    const std::uint64_t decoded = header_.interlaced ? header_.height : 2;
    return rows * header_.width * sample_bytes_ + decoded * header_.row_bytes;
  }

 private:
  /// How many decoded rows may be kept.
  [[nodiscard]] std::size_t rows_within(std::uint64_t bytes) const {
    if (header_.interlaced) return header_.height;
    const std::uint64_t most = std::min<std::uint64_t>(kMaxKeptRows, header_.height);
    const std::uint64_t fitting = std::min<std::uint64_t>(bytes, kKeptBytes) / (header_.width * sample_bytes_);
    return static_cast<std::size_t>(std::clamp<std::uint64_t>(fitting, 1, most));
  }

  /// Opens the file anew; the next row decoded is the first.
  void restart() {
    next_row_ = 0;
    if (!decoder_->open(info_.path, header_)) {
      throw Error(decoder_->has_file() ? ErrorCode::kCorrupt : ErrorCode::kIo,
                  fmt::format("{}: {} header: {}", info_.path, info_.format, decoder_->message()));
    }
    if (header_.has_palette && !wants_packed_) {
      throw Error(ErrorCode::kUnsupported,
                  info_.path +
                      ": PNG with a palette: its numbers are colours, not elevations, unless these are packed "
                      "into them (`encoding` terrarium, mapbox or rgba-float)");
    }
    check_size();
    if (!decoder_->start(header_,
                         header_.has_palette ? PictureDecoder::For::kPicture : PictureDecoder::For::kNumbers)) {
      throw Error(ErrorCode::kCorrupt, fmt::format("{}: {} header: {}", info_.path, info_.format, decoder_->message()));
    }
  }

  void check_size() const {
    const std::uint64_t picture_bytes = (header_.row_bytes + 1) * std::uint64_t{header_.height};
    std::error_code error;
    const std::uint64_t file_size = std::filesystem::file_size(info_.path, error);
    if (!error && picture_bytes / kMaxCompressionRatio > file_size && info_.format == "PNG") {
      throw Error(ErrorCode::kCorrupt, fmt::format("{}: PNG header declares {} x {} pixels, for which a file of {} "
                                                   "bytes has no room",
                                                   info_.path, header_.width, header_.height, file_size));
    }
    if (header_.interlaced && picture_bytes > kMaxInterlacedBytes) {
      throw Error(ErrorCode::kUnsupported,
                  fmt::format("{}: interlaced PNG of {} x {} pixels would take more than {} "
                              "MiB; store it without interlacing",
                              info_.path, header_.width, header_.height, kMaxInterlacedBytes >> 20U));
    }
  }

  void choose_channel(const std::string& wanted) {
    const std::vector<const char*>& channels = header_.channels;
    channels_ = channels.size();
    if (const auto packing = packing_from_string(wanted)) return unpack(*packing);
    const auto is_wanted = [&](std::size_t at) { return wanted == channels[at] || wanted == std::to_string(at); };
    while (channel_ < channels_ && !wanted.empty() && !is_wanted(channel_)) ++channel_;
    if (channel_ == channels_) {
      throw Error(ErrorCode::kInvalidArgument,
                  fmt::format("{}: has no channel \"{}\"; it has {} (or 0...{}){}", info_.path, wanted,
                              fmt::join(channels, ", "), channels_ - 1,
                              channels_ > 2 ? ", and with `encoding` terrarium, mapbox or rgba-float" : ""));
    }
    if (channels_ == 1) return;
    info_.channel = channels[channel_];
  }

  /// What isohf wrote beside the picture says what its numbers mean and where they lie; a world file says the latter.
  /// Packed elevations say themselves what they mean.
  void read_beside() {
    if (!packing_ && has_raster_description(info_.path)) {
      const RasterDescription description(info_.path);
      if (!description.format().empty()) {
        description.require("png", info_);
        return description.describe(info_);
      }
      info_.warnings.push_back(loss("the .json beside it names no format, as one of isohf's would: it is left aside"));
    }
    read_place_beside(info_, packing_ ? 0 : static_cast<int>(channel_) + 1);
    if (packing_) place_web_tile(info_);
  }

  /// All channels together are one elevation.
  void unpack(Packing packing) {
    packing_ = packing;
    if (header_.is_lossy) {
      throw Error(ErrorCode::kUnsupported,
                  info_.path + ": is lossy WebP, which does not keep the bytes of elevations; a lossless picture does");
    }
    describe_packing(packing, channels_, header_.bit_depth, info_);
    sample_bytes_ = size_bytes(info_.sample_type);
  }

  void decide_on_colours() {
    PackingEvidence evidence(channels_);
    const std::size_t rows = std::min<std::size_t>(PackingEvidence::kRows, header_.height);
    if (header_.bit_depth == 8 && header_.interlaced) {
      const std::unique_ptr<std::byte[]> picture = decoded_picture();
      for (std::size_t row = 0; row < rows; ++row) {
        evidence.add({picture.get() + row * header_.row_bytes, header_.row_bytes});
      }
      restart();
    } else if (!header_.interlaced) {
      row_.resize(header_.row_bytes);
      for (std::size_t row = 0; row < rows && decoder_->read_row(row_); ++row) {
        header_.bit_depth == 8 ? evidence.add(row_) : evidence.add_wide(row_);
      }
      restart();
    }
    if (const auto packing = evidence.decide(fmt::format("{}", fmt::join(header_.channels, ", ")), info_))
      unpack(*packing);
  }

  [[nodiscard]] std::byte* kept_row(std::size_t row) {
    return kept_.data() + row % kept_rows_ * header_.width * sample_bytes_;
  }

  void decode_next() {
    if (header_.interlaced) return decode_all();
    if (kept_.empty()) kept_.resize(kept_rows_ * header_.width * sample_bytes_);
    row_.resize(header_.row_bytes);
    if (!decoder_->read_row(row_)) fail(fmt::format("PNG row {}", next_row_));
    if (next_row_ + 1 == header_.height && !decoder_->finish()) fail(fmt::format("PNG row {}", next_row_));
    pick_channel(row_.data(), kept_row(next_row_));
    ++next_row_;
  }

  void decode_all() {
    const std::unique_ptr<std::byte[]> picture = decoded_picture();
    if (kept_.empty()) kept_.resize(kept_rows_ * header_.width * sample_bytes_);
    for (std::size_t row = 0; row < header_.height; ++row) {
      pick_channel(picture.get() + row * header_.row_bytes, kept_row(row));
    }
    next_row_ = header_.height;
  }

  /// All of it; memory that a damaged picture does not come to is never touched.
  [[nodiscard]] std::unique_ptr<std::byte[]> decoded_picture() {
    const std::size_t bytes = header_.row_bytes * header_.height;
    auto picture = std::make_unique_for_overwrite<std::byte[]>(bytes);
    if (!decoder_->read_picture({picture.get(), bytes}, header_) || !decoder_->finish()) {
      fail(info_.format == "PNG" ? "interlaced PNG" : "WebP");
    }
    return picture;
  }

  void pick_channel(const std::byte* pixels, std::byte* out) const {
    if (packing_) {
      const std::span all(pixels, header_.width * channels_);
      return unpack_elevations(*packing_, channels_, all, {out, header_.width * sample_bytes_});
    }
    const std::size_t pixel_bytes = channels_ * sample_bytes_;
    if (channels_ == 1) {
      std::memcpy(out, pixels, header_.width * sample_bytes_);
      return;
    }
    pixels += channel_ * sample_bytes_;
    for (std::size_t column = 0; column < header_.width; ++column, pixels += pixel_bytes, out += sample_bytes_) {
      std::memcpy(out, pixels, sample_bytes_);
    }
  }

  /// The decoder cannot go on after an error: the next request starts again from the first row.
  [[noreturn]] void fail(const std::string& where) {
    next_row_ = header_.height + kept_rows_ + 1;
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: {}: {}", info_.path, where, decoder_->message()));
  }

  std::unique_ptr<PictureDecoder> decoder_;
  PngHeader header_;
  SourceInfo info_;
  std::size_t sample_bytes_ = 0;
  std::size_t channels_ = 1;
  std::size_t channel_ = 0;
  std::optional<Packing> packing_;
  bool wants_packed_ = false;  ///< the user says that all channels are one elevation: a palette is expanded
  std::size_t next_row_ = 0;   ///< the row that the decoder delivers next
  std::size_t kept_rows_ = 0;  ///< rows next_row_ - kept_rows_ ... next_row_ - 1 are in kept_, at row % kept_rows_
  std::vector<std::byte> kept_;
  std::vector<std::byte> row_;
};

}  // namespace

bool looks_like_png(std::span<const std::byte> head) {
  return head.size() >= kMagic.size() && std::memcmp(head.data(), kMagic.data(), kMagic.size()) == 0;
}

std::unique_ptr<HeightSource> open_png(const std::string& path, const OpenOptions& options) {
  auto source = std::make_unique<PngSource>(path, "PNG", std::make_unique<PngDecoder>(), options);
  if (!options.channel.empty() || !source->is_beside_opacity()) return source;
  OpenOptions opacity;
  opacity.channel = "A";
  return mask_transparent(std::move(source),
                          std::make_unique<PngSource>(path, "PNG", std::make_unique<PngDecoder>(), opacity));
}

std::unique_ptr<HeightSource> open_webp(const std::string& path, const OpenOptions& options) {
  return std::make_unique<PngSource>(path, "WebP", std::make_unique<WebpDecoder>(), options);
}

}  // namespace isohf
