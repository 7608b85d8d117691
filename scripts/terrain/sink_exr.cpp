#include <ImfChannelList.h>
#include <ImfFloatAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <ImfTiledOutputFile.h>

#include <optional>

#include "isohf/error.h"
#include "sink.h"

namespace isohf::terrain {
namespace {

/// One channel Y, in metres. Tiled files are written a row of tiles at a time, as the others are by scan lines.
class ExrSink final : public Sink {
 public:
  ExrSink(const std::string& path, const Raster& raster)
      : path_(path), raster_(raster), type_(raster.type == SampleType::kFloat16 ? Imf::HALF : Imf::FLOAT) {
    Imf::Header header(static_cast<int>(raster.columns), static_cast<int>(raster.rows));
    header.channels().insert("Y", Imf::Channel(type_));
    header.compression() = raster.deflate ? Imf::ZIP_COMPRESSION : Imf::NO_COMPRESSION;
    header.insert("spacing_m", Imf::FloatAttribute(static_cast<float>(raster.spacing_m)));
    try {
      if (raster.tiled) {
        header.setTileDescription(Imf::TileDescription(kBandRows, kBandRows, Imf::ONE_LEVEL));
        tiles_.emplace(path.c_str(), header);
      } else {
        lines_.emplace(path.c_str(), header);
      }
    } catch (const std::exception& e) {
      throw Error(ErrorCode::kIo, path + ": " + e.what());
    }
  }

  void write_band(std::span<std::byte> samples) override {
    const std::size_t sample_bytes = size_bytes(raster_.type);
    const std::size_t row_bytes = static_cast<std::size_t>(raster_.columns) * sample_bytes;
    const int rows = static_cast<int>(samples.size() / row_bytes);
    Imf::FrameBuffer buffer;
    // OpenEXR addresses samples by absolute row: the slice begins where row 0 would lie.
    char* origin = reinterpret_cast<char*>(samples.data()) - static_cast<std::ptrdiff_t>(row_bytes) * row_;
    buffer.insert("Y", Imf::Slice(type_, origin, sample_bytes, row_bytes));
    try {
      if (tiles_) {
        tiles_->setFrameBuffer(buffer);
        const int tile_row = static_cast<int>(row_ / kBandRows);
        tiles_->writeTiles(0, tiles_->numXTiles() - 1, tile_row, tile_row);
      } else {
        lines_->setFrameBuffer(buffer);
        lines_->writePixels(rows);
      }
    } catch (const std::exception& e) {
      throw Error(ErrorCode::kIo, path_ + ": " + e.what());
    }
    row_ += rows;
  }

  void finish() override {
    tiles_.reset();
    lines_.reset();
  }

 private:
  std::string path_;
  Raster raster_;
  Imf::PixelType type_;
  std::optional<Imf::TiledOutputFile> tiles_;
  std::optional<Imf::OutputFile> lines_;
  int row_ = 0;
};

}  // namespace

std::unique_ptr<Sink> make_exr_sink(const std::string& path, const Raster& raster) {
  return std::make_unique<ExrSink>(path, raster);
}

}  // namespace isohf::terrain
