#include <fmt/core.h>
#include <tiff.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "formats/adapters/masked_source.h"
#include "formats/georeference/sidecars.h"
#include "formats/geotiff/gdal_tags.h"
#include "formats/geotiff/geotiff_keys.h"
#include "formats/geotiff/tiff_blocks.h"
#include "formats/geotiff/tiff_file.h"
#include "formats/grids/plain_samples.h"
#include "formats/io/bands.h"
#include "formats/io/raw_file.h"
#include "formats/open_options.h"
#include "formats/png/packed_elevations.h"
#include "formats/readers.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

/// The transparency mask in a directory of a TIFF file: samples of one byte, 0 if the image is transparent there.
class TiffMask final : public HeightSource {
 public:
  /// Delivers the last row first if the image is stored so. Throws Error: kIo, kCorrupt, kUnsupported (other bits).
  TiffMask(const std::string& path, std::uint32_t directory, bool rows_from_south) : rows_from_south_(rows_from_south) {
    TiffMainImage image = open_image(path, directory);
    const TiffLayout layout = image.handle->read_layout();
    if (layout.samples_per_pixel != 1 || (layout.bits_per_sample != 1 && layout.bits_per_sample != 8)) {
      throw Error(
          ErrorCode::kUnsupported,
          fmt::format(
              "{}: the transparency mask has {} samples of {} bits a pixel, must have one of 1 or 8; `channel` 0 "
              "reads the image without it",
              path, layout.samples_per_pixel, layout.bits_per_sample));
    }
    info_.path = path;
    info_.format = "TIFF transparency mask";
    info_.width = layout.width;
    info_.height = layout.height;
    info_.sample_type = SampleType::kUint8;
    info_.block_width = layout.block_width;
    info_.block_height = layout.block_height;
    blocks_.emplace(path, layout, std::move(image), 0);
  }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }
  void read_window(const Window& window, std::span<std::byte> samples) override {
    blocks_->read(rows_from_south_ ? turned(window, info_.height) : window, samples);
    if (rows_from_south_) turn_rows(samples, static_cast<std::size_t>(window.columns));
  }
  [[nodiscard]] std::uint64_t buffer_bytes() const override { return blocks_->buffer_bytes(); }

 private:
  SourceInfo info_;
  bool rows_from_south_;
  std::optional<TiffBlocks> blocks_;
};

SampleType sample_type_of(const TiffLayout& layout) {
  struct Row {
    int format;
    int bits;
    SampleType type;
  };
  constexpr std::array<Row, 11> kTypes = {{{SAMPLEFORMAT_UINT, 8, SampleType::kUint8},
                                           {SAMPLEFORMAT_UINT, 16, SampleType::kUint16},
                                           {SAMPLEFORMAT_UINT, 32, SampleType::kUint32},
                                           {SAMPLEFORMAT_UINT, 64, SampleType::kFloat64},
                                           {SAMPLEFORMAT_INT, 8, SampleType::kInt8},
                                           {SAMPLEFORMAT_INT, 16, SampleType::kInt16},
                                           {SAMPLEFORMAT_INT, 32, SampleType::kInt32},
                                           {SAMPLEFORMAT_INT, 64, SampleType::kFloat64},
                                           {SAMPLEFORMAT_IEEEFP, 16, SampleType::kFloat16},
                                           {SAMPLEFORMAT_IEEEFP, 32, SampleType::kFloat32},
                                           {SAMPLEFORMAT_IEEEFP, 64, SampleType::kFloat64}}};
  constexpr std::array kFormats = {"undefined", "unsigned", "signed", "floating-point",
                                   "undefined", "complex",  "complex"};
  // Any other number is as good as none.
  const std::size_t format = layout.sample_format < kFormats.size() ? layout.sample_format : 0;
  const bool is_unsigned = format == 0 || format == SAMPLEFORMAT_UINT || format == SAMPLEFORMAT_VOID;
  for (const Row& row : kTypes) {
    const bool is_format = is_unsigned ? row.format == SAMPLEFORMAT_UINT : row.format == layout.sample_format;
    if (is_format && row.bits == layout.bits_per_sample) return row.type;
  }
  const bool can_widen = layout.bits_per_sample < 32 && (is_unsigned || format == SAMPLEFORMAT_IEEEFP);
  const unsigned bits = is_unsigned ? std::bit_ceil(std::max(8U, unsigned{layout.bits_per_sample})) : 32U;
  throw Error(ErrorCode::kUnsupported,
              fmt::format("the samples are {} bit {} numbers; isohf reads integers of 8, 16, 32 and 64 bits and floats "
                          "of 16, 32 and 64{}",
                          layout.bits_per_sample, kFormats[format],
                          can_widen ? fmt::format(" (gdal_translate -co NBITS={} makes them so)", bits) : ""));
}

