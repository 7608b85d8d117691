#include "formats/readers.h"

#include <fmt/core.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "formats/adapters/masked_source.h"
#include "formats/georeference/files_beside.h"
#include "formats/geotiff/gdal_tags.h"
#include "formats/geotiff/geotiff_keys.h"
#include "formats/geotiff/tiff_blocks.h"
#include "formats/geotiff/tiff_file.h"
#include "formats/grids/plain_samples.h"
#include "formats/io/bands.h"
#include "formats/io/raw_file.h"
#include "formats/io/text.h"
#include "formats/open_options.h"
#include "isohf/base/assert.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

/// Rows of samples that fill no bytes are rows of bytes: blocks begin at whole ones.
TiffLayout layout_of_bytes(TiffLayout layout) {
  if (layout.bits_per_sample != 8) {
    layout.width = (layout.width * layout.bits_per_sample + 7) / 8;
    layout.block_width = (layout.block_width * layout.bits_per_sample + 7) / 8;
    layout.bits_per_sample = 8;
  }
  return layout;
}

class TiffMask final : public HeightSource {
 public:
  TiffMask(const std::string& path, std::uint32_t directory, bool rows_from_south)
      : file_(path), rows_from_south_(rows_from_south) {
    TiffMainImage image = open_image(file_, directory);
    const TiffLayout layout = image.handle->read_layout();
    const bool is_read = layout.samples_per_pixel == 1 && (layout.bits_per_sample == 1 || layout.bits_per_sample == 8);
    if (!is_read) {
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
    has_bits_ = layout.bits_per_sample == 1;
    blocks_.emplace(file_, layout_of_bytes(layout), std::move(image), 0);
    info_.block_width = layout.block_width;
    info_.block_height = blocks_->unit_rows();
  }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    const Window stored = rows_from_south_ ? turned(window, info_.height) : window;
    if (has_bits_) {
      read_bits(stored, samples);
    } else {
      blocks_->read(stored, samples);
    }
    if (rows_from_south_) turn_rows(samples, static_cast<std::size_t>(window.columns));
  }

  void limit_buffers(std::uint64_t bytes) override {
    if (!rows_from_south_) blocks_->limit_cache(bytes);
  }
  [[nodiscard]] std::uint64_t buffer_bytes(std::uint64_t limit) const override {
    return blocks_->cache_bytes(rows_from_south_ ? UINT64_MAX : limit);
  }

 private:
  void read_bits(const Window& window, std::span<std::byte> samples) {
    const std::int64_t first = window.column / 8;
    const std::int64_t bytes = (window.column + window.columns + 7) / 8 - first;
    bits_.resize(static_cast<std::size_t>(bytes * window.rows));
    blocks_->read({first, window.row, bytes, window.rows}, bits_);
    std::byte* out = samples.data();
    for (std::int64_t row = 0; row < window.rows; ++row) {
      const std::byte* const in = bits_.data() + row * bytes;
      for (std::int64_t i = window.column - 8 * first; i < window.column - 8 * first + window.columns; ++i) {
        *out++ = in[i / 8] >> (7 - i % 8) & std::byte{1};
      }
    }
  }

  RawFile file_;
  SourceInfo info_;
  bool rows_from_south_;
  bool has_bits_ = false;
  std::optional<TiffBlocks> blocks_;
  std::vector<std::byte> bits_;
};

/// The transparency mask that is directory `directory` of a TIFF file: samples of one byte, 0 where the image is
/// transparent. Masks of 1 and of 8 bits are read, in strips or tiles of any compression.
/// rows_from_south  delivered last row first, as the image is whose mask it is
/// Throws Error: kIo; kCorrupt; kUnsupported (other bits).
std::unique_ptr<HeightSource> open_tiff_mask(const std::string& path, std::uint32_t directory, bool rows_from_south) {
  return std::make_unique<TiffMask>(path, directory, rows_from_south);
}

