#include "formats/geotiff/tiff_file.h"

#include <fmt/core.h>
#include <tiffio.h>
#include <xtiffio.h>

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <string_view>
#include <utility>

#include "formats/geotiff/gdal_tags.h"
#include "formats/io/file_stamp.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// No buffer of libtiff is larger; blocks are checked against smaller bounds before.
constexpr tmsize_t kLargestAllocation = tmsize_t{1} << 30;
constexpr std::uint32_t kMostDirectories = 1024;
constexpr std::size_t kMostWarnings = 8;

std::string formatted(const char* format, std::va_list arguments) {
  std::array<char, 512> buffer = {};
  std::vsnprintf(buffer.data(), buffer.size(), format, arguments);
  return one_line(buffer.data());  // some have several
}

/// Handlers return 1: nothing goes to the handlers of the process, which print.
int keep_error(TIFF* /*tiff*/, void* error, const char* /*module*/, const char* format, std::va_list arguments) {
  auto& first = *static_cast<std::string*>(error);
  if (first.empty()) first = formatted(format, arguments);
  return 1;
}

int keep_warning(TIFF* /*tiff*/, void* warnings, const char* /*module*/, const char* format, std::va_list arguments) {
  auto& kept = *static_cast<std::vector<std::string>*>(warnings);
  std::string message = formatted(format, arguments);
  // Private tags of other programs.
  if (!message.starts_with("Unknown field with tag") && kept.size() < kMostWarnings) kept.push_back(std::move(message));
  return 1;
}

TIFFExtendProc next_extender = nullptr;

void extend_tags(TIFF* tiff) {
  const auto numbers = [](std::uint32_t tag, TIFFDataType type, const char* name) {
    return TIFFFieldInfo{tag, TIFF_VARIABLE, TIFF_VARIABLE, type, FIELD_CUSTOM, 1, 1, const_cast<char*>(name)};
  };
  const auto text = [](std::uint32_t tag, const char* name) {
    return TIFFFieldInfo{tag, TIFF_VARIABLE, TIFF_VARIABLE, TIFF_ASCII, FIELD_CUSTOM, 1, 0, const_cast<char*>(name)};
  };
  // libtiff keeps pointers to the definitions.
  static const std::array<TIFFFieldInfo, 8> kFields = {
      numbers(TIFFTAG_GEOPIXELSCALE, TIFF_DOUBLE, "ModelPixelScale"),
      numbers(TIFFTAG_GEOTIEPOINTS, TIFF_DOUBLE, "ModelTiepoint"),
      numbers(TIFFTAG_GEOTRANSMATRIX, TIFF_DOUBLE, "ModelTransformation"),
      numbers(TIFFTAG_GEOKEYDIRECTORY, TIFF_SHORT, "GeoKeyDirectory"),
      numbers(TIFFTAG_GEODOUBLEPARAMS, TIFF_DOUBLE, "GeoDoubleParams"),
      text(TIFFTAG_GEOASCIIPARAMS, "GeoAsciiParams"),
      text(kGdalMetadataTag, "GDALMetadata"),
      text(kGdalNodataTag, "GDALNoDataValue")};
  TIFFMergeFieldInfo(tiff, kFields.data(), static_cast<std::uint32_t>(kFields.size()));
  if (next_extender != nullptr) next_extender(tiff);
}

bool is_kept(const std::vector<std::string>& warnings, std::string_view begin) {
  return std::ranges::any_of(warnings, [&](const std::string& warning) { return warning.starts_with(begin); });
}

}  // namespace

void define_geotiff_tags() {
  [[maybe_unused]] static const bool is_done = [] {
    next_extender = TIFFSetTagExtender(extend_tags);
    return true;
  }();
}

bool TiffLayout::is_grey() const {
  return photometric == PHOTOMETRIC_MINISWHITE || photometric == PHOTOMETRIC_MINISBLACK;
}

