#include <fmt/format.h>
#include <libdeflate.h>
#include <tbb/parallel_for.h>
#include <tiffio.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "formats/georeference/gdal_unit.h"
#include "formats/geotiff/gdal_tags.h"
#include "formats/geotiff/geotiff_keys.h"
#include "formats/write/encoders.h"
#include "isohf/base/bytes.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

/// How the rows of a strip are laid out before compression.
struct TiffStripLayout {
  SampleType sample_type = SampleType::kFloat32;
  std::size_t samples_per_row = 0;  ///< of all channels
  std::size_t channels = 1;         ///< interleaved
  bool compress = true;
};

constexpr int kLevel = 6;

/// Differences to the sample one pixel before, modulo the type's range; from the end, so that it can be done in place.
template <typename Unsigned>
void difference_row(std::byte* row, std::size_t samples, std::size_t channels) {
  for (std::size_t at = samples; at-- > channels;) {
    Unsigned value{};
    Unsigned before{};
    std::memcpy(&value, row + at * sizeof(Unsigned), sizeof(Unsigned));
    std::memcpy(&before, row + (at - channels) * sizeof(Unsigned), sizeof(Unsigned));
    value = static_cast<Unsigned>(value - before);
    std::memcpy(row + at * sizeof(Unsigned), &value, sizeof(Unsigned));
  }
}

/// The bytes of a row's samples, most significant ones first, each significance together; then differences of bytes.
void difference_byte_planes(std::byte* row, std::size_t samples, std::size_t size, std::size_t channels,
                            std::vector<std::byte>& scratch) {
  scratch.assign(row, row + samples * size);
  for (std::size_t byte = 0; byte < size; ++byte) {
    std::byte* plane = row + (size - 1 - byte) * samples;
    for (std::size_t at = 0; at < samples; ++at) plane[at] = scratch[at * size + byte];
  }
  difference_row<std::uint8_t>(row, samples * size, channels);
}

void predict(const TiffStripLayout& layout, std::span<std::byte> rows) {
  const std::size_t size = size_bytes(layout.sample_type);
  const std::size_t row_bytes = layout.samples_per_row * size;
  std::vector<std::byte> scratch;
  for (std::size_t at = 0; at < rows.size(); at += row_bytes) {
    std::byte* row = rows.data() + at;
    if (is_floating(layout.sample_type)) {
      difference_byte_planes(row, layout.samples_per_row, size, layout.channels, scratch);
    } else if (size == 1) {
      difference_row<std::uint8_t>(row, layout.samples_per_row, layout.channels);
    } else if (size == 2) {
      difference_row<std::uint16_t>(row, layout.samples_per_row, layout.channels);
    } else {
      difference_row<std::uint32_t>(row, layout.samples_per_row, layout.channels);
    }
  }
}

/// Predicts and deflates whole rows as TIFF asks for: predictor 2, differences of neighbouring samples, for integers;
/// predictor 3, differences of byte planes, for floats (TIFF 6.0 section 14; Adobe Photoshop TIFF technical note 3).
/// The compression is a zlib stream. `rows` is overwritten. The same rows always give the same bytes.
/// Throws Error{kOutOfMemory}.
std::vector<std::byte> compress_tiff_strip(const TiffStripLayout& layout, std::span<std::byte> rows) {
  if (!layout.compress) return {rows.begin(), rows.end()};
  predict(layout, rows);
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(kLevel), libdeflate_free_compressor);
  if (!compressor) throw Error(ErrorCode::kOutOfMemory, "libdeflate ran out of memory");
  std::vector<std::byte> compressed(libdeflate_zlib_compress_bound(compressor.get(), rows.size()));
  compressed.resize(
      libdeflate_zlib_compress(compressor.get(), rows.data(), rows.size(), compressed.data(), compressed.size()));
  return compressed;
}

/// Sides of tiles; rasters that are no larger, and those where so many rows take more than kMostBandBytes, have strips.
constexpr std::size_t kTileSide = 256;
constexpr std::size_t kMostBandBytes = std::size_t{64} << 20U;
/// Strips of about this size: small enough to read a part of the raster cheaply, large enough to compress well.
constexpr std::size_t kStripBytes = std::size_t{256} << 10U;
/// Strips that are compressed side by side, and the most bytes that they may have together.
constexpr std::size_t kBatchStrips = 16;
constexpr std::size_t kBatchBytes = std::size_t{8} << 20U;
/// Classic TIFF counts bytes in 32 bits; a little is left for tags and for samples that do not compress.
constexpr double kClassicBytes = 4.0e9;

// GeoTIFF (OGC 19-008r4) and GDAL's tags, which libtiff does not know by itself.
constexpr ttag_t kPixelScaleTag = 33550;
constexpr ttag_t kTiepointTag = 33922;
constexpr ttag_t kGeoDirectoryTag = 34735;
constexpr ttag_t kGeoDoublesTag = 34736;
constexpr ttag_t kGeoAsciiTag = 34737;

