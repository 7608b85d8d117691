#include "formats/text_grids/usgs_dem_header.h"

#include <fmt/format.h>

#include <array>
#include <cstdlib>
#include <optional>
#include <utility>

#include "formats/text_grids/fortran_fields.h"
#include "formats/text_grids/text_tokens.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::size_t kLeastBytes = 864;
constexpr std::size_t kRecordBytes = 1024;

}  // namespace

UsgsDemHeader::UsgsDemHeader(std::string path, std::string text) : path_(std::move(path)), text_(std::move(text)) {
  if (text_.size() < kLeastBytes) refuse(fmt::format("has {} bytes, must have {}", text_.size(), kLeastBytes));
  text_.resize(kRecordBytes, ' ');
}

void UsgsDemHeader::refuse(const std::string& what) const {
  throw Error(ErrorCode::kCorrupt, fmt::format("{}: the type A record: {}", path_, what));
}

std::string_view UsgsDemHeader::field(std::size_t first, std::size_t size) const {
  return std::string_view(text_).substr(first - 1, size);  // the standard counts from 1
}

std::int64_t UsgsDemHeader::whole(std::size_t first, std::size_t size, const char* name, std::int64_t lowest,
                                  std::int64_t highest) const {
  const std::optional<std::int64_t> value = whole_number(field(first, size));
  if (!value || *value < lowest || *value > highest) {
    refuse(fmt::format("the {} at byte {} is \"{}\", must be a whole number from {} to {}", name, first - 1,
                       printable(trimmed(field(first, size))), lowest, highest));
  }
  return *value;
}

void UsgsDemHeader::read_grid(SourceInfo& info) {
  if (whole(151, 6, "elevation pattern", 1, 4) != 1) {
    throw Error(ErrorCode::kUnsupported, path_ + ": the elevation pattern is not regular (1), which is read");
  }
  unit_ = static_cast<Unit>(whole(529, 6, "unit of the ground coordinates", 0, 3));
  if (unit_ == Unit::kRadian)
    throw Error(ErrorCode::kUnsupported,
                path_ + ": the ground coordinates are radians; feet, metres and seconds are read");
  if (const auto angle = fortran_number(field(787, 24)); angle && *angle != 0.0) {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("{}: the grid is turned by {} radians; only grids along the axes are read", path_, *angle));
  }
  const std::array<const char*, 3> names = {"x", "y", "vertical"};
  std::array<double, 3> resolution = {};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto value = fortran_number(field(817 + 12 * i, 12));
    if (!value || !(*value > 0.0)) {
      refuse(fmt::format("the {} resolution at byte {} is not a positive number", names[i], 816 + 12 * i));
    }
    resolution[i] = *value;
  }
  spacing_x_ = resolution[0];
  spacing_y_ = resolution[1];
  info.z_scale = resolution[2];
  info.width = whole(859, 6, "number of profiles", 1, kMostPosts);
  const std::int64_t unit = whole(535, 6, "unit of the elevations", 1, 2);
  info.vertical_unit = unit == 1 ? "foot" : "metre";
  info.metres_per_vertical_unit = unit == 1 ? 0.3048 : 1.0;
  // A range that the header does not say is taken for one that fits.
  const double low = fortran_number(field(739, 24)).value_or(0.0) / info.z_scale;
  const double high = fortran_number(field(763, 24)).value_or(0.0) / info.z_scale;
  const bool small = low >= -32767.0 && high <= 32767.0;
  info.sample_type = small ? SampleType::kInt16 : SampleType::kInt32;
  info.void_values = {static_cast<double>(kVoid)};
}

void UsgsDemHeader::read_system(SourceInfo& info) const {
  struct Datum {
    const char* name;
    int geographic;
    int utm_north;
    int utm_south;
    double semi_major_axis_m;
    double inverse_flattening;
  };
  constexpr std::array<Datum, 4> kDatums = {{{"NAD27", 4267, 26700, 0, 6378206.4, 294.9786982},
                                             {"WGS 72", 4322, 32200, 32300, 6378135.0, 298.26},
                                             {"WGS 84", 4326, 32600, 32700, 6378137.0, 298.257223563},
                                             {"NAD83", 4269, 26900, 0, 6378137.0, 298.257222101}}};
  ReferenceSystem& system = info.georeference.system;
  system.body = "Earth";
  const std::int64_t kind = whole(157, 6, "ground reference system", -9999, 99);
  const auto datum = whole_number(field(891, 2));
  const Datum* known = datum && *datum >= 1 && *datum <= 4 ? &kDatums[static_cast<std::size_t>(*datum - 1)] : nullptr;
  if (known != nullptr) {
    system.semi_major_axis_m = known->semi_major_axis_m;
    system.inverse_flattening = known->inverse_flattening;
  } else {
    info.warnings.push_back(loss("the header names no horizontal datum that isohf knows (old files mean NAD27)"));
  }
  const std::string name = known != nullptr ? known->name : "unknown datum";
  system.name = name;
  if (kind == 0) {
    if (known != nullptr) system.epsg = known->geographic;
  } else if (kind == 1) {
    const std::int64_t zone = whole(163, 6, "UTM zone", -60, 60);
    system.name = fmt::format("{} / UTM zone {}{}", name, std::abs(zone), zone < 0 ? 'S' : 'N');
    const int base = known == nullptr ? 0 : zone < 0 ? known->utm_south : known->utm_north;
    if (base != 0 && zone != 0) system.epsg = base + static_cast<int>(std::abs(zone));
  } else {
    system.name =
        fmt::format("{} / {} zone {}", name, kind == 2 ? "State Plane" : "unknown projection", trimmed(field(163, 6)));
  }
  const std::int64_t vertical = whole_number(field(889, 2)).value_or(0);
  system.vertical_datum = vertical == 1 ? "mean sea level" : vertical == 2 ? "NGVD29" : vertical == 3 ? "NAVD88" : "";
  if (vertical == 3 && info.vertical_unit == "metre") system.vertical_epsg = 5703;
}

}  // namespace isohf
