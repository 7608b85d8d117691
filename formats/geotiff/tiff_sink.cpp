#include <fmt/format.h>
#include <libdeflate.h>
#include <tbb/parallel_for.h>
#include <tiffio.h>
#include <xtiffio.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "formats/georeference/gdal_unit.h"
#include "formats/geotiff/gdal_tags.h"
#include "formats/geotiff/geotiff_keys.h"
#include "formats/geotiff/tiff_file.h"
#include "formats/geotiff/tiff_io.h"
#include "formats/write/encoders.h"
#include "isohf/base/sample.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

/// The rows of a block.
struct TiffBlockRows {
  SampleType sample_type = SampleType::kFloat32;
  std::size_t samples_per_row = 0;  ///< of all channels
  std::size_t channels = 1;         ///< interleaved
};

/// Differences to the sample one pixel before, modulo the type's range; from the end, so that it can be done in place.
template <typename Unsigned>
void difference_row(std::byte* row, std::size_t samples, std::size_t channels) {
  for (std::size_t at = samples; at-- > channels;) {
    const auto value = stored_at<Unsigned>(row + at * sizeof(Unsigned));
    const auto before = stored_at<Unsigned>(row + (at - channels) * sizeof(Unsigned));
    const auto difference = static_cast<Unsigned>(value - before);
    std::memcpy(row + at * sizeof(Unsigned), &difference, sizeof(Unsigned));
  }
}

/// Predictor 2 (TIFF 6.0, section 14), differences of neighbouring samples, for integers; predictor 3 (Adobe Photoshop
/// TIFF technical note 3) for floats: differences of bytes, the most significant ones of all samples first.
void predict(const TiffBlockRows& block, std::span<std::byte> rows) {
  const std::size_t size = size_bytes(block.sample_type);
  const std::size_t samples = block.samples_per_row;
  std::vector<std::byte> scratch;
  for (std::byte* row = rows.data(); row < rows.data() + rows.size(); row += samples * size) {
    if (is_floating(block.sample_type)) {
      scratch.assign(row, row + samples * size);
      for (std::size_t i = 0; i < samples * size; ++i) row[(size - 1 - i % size) * samples + i / size] = scratch[i];
      difference_row<std::uint8_t>(row, samples * size, block.channels);
    } else if (size == 1) {
      difference_row<std::uint8_t>(row, samples, block.channels);
    } else if (size == 2) {
      difference_row<std::uint16_t>(row, samples, block.channels);
    } else {
      difference_row<std::uint32_t>(row, samples, block.channels);
    }
  }
}