TIFFFieldInfo counted(ttag_t tag, TIFFDataType type, const char* name) {
  return {tag, TIFF_VARIABLE, TIFF_VARIABLE, type, FIELD_CUSTOM, 1, 1, const_cast<char*>(name)};
}

TIFFFieldInfo text(ttag_t tag, const char* name) {
  return {tag, TIFF_VARIABLE, TIFF_VARIABLE, TIFF_ASCII, FIELD_CUSTOM, 1, 0, const_cast<char*>(name)};
}

/// The unit and scale as GDAL stores them; empty where there is nothing to say.
std::string gdal_metadata(const RasterSpec& spec) {
  std::string items;
  if (spec.z_scale != 1.0 || spec.z_offset != 0.0) {
    items += fmt::format("  <Item name=\"OFFSET\" sample=\"0\" role=\"offset\">{}</Item>\n", spec.z_offset);
    items += fmt::format("  <Item name=\"SCALE\" sample=\"0\" role=\"scale\">{}</Item>\n", spec.z_scale);
  }
  if (!spec.vertical_unit.empty()) {
    std::string unit;
    const bool has_code = spec.georeference && spec.georeference->system.vertical_epsg;
    for (const char c : gdal_unit(spec.vertical_unit, has_code))
      unit += c == '<' ? "&lt;" : c == '&' ? "&amp;" : std::string(1, c);
    items += fmt::format("  <Item name=\"UNITTYPE\" sample=\"0\" role=\"unittype\">{}</Item>\n", unit);
  }
  return items.empty() ? items : "<GDALMetadata>\n" + items + "</GDALMetadata>\n";
}

class TiffEncoder final : public RasterEncoder {
 public:
  TiffEncoder(OutputFile& out, const RasterSpec& spec) : out_(out) {
    const double raw_bytes = static_cast<double>(row_bytes(spec)) * static_cast<double>(spec.height);
    TIFFOpenOptions* options = TIFFOpenOptionsAlloc();
    if (options == nullptr) throw Error(ErrorCode::kOutOfMemory, "libtiff ran out of memory");
    TIFFOpenOptionsSetErrorHandlerExtR(options, on_error, this);
    TIFFOpenOptionsSetWarningHandlerExtR(options, on_warning, this);
    tiff_ = TIFFClientOpenExt(out.path().c_str(), raw_bytes > kClassicBytes ? "wl8" : "wl", this, on_read, on_write,
                              on_seek, on_close, on_size, nullptr, nullptr, options);
    TIFFOpenOptionsFree(options);
    if (tiff_ == nullptr) fail();
    try {
      out_.flush();  // a full disk shows before the work
      set_layout(spec);
      set_place(spec);
    } catch (...) {
      release();
      throw;
    }
  }
  ~TiffEncoder() override { release(); }

  void write(std::span<const std::byte> rows, std::int64_t /*count*/) override {
    for (; tiled_ && !rows.empty(); rows = rows.subspan(row_bytes_)) {
      band_->write(band_rows_++, 0, rows.first(row_bytes_));
      if (band_rows_ == static_cast<std::int64_t>(kTileSide)) write_tiles();
    }
    while (!rows.empty()) {
      const auto taken = rows.first(std::min(rows.size(), batch_bytes_ - pending_.size()));
      pending_.insert(pending_.end(), taken.begin(), taken.end());
      rows = rows.subspan(taken.size());
      if (pending_.size() == batch_bytes_) write_pending();
    }
  }

  void close() override {
    write_pending();
    if (TIFFWriteDirectory(tiff_) == 0) fail();
    release();
    if (failed_ || failure_) fail();
  }

 private:
  /// Keeps the first message: those that follow are its consequences.
  static int on_error(TIFF*, void* self, const char* module, const char* format, va_list arguments) {
    auto& encoder = *static_cast<TiffEncoder*>(self);
    if (encoder.failed_) return 1;
    encoder.failed_ = true;
    std::array<char, 300> text{};
    std::vsnprintf(text.data(), text.size(), format, arguments);
    encoder.message_ = fmt::format("{}: {}", module != nullptr ? module : "libtiff", text.data());
    return 1;
  }
  static int on_warning(TIFF*, void*, const char*, const char*, va_list) { return 1; }