// TIFF 6.0 and its supplements: PhotometricInterpretation, SampleFormat, Orientation.
constexpr int kMinIsWhite = 0;
constexpr int kMinIsBlack = 1;
constexpr int kRgb = 2;
constexpr int kYCbCr = 6;
constexpr int kJpeg = 7;
constexpr int kUnsigned = 1;
constexpr int kSigned = 2;
constexpr int kFloating = 3;
constexpr int kUndefined = 4;
constexpr int kComplexFloating = 6;
constexpr int kTopLeft = 1;
constexpr int kBottomLeft = 4;

SampleType sample_type_of(const TiffLayout& layout) {
  struct Row {
    int format;
    int bits;
    SampleType type;
  };
  constexpr std::array<Row, 11> kTypes = {{{kUnsigned, 8, SampleType::kUint8},
                                           {kUnsigned, 64, SampleType::kFloat64},
                                           {kSigned, 64, SampleType::kFloat64},
                                           {kUnsigned, 16, SampleType::kUint16},
                                           {kUnsigned, 32, SampleType::kUint32},
                                           {kSigned, 8, SampleType::kInt8},
                                           {kSigned, 16, SampleType::kInt16},
                                           {kSigned, 32, SampleType::kInt32},
                                           {kFloating, 16, SampleType::kFloat16},
                                           {kFloating, 32, SampleType::kFloat32},
                                           {kFloating, 64, SampleType::kFloat64}}};
  // Any other number means what no number does.
  const bool is_known = layout.sample_format >= kUnsigned && layout.sample_format <= kComplexFloating;
  const int stored_as = is_known && layout.sample_format != kUndefined ? layout.sample_format : kUnsigned;
  for (const Row& row : kTypes) {
    if (row.format == stored_as && row.bits == layout.bits_per_sample) return row.type;
  }
  constexpr std::array<const char*, 7> kFormats = {
      "undefined", "unsigned integer", "signed integer",        "floating-point",
      "undefined", "complex integer",  "complex floating-point"};
  const char* format = layout.sample_format < kFormats.size() ? kFormats[layout.sample_format] : "undefined";
  std::string text = fmt::format(
      "the samples are {} bit {}; isohf reads integers of 8, 16, 32 and 64 bits and floats of 16, 32 and 64",
      layout.bits_per_sample, format);
  if (stored_as == kUnsigned && layout.bits_per_sample < 32) {
    text += fmt::format(" (gdal_translate -co NBITS={} makes them so)",
                        std::bit_ceil(std::max(8U, unsigned{layout.bits_per_sample})));
  }
  throw Error(ErrorCode::kUnsupported, text);
}

void require_heights(const TiffLayout& layout) {
  const int photometric = layout.photometric;
  const bool picture = photometric == kRgb || (photometric == kYCbCr && layout.compression == kJpeg);
  if (photometric == kMinIsWhite || photometric == kMinIsBlack || picture) return;
  constexpr std::array<const char*, 11> kNames = {"",
                                                  "",
                                                  "",
                                                  "a colour palette",
                                                  "a transparency mask",
                                                  "CMYK colour",
                                                  "YCbCr colour",
                                                  "",
                                                  "CIE L*a*b* colour",
                                                  "ICC L*a*b* colour",
                                                  "ITU L*a*b* colour"};
  const auto index = static_cast<std::size_t>(photometric);
  const std::string what = index < kNames.size() && kNames[index][0] != '\0'
                               ? std::string(kNames[index])
                               : fmt::format("photometric interpretation {}", photometric);
  throw Error(ErrorCode::kUnsupported, fmt::format("the image has {}; isohf reads grey and RGB images", what));
}

/// Whether a pixel has two samples, an elevation and its opacity.
bool has_grey_and_opacity(const TiffLayout& layout) {
  const bool is_grey = layout.photometric == kMinIsWhite || layout.photometric == kMinIsBlack;
  return is_grey && layout.samples_per_pixel == 2 && layout.alpha_sample == 1;
}

/// "R", "G", "B" or "Y" and "A"; empty where a sample has no name.
std::vector<std::string> channel_names(const TiffLayout& layout) {
  std::vector<std::string> names(layout.samples_per_pixel);
  if (layout.photometric == kMinIsWhite || layout.photometric == kMinIsBlack) {
    names[0] = std::string(1, 'Y');
  } else {
    for (std::size_t i = 0; i < std::min<std::size_t>(names.size(), 3); ++i) names[i] = std::string(1, "RGB"[i]);
  }
  if (layout.alpha_sample > 0 && static_cast<std::size_t>(layout.alpha_sample) < names.size()) {
    names[static_cast<std::size_t>(layout.alpha_sample)] = std::string(1, 'A');
  }
  return names;
}

