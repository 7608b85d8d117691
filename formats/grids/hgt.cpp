#include <fmt/core.h>
#include <fmt/format.h>

#include <cctype>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/georeference/files_beside.h"
#include "formats/grids/plain_samples.h"
#include "formats/io/bands.h"
#include "formats/io/text.h"
#include "formats/open_options.h"
#include "formats/readers.h"
#include "formats/write/encoders.h"
#include "isohf/base/bytes.h"
#include "isohf/error.h"
#include "isohf/projection/source_system.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

/// The South-West post of an SRTM tile, whole degrees.
struct HgtCorner {
  int longitude = 0;  ///< -180...180
  int latitude = 0;   ///< -90...90
};

/// The corner in a word of exactly seven letters: hemisphere and two digits, hemisphere and three digits, in any case.
std::optional<HgtCorner> corner_in(std::string_view word) {
  const auto is_one_of = [&](std::size_t at, std::string_view letters) {
    return letters.find(static_cast<char>(std::tolower(static_cast<unsigned char>(word[at])))) != letters.npos;
  };
  const auto digits = [&](std::size_t begin, std::size_t count) {
    int value = 0;
    for (std::size_t i = begin; i < begin + count; ++i) {
      if (std::isdigit(static_cast<unsigned char>(word[i])) == 0) return -1;
      value = value * 10 + (word[i] - '0');
    }
    return value;
  };
  if (!is_one_of(0, "ns") || !is_one_of(3, "ew")) return std::nullopt;
  const int latitude = digits(1, 2);
  const int longitude = digits(4, 3);
  if (latitude < 0 || latitude > 90 || longitude < 0 || longitude > 180) return std::nullopt;
  return HgtCorner{is_one_of(3, "w") ? -longitude : longitude, is_one_of(0, "s") ? -latitude : latitude};
}

/// What the name of an SRTM tile states: "N44E006.hgt", "s35e145.SRTMGL1.hgt.zip", "srtm_n44e006_v3.hgt": the one
/// place in it that stands between other characters than letters and digits, or at its beginning. nullopt: none, or
/// several. Directories may precede the name.
std::optional<HgtCorner> hgt_corner_of(const std::string& path) {
  const std::string name = path.substr(path.find_last_of('/') + 1);
  constexpr std::size_t kLength = 7;
  const auto is_inside_word = [&](std::size_t at) {
    return at < name.size() && std::isalnum(static_cast<unsigned char>(name[at])) != 0;
  };
  if (name.size() < kLength) return std::nullopt;
  if (const auto first = corner_in(std::string_view(name).substr(0, kLength))) return first;
  std::optional<HgtCorner> found;
  for (std::size_t at = 1; at + kLength <= name.size(); ++at) {
    if (is_inside_word(at - 1) || is_inside_word(at + kLength)) continue;
    const auto corner = corner_in(std::string_view(name).substr(at, kLength));
    if (corner && found) return std::nullopt;
    if (corner) found = corner;
  }
  return found;
}

constexpr std::int64_t kSampleBytes = 2;

std::string file_name(const std::string& path) {
  const std::size_t slash = path.find_last_of('/');
  return slash == std::string::npos ? path : path.substr(slash + 1);
}

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
    std::string name = path;
    if (lower_case(path).ends_with(".zip")) {
      name = open_member(options.unpacked_bytes);
    } else {
      file_.emplace(path, options.unpacked_bytes);
    }
    describe(name, file_->size_bytes(), options);
    read_auxiliary_metadata(info_, 1);
    apply_open_options(info_, options);
  }

 private:
  /// Opens the tile of a zip archive; returns the name that says where it lies.
  std::string open_member(std::uint64_t unpacked_bytes) {
    std::vector<ZipEntry> tiles;
    for (ZipEntry& member : zipped_files(RawFile(info_.path))) {
      if (lower_case(member.name).ends_with(".hgt")) tiles.push_back(std::move(member));
    }
    if (tiles.size() != 1) {
      throw Error(
          ErrorCode::kUnsupported,
          fmt::format("{}: {} .hgt files are in the archive, must be 1; unpack it, a folder of them is one input",
                      info_.path, tiles.size()));
    }
    file_.emplace(info_.path, tiles.front(), unpacked_bytes);
    const std::optional<HgtCorner> inside = hgt_corner_of(tiles.front().name);
    const std::optional<HgtCorner> outside = hgt_corner_of(info_.path);
    if (inside && outside && (inside->latitude != outside->latitude || inside->longitude != outside->longitude)) {
      info_.warnings.push_back(fmt::format("the archive is called {} and holds {}; the latter says where the tile lies",
                                           file_name(info_.path), file_name(tiles.front().name)));
    }
    return inside ? tiles.front().name : info_.path;
  }

  void describe(const std::string& name, std::uint64_t bytes, const OpenOptions& options) {
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
    info_.void_values = {-32768.0};
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
    if (const std::optional<HgtCorner> corner = hgt_corner_of(name)) {
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

constexpr double kHgtVoid = -32768.0;

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

bool is_zip_of_hgt(const std::string& path) {
  if (!lower_case(path).ends_with(".zip")) return false;
  try {
    const std::vector<ZipEntry> members = zipped_files(RawFile(path));
    return std::ranges::count_if(members,
                                 [](const ZipEntry& member) { return lower_case(member.name).ends_with(".hgt"); }) == 1;
  } catch (const Error&) {
    return false;  // is something else, or too damaged to say
  }
}

std::unique_ptr<HeightSource> open_hgt(const std::string& path, const OpenOptions& options) {
  return std::make_unique<HgtSource>(path, options);
}

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