void require_heights(const TiffLayout& layout, bool has_channel) {
  if (layout.is_grey() || layout.is_colour()) return;
  if (layout.photometric != PHOTOMETRIC_PALETTE) {
    throw Error(
        ErrorCode::kUnsupported,
        fmt::format("the image has {} (photometric interpretation {}); isohf reads grey and RGB images",
                    layout.photometric == PHOTOMETRIC_SEPARATED ? "CMYK colour" : "other colours", layout.photometric));
  }
  if (has_channel) return;
  throw Error(ErrorCode::kUnsupported,
              "the image has a colour palette: its samples may be places in it, or elevations that have colours for "
              "display; `channel` 0 reads them as elevations");
}

/// Whether red, green and blue are equal at the top, in the middle and at the bottom of a colour image.
bool has_equal_colours(const std::string& path, std::uint32_t directory, const TiffLayout& layout) {
  constexpr std::int64_t kRows = 16;
  constexpr std::size_t kMostChannels = 4;
  if (layout.samples_per_pixel < 3 || layout.samples_per_pixel > kMostChannels) return false;
  TiffBlocks blocks(path, layout, open_image(path, directory), TiffBlocks::kAllSamples);
  const std::int64_t rows = std::min(kRows, layout.height);
  const std::size_t sample_bytes = layout.bits_per_sample / 8U;
  const std::size_t pixel_bytes = sample_bytes * layout.samples_per_pixel;
  std::vector<std::byte> pixels(static_cast<std::size_t>(layout.width * rows) * pixel_bytes);
  for (const std::int64_t row : {std::int64_t{0}, (layout.height - rows) / 2, layout.height - rows}) {
    blocks.read({0, row, layout.width, rows}, pixels);
    for (std::size_t at = 0; at < pixels.size(); at += pixel_bytes) {
      // Equal neighbours: the first two channels are the second and third.
      if (std::memcmp(&pixels[at], &pixels[at + sample_bytes], 2 * sample_bytes) != 0) return false;
    }
  }
  return true;
}

