#include "formats/geotiff/tiff_file.h"

#include <fmt/core.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <tiff.h>
#include <tiffio.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <optional>
#include <span>
#include <utility>

#include "formats/geotiff/gdal_tags.h"
#include "formats/io/raw_file.h"
#include "formats/io/text.h"
#include "formats/readers.h"
#include "isohf/base/bytes.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// Where a directory of a TIFF file lies, and how its numbers are written.
struct TiffDirectoryPlace {
  std::uint64_t offset_bytes = 0;
  bool big_tiff = false;  ///< numbers of 64 bits
  bool swapped = false;   ///< in big-endian order
};

/// The count of tag `wanted` in the directory as it stands in the file; nullopt where it is absent. libtiff pads short
/// tables with zeros, which would pass for blocks that a sparse file leaves out. Throws Error{kIo, kCorrupt}.
std::optional<std::uint64_t> tiff_stored_count(const RawFile& file, const TiffDirectoryPlace& place,
                                               std::uint16_t wanted) {
  const auto number = [&](std::uint64_t offset, std::size_t bytes) {
    std::array<std::byte, 8> stored = {};
    file.read(offset, std::span(stored).first(bytes));
    if (place.swapped) std::reverse(stored.begin(), stored.begin() + static_cast<std::ptrdiff_t>(bytes));
    return load_little<std::uint64_t>(stored.data());
  };
  const std::uint64_t entries = number(place.offset_bytes, place.big_tiff ? 8 : 2);
  for (std::uint64_t i = 0; i < entries; ++i) {
    const std::uint64_t entry = place.offset_bytes + (place.big_tiff ? 8 + 20 * i : 2 + 12 * i);
    if (number(entry, 2) == wanted) return number(entry + 4, place.big_tiff ? 8 : 4);
  }
  return std::nullopt;
}

/// No buffer that libtiff asks for is larger; blocks are checked against smaller bounds before.
constexpr tmsize_t kLargestAllocation = tmsize_t{1} << 30;
constexpr std::uint32_t kMostDirectories = 1024;
constexpr std::size_t kMostWarnings = 8;

// Tags that libtiff does not know by itself; it delivers them as anonymous arrays.
constexpr std::uint32_t kModelPixelScaleTag = 33550;
constexpr std::uint32_t kModelTiepointTag = 33922;
constexpr std::uint32_t kModelTransformationTag = 34264;
constexpr std::uint32_t kGeoKeyDirectoryTag = 34735;
constexpr std::uint32_t kGeoDoubleParamsTag = 34736;
constexpr std::uint32_t kGeoAsciiParamsTag = 34737;

}  // namespace

/// The libtiff handle with its input, its messages and the callbacks that connect them.
struct TiffHandle::Impl {
  Impl(const RawFile& raw_file, bool map) : file(raw_file), mapped(map) {
    TIFFOpenOptions* options = TIFFOpenOptionsAlloc();
    if (options == nullptr) throw Error(ErrorCode::kOutOfMemory, file.path() + ": no memory for a TIFF handle");
    TIFFOpenOptionsSetMaxSingleMemAlloc(options, kLargestAllocation);
    TIFFOpenOptionsSetErrorHandlerExtR(options, on_error, this);
    TIFFOpenOptionsSetWarningHandlerExtR(options, on_warning, this);
    // r: read; O: load entries of the block table when asked for; c: leave one large strip in one piece; m: no map.
    tif = TIFFClientOpenExt(file.path().c_str(), mapped ? "rOc" : "rOcm", this, on_read, on_write, on_seek, on_close,
                            on_size, on_map, on_unmap, options);
    TIFFOpenOptionsFree(options);
    if (tif == nullptr) fail("is not a readable TIFF file");
  }