int choose_channel(const TiffLayout& layout, const std::vector<std::string>& described, const std::string& wanted,
                   SourceInfo& info) {
  std::vector<std::string> names = channel_names(layout);
  const auto by_description = std::ranges::find(described, wanted);
  if (!wanted.empty() && by_description != described.end()) {
    if (names.size() > 1) info.channel = printable(wanted);
    return static_cast<int>(by_description - described.begin());
  }
  for (std::size_t i = 0; i < std::min(names.size(), described.size()); ++i) {
    if (!described[i].empty()) names[i] = printable(described[i]);
  }
  const auto label = [&](std::size_t i) { return names[i].empty() ? std::to_string(i) : names[i]; };
  std::size_t chosen = described.empty() ? 0 : band_of_heights(described);
  if (!wanted.empty()) {
    chosen = static_cast<std::size_t>(std::find(names.begin(), names.end(), upper_case(wanted)) - names.begin());
    if (chosen == names.size()) {
      const auto [end, failure] = std::from_chars(wanted.data(), wanted.data() + wanted.size(), chosen);
      if (failure != std::errc() || end != wanted.data() + wanted.size()) chosen = names.size();
    }
    if (chosen >= names.size()) {
      std::vector<std::string> there;
      for (std::size_t i = 0; i < names.size(); ++i) {
        there.push_back(names[i].empty() ? std::to_string(i) : fmt::format("{} ({})", i, names[i]));
      }
      throw Error(ErrorCode::kInvalidArgument,
                  fmt::format("there is no channel \"{}\"; there are {}", wanted, fmt::join(there, ", ")));
    }
  }
  const bool colour = layout.photometric == kRgb || layout.photometric == kYCbCr;
  if (names.size() > 1) info.channel = label(chosen);
  if (wanted.empty() && colour && layout.bits_per_sample == 8) {
    throw Error(ErrorCode::kUnsupported,
                "is a colour picture of 8 bits; say which channel holds elevations (`channel` R)");
  }
  if (wanted.empty() && names.size() > 1 && !has_grey_and_opacity(layout)) {
    info.warnings.push_back(fmt::format("there are {} channels; channel {} is read", names.size(), label(chosen)));
  }
  return static_cast<int>(chosen);
}

