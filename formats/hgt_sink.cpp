#include <fmt/format.h>

#include <vector>

#include "formats/output_stream.h"
#include "formats/raster_encoder.h"
#include "formats/raw_file.h"
#include "isohf/base/error.h"

namespace isohf {
namespace {

constexpr double kVoid = -32768.0;

/// Big-endian int16, nothing else.
class HgtEncoder final : public RasterEncoder {
 public:
  explicit HgtEncoder(const std::string& path) : out_(path) {}

  void write(std::span<const std::byte> rows, std::int64_t /*count*/) override {
    swapped_.assign(rows.begin(), rows.end());
    swap_byte_order(swapped_, sizeof(std::int16_t));
    out_.write(swapped_);
  }
  void close() override { out_.close(); }

 private:
  OutputStream out_;
  std::vector<std::byte> swapped_;
};

bool is_tile_size(std::int64_t width, std::int64_t height) {
  return (height == 3601 && (width == 3601 || width == 1801)) || (height == 1201 && width == 1201);
}

}  // namespace

std::unique_ptr<RasterEncoder> encode_hgt(const std::string& path, const RasterSpec& spec) {
  if (spec.sample_type != SampleType::kInt16 || spec.channels != 1) {
    throw Error(ErrorCode::kUnsupported, fmt::format("HGT stores one channel of int16, not {} of {}", spec.channels,
                                                     to_string(spec.sample_type)));
  }
  if (!is_tile_size(spec.width, spec.height)) {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("an HGT tile has 1201 x 1201, 3601 x 3601 or 1801 x 3601 samples, not {} x {}", spec.width,
                            spec.height));
  }
  if (spec.void_value && *spec.void_value != kVoid) {
    throw Error(ErrorCode::kUnsupported, fmt::format("HGT's void value is -32768, not {}", *spec.void_value));
  }
  return std::make_unique<HgtEncoder>(path);
}

}  // namespace isohf