  /// Throws where a part of the directory could not be read: libtiff goes on without the tag, be it void value, place
  /// or reference system, and calls that a warning.
  void check_directory() {
    if (io_error) std::rethrow_exception(std::exchange(io_error, nullptr));
    const auto lost = std::find_if(warnings.begin(), warnings.end(), [](const std::string& warning) {
      return warning.starts_with("IO error during reading");
    });
    if (lost != warnings.end() && error.empty()) error = *lost;
    if (!error.empty()) fail("a tag cannot be read, the file is damaged or cut off");
  }
  [[nodiscard]] static std::unique_ptr<Impl> on_directory(const RawFile& file, std::uint32_t directory, bool mapped) {
    auto impl = std::make_unique<Impl>(file, mapped);
    if (directory != 0 && TIFFSetDirectory(impl->tif, directory) != 1) {
      impl->fail(fmt::format("directory {} cannot be read", directory));
    }
    return impl;
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    if (tif != nullptr) TIFFClose(tif);
  }

  /// Throws what went wrong in the call before: an I/O error of ours, else libtiff's words, else `fallback`.
  [[noreturn]] void fail(const std::string& fallback) {
    if (io_error) std::rethrow_exception(std::exchange(io_error, nullptr));
    throw Error(ErrorCode::kCorrupt, file.path() + ": " + (error.empty() ? fallback : fallback + ": " + error));
  }

  void forget_messages() {
    error.clear();
    warnings.clear();
    io_error = nullptr;
  }

  /// A JPEG that ends early is a mere warning to libjpeg, which then makes the rest up.
  [[nodiscard]] bool invented() {
    if (warnings.empty() || field<std::uint16_t>(TIFFTAG_COMPRESSION, COMPRESSION_NONE) != COMPRESSION_JPEG)
      return false;
    if (error.empty()) error = warnings.front();
    return true;
  }

  static std::string text(const char* format, std::va_list arguments) {
    std::array<char, 512> buffer = {};
    std::vsnprintf(buffer.data(), buffer.size(), format, arguments);
    return one_line(buffer.data());  // some have several
  }

  static int on_error(TIFF* /*tif*/, void* self, const char* /*module*/, const char* format, std::va_list arguments) {
    auto* impl = static_cast<Impl*>(self);
    if (impl->error.empty()) impl->error = text(format, arguments);
    return 1;  // handled: nothing goes to the process-wide handler
  }

  static int on_warning(TIFF* /*tif*/, void* self, const char* /*module*/, const char* format, std::va_list arguments) {
    auto* impl = static_cast<Impl*>(self);
    std::string message = text(format, arguments);
    // The GeoTIFF tags are unknown to libtiff; that is no news for anyone.
    const bool expected = message.rfind("Unknown field with tag", 0) == 0;
    if (!expected && impl->warnings.size() < kMostWarnings) impl->warnings.push_back(std::move(message));
    return 1;
  }

  static tmsize_t on_read(thandle_t self, void* bytes, tmsize_t count) {
    auto* impl = static_cast<Impl*>(self);
    if (count < 0) return -1;
    try {
      const std::size_t got =
          impl->file.read_some(impl->position, {static_cast<std::byte*>(bytes), static_cast<std::size_t>(count)});
      impl->position += got;
      return static_cast<tmsize_t>(got);
    } catch (...) {
      impl->io_error = std::current_exception();  // not through libtiff's frames
      return -1;
    }
  }

  static tmsize_t on_write(thandle_t /*self*/, void* /*bytes*/, tmsize_t /*count*/) { return -1; }

  static toff_t on_seek(thandle_t self, toff_t offset, int whence) {
    auto* impl = static_cast<Impl*>(self);
    if (whence == SEEK_CUR) offset += impl->position;
    if (whence == SEEK_END) offset += impl->file.size_bytes();
    impl->position = offset;
    return offset;
  }

  static int on_close(thandle_t /*self*/) { return 0; }
  static toff_t on_size(thandle_t self) { return static_cast<Impl*>(self)->file.size_bytes(); }

