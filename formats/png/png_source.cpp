#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "formats/georeference/raster_description.h"
#include "formats/georeference/sidecars.h"
#include "formats/io/file_source.h"
#include "formats/open_options.h"
#include "formats/png/packed_elevations.h"
#include "formats/png/png_decoder.h"
#include "formats/readers.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

constexpr std::array<unsigned char, 8> kMagic = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};

/// Decoded rows of samples that are kept for a reader whose windows overlap.
constexpr std::size_t kKeptBytes = std::size_t{8} << 20U;
constexpr std::int64_t kMaxKeptRows = 1024;
/// Of a picture of colours, rows that are looked at when it is opened.
constexpr std::int64_t kFirstRows = 64;
constexpr int kTransparent = -1;

/// One channel of a PNG or WebP picture, the greys of all, or elevations packed into them.
class PngSource final : public HeightSource {
 public:
  PngSource(const std::string& path, const char* format, std::unique_ptr<PictureDecoder> decoder,
            const OpenOptions& options)
      : packing_(stated_packing(options)),
        rows_(path, format, std::move(decoder),
              packing_ ? PictureDecoder::For::kPicture : PictureDecoder::For::kNumbers),
        header_(rows_.header()),
        channels_(header_.channels.size()) {
    info_.path = path;
    info_.format = format;
    info_.width = info_.block_width = header_.width;
    info_.height = header_.height;
    info_.block_height = header_.interlaced ? info_.height : 1;
    if (packing_) {
      if (header_.is_lossy) {
        throw Error(ErrorCode::kUnsupported,
                    "is lossy WebP, which does not keep the bytes of elevations; a lossless picture does");
      }
      describe_packing(*packing_, channels_, header_.bit_depth, options, info_);
    } else {
      info_.sample_type = header_.bit_depth == 16 ? SampleType::kUint16 : SampleType::kUint8;
      if (header_.transparent_number) info_.void_values = {static_cast<double>(*header_.transparent_number)};
      choose_channel(options.channel);
    }
    read_beside();
    if (has_mask_) widen();
    apply_open_options(info_, options);
    sample_bytes_ = size_bytes(info_.sample_type);
    kept_rows_ = rows_within(options.buffer_bytes);
    if (is_grey_) (void)samples_of(std::min(kFirstRows, info_.height) - 1);
  }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    ISOHF_ASSERT(is_window_of(info_, window, samples.size()));
    const std::size_t out_bytes = static_cast<std::size_t>(window.columns) * sample_bytes_;
    if (samples.empty()) return;
    std::byte* out = samples.data();
    try {
      for (std::int64_t row = window.row; row < window.row + window.rows; ++row, out += out_bytes) {
        std::memcpy(out, samples_of(row) + static_cast<std::size_t>(window.column) * sample_bytes_, out_bytes);
      }
    } catch (const Error& error) {
      next_row_ = 0;
      throw error.within(info_.path);
    }
  }

  [[nodiscard]] std::uint64_t buffer_bytes() const override {
    return static_cast<std::uint64_t>(kept_rows_) * header_.width * sample_bytes_ + rows_.buffer_bytes();
  }

 private:
  /// How many rows of samples may be kept.
  [[nodiscard]] std::int64_t rows_within(std::uint64_t bytes) const {
    if (header_.interlaced) return 1;  // the picture is held
    const std::uint64_t fitting = std::min<std::uint64_t>(bytes, kKeptBytes) / (header_.width * sample_bytes_);
    return std::clamp<std::int64_t>(static_cast<std::int64_t>(fitting), 1, std::min(kMaxKeptRows, info_.height));
  }

  void choose_channel(const std::string& wanted) {
    const std::vector<const char*>& names = header_.channels;
    if (header_.has_palette) {
      throw Error(ErrorCode::kUnsupported,
                  fmt::format("PNG with a palette: its numbers are colours, not elevations, unless these are packed "
                              "into them (`encoding` {})",
                              kEncodings));
    }
    const auto is_wanted = [&](std::size_t at) { return wanted == names[at] || wanted == std::to_string(at); };
    while (channel_ < channels_ && !wanted.empty() && !is_wanted(channel_)) ++channel_;
    if (channel_ == channels_) {
      throw Error(ErrorCode::kInvalidArgument,
                  fmt::format("has no channel \"{}\"; it has {} (or 0...{}){}", wanted, fmt::join(names, ", "),
                              channels_ - 1, channels_ > 2 ? fmt::format(", and `encoding` {}", kEncodings) : ""));
    }
    if (channels_ > 1) info_.channel = names[channel_];
    is_grey_ = wanted.empty() && channels_ > 2;
    has_mask_ = wanted.empty() && channels_ % 2 == 0;
    if (is_grey_) info_.warnings.emplace_back("colour picture in greys: channel R is read");
    if (header_.is_lossy) info_.warnings.emplace_back("lossy WebP: elevations are only about those that were stored");
  }

  /// Makes room for a number that no sample has.
  void widen() {
    const SampleType wide = info_.sample_type == SampleType::kUint8 ? SampleType::kInt16 : SampleType::kInt32;
    info_.warnings.push_back(
        fmt::format("transparent samples are nodata: samples of {} become {}, which has a number to spare for them "
                    "(`channel` {} reads them all)",
                    to_string(info_.sample_type), to_string(wide), info_.channel));
    info_.sample_type = wide;
    info_.void_values.push_back(kTransparent);
    info_.valid_min = kTransparent + 1.0;  // whatever `void_values` say
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
    read_sidecars(info_, packing_ ? 0 : static_cast<int>(channel_) + 1);
    if (packing_) place_web_tile(info_);
  }

  /// A row of samples, decoded now or among those that are kept.
  const std::byte* samples_of(std::int64_t row) {
    const std::size_t row_bytes = header_.width * sample_bytes_;
    if (kept_.empty()) kept_.resize(static_cast<std::size_t>(kept_rows_) * row_bytes);
    const auto kept = [&](std::int64_t at) {
      return kept_.data() + static_cast<std::size_t>(at % kept_rows_) * row_bytes;
    };
    if (header_.interlaced) {
      pick(rows_.row(row), kept(row));
      return kept(row);
    }
    if (row < next_row_ - kept_rows_) next_row_ = 0;
    for (; next_row_ <= row; ++next_row_) pick(rows_.row(next_row_), kept(next_row_));
    return kept(row);
  }

  void pick(std::span<const std::byte> pixels, std::byte* out) const {
    if (packing_) return unpack_elevations(*packing_, channels_, pixels, {out, header_.width * sample_bytes_});
    if (channels_ == 1) {
      std::memcpy(out, pixels.data(), pixels.size());
    } else if (header_.bit_depth == 16) {
      has_mask_ ? pick_as<std::uint16_t, std::int32_t>(pixels, out)
                : pick_as<std::uint16_t, std::uint16_t>(pixels, out);
    } else {
      has_mask_ ? pick_as<std::uint8_t, std::int16_t>(pixels, out) : pick_as<std::uint8_t, std::uint8_t>(pixels, out);
    }
  }

  template <typename Stored, typename Sample>
  void pick_as(std::span<const std::byte> pixels, std::byte* out) const {
    std::array<Stored, 4> pixel{};
    const std::size_t pixel_bytes = channels_ * sizeof(Stored);
    for (; !pixels.empty(); pixels = pixels.subspan(pixel_bytes), out += sizeof(Sample)) {
      std::memcpy(pixel.data(), pixels.data(), pixel_bytes);
      const bool is_transparent = has_mask_ && pixel[channels_ - 1] == 0;
      if (is_grey_ && !is_transparent && (pixel[0] != pixel[1] || pixel[0] != pixel[2])) refuse_colours();
      const auto sample = static_cast<Sample>(is_transparent ? kTransparent : pixel[channel_]);
      std::memcpy(out, &sample, sizeof(Sample));
    }
  }

  [[noreturn]] void refuse_colours() const {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("is a colour picture with channels {0}; `channel` {1} reads one of them, `encoding` {2} "
                            "unpacks elevations from all",
                            fmt::join(header_.channels, ", "), header_.channels.front(), kEncodings));
  }

  std::optional<Packing> packing_;  ///< all channels are one elevation
  PictureRows rows_;
  PngHeader header_;
  SourceInfo info_;
  std::size_t channels_;
  std::size_t channel_ = 0;
  std::size_t sample_bytes_ = 0;
  bool is_grey_ = false;        ///< several channels of colour are read as one, and must be alike
  bool has_mask_ = false;       ///< the last channel tells what is transparent
  std::int64_t next_row_ = 0;   ///< the row that is decoded next
  std::int64_t kept_rows_ = 0;  ///< rows next_row_ - kept_rows_ ... next_row_ - 1 are in kept_, at row % kept_rows_
  std::vector<std::byte> kept_;
};

