#include <tiffio.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <vector>

#include "isohf/error.h"
#include "sink.h"

namespace isohf::terrain {
namespace {

constexpr ttag_t kPixelScale = 33550;
constexpr ttag_t kTiePoint = 33922;
constexpr ttag_t kGeoKeys = 34735;
constexpr ttag_t kNoData = 42113;

const std::array<TIFFFieldInfo, 4> kFields = {{
    {kPixelScale, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, const_cast<char*>("ModelPixelScale")},
    {kTiePoint, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, const_cast<char*>("ModelTiepoint")},
    {kGeoKeys, -1, -1, TIFF_SHORT, FIELD_CUSTOM, 1, 1, const_cast<char*>("GeoKeyDirectory")},
    {kNoData, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, const_cast<char*>("GDALNoData")},
}};

class TiffSink final : public Sink {
 public:
  TiffSink(const std::string& path, const Raster& raster) : path_(path), raster_(raster) {
    // Classic TIFF ends at 4 GiB; compressed samples are never much longer than raw ones.
    const double raw = static_cast<double>(raster.columns) * static_cast<double>(raster.rows) *
                       static_cast<double>(size_bytes(raster.type));
    tiff_ = TIFFOpen(path.c_str(), raw > 3.9e9 ? "w8" : "w");
    if (tiff_ == nullptr) fail("cannot create");
    TIFFMergeFieldInfo(tiff_, kFields.data(), static_cast<std::uint32_t>(kFields.size()));
    set_layout();
    set_georeference();
  }
  ~TiffSink() override {
    if (tiff_ != nullptr) TIFFClose(tiff_);
  }

  void write_band(std::span<std::byte> samples) override {
    const std::size_t row_bytes = static_cast<std::size_t>(raster_.columns) * size_bytes(raster_.type);
    const auto rows = static_cast<std::int64_t>(samples.size() / row_bytes);
    if (raster_.tiled) {
      write_tiles(samples, rows, row_bytes);
    } else {
      for (std::int64_t r = 0; r < rows; ++r) {
        std::byte* row = samples.data() + static_cast<std::size_t>(r) * row_bytes;
        if (TIFFWriteScanline(tiff_, row, static_cast<std::uint32_t>(row_ + r), 0) < 0) fail("cannot write");
      }
    }
    row_ += rows;
  }

  void finish() override {
    if (TIFFFlush(tiff_) == 0) fail("cannot write");
    TIFFClose(tiff_);
    tiff_ = nullptr;
  }

 private:
  [[noreturn]] void fail(const char* what) const { throw Error(ErrorCode::kIo, path_ + ": " + what); }

  void set_layout() {
    TIFFSetField(tiff_, TIFFTAG_IMAGEWIDTH, static_cast<std::uint32_t>(raster_.columns));
    TIFFSetField(tiff_, TIFFTAG_IMAGELENGTH, static_cast<std::uint32_t>(raster_.rows));
    TIFFSetField(tiff_, TIFFTAG_BITSPERSAMPLE, static_cast<int>(8 * size_bytes(raster_.type)));
    TIFFSetField(tiff_, TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(tiff_, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(tiff_, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    const bool real = raster_.type == SampleType::kFloat32;
    TIFFSetField(
        tiff_, TIFFTAG_SAMPLEFORMAT,
        real ? SAMPLEFORMAT_IEEEFP : (raster_.type == SampleType::kInt16 ? SAMPLEFORMAT_INT : SAMPLEFORMAT_UINT));
    if (raster_.deflate) {
      TIFFSetField(tiff_, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
      TIFFSetField(tiff_, TIFFTAG_PREDICTOR, real ? PREDICTOR_FLOATINGPOINT : PREDICTOR_HORIZONTAL);
    }
    if (raster_.tiled) {
      TIFFSetField(tiff_, TIFFTAG_TILEWIDTH, kBandRows);
      TIFFSetField(tiff_, TIFFTAG_TILELENGTH, kBandRows);
    } else {
      TIFFSetField(tiff_, TIFFTAG_ROWSPERSTRIP, TIFFDefaultStripSize(tiff_, 0));
    }
  }

  /// Metres of UTM zone 33 North, far enough from the zone's edge, cells (not points).
  void set_georeference() {
    const std::array<double, 3> scale = {raster_.spacing_m, raster_.spacing_m, 0};
    const std::array<double, 6> tie = {0, 0, 0, 300000, 5300000, 0};
    const std::array<std::uint16_t, 20> keys = {1,    1, 0, 4,      // version, revision, number of keys
                                                1024, 0, 1, 1,      // projected
                                                1025, 0, 1, 1,      // pixel is area
                                                3072, 0, 1, 32633,  // WGS 84 / UTM 33N
                                                3076, 0, 1, 9001};  // metres
    TIFFSetField(tiff_, kPixelScale, 3, scale.data());
    TIFFSetField(tiff_, kTiePoint, 6, tie.data());
    TIFFSetField(tiff_, kGeoKeys, static_cast<int>(keys.size()), keys.data());
    if (raster_.voids) {
      const char* text = raster_.type == SampleType::kInt16    ? "-32768"
                         : raster_.type == SampleType::kUint16 ? "65535"
                                                               : "nan";
      TIFFSetField(tiff_, kNoData, text);
    }
  }

  void write_tiles(std::span<const std::byte> samples, std::int64_t rows, std::size_t row_bytes) {
    const std::size_t tile_row_bytes = static_cast<std::size_t>(kBandRows) * size_bytes(raster_.type);
    tile_.resize(tile_row_bytes * static_cast<std::size_t>(kBandRows));
    for (std::size_t at = 0; at < row_bytes; at += tile_row_bytes) {
      const std::size_t length = std::min(tile_row_bytes, row_bytes - at);
      std::fill(tile_.begin(), tile_.end(), std::byte{0});
      for (std::size_t r = 0; r < static_cast<std::size_t>(rows); ++r) {
        std::memcpy(tile_.data() + r * tile_row_bytes, samples.data() + r * row_bytes + at, length);
      }
      const auto column = static_cast<std::uint32_t>(at / size_bytes(raster_.type));
      if (TIFFWriteTile(tiff_, tile_.data(), column, static_cast<std::uint32_t>(row_), 0, 0) < 0) fail("cannot write");
    }
  }

  std::string path_;
  Raster raster_;
  TIFF* tiff_ = nullptr;
  std::int64_t row_ = 0;
  std::vector<std::byte> tile_;
};

}  // namespace

std::unique_ptr<Sink> make_tiff_sink(const std::string& path, const Raster& raster) {
  return std::make_unique<TiffSink>(path, raster);
}

}  // namespace isohf::terrain