  static int on_map(thandle_t self, void** base, toff_t* size) {
    auto* impl = static_cast<Impl*>(self);
    const std::size_t bytes = impl->file.size_bytes();
    void* map = ::mmap(nullptr, bytes, PROT_READ, MAP_SHARED, impl->file.descriptor(), 0);
    if (map == MAP_FAILED) return 0;  // libtiff reads instead
    impl->map_base = map;
    impl->map_bytes = bytes;
    *base = map;
    *size = bytes;
    return 1;
  }

  /// The system kills a process that looks at mapped bytes which another one has cut off the file. Between this look
  /// and the decoder's there is still a moment in which that can happen.
  void check_map() const {
    if (map_base == nullptr) return;
    struct stat status = {};
    if (::fstat(file.descriptor(), &status) == 0 && static_cast<std::uint64_t>(status.st_size) < map_bytes) {
      throw Error(ErrorCode::kIo, fmt::format("{}: has {} bytes, had {} when it was opened: another program cut it; no "
                                              "file may be changed while it is read",
                                              file.path(), status.st_size, map_bytes));
    }
  }

  static void on_unmap(thandle_t self, void* base, toff_t size) {
    ::munmap(base, size);
    static_cast<Impl*>(self)->map_base = nullptr;
  }

  template <typename T>
  [[nodiscard]] T field(std::uint32_t tag, T otherwise) {
    T value = otherwise;
    return TIFFGetFieldDefaulted(tif, tag, &value) == 1 ? value : otherwise;
  }

  /// The elements of an anonymous array tag, whether libtiff or a tag extender of someone else in the process defined
  /// it.
  [[nodiscard]] std::pair<const void*, std::uint32_t> array_field(std::uint32_t tag, TIFFDataType& type) {
    const TIFFField* definition = TIFFFieldWithTag(tif, tag);
    if (definition == nullptr) return {nullptr, 0};
    type = TIFFFieldDataType(definition);
    void* data = nullptr;
    if (TIFFFieldPassCount(definition) == 0) {
      if (type != TIFF_ASCII || TIFFGetField(tif, tag, &data) != 1 || data == nullptr) return {nullptr, 0};
      return {data, static_cast<std::uint32_t>(std::char_traits<char>::length(static_cast<const char*>(data)))};
    }
    if (TIFFFieldReadCount(definition) == TIFF_VARIABLE2) {
      std::uint32_t count = 0;
      if (TIFFGetField(tif, tag, &count, &data) != 1 || data == nullptr) return {nullptr, 0};
      return {data, count};
    }
    std::uint16_t count = 0;
    if (TIFFGetField(tif, tag, &count, &data) != 1 || data == nullptr) return {nullptr, 0};
    return {data, count};
  }

  template <typename Stored, typename T>
  static std::vector<T> converted(const void* data, std::uint32_t count) {
    const auto* begin = static_cast<const Stored*>(data);
    std::vector<T> values(count);
    std::transform(begin, begin + count, values.begin(), [](Stored value) { return static_cast<T>(value); });
    return values;
  }

  template <typename T>
  [[nodiscard]] std::vector<T> numbers(std::uint32_t tag) {
    TIFFDataType type = TIFF_NOTYPE;
    const auto [data, count] = array_field(tag, type);
    if (data == nullptr) return {};
    switch (type) {
      case TIFF_DOUBLE:
        return converted<double, T>(data, count);
      case TIFF_FLOAT:
        return converted<float, T>(data, count);
      case TIFF_SHORT:
        return converted<std::uint16_t, T>(data, count);
      case TIFF_LONG:
        return converted<std::uint32_t, T>(data, count);
      default:
        return {};
    }
  }

  [[nodiscard]] std::string string(std::uint32_t tag) {
    TIFFDataType type = TIFF_NOTYPE;
    const auto [data, count] = array_field(tag, type);
    if (data == nullptr || (type != TIFF_ASCII && type != TIFF_BYTE)) return {};
    std::string value(static_cast<const char*>(data), count);
    while (!value.empty() && value.back() == '\0') value.pop_back();
    return value;
  }

