#include <fmt/core.h>
#include <fmt/format.h>

#include <cctype>
#include <cmath>
#include <optional>
#include <regex>
#include <string>
#include <vector>

#include "formats/georeference/sidecars.h"
#include "formats/grids/plain_samples.h"
#include "formats/io/bands.h"
#include "formats/open_options.h"
#include "formats/readers.h"
#include "formats/write/encoders.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/projection/crs/source_system.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

/// The South-West post of an SRTM tile, whole degrees.
struct HgtCorner {
  int longitude = 0;  ///< -180...180
  int latitude = 0;   ///< -90...90
};

/// What the name of an SRTM tile states: "N44E006.hgt", "s35e145.SRTMGL1.hgt", "srtm_n44e006_v3.hgt": the one place in it
/// that stands between other characters than letters and digits, or at its beginning. nullopt: none, or several.
std::optional<HgtCorner> hgt_corner_of(const std::string& path) {
  static const std::regex kPlace("([ns])([0-9]{2})([ew])([0-9]{3})");
  const std::string name = lower_case(path.substr(path.find_last_of('/') + 1));
  const auto is_in_word = [&](std::size_t at) {
    return at < name.size() && std::isalnum(static_cast<unsigned char>(name[at])) != 0;
  };
  std::optional<HgtCorner> found;
  for (std::sregex_iterator at(name.begin(), name.end(), kPlace); at != std::sregex_iterator(); ++at) {
    const auto begin = static_cast<std::size_t>(at->position());
    if (begin != 0 && (is_in_word(begin - 1) || is_in_word(begin + at->str().size()))) continue;
    const int latitude = std::stoi(at->str(2));
    const int longitude = std::stoi(at->str(4));
    if (latitude > 90 || longitude > 180) continue;
    const HgtCorner corner{at->str(3) == "w" ? -longitude : longitude, at->str(1) == "s" ? -latitude : latitude};
    if (begin == 0) return corner;
    if (found) return std::nullopt;
    found = corner;
  }
  return found;
}

constexpr std::int64_t kSampleBytes = 2;
constexpr double kHgtVoid = -32768.0;

struct Size {
  std::int64_t columns = 0;
  std::int64_t rows = 0;
};

std::optional<Size> size_of_tile(std::uint64_t bytes) {
  if (bytes % kSampleBytes != 0) return std::nullopt;
  const auto samples = static_cast<std::int64_t>(bytes / kSampleBytes);
  // Beyond 50 degrees of latitude some producers halve the columns.
  if (samples == std::int64_t{1801} * 3601) return Size{1801, 3601};
  const auto side = static_cast<std::int64_t>(std::llround(std::sqrt(static_cast<double>(samples))));
  if (side < 2 || side * side != samples) return std::nullopt;
  return Size{side, side};
}

class HgtSource final : public PlainSource {
 public:
  HgtSource(const std::string& path, const OpenOptions& options) : PlainSource(path, "SRTM HGT") {
    describe(options);
    read_sidecars(info_, 1);
    apply_open_options(info_, options);
  }

 private:
  void describe(const OpenOptions& options) {
    const std::uint64_t bytes = file_->size_bytes();
    const std::optional<Size> size = size_of_tile(bytes);
    if (!size) {
      throw Error(
          ErrorCode::kCorrupt,
          fmt::format("{}: the tile has {} bytes; an HGT tile has 2884802 (1201 x 1201), 25934402 (3601 x 3601), "
                      "12970802 (1801 x 3601) or another square of 2 byte samples",
                      info_.path, bytes));
    }
    (void)choose_band(info_, options, 1);
    info_.width = size->columns;
    info_.height = size->rows;
    info_.sample_type = SampleType::kInt16;
    info_.void_values = {kHgtVoid};
    info_.vertical_unit = "metre";
    info_.block_width = info_.width;
    info_.block_height = 1;
    layout_.row_bytes = static_cast<std::uint64_t>(info_.width * kSampleBytes);
    layout_.big_endian = true;
    Georeference& geo = info_.georeference;
    geo.registration = Registration::kPoint;
    geo.unit = HorizontalUnit::kDegree;
    geo.spacing_x = 1.0 / static_cast<double>(size->columns - 1);
    geo.spacing_y = 1.0 / static_cast<double>(size->rows - 1);
    geo.system = wgs84_system();
    geo.system.vertical_datum = "EGM96";
    if (const std::optional<HgtCorner> corner = hgt_corner_of(info_.path)) {
      geo.has_origin = true;
      geo.origin_x = corner->longitude;
      geo.origin_y = corner->latitude + 1;
    } else {
      info_.warnings.push_back(
          loss("the name does not state where the tile lies; its position is unknown: name it as in N44E006.hgt"));
    }
    if (size->rows != 1201 && size->rows != 3601) {
      info_.warnings.push_back(
          fmt::format("{} x {} is not the size of an SRTM tile (1201 or 3601 squared); it is read as "
                      "one degree",
                      size->columns, size->rows));
    }
  }
};

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

std::unique_ptr<HeightSource> open_hgt(const std::string& path, const OpenOptions& options) {
  return std::make_unique<HgtSource>(path, options);
}

}  // namespace

const Format kHgtFormat = {.name = "SRTM HGT", .extensions = {".hgt"}, .open = open_hgt, .goes_by_name = true};

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
  if (spec.void_value && *spec.void_value != kHgtVoid) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("HGT's void value is -32768, not {}", *spec.void_value));
  }
  check_place(out.path(), spec);
  return std::make_unique<HgtEncoder>(out);
}

}  // namespace isohf