bool TiffLayout::is_colour() const {
  return photometric == PHOTOMETRIC_RGB || (photometric == PHOTOMETRIC_YCBCR && compression == COMPRESSION_JPEG);
}

double TiffLayout::block_row_bytes() const {
  return std::ceil(static_cast<double>(block_width) * static_cast<double>(interleaved()) * bits_per_sample / 8.0);
}

TiffHandle::TiffHandle(const std::string& path, std::uint32_t directory, PlainStrips plain)
    : path_(path), io_(path, File::Mode::kRead) {
  define_geotiff_tags();
  TIFFOpenOptions* options = TIFFOpenOptionsAlloc();
  if (options == nullptr) throw Error(ErrorCode::kOutOfMemory, path + ": no memory for a TIFF handle");
  TIFFOpenOptionsSetMaxSingleMemAlloc(options, kLargestAllocation);
  TIFFOpenOptionsSetErrorHandlerExtR(options, keep_error, &messages_.error);
  TIFFOpenOptionsSetWarningHandlerExtR(options, keep_warning, &messages_.warnings);
  // r: read; O: load entries of the block table when needed; m: no mapping, which a file that is cut turns into a
  // signal; c: do not chop.
  tiff_ = io_.open(plain == PlainStrips::kChopped ? "rOm" : "rOmc", options);
  TIFFOpenOptionsFree(options);
  if (tiff_ == nullptr) fail("is not a readable TIFF file");
  if (directory != 0 && TIFFSetDirectory(tiff_, directory) != 1) {
    TIFFClose(tiff_);
    fail(fmt::format("directory {} cannot be read", directory));
  }
  // Sub-sampled colour comes out as one value per sample.
  if (field<std::uint16_t>(TIFFTAG_COMPRESSION, COMPRESSION_NONE) == COMPRESSION_JPEG &&
      field<std::uint16_t>(TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK) == PHOTOMETRIC_YCBCR) {
    TIFFSetField(tiff_, TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB);
  }
}

TiffHandle::~TiffHandle() {
  TIFFClose(tiff_);
}

void TiffHandle::fail(const std::string& problem) const {
  if (io_.failure()) throw *io_.failure();
  const std::string& why = messages_.error;
  throw Error(ErrorCode::kCorrupt, fmt::format("{}: {}{}{}", path_, problem, why.empty() ? "" : ": ", why));
}

template <typename T>
T TiffHandle::field(std::uint32_t tag, T otherwise) const {
  T value = otherwise;
  return TIFFGetFieldDefaulted(tiff_, tag, &value) == 1 ? value : otherwise;
}

template <typename T>
std::vector<T> TiffHandle::array(std::uint32_t tag) const {
  std::uint16_t count = 0;
  const T* values = nullptr;
  if (TIFFGetField(tiff_, tag, &count, &values) != 1 || values == nullptr) return {};
  return {values, values + count};
}

std::string TiffHandle::text(std::uint32_t tag) const {
  const char* characters = nullptr;
  return TIFFGetField(tiff_, tag, &characters) == 1 && characters != nullptr ? characters : "";
}

void TiffHandle::decode_block(std::uint64_t index, std::span<std::byte> bytes) {
  messages_ = {};
  const bool tiled = TIFFIsTiled(tiff_) != 0;
  const auto block = static_cast<std::uint32_t>(index);
  const auto size = static_cast<tmsize_t>(bytes.size());
  const tmsize_t got = tiled ? TIFFReadEncodedTile(tiff_, block, bytes.data(), size)
                             : TIFFReadEncodedStrip(tiff_, block, bytes.data(), size);
  // A JPEG that ends early is a mere warning to libjpeg, which then makes the rest up.
  const bool is_jpeg = field<std::uint16_t>(TIFFTAG_COMPRESSION, COMPRESSION_NONE) == COMPRESSION_JPEG;
  if (is_jpeg && !messages_.warnings.empty() && messages_.error.empty()) messages_.error = messages_.warnings.front();
  if (got != size || (is_jpeg && !messages_.error.empty())) {
    fail(fmt::format("{} {} cannot be decoded", tiled ? "tile" : "strip", index));
  }
}