  [[nodiscard]] std::optional<std::uint64_t> stored_count(std::uint16_t wanted) const {
    return tiff_stored_count(file, {TIFFCurrentDirOffset(tif), TIFFIsBigTIFF(tif) != 0, TIFFIsBigEndian(tif) != 0},
                             wanted);
  }

  const RawFile& file;
  bool mapped;
  TIFF* tif = nullptr;
  std::uint64_t position = 0;
  void* map_base = nullptr;
  std::size_t map_bytes = 0;
  std::string error;
  std::vector<std::string> warnings;
  std::exception_ptr io_error;
};

TiffHandle::TiffHandle(const RawFile& file, std::uint32_t directory, bool mapped)
    : TiffHandle(Impl::on_directory(file, directory, mapped)) {}

TiffHandle::TiffHandle(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {
  // Sub-sampled colour comes out as one value per sample.
  if (impl_->field<std::uint16_t>(TIFFTAG_COMPRESSION, COMPRESSION_NONE) == COMPRESSION_JPEG &&
      impl_->field<std::uint16_t>(TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK) == PHOTOMETRIC_YCBCR) {
    TIFFSetField(impl_->tif, TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB);
  }
}

TiffHandle::~TiffHandle() = default;

void TiffHandle::decode_block(std::uint64_t index, bool tiled, std::span<std::byte> bytes) {
  impl_->forget_messages();
  const auto block = static_cast<std::uint32_t>(index);
  const auto size = static_cast<tmsize_t>(bytes.size());
  const tmsize_t got = tiled ? TIFFReadEncodedTile(impl_->tif, block, bytes.data(), size)
                             : TIFFReadEncodedStrip(impl_->tif, block, bytes.data(), size);
  if (got != size || impl_->invented())
    impl_->fail(fmt::format("{} {} cannot be decoded", tiled ? "tile" : "strip", index));
}

void TiffHandle::decode_row(std::int64_t row, std::int64_t plane, std::span<std::byte> bytes) {
  impl_->forget_messages();
  impl_->check_map();
  const int result =
      TIFFReadScanline(impl_->tif, bytes.data(), static_cast<std::uint32_t>(row), static_cast<std::uint16_t>(plane));
  if (result != 1 || impl_->invented()) impl_->fail(fmt::format("row {} cannot be decoded", row));
}

void TiffHandle::forget_mapped() {
  if (impl_->map_base != nullptr) ::madvise(impl_->map_base, impl_->map_bytes, MADV_DONTNEED);
}

TiffBlockSpan TiffHandle::block_span(std::uint64_t index) {
  impl_->forget_messages();
  int bad_offset = 0;
  int bad_size = 0;
  const auto block = static_cast<std::uint32_t>(index);
  const TiffBlockSpan span = {TIFFGetStrileOffsetWithErr(impl_->tif, block, &bad_offset),
                              TIFFGetStrileByteCountWithErr(impl_->tif, block, &bad_size)};
  if (bad_offset != 0 || bad_size != 0) impl_->fail(fmt::format("the table of blocks has no entry {}", index));
  return span;
}

TiffLayout TiffHandle::read_layout() {
  Impl& impl = *impl_;
  TiffLayout layout;
  layout.width = impl.field<std::uint32_t>(TIFFTAG_IMAGEWIDTH, 0);
  layout.height = impl.field<std::uint32_t>(TIFFTAG_IMAGELENGTH, 0);
  if (layout.width < 1 || layout.height < 1) {
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: the size is {} x {}, must be positive", impl.file.path(),
                                                 layout.width, layout.height));
  }
  layout.bits_per_sample = impl.field<std::uint16_t>(TIFFTAG_BITSPERSAMPLE, 1);
  layout.samples_per_pixel = impl.field<std::uint16_t>(TIFFTAG_SAMPLESPERPIXEL, 1);
  layout.sample_format = impl.field<std::uint16_t>(TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT);
  layout.compression = impl.field<std::uint16_t>(TIFFTAG_COMPRESSION, COMPRESSION_NONE);
  layout.photometric = impl.field<std::uint16_t>(TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  layout.orientation = impl.field<std::uint16_t>(TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT);
  layout.separate = layout.samples_per_pixel > 1 &&
                    impl.field<std::uint16_t>(TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) == PLANARCONFIG_SEPARATE;
  layout.big_endian = TIFFIsBigEndian(impl.tif) != 0;
  layout.bits_reversed = impl.field<std::uint16_t>(TIFFTAG_FILLORDER, FILLORDER_MSB2LSB) != FILLORDER_MSB2LSB;
  std::uint16_t extra_count = 0;
  std::uint16_t* extra = nullptr;
  if (TIFFGetFieldDefaulted(impl.tif, TIFFTAG_EXTRASAMPLES, &extra_count, &extra) == 1 && extra != nullptr) {
    for (int i = 0; i < extra_count; ++i) {
      if (extra[i] == EXTRASAMPLE_UNSPECIFIED || layout.alpha_sample >= 0) continue;
      layout.alpha_sample = layout.samples_per_pixel - extra_count + i;
    }
  }
  layout.tiled = TIFFIsTiled(impl.tif) != 0;
  if (layout.tiled) {
    layout.block_width = impl.field<std::uint32_t>(TIFFTAG_TILEWIDTH, 0);
    layout.block_height = impl.field<std::uint32_t>(TIFFTAG_TILELENGTH, 0);
  } else {
    layout.block_width = layout.width;
    layout.block_height =
        std::min<std::int64_t>(impl.field<std::uint32_t>(TIFFTAG_ROWSPERSTRIP, UINT32_MAX), layout.height);
  }
  if (layout.block_width < 1 || layout.block_height < 1) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("{}: the {} size is {} x {}, must be positive", impl.file.path(),
                            layout.tiled ? "tile" : "strip", layout.block_width, layout.block_height));
  }
  layout.blocks_across = (layout.width + layout.block_width - 1) / layout.block_width;
  layout.blocks_down = (layout.height + layout.block_height - 1) / layout.block_height;
  // Without sizes libtiff works them out from the offsets.
  const auto offsets = impl.stored_count(layout.tiled ? TIFFTAG_TILEOFFSETS : TIFFTAG_STRIPOFFSETS);
  const auto sizes = impl.stored_count(layout.tiled ? TIFFTAG_TILEBYTECOUNTS : TIFFTAG_STRIPBYTECOUNTS);
  layout.table_entries = std::min(offsets.value_or(0), sizes.value_or(UINT64_MAX));
  if (TIFFIsCODECConfigured(layout.compression) == 0) {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("{}: the compression is {}, which this build of libtiff cannot read", impl.file.path(),
                            tiff_compression_name(layout.compression)));
  }
  return layout;
}