/// Predicts and deflates a block; `rows` is overwritten. libtiff would do the same on one thread. The same rows always
/// give the same bytes. Throws Error{kOutOfMemory}.
std::vector<std::byte> compress_block(const TiffBlockRows& block, std::span<std::byte> rows) {
  constexpr int kLevel = 6;
  predict(block, rows);
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
/// Blocks that are compressed side by side, and the most bytes that strips may have together.
constexpr std::size_t kBatchBlocks = 16;
constexpr std::size_t kBatchBytes = std::size_t{8} << 20U;
/// Classic TIFF counts bytes in 32 bits; a little is left for tags and for samples that do not compress.
constexpr double kClassicBytes = 4.0e9;

class TiffEncoder final : public RasterEncoder {
 public:
  /// libtiff writes the file under its name while it has no other; nothing else is appended to `out`.
  TiffEncoder(const OutputFile& out, const RasterSpec& spec)
      : io_(out.part_path(), File::Mode::kReadWrite), compresses_(spec.compress) {
    define_geotiff_tags();
    const double raw_bytes = static_cast<double>(row_bytes(spec)) * static_cast<double>(spec.height);
    TIFFOpenOptions* options = TIFFOpenOptionsAlloc();
    if (options == nullptr) throw Error(ErrorCode::kOutOfMemory, "libtiff ran out of memory");
    TIFFOpenOptionsSetErrorHandlerExtR(options, on_error, &message_);
    TIFFOpenOptionsSetWarningHandlerExtR(options, on_warning, nullptr);
    tiff_.reset(io_.open(raw_bytes > kClassicBytes ? "wl8" : "wl", options));
    TIFFOpenOptionsFree(options);
    if (!tiff_) fail();
    set_layout(spec);
    set_tags(spec);
  }

  void write(std::span<const std::byte> rows, std::int64_t /*count*/) override {
    for (; band_ && !rows.empty(); rows = rows.subspan(row_bytes_)) {
      band_->write(band_rows_++, 0, rows.first(row_bytes_));
      if (band_rows_ == static_cast<std::int64_t>(kTileSide)) write_tiles();
    }
    while (!rows.empty()) {
      const auto taken = rows.first(std::min(rows.size(), batch_bytes_ - pending_.size()));
      pending_.insert(pending_.end(), taken.begin(), taken.end());
      rows = rows.subspan(taken.size());
      if (pending_.size() == batch_bytes_) write_strips();
    }
  }

  void close() override {
    band_ ? write_tiles() : write_strips();
    if (TIFFWriteDirectory(tiff_.get()) == 0) fail();
    tiff_.reset();
    if (!message_.empty()) fail();
  }

 private:
  /// Keeps the first message: those that follow are its consequences.
  static int on_error(TIFF*, void* message, const char* module, const char* format, va_list arguments) {
    auto& first = *static_cast<std::string*>(message);
    if (!first.empty()) return 1;
    const int reason = errno;
    std::array<char, 300> text{};
    std::vsnprintf(text.data(), text.size(), format, arguments);
    first = fmt::format("{}: {}{}{}", module != nullptr ? module : "libtiff", text.data(), reason != 0 ? ": " : "",
                        reason != 0 ? std::strerror(reason) : "");
    return 1;
  }
  static int on_warning(TIFF*, void*, const char*, const char*, va_list) { return 1; }

  [[noreturn]] void fail() const {
    if (io_.failure()) throw Error(ErrorCode::kIo, std::string("TIFF cannot be written: ") + io_.failure()->what());
    throw Error(ErrorCode::kIo, "TIFF cannot be written: " + (message_.empty() ? "unknown reason" : message_));
  }

  template <typename... Values>
  void set(ttag_t tag, Values... values) {
    errno = 0;
    if (TIFFSetField(tiff_.get(), tag, values...) == 0) fail();
  }

  void set_layout(const RasterSpec& spec) {
    const bool floating = is_floating(spec.sample_type);
    const bool is_signed = spec.sample_type == SampleType::kInt8 || spec.sample_type == SampleType::kInt16 ||
                           spec.sample_type == SampleType::kInt32;
    const std::size_t one_row = row_bytes(spec);
    const auto channels = static_cast<std::size_t>(spec.channels);
    constexpr auto kSide = static_cast<std::int64_t>(kTileSide);
    row_bytes_ = one_row;
    block_ = {spec.sample_type, static_cast<std::size_t>(spec.width) * channels, channels};
    if (spec.width > kSide && spec.height > kSide && one_row <= kMostBandBytes / kTileSide) {
      band_.emplace(one_row, spec.scratch);
      for (std::int64_t row = 0; row < kSide; ++row) band_->add(row);
      block_.samples_per_row = kTileSide * channels;
      set(TIFFTAG_TILEWIDTH, static_cast<std::uint32_t>(kTileSide));
      set(TIFFTAG_TILELENGTH, static_cast<std::uint32_t>(kTileSide));
    } else {
      const auto rows_per_strip =
          std::clamp<std::size_t>(kStripBytes / one_row, 1, static_cast<std::size_t>(spec.height));
      strip_bytes_ = rows_per_strip * one_row;
      batch_bytes_ = strip_bytes_ * std::clamp<std::size_t>(kBatchBytes / strip_bytes_, 1, kBatchBlocks);
      set(TIFFTAG_ROWSPERSTRIP, static_cast<std::uint32_t>(rows_per_strip));
    }
    set(TIFFTAG_IMAGEWIDTH, static_cast<std::uint32_t>(spec.width));
    set(TIFFTAG_IMAGELENGTH, static_cast<std::uint32_t>(spec.height));
    set(TIFFTAG_BITSPERSAMPLE, static_cast<int>(8 * size_bytes(spec.sample_type)));
    set(TIFFTAG_SAMPLESPERPIXEL, spec.channels);
    set(TIFFTAG_SAMPLEFORMAT, floating ? SAMPLEFORMAT_IEEEFP : is_signed ? SAMPLEFORMAT_INT : SAMPLEFORMAT_UINT);
    set(TIFFTAG_PHOTOMETRIC, spec.channels == 1 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB);
    set(TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    set(TIFFTAG_COMPRESSION, spec.compress ? COMPRESSION_ADOBE_DEFLATE : COMPRESSION_NONE);
    if (spec.compress) set(TIFFTAG_PREDICTOR, floating ? PREDICTOR_FLOATINGPOINT : PREDICTOR_HORIZONTAL);
    if (spec.channels == 4) {
      const std::uint16_t opacity = EXTRASAMPLE_UNASSALPHA;
      set(TIFFTAG_EXTRASAMPLES, 1, &opacity);
    }
  }

  void set_tags(const RasterSpec& spec) {
    if (spec.georeference) {
      const GeoTags tags = geotiff_tags(*spec.georeference, spec.metres_per_vertical_unit, spec.vertical_unit);
      set_array(TIFFTAG_GEOPIXELSCALE, tags.pixel_scale);
      set_array(TIFFTAG_GEOTIEPOINTS, tags.tiepoints);
      set_array(TIFFTAG_GEOKEYDIRECTORY, tags.directory);
      set_array(TIFFTAG_GEODOUBLEPARAMS, tags.doubles);
      if (!tags.ascii.empty()) set(TIFFTAG_GEOASCIIPARAMS, tags.ascii.c_str());
    }
    const bool has_code = spec.georeference && spec.georeference->system.vertical_epsg;
    const std::string metadata = gdal_metadata(spec.z_scale, spec.z_offset, gdal_unit(spec.vertical_unit, has_code));
    if (!metadata.empty()) set(kGdalMetadataTag, metadata.c_str());
    if (spec.void_value) {
      const std::string value = std::isnan(*spec.void_value) ? "nan" : fmt::format("{}", *spec.void_value);
      set(kGdalNodataTag, value.c_str());
    }
  }

  template <typename Value>
  void set_array(ttag_t tag, const std::vector<Value>& values) {
    if (!values.empty()) set(tag, static_cast<int>(values.size()), values.data());
  }

  /// Makes and compresses blocks [next_block_, next_block_ + count) on all threads and stores them in order. `block_at`
  /// gives a block's rows by its number among them.
  template <typename BlockAt>
  void write_blocks(std::size_t count, BlockAt block_at) {
    for (std::size_t first = 0; first < count; first += kBatchBlocks) {
      std::vector<std::vector<std::byte>> blocks(std::min(kBatchBlocks, count - first));
      tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t at) {
        blocks[at] = block_at(first + at);
        if (compresses_) blocks[at] = compress_block(block_, blocks[at]);
      });
      for (std::vector<std::byte>& block : blocks) {
        const auto bytes = static_cast<tmsize_t>(block.size());
        errno = 0;
        const tmsize_t written = band_ ? TIFFWriteRawTile(tiff_.get(), next_block_++, block.data(), bytes)
                                       : TIFFWriteRawStrip(tiff_.get(), next_block_++, block.data(), bytes);
        if (written != bytes) fail();
      }
    }
  }

  void write_strips() {
    write_blocks((pending_.size() + strip_bytes_ - 1) / strip_bytes_, [&](std::size_t at) {
      const std::byte* begin = pending_.data() + at * strip_bytes_;
      return std::vector(begin, begin + std::min(strip_bytes_, pending_.size() - at * strip_bytes_));
    });
    pending_.clear();
  }

  /// A band of rows as tiles; they are zero beyond the raster.
  void write_tiles() {
    const std::size_t tile_row = block_.samples_per_row * size_bytes(block_.sample_type);
    const std::size_t across = band_rows_ > 0 ? (row_bytes_ + tile_row - 1) / tile_row : 0;
    write_blocks(across, [&](std::size_t at) {
      std::vector<std::byte> tile(tile_row * kTileSide);
      const std::size_t begin = at * tile_row;
      std::vector<std::byte> buffer;
      for (std::int64_t row = 0; row < band_rows_; ++row) {
        const auto part = band_->read(row, begin, std::min(tile_row, row_bytes_ - begin), buffer);
        std::memcpy(tile.data() + static_cast<std::size_t>(row) * tile_row, part.data(), part.size());
      }
      return tile;
    });
    band_rows_ = 0;
  }

  TiffIo io_;
  bool compresses_;
  std::size_t row_bytes_ = 0;
  std::size_t strip_bytes_ = 0;
  std::size_t batch_bytes_ = 0;
  TiffBlockRows block_;
  std::string message_;  ///< of libtiff, which may add to it while it closes the file
  std::unique_ptr<TIFF, decltype(&TIFFClose)> tiff_{nullptr, TIFFClose};
  std::uint32_t next_block_ = 0;
  std::vector<std::byte> pending_;           ///< rows of the next strips
  std::optional<KeptRows<std::byte>> band_;  ///< rows of the next tiles; none: strips
  std::int64_t band_rows_ = 0;
};

}  // namespace

std::unique_ptr<RasterEncoder> encode_tiff(OutputFile& out, const RasterSpec& spec) {
  return std::make_unique<TiffEncoder>(out, spec);
}

}  // namespace isohf