TiffBlockSpan TiffHandle::block_span(std::uint64_t index) {
  messages_ = {};
  int bad_offset = 0;
  int bad_size = 0;
  const auto block = static_cast<std::uint32_t>(index);
  const TiffBlockSpan span = {TIFFGetStrileOffsetWithErr(tiff_, block, &bad_offset),
                              TIFFGetStrileByteCountWithErr(tiff_, block, &bad_size)};
  // libtiff pads short tables with zeros, which would pass for blocks that a sparse file leaves out.
  if (bad_offset != 0 || bad_size != 0 || is_kept(messages_.warnings, "Incorrect count for")) {
    fail(fmt::format("the table of {} has no entry {}", TIFFIsTiled(tiff_) != 0 ? "tiles" : "strips", index));
  }
  return span;
}

TiffLayout TiffHandle::read_layout() {
  TiffLayout layout;
  const auto number = [&](std::uint32_t tag, std::uint16_t otherwise) { return field<std::uint16_t>(tag, otherwise); };
  layout.width = field<std::uint32_t>(TIFFTAG_IMAGEWIDTH, 0);
  layout.height = field<std::uint32_t>(TIFFTAG_IMAGELENGTH, 0);
  layout.bits_per_sample = number(TIFFTAG_BITSPERSAMPLE, 1);
  layout.samples_per_pixel = number(TIFFTAG_SAMPLESPERPIXEL, 1);
  layout.sample_format = number(TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT);
  layout.compression = number(TIFFTAG_COMPRESSION, COMPRESSION_NONE);
  layout.photometric = number(TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  layout.orientation = number(TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT);
  layout.separate =
      layout.samples_per_pixel > 1 && number(TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) == PLANARCONFIG_SEPARATE;
  std::uint16_t extra_count = 0;
  const std::uint16_t* extra = nullptr;
  if (TIFFGetFieldDefaulted(tiff_, TIFFTAG_EXTRASAMPLES, &extra_count, &extra) == 1 && extra != nullptr) {
    for (int i = 0; i < extra_count; ++i) {
      if (extra[i] == EXTRASAMPLE_UNSPECIFIED || layout.alpha_sample >= 0) continue;
      layout.alpha_sample = layout.samples_per_pixel - extra_count + i;
    }
  }
  layout.tiled = TIFFIsTiled(tiff_) != 0;
  layout.block_width = layout.tiled ? field<std::uint32_t>(TIFFTAG_TILEWIDTH, 0) : layout.width;
  layout.block_height =
      layout.tiled ? field<std::uint32_t>(TIFFTAG_TILELENGTH, 0)
                   : std::min<std::int64_t>(field<std::uint32_t>(TIFFTAG_ROWSPERSTRIP, UINT32_MAX), layout.height);
  if (std::min({layout.width, layout.height, layout.block_width, layout.block_height}) < 1) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("{}: the size is {} x {} in {} of {} x {}, must be positive", path_, layout.width,
                            layout.height, layout.tiled ? "tiles" : "strips", layout.block_width, layout.block_height));
  }
  layout.blocks_across = (layout.width + layout.block_width - 1) / layout.block_width;
  layout.blocks_down = (layout.height + layout.block_height - 1) / layout.block_height;
  if (TIFFIsCODECConfigured(layout.compression) == 0) {
    const TIFFCodec* codec = TIFFFindCODEC(layout.compression);
    throw Error(ErrorCode::kUnsupported,
                fmt::format("{}: the compression is {}, which this build of libtiff cannot read; gdal_translate makes "
                            "a file of another",
                            path_, codec != nullptr ? codec->name : std::to_string(layout.compression)));
  }
  return layout;
}