class TiffSource final : public HeightSource {
 public:
  TiffSource(const std::string& path, const OpenOptions& options) {
    info_.path = path;
    page_ = page_of(options.part);
    TiffMainImage image = open_main_image(path, page_);
    directory_ = image.directories.main;
    const TiffTags tags = image.handle->read_tags();
    layout_ = image.handle->read_layout();
    try {
      describe(image.directories, tags, options);
    } catch (const Error& error) {
      if (std::string_view(error.what()).starts_with(path)) throw;
      throw error.within(path);
    }
    apply_open_options(info_, options);
    blocks_.emplace(path, layout_, std::move(image), packing_ ? TiffBlocks::kAllSamples : channel_,
                    options.buffer_bytes);
    describe_blocks();
  }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  /// Which samples are transparent; null if nothing says so.
  [[nodiscard]] std::unique_ptr<HeightSource> open_opacity() const {
    if (mask_) return std::make_unique<TiffMask>(info_.path, *mask_, turned_);
    const std::string beside = info_.path + ".msk";  // as GDAL writes them, for the first image
    if (page_ == 0 && is_file(beside)) return std::make_unique<TiffMask>(beside, 0, turned_);
    if (!has_opacity_channel_) return nullptr;
    OpenOptions options;
    options.channel = std::to_string(layout_.alpha_sample);
    options.part = std::to_string(page_);
    return std::make_unique<TiffSource>(info_.path, options);
  }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    const Window stored = turned_ ? turned(window, info_.height) : window;
    if (packing_) {
      pixels_.resize(static_cast<std::size_t>(window.columns * window.rows) * layout_.samples_per_pixel);
      blocks_->read(stored, pixels_);
      unpack_elevations(*packing_, layout_.samples_per_pixel, pixels_, samples);
    } else {
      blocks_->read(stored, samples);
    }
    if (turned_) turn_rows(samples, static_cast<std::size_t>(window.columns) * size_bytes(info_.sample_type));
    if (layout_.bits_per_sample == 64 && layout_.sample_format != SAMPLEFORMAT_IEEEFP) {
      widen_whole_numbers(info_.path, layout_.sample_format == SAMPLEFORMAT_INT, window, samples);
    }
  }
  [[nodiscard]] std::uint64_t buffer_bytes() const override { return blocks_->buffer_bytes() + pixels_.capacity(); }

 private:
  void describe(const TiffDirectories& directories, const TiffTags& tags, const OpenOptions& options) {
    packing_ = stated_packing(options);
    require_heights(layout_, !options.channel.empty());
    info_.format = std::string(tags.geo.empty() ? "TIFF" : "GeoTIFF");
    info_.width = layout_.width;
    info_.height = layout_.height;
    info_.sample_type = sample_type_of(layout_);
    for (const std::string& warning : tags.warnings) info_.warnings.push_back("libtiff: " + warning);
    if (!packing_) choose_channel(tags, options);
    if (directories.images > 1 && options.part.empty()) {
      info_.warnings.push_back(
          fmt::format("there are {} images in the file; the first is read, `part` 0 to {} names one",
                      directories.images, directories.images - 1));
    }
    if (directories.has_broken)
      info_.warnings.push_back(
          loss("a directory behind the image is damaged; a transparency mask there is not applied"));
    mask_ = directories.mask;
    place(tags);
    if (!packing_) read_gdal_metadata(tags.gdal_metadata, channel_, info_);
    // What the tags leave open may stand in other files, which are about the first image.
    if (page_ == 0 && read_sidecars(info_, packing_ ? 0 : channel_ + 1, true)) turned_ = true;
    if (packing_) {
      describe_packing(*packing_, layout_.samples_per_pixel, layout_.bits_per_sample, options, info_);
    } else if (info_.void_values.empty()) {
      read_gdal_nodata(tags.gdal_nodata, info_);  // after the file beside, as in GDAL
    }
    check_orientation();
    bound_undeclared_voids(info_);
  }

  /// By GDAL's descriptions, "R", "G", "B", "Y" and "A", or numbers.
  void choose_channel(const TiffTags& tags, const OpenOptions& options) {
    const std::size_t samples = layout_.samples_per_pixel;
    std::vector<std::string> names = gdal_band_names(tags.gdal_metadata, samples);
    if (page_ == 0 && samples > 1) name_bands_beside(info_.path, samples, names);
    const auto name = [&](std::size_t at, const char* letter) {
      if (at < samples && names[at].empty()) names[at] = letter;
    };
    if (layout_.is_grey()) name(0, "Y");
    for (std::size_t i = 0; i < 3 && layout_.is_colour(); ++i) name(i, std::array{"R", "G", "B"}[i]);
    if (layout_.alpha_sample > 0) name(static_cast<std::size_t>(layout_.alpha_sample), "A");
    OpenOptions chosen = options;
    if (options.channel.empty() && layout_.is_colour() && has_equal_colours(info_.path, directory_, layout_)) {
      info_.warnings.emplace_back("colour picture in greys: channel R is read");
      chosen.channel = "0";
      has_opacity_channel_ = layout_.alpha_sample == 3;
    } else if (options.channel.empty() && layout_.is_colour() && layout_.bits_per_sample == 8) {
      throw Error(
          ErrorCode::kUnsupported,
          fmt::format(
              "is a colour picture of 8 bits; say which channel holds elevations (`channel` R), or how they are "
              "packed into all (`encoding` {})",
              kEncodings));
    } else if (options.channel.empty() && layout_.is_grey() && samples == 2 && layout_.alpha_sample == 1) {
      chosen.channel = "0";
      has_opacity_channel_ = true;
    } else if (std::ranges::find(names, options.channel) == names.end()) {
      chosen.channel = upper_case(options.channel);
    }
    channel_ = static_cast<int>(choose_band(info_, chosen, static_cast<std::int64_t>(samples), names));
  }

  [[nodiscard]] std::uint32_t page_of(const std::string& part) const {
    std::uint32_t page = 0;
    const auto [end, failure] = std::from_chars(part.data(), part.data() + part.size(), page);
    if (part.empty() || (failure == std::errc() && end == part.data() + part.size())) return page;
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: its images have numbers, from 0; there is no \"{}\"", info_.path, printable(part)));
  }

  void place(const TiffTags& tags) {
    GeoTiffPlace place = place_from_geotiff(tags.geo, layout_.height);
    info_.georeference = place.georeference;
    info_.vertical_unit = place.vertical_unit;
    info_.metres_per_vertical_unit = place.metres_per_vertical_unit;
    info_.z_scale = place.z_scale;
    info_.z_offset = place.z_offset;
    info_.warnings.insert(info_.warnings.end(), place.warnings.begin(), place.warnings.end());
    turned_ = place.rows_from_south;
  }

  void check_orientation() {
    if (layout_.orientation == ORIENTATION_TOPLEFT) return;
    if (info_.georeference.has_origin) {
      info_.warnings.push_back(fmt::format(
          "the orientation tag ({}) is ignored: the georeference says which way the rows run", layout_.orientation));
    } else if (layout_.orientation == ORIENTATION_BOTLEFT) {
      turned_ = !turned_;
    } else {
      throw Error(
          ErrorCode::kUnsupported,
          fmt::format("the orientation is {}; isohf reads 1 (top-left) and 4 (bottom-left)", layout_.orientation));
    }
  }

  void describe_blocks() {
    info_.block_width = layout_.block_width;
    info_.block_height = layout_.block_height;
    if (blocks_->missing_blocks() == 0) return;
    const bool is_void = !packing_ && !info_.void_values.empty();
    if (is_void) blocks_->set_fill(stored_sample(info_.sample_type, info_.void_values.front()));
    info_.warnings.push_back(
        loss(fmt::format("{} of {} {} are not stored in the file; they read as {}", blocks_->missing_blocks(),
                         blocks_->block_count(), layout_.tiled ? "tiles" : "strips", is_void ? "void" : "0")));
  }

  TiffLayout layout_;
  SourceInfo info_;
  std::uint32_t page_ = 0;  // of several images
  std::uint32_t directory_ = 0;
  int channel_ = 0;
  std::optional<Packing> packing_;  // all channels are one elevation
  std::optional<std::uint32_t> mask_;
  bool has_opacity_channel_ = false;
  bool turned_ = false;  // the stored rows run from South to North
  std::optional<TiffBlocks> blocks_;
  std::vector<std::byte> pixels_;  // packed ones
};

bool looks_like_tiff(std::span<const std::byte> head) {
  if (head.size() < 4) return false;
  const auto is = [&](std::array<int, 4> magic) {
    return std::equal(magic.begin(), magic.end(), head.begin(),
                      [](int wanted, std::byte found) { return static_cast<std::byte>(wanted) == found; });
  };
  return is({'I', 'I', 42, 0}) || is({'M', 'M', 0, 42}) || is({'I', 'I', 43, 0}) || is({'M', 'M', 0, 43});
}

std::unique_ptr<HeightSource> open_tiff(const std::string& path, const OpenOptions& options) {
  auto source = std::make_unique<TiffSource>(path, options);
  std::unique_ptr<HeightSource> opacity =
      options.channel.empty() && options.encoding.empty() ? source->open_opacity() : nullptr;
  if (!opacity) return source;
  return mask_transparent(std::move(source), std::move(opacity));
}

}  // namespace

const Format kTiffFormat = {.name = "TIFF",
                            .extensions = {".tif", ".tiff"},
                            .library = tiff_library,
                            .note = "takes `channel` and `part`",
                            .open = open_tiff,
                            .recognises = looks_like_tiff,
                            .takes_part = true,
                            .takes_encoding = true};

}  // namespace isohf