class TiffSource final : public HeightSource {
 public:
  TiffSource(const std::string& path, const OpenOptions& options) : file_(path) {
    info_.path = path;
    page_ = page_of(options.part);
    TiffMainImage image = open_main_image(file_, page_);
    const TiffTags tags = image.handle->read_tags();
    layout_ = image.handle->read_layout();
    try {
      describe(image.directories, tags, options);
    } catch (const Error& error) {
      throw error.within(path);
    }
    apply_open_options(info_, options);
    blocks_.emplace(file_, layout_, std::move(image), channel_);
    describe_missing_blocks();
  }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  /// What tells which samples are transparent; null where nothing does.
  [[nodiscard]] std::unique_ptr<HeightSource> open_opacity() const {
    if (mask_) return open_tiff_mask(info_.path, *mask_, turned_);
    const std::string beside = info_.path + ".msk";  // as GDAL writes them, of the first image
    if (page_ == 0 && is_file(beside)) return open_tiff_mask(beside, 0, turned_);
    if (!has_grey_and_opacity(layout_) || channel_ != 0) return nullptr;
    OpenOptions options;
    options.channel = "A";
    options.part = std::to_string(page_);
    return std::make_unique<TiffSource>(info_.path, options);
  }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    const Window stored = turned_ ? turned(window, info_.height) : window;
    blocks_->read(stored, samples);
    if (turned_) turn_rows(samples, static_cast<std::size_t>(window.columns) * size_bytes(info_.sample_type));
    if (layout_.bits_per_sample == 64 && layout_.sample_format != kFloating) {
      widen_whole_numbers(info_.path, layout_.sample_format == kSigned, window, samples);
    }
  }

  // From the South the windows of a caller do not begin where blocks do.
  void limit_buffers(std::uint64_t bytes) override {
    if (!turned_) blocks_->limit_cache(bytes);
  }
  [[nodiscard]] std::uint64_t buffer_bytes(std::uint64_t limit) const override {
    return blocks_->cache_bytes(turned_ ? UINT64_MAX : limit);
  }

 private:
  void describe(const TiffDirectories& directories, const TiffTags& tags, const OpenOptions& options) {
    require_heights(layout_);
    info_.format = std::string(tags.geo.empty() ? "TIFF" : "GeoTIFF");
    info_.width = layout_.width;
    info_.height = layout_.height;
    info_.sample_type = sample_type_of(layout_);
    for (const std::string& warning : tags.warnings) info_.warnings.push_back("libtiff: " + warning);
    std::vector<std::string> names = gdal_band_names(tags.gdal_metadata, layout_.samples_per_pixel);
    if (page_ == 0 && names.size() > 1) name_bands_beside(info_.path, names.size(), names);
    channel_ = choose_channel(layout_, names, options.channel, info_);
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
    read_gdal_metadata(tags.gdal_metadata, channel_, info_);
    read_files_beside();
    if (info_.void_values.empty()) read_gdal_nodata(tags.gdal_nodata, info_);  // as for GDAL
    check_orientation();
    bound_undeclared_voids(info_);
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
    info_.warnings.insert(info_.warnings.end(), place.warnings.begin(), place.warnings.end());
    turned_ = place.rows_from_south;
    is_placed_ = place.placed;
  }

  /// What the tags leave open may stand in other files.
  void read_files_beside() {
    if (page_ == 0) read_auxiliary_metadata(info_, channel_ + 1);  // which GDAL keeps apart of others
    if (!is_placed_ && !info_.georeference.has_origin) place_by_world_file();
    if (!has_reference_system(info_.georeference)) read_prj_beside(info_);
  }

  void check_orientation() {
    if (layout_.orientation == kTopLeft) return;
    if (info_.georeference.has_origin) {
      info_.warnings.push_back(fmt::format(
          "the orientation tag ({}) is ignored: the georeference says which way the rows run", layout_.orientation));
    } else if (layout_.orientation == kBottomLeft) {
      turned_ = !turned_;
    } else {
      throw Error(
          ErrorCode::kUnsupported,
          fmt::format("the orientation is {}; isohf reads 1 (top-left) and 4 (bottom-left)", layout_.orientation));
    }
  }

  void place_by_world_file() {
    const std::optional<WorldFile> world = world_file_beside(info_.path);
    if (!world) return;
    turned_ = world->rows_from_south();
    place_by(*world, layout_.height, info_.georeference);
  }

  void describe_missing_blocks() {
    info_.block_width = layout_.block_width;
    info_.block_height = blocks_->unit_rows();
    if (blocks_->missing_blocks() == 0) return;
    const char* reads_as = "0";
    if (!info_.void_values.empty()) {
      blocks_->set_fill(stored_sample(info_.sample_type, info_.void_values.front()));
      reads_as = "void";
    }
    info_.warnings.push_back(
        loss(fmt::format("{} of {} {} are not stored in the file; they read as {}", blocks_->missing_blocks(),
                         blocks_->block_count(), layout_.tiled ? "tiles" : "strips", reads_as)));
  }

  RawFile file_;
  TiffLayout layout_;
  SourceInfo info_;
  std::uint32_t page_ = 0;  // of several images
  int channel_ = 0;
  std::optional<std::uint32_t> mask_;
  bool is_placed_ = false;  // by its tags, if without an origin
  bool turned_ = false;     // the stored rows run from South to North
  std::optional<TiffBlocks> blocks_;
};

}  // namespace

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
  std::unique_ptr<HeightSource> opacity = options.channel.empty() ? source->open_opacity() : nullptr;
  if (!opacity) return source;
  return mask_transparent(std::move(source), std::move(opacity));
}

}  // namespace isohf
