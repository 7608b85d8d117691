#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <iterator>

#include "formats/output_stream.h"
#include "formats/raster_encoder.h"
#include "formats/raster_sidecars.h"
#include "isohf/base/error.h"

namespace isohf {
namespace {

/// An ESRI ASCII grid: a line a row, every number in the fewest digits that give it back.
class AscEncoder final : public RasterEncoder {
 public:
  AscEncoder(const std::string& path, const RasterSpec& spec)
      : out_(path), type_(spec.sample_type), width_(static_cast<std::size_t>(spec.width)), void_(grid_void(spec)) {
    out_.write(ascii_grid_header(spec));
  }

  void write(std::span<const std::byte> rows, std::int64_t count) override {
    const std::size_t row_bytes = width_ * size_bytes(type_);
    for (std::int64_t row = 0; row < count; ++row) {
      line_.clear();
      append_row(rows.subspan(static_cast<std::size_t>(row) * row_bytes, row_bytes));
      line_.data()[line_.size() - 1] = '\n';  // in the last blank's place
      out_.write(std::string_view(line_.data(), line_.size()));
    }
  }
  void close() override { out_.close(); }

 private:
  void append_row(std::span<const std::byte> row) {
    switch (type_) {
      case SampleType::kUint8:
        return append<std::uint8_t>(row, [](std::uint8_t z) { return static_cast<int>(z); });
      case SampleType::kInt8:
        return append<std::int8_t>(row, [](std::int8_t z) { return static_cast<int>(z); });
      case SampleType::kUint16:
        return append<std::uint16_t>(row, [](std::uint16_t z) { return static_cast<int>(z); });
      case SampleType::kInt16:
        return append<std::int16_t>(row, [](std::int16_t z) { return static_cast<int>(z); });
      case SampleType::kUint32:
        return append<std::uint32_t>(row, [](std::uint32_t z) { return z; });
      case SampleType::kInt32:
        return append<std::int32_t>(row, [](std::int32_t z) { return z; });
      case SampleType::kFloat16:
        return append<std::uint16_t>(row, [this](std::uint16_t z) { return or_void(float_from_half(z)); });
      case SampleType::kFloat32:
        return append<float>(row, [this](float z) { return or_void(z); });
      case SampleType::kFloat64:
        return append<double>(row, [this](double z) { return or_void(z); });
    }
  }

  template <typename Float>
  Float or_void(Float z) const {
    return std::isfinite(z) ? z : static_cast<Float>(void_);
  }

  template <typename Sample, typename Number>
  void append(std::span<const std::byte> row, Number number) {
    for (std::size_t at = 0; at < row.size(); at += sizeof(Sample)) {
      Sample sample;
      std::memcpy(&sample, row.data() + at, sizeof(sample));
      fmt::format_to(std::back_inserter(line_), "{} ", number(sample));
    }
  }

  OutputStream out_;
  SampleType type_;
  std::size_t width_;
  double void_;
  fmt::memory_buffer line_;
};

}  // namespace

std::unique_ptr<RasterEncoder> encode_asc(const std::string& path, const RasterSpec& spec) {
  if (spec.channels != 1) {
    throw Error(ErrorCode::kUnsupported, fmt::format("an ASCII grid stores one channel, not {}", spec.channels));
  }
  return std::make_unique<AscEncoder>(path, spec);
}

}  // namespace isohf