  /// Runs what may throw, but not through libtiff's frames; what failed first is the reason.
  template <typename Action>
  tmsize_t guarded(Action action) noexcept {
    try {
      return static_cast<tmsize_t>(action());
    } catch (...) {
      if (!failure_) failure_ = std::current_exception();
      return -1;
    }
  }
  static tmsize_t on_read(thandle_t self, void* bytes, tmsize_t count) {
    auto& encoder = *static_cast<TiffEncoder*>(self);
    return encoder.guarded([&] {
      encoder.out_.flush();
      const std::size_t got =
          encoder.out_.read_at(encoder.position_, {static_cast<std::byte*>(bytes), static_cast<std::size_t>(count)});
      encoder.position_ += got;
      return got;
    });
  }
  static tmsize_t on_write(thandle_t self, void* bytes, tmsize_t count) {
    auto& encoder = *static_cast<TiffEncoder*>(self);
    return encoder.guarded([&] {
      const std::span data(static_cast<const std::byte*>(bytes), static_cast<std::size_t>(count));
      encoder.out_.write_at(encoder.position_, data);
      encoder.position_ += data.size();
      return count;
    });
  }
  static toff_t on_seek(thandle_t self, toff_t offset, int whence) {
    auto& encoder = *static_cast<TiffEncoder*>(self);
    if (whence == SEEK_CUR) offset += encoder.position_;
    if (whence == SEEK_END) offset += encoder.out_.position();
    return encoder.position_ = offset;
  }
  static int on_close(thandle_t) { return 0; }
  static toff_t on_size(thandle_t self) { return static_cast<TiffEncoder*>(self)->out_.position(); }

  [[noreturn]] void fail() {
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
    throw Error(ErrorCode::kIo, "TIFF cannot be written: " + (message_.empty() ? "unknown reason" : message_));
  }

  template <typename... Values>
  void set(ttag_t tag, Values... values) {
    if (TIFFSetField(tiff_, tag, values...) == 0) fail();
  }