TiffTags TiffHandle::read_tags() {
  Impl& impl = *impl_;
  impl.check_directory();
  TiffTags tags;
  tags.geo.pixel_scale = impl.numbers<double>(kModelPixelScaleTag);
  tags.geo.tiepoints = impl.numbers<double>(kModelTiepointTag);
  tags.geo.transformation = impl.numbers<double>(kModelTransformationTag);
  tags.geo.directory = impl.numbers<std::uint16_t>(kGeoKeyDirectoryTag);
  tags.geo.doubles = impl.numbers<double>(kGeoDoubleParamsTag);
  tags.geo.ascii = impl.string(kGeoAsciiParamsTag);
  tags.gdal_metadata = impl.string(kGdalMetadataTag);
  tags.gdal_nodata = impl.string(kGdalNodataTag);
  tags.warnings = impl.warnings;
  return tags;
}

std::vector<std::array<std::uint8_t, 3>> TiffHandle::read_palette() {
  std::array<std::uint16_t*, 3> channels = {};
  if (TIFFGetField(impl_->tif, TIFFTAG_COLORMAP, &channels[0], &channels[1], &channels[2]) != 1) {
    impl_->fail("the palette is missing");
  }
  std::vector<std::array<std::uint8_t, 3>> colours(std::size_t{1}
                                                   << impl_->field<std::uint16_t>(TIFFTAG_BITSPERSAMPLE, 1));
  for (std::size_t i = 0; i < colours.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) colours[i][c] = static_cast<std::uint8_t>(channels[c][i] / 257);
  }
  return colours;
}