std::unique_ptr<HeightSource> open_picture(const std::string& path, const char* format,
                                           std::unique_ptr<PictureDecoder> decoder, const OpenOptions& options) try {
  return std::make_unique<PngSource>(path, format, std::move(decoder), options);
} catch (const Error& error) {
  throw naming(path, error);
}

bool looks_like_png(std::span<const std::byte> head) {
  return head.size() >= kMagic.size() && std::memcmp(head.data(), kMagic.data(), kMagic.size()) == 0;
}

std::unique_ptr<HeightSource> open_png(const std::string& path, const OpenOptions& options) {
  return open_picture(path, "PNG", std::make_unique<PngDecoder>(), options);
}

std::unique_ptr<HeightSource> open_webp(const std::string& path, const OpenOptions& options) {
  return open_picture(path, "WebP", std::make_unique<WebpDecoder>(), options);
}

}  // namespace

const Format kPngFormat = {.name = "PNG",
                           .extensions = {".png"},
                           .library = png_library,
                           .note = "takes `channel` and `encoding`",
                           .open = open_png,
                           .recognises = looks_like_png,
                           .takes_encoding = true};

const Format kWebpFormat = {.name = "WebP",
                            .extensions = {".webp"},
                            .library = webp_library,
                            .note = "takes `channel` and `encoding`",
                            .open = open_webp,
                            .recognises = looks_like_webp,
                            .takes_encoding = true};

}  // namespace isohf