  void set_layout(const RasterSpec& spec) {
    const bool floating = is_floating(spec.sample_type);
    const bool is_signed = spec.sample_type == SampleType::kInt8 || spec.sample_type == SampleType::kInt16 ||
                           spec.sample_type == SampleType::kInt32;
    const std::size_t one_row = row_bytes(spec);
    const auto channels = static_cast<std::size_t>(spec.channels);
    constexpr auto kSide = static_cast<std::int64_t>(kTileSide);
    row_bytes_ = one_row;
    tiled_ = spec.width > kSide && spec.height > kSide && one_row <= kMostBandBytes / kTileSide;
    if (tiled_) {
      band_.emplace(one_row, spec.scratch);
      for (std::int64_t row = 0; row < kSide; ++row) band_->add(row);
      layout_ = {spec.sample_type, kTileSide * channels, channels};
      set(TIFFTAG_TILEWIDTH, static_cast<std::uint32_t>(kTileSide));
      set(TIFFTAG_TILELENGTH, static_cast<std::uint32_t>(kTileSide));
    } else {
      const auto rows_per_strip =
          std::clamp<std::size_t>(kStripBytes / one_row, 1, static_cast<std::size_t>(spec.height));
      strip_bytes_ = rows_per_strip * one_row;
      batch_bytes_ = strip_bytes_ * std::clamp<std::size_t>(kBatchBytes / strip_bytes_, 1, kBatchStrips);
      layout_ = {spec.sample_type, static_cast<std::size_t>(spec.width) * channels, channels};
      set(TIFFTAG_ROWSPERSTRIP, static_cast<std::uint32_t>(rows_per_strip));
    }
    set(TIFFTAG_IMAGEWIDTH, static_cast<std::uint32_t>(spec.width));
    set(TIFFTAG_IMAGELENGTH, static_cast<std::uint32_t>(spec.height));
    set(TIFFTAG_BITSPERSAMPLE, static_cast<int>(8 * size_bytes(spec.sample_type)));
    set(TIFFTAG_SAMPLESPERPIXEL, spec.channels);
    set(TIFFTAG_SAMPLEFORMAT, floating ? SAMPLEFORMAT_IEEEFP : is_signed ? SAMPLEFORMAT_INT : SAMPLEFORMAT_UINT);
    set(TIFFTAG_PHOTOMETRIC, spec.channels == 1 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB);
    set(TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    layout_.compress = spec.compress;
    set(TIFFTAG_COMPRESSION, spec.compress ? COMPRESSION_ADOBE_DEFLATE : COMPRESSION_NONE);
    if (spec.compress) set(TIFFTAG_PREDICTOR, floating ? PREDICTOR_FLOATINGPOINT : PREDICTOR_HORIZONTAL);
    if (spec.channels == 4) {
      const std::uint16_t opacity = EXTRASAMPLE_UNASSALPHA;
      set(TIFFTAG_EXTRASAMPLES, 1, &opacity);
    }
  }

  void set_place(const RasterSpec& spec) {
    const std::array<TIFFFieldInfo, 7> fields = {counted(kPixelScaleTag, TIFF_DOUBLE, "ModelPixelScale"),
                                                 counted(kTiepointTag, TIFF_DOUBLE, "ModelTiepoint"),
                                                 counted(kGeoDirectoryTag, TIFF_SHORT, "GeoKeyDirectory"),
                                                 counted(kGeoDoublesTag, TIFF_DOUBLE, "GeoDoubleParams"),
                                                 text(kGeoAsciiTag, "GeoAsciiParams"),
                                                 text(kGdalMetadataTag, "GDALMetadata"),
                                                 text(kGdalNodataTag, "GDALNoDataValue")};
    if (TIFFMergeFieldInfo(tiff_, fields.data(), static_cast<std::uint32_t>(fields.size())) != 0) fail();
    if (spec.georeference) {
      const GeoTags tags = geotiff_tags(*spec.georeference, spec.metres_per_vertical_unit, spec.vertical_unit);
      set_counted(kPixelScaleTag, tags.pixel_scale);
      set_counted(kTiepointTag, tags.tiepoints);
      set_counted(kGeoDirectoryTag, tags.directory);
      set_counted(kGeoDoublesTag, tags.doubles);
      if (!tags.ascii.empty()) set(kGeoAsciiTag, tags.ascii.c_str());
    }
    if (const std::string metadata = gdal_metadata(spec); !metadata.empty()) set(kGdalMetadataTag, metadata.c_str());
    if (spec.void_value) {
      const std::string value = std::isnan(*spec.void_value) ? "nan" : fmt::format("{}", *spec.void_value);
      set(kGdalNodataTag, value.c_str());
    }
  }

  template <typename Value>
  void set_counted(ttag_t tag, const std::vector<Value>& values) {
    if (!values.empty()) set(tag, static_cast<int>(values.size()), values.data());
  }

  /// Compresses the pending strips on all threads and stores them in order.
  void write_pending() {
    if (tiled_) return write_tiles();
    const std::size_t count = (pending_.size() + strip_bytes_ - 1) / strip_bytes_;
    std::vector<std::vector<std::byte>> strips(count);
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t at) {
      const std::size_t begin = at * strip_bytes_;
      strips[at] = compress_tiff_strip(
          layout_, std::span(pending_).subspan(begin, std::min(strip_bytes_, pending_.size() - begin)));
    });
    for (std::vector<std::byte>& strip : strips) {
      const auto size = static_cast<tmsize_t>(strip.size());
      if (TIFFWriteRawStrip(tiff_, strip_, strip.data(), size) != size) fail();
      ++strip_;
    }
    pending_.clear();
  }

  /// The same for a band of rows as tiles; what lies beyond the raster is zero.
  void write_tiles() {
    const std::size_t tile_row = layout_.samples_per_row * size_bytes(layout_.sample_type);
    const std::size_t across = band_rows_ > 0 ? (row_bytes_ + tile_row - 1) / tile_row : 0;
    for (std::size_t first = 0; first < across; first += kBatchStrips) {
      std::vector<std::vector<std::byte>> tiles(std::min(kBatchStrips, across - first));
      tbb::parallel_for(std::size_t{0}, tiles.size(), [&](std::size_t at) {
        std::vector<std::byte> tile(tile_row * kTileSide);
        const std::size_t begin = (first + at) * tile_row;
        std::vector<std::byte> buffer;
        for (std::int64_t row = 0; row < band_rows_; ++row) {
          const auto part = band_->read(row, begin, std::min(tile_row, row_bytes_ - begin), buffer);
          std::memcpy(tile.data() + static_cast<std::size_t>(row) * tile_row, part.data(), part.size());
        }
        tiles[at] = compress_tiff_strip(layout_, tile);
      });
      for (std::vector<std::byte>& tile : tiles) {
        const auto bytes = static_cast<tmsize_t>(tile.size());
        if (TIFFWriteRawTile(tiff_, strip_, tile.data(), bytes) != bytes) fail();
        ++strip_;
      }
    }
    band_rows_ = 0;
  }

  void release() {
    if (tiff_ != nullptr) TIFFClose(tiff_);
    tiff_ = nullptr;
  }

  OutputFile& out_;
  std::uint64_t position_ = 0;
  std::exception_ptr failure_;  ///< of out_
  bool tiled_ = false;
  std::size_t row_bytes_ = 0;
  std::size_t strip_bytes_ = 0;
  std::size_t batch_bytes_ = 0;
  TiffStripLayout layout_;
  TIFF* tiff_ = nullptr;
  std::uint32_t strip_ = 0;                  ///< or tile, the next one
  std::vector<std::byte> pending_;           ///< rows of the next strips
  std::optional<KeptRows<std::byte>> band_;  ///< rows of the next tiles
  std::int64_t band_rows_ = 0;
  bool failed_ = false;
  std::string message_;
};

}  // namespace

std::unique_ptr<RasterEncoder> encode_tiff(OutputFile& out, const RasterSpec& spec) {
  return std::make_unique<TiffEncoder>(out, spec);
}

}  // namespace isohf
