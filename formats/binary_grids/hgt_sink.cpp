#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <vector>

#include "formats/binary_grids/hgt_name.h"
#include "formats/files/raw_file.h"
#include "formats/write/raster_encoder.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr double kVoid = -32768.0;

/// Big-endian int16, nothing else.
class HgtEncoder final : public RasterEncoder {
 public:
  explicit HgtEncoder(OutputFile& out) : out_(out) {}

  void write(std::span<const std::byte> rows, std::int64_t /*count*/) override {
    swapped_.assign(rows.begin(), rows.end());
    swap_byte_order(swapped_, sizeof(std::int16_t));
    out_.append(swapped_);
  }
  void close() override {}

 private:
  OutputFile& out_;
  std::vector<std::byte> swapped_;
};

bool is_tile_size(std::int64_t width, std::int64_t height) {
  return (height == 3601 && (width == 3601 || width == 1801)) || (height == 1201 && width == 1201);
}

/// Nothing in the file says where it lies but its name, which readers believe: it must be true.
void check_place(const std::string& path, const RasterSpec& spec) {
  const std::optional<HgtCorner> named = hgt_corner_of(path);
  if (!named || !spec.georeference || !spec.georeference->has_origin) return;
  const Georeference& place = *spec.georeference;
  const double west_off = std::remainder(place.origin_x - named->longitude, 360.0);
  const double north_off = place.origin_y - (named->latitude + 1);
  const double column = 1.0 / static_cast<double>(spec.width - 1);
  const double row = 1.0 / static_cast<double>(spec.height - 1);
  // A thousandth of a sample, anywhere in the tile.
  const bool is_there = place.unit == HorizontalUnit::kDegree && std::abs(west_off) < column / 1000.0 &&
                        std::abs(north_off) < row / 1000.0 &&
                        std::abs(place.spacing_x - column) < column * column / 1000.0 &&
                        std::abs(place.spacing_y - row) < row * row / 1000.0;
  if (is_there) return;
  throw Error(
      ErrorCode::kInvalidArgument,
      fmt::format("the name of an HGT tile says where it lies, here {} to {} East and {} to {} North in degrees; "
                  "these samples lie at {} to {} and {} to {}{}; give the file the name of its place",
                  named->longitude, named->longitude + 1, named->latitude, named->latitude + 1, place.origin_x,
                  place.origin_x + place.spacing_x * static_cast<double>(spec.width - 1),
                  place.origin_y - place.spacing_y * static_cast<double>(spec.height - 1), place.origin_y,
                  place.unit == HorizontalUnit::kDegree ? "" : ", not in degrees"));
}

}  // namespace

std::unique_ptr<RasterEncoder> encode_hgt(OutputFile& out, const RasterSpec& spec) {
  if (spec.sample_type != SampleType::kInt16 || spec.channels != 1) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("HGT stores one channel of int16, not {} of {}", spec.channels,
                                                         to_string(spec.sample_type)));
  }
  if (!is_tile_size(spec.width, spec.height)) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("an HGT tile has 1201 x 1201, 3601 x 3601 or 1801 x 3601 samples, not {} x {}", spec.width,
                            spec.height));
  }
  if (spec.void_value && *spec.void_value != kVoid) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("HGT's void value is -32768, not {}", *spec.void_value));
  }
  check_place(out.path(), spec);
  return std::make_unique<HgtEncoder>(out);
}

}  // namespace isohf