TiffMainImage open_image(const RawFile& file, std::uint32_t directory) {
  TiffMainImage image;
  image.directories.main = directory;
  image.handle = std::make_unique<TiffHandle>(file, directory, false);
  return image;
}

TiffMainImage open_main_image(const RawFile& file, std::uint32_t wanted) {
  auto walk = std::make_unique<TiffHandle::Impl>(file, false);
  TiffDirectories found;
  bool walked = false;
  for (std::uint32_t i = 0; i < kMostDirectories; ++i) {
    const auto kind = walk->field<std::uint32_t>(TIFFTAG_SUBFILETYPE, 0);
    const bool mask = (kind & FILETYPE_MASK) != 0;
    const bool reduced = (kind & FILETYPE_REDUCEDIMAGE) != 0;
    if (mask && !reduced && found.images == wanted + 1 && !found.mask) found.mask = i;
    if (!mask && !reduced && found.images++ == wanted) found.main = i;
    if (TIFFLastDirectory(walk->tif) != 0) break;
    walked = true;
    found.has_broken = TIFFReadDirectory(walk->tif) != 1;
    if (found.has_broken && walk->io_error) std::rethrow_exception(walk->io_error);
    if (found.has_broken) break;
  }
  if (wanted > 0 && wanted >= found.images) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("{}: there is no image {}; there are 0 to {}", file.path(),
                                                         wanted, std::max(found.images, 1U) - 1));
  }
  // A walk leaves the handle elsewhere, with what libtiff said of other images.
  if (walked) walk = TiffHandle::Impl::on_directory(file, found.main, false);
  return {found, std::unique_ptr<TiffHandle>(new TiffHandle(std::move(walk)))};
}

std::string tiff_library() {
  // "LIBTIFF, Version 4.5.0" and lines of copyright.
  const std::string text = TIFFGetVersion();
  const std::size_t number = std::min(text.find_first_of("0123456789"), text.size());
  return "libtiff " + text.substr(number, text.find('\n') - number);
}

std::int64_t TiffLayout::stored_rows(std::int64_t down) const {
  return tiled ? block_height : std::min(block_height, height - down * block_height);
}

std::string tiff_compression_name(std::uint16_t compression) {
  constexpr std::array<std::pair<std::uint16_t, const char*>, 20> kNames = {{
      {COMPRESSION_NONE, "none"},
      {COMPRESSION_CCITTRLE, "CCITT RLE"},
      {COMPRESSION_CCITTFAX3, "CCITT fax 3"},
      {COMPRESSION_CCITTFAX4, "CCITT fax 4"},
      {COMPRESSION_LZW, "LZW"},
      {COMPRESSION_OJPEG, "old JPEG"},
      {COMPRESSION_JPEG, "JPEG"},
      {COMPRESSION_PACKBITS, "PackBits"},
      {COMPRESSION_PIXARLOG, "PixarLog"},
      {COMPRESSION_DEFLATE, "DEFLATE"},
      {COMPRESSION_ADOBE_DEFLATE, "DEFLATE"},
      {COMPRESSION_JBIG, "JBIG"},
      {COMPRESSION_SGILOG, "SGILog"},
      {COMPRESSION_JP2000, "JPEG 2000"},
      {COMPRESSION_LERC, "LERC"},
      {COMPRESSION_LZMA, "LZMA"},
      {COMPRESSION_ZSTD, "ZSTD"},
      {COMPRESSION_WEBP, "WebP"},
      {COMPRESSION_JXL, "JPEG XL"},
      {COMPRESSION_THUNDERSCAN, "ThunderScan"},
  }};
  for (const auto& [code, name] : kNames) {
    if (code == compression) return name;
  }
  return std::to_string(compression);
}

}  // namespace isohf