TiffTags TiffHandle::read_tags() {
  // libtiff goes on without a tag that it cannot read, be it nodata or georeference, and calls that a warning.
  if (messages_.error.empty() && is_kept(messages_.warnings, "IO error during reading")) {
    messages_.error = messages_.warnings.back();
  }
  if (!messages_.error.empty()) fail("a tag cannot be read, the file is damaged or cut off");
  TiffTags tags;
  tags.geo.pixel_scale = array<double>(TIFFTAG_GEOPIXELSCALE);
  tags.geo.tiepoints = array<double>(TIFFTAG_GEOTIEPOINTS);
  tags.geo.transformation = array<double>(TIFFTAG_GEOTRANSMATRIX);
  tags.geo.directory = array<std::uint16_t>(TIFFTAG_GEOKEYDIRECTORY);
  tags.geo.doubles = array<double>(TIFFTAG_GEODOUBLEPARAMS);
  tags.geo.ascii = text(TIFFTAG_GEOASCIIPARAMS);
  tags.gdal_metadata = text(kGdalMetadataTag);
  tags.gdal_nodata = text(kGdalNodataTag);
  tags.warnings = messages_.warnings;
  return tags;
}

std::vector<std::array<std::uint8_t, 3>> TiffHandle::read_palette() {
  std::array<const std::uint16_t*, 3> channels = {};
  if (TIFFGetField(tiff_, TIFFTAG_COLORMAP, &channels[0], &channels[1], &channels[2]) != 1) {
    fail("the palette is missing");
  }
  std::vector<std::array<std::uint8_t, 3>> colours(std::size_t{1} << field<std::uint16_t>(TIFFTAG_BITSPERSAMPLE, 1));
  for (std::size_t i = 0; i < colours.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) colours[i][c] = static_cast<std::uint8_t>(channels[c][i] / 257);
  }
  return colours;
}

TiffDirectories TiffHandle::walk(std::uint32_t wanted) {
  TiffDirectories found;
  for (std::uint32_t i = 0; i < kMostDirectories && !found.has_broken; ++i) {
    ++found.count;
    const auto kind = field<std::uint32_t>(TIFFTAG_SUBFILETYPE, 0);
    const bool is_mask = (kind & FILETYPE_MASK) != 0;
    const bool is_reduced = (kind & FILETYPE_REDUCEDIMAGE) != 0;
    if (is_mask && !is_reduced && found.images == wanted + 1 && !found.mask) found.mask = i;
    if (!is_mask && !is_reduced && found.images++ == wanted) found.main = i;
    if (TIFFLastDirectory(tiff_) != 0) break;
    found.has_broken = TIFFReadDirectory(tiff_) != 1;
  }
  return found;
}

TiffMainImage open_image(const std::string& path, std::uint32_t directory) {
  static_cast<void>(FileStamp::of(path));  // says why a file cannot be opened
  TiffMainImage image;
  image.directories.main = directory;
  image.handle = std::make_unique<TiffHandle>(path, directory);
  return image;
}

TiffMainImage open_main_image(const std::string& path, std::uint32_t wanted) {
  TiffMainImage image = open_image(path, 0);
  image.directories = image.handle->walk(wanted);
  const TiffDirectories& found = image.directories;
  if (wanted > 0 && wanted >= found.images) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("{}: there is no image {}; there are 0 to {}", path, wanted,
                                                         std::max(found.images, 1U) - 1));
  }
  // A walk leaves the handle elsewhere, with libtiff's messages about other images.
  if (found.count > 1 || found.has_broken) image.handle = std::make_unique<TiffHandle>(path, found.main);
  return image;
}

std::string tiff_library() {
  // "LIBTIFF, Version 4.5.0" and lines of copyright.
  const std::string text = TIFFGetVersion();
  const std::size_t number = std::min(text.find_first_of("0123456789"), text.size());
  return "libtiff " + text.substr(number, text.find('\n') - number);
}

}  // namespace isohf
