#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "formats/georeference/sidecars.h"
#include "formats/grids/described_source.h"
#include "formats/io/bands.h"
#include "formats/io/raw_file.h"
#include "formats/readers.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/projection/crs/source_system.h"
#include "isohf/projection/length_unit.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

/// The code of the system that "map info" names, where it is on one of the datums that most maps are on: degrees, and
/// zones of UTM; empty for any other.
std::string system_of(const std::vector<std::string>& parts) {
  struct Datum {
    std::array<std::string_view, 2> names;
    int degrees;
    int north;  ///< of zone 0 of UTM
    int south;
    int zones;
  };
  static constexpr std::array<Datum, 3> kDatums = {{{{"wgs-84", "wgs84"}, 4326, 32600, 32700, 60},
                                                    {{"north america 1927", ""}, 4267, 26700, 0, 22},
                                                    {{"north america 1983", ""}, 4269, 26900, 0, 23}}};
  const std::string kind = lower_case(parts[0]);
  for (std::size_t i = 7; i < parts.size(); ++i) {
    const std::string name = lower_case(parts[i]);
    for (const Datum& datum : kDatums) {
      if (name.empty() || std::ranges::find(datum.names, name) == datum.names.end()) continue;
      if (kind.starts_with("geographic")) return fmt::format("EPSG:{}", datum.degrees);
      if (kind != "utm" || i < 9) return {};
      const int zone = std::atoi(parts[7].c_str());
      const int first = lower_case(parts[8]) == "south" ? datum.south : datum.north;
      return first > 0 && zone >= 1 && zone <= datum.zones ? fmt::format("EPSG:{}", first + zone) : std::string();
    }
  }
  return {};
}

class EnviSource final : public DescribedSource {
 public:
  EnviSource(const std::string& data, const std::string& header, const OpenOptions& options)
      : DescribedSource(data, "ENVI", header), words_(read_header_words(header)) {
    set_size(number(words_, "samples"), number(words_, "lines"));
    const std::int64_t bands = count(number(words_, "bands", 1.0), "bands");
    const std::int64_t band = choose_band(info_, options, bands, list_of(text("band names")));
    read_type();
    if (number(words_, "file compression", 0.0) != 0.0) refuse(ErrorCode::kUnsupported, "its samples are compressed");
    layout_.offset_bytes =
        static_cast<std::uint64_t>(count(number(words_, "header offset", 0.0), "header offset", 0.0));
    layout_.take_band(info_, order(), band, bands, header);
    read_place();
    read_sidecars(info_, static_cast<int>(band) + 1);  // which goes before the header, as for GDAL
    if (info_.z_scale == 1.0 && info_.z_offset == 0.0) {
      const auto of_band = [&](const char* key, double otherwise) {
        const std::vector<std::string> list = list_of(text(key));
        const auto at = static_cast<std::size_t>(band);
        return at < list.size() && !list[at].empty() ? number(list[at], key) : otherwise;
      };
      set_scale(of_band("data gain values", 1.0), of_band("data offset values", 0.0), "data gain values");
    }
    if (const std::string value = text("data ignore value"); !value.empty() && info_.void_values.empty())
      set_void(number(value, "data ignore value"));
    finish(options, 0);
  }

 private:
  /// Empty where the header has no such word.
  [[nodiscard]] std::string text(const char* key) const {
    const auto found = words_.find(key);
    return found == words_.end() ? std::string() : found->second;
  }

  [[nodiscard]] BandOrder order() const {
    const std::string name = lower_case(text("interleave"));
    if (name == "bil") return BandOrder::kLines;
    if (name == "bip") return BandOrder::kSamples;
    if (name != "bsq" && !name.empty())
      refuse(ErrorCode::kCorrupt, fmt::format("interleave is \"{}\", must be bsq, bil or bip", printable(name)));
    return BandOrder::kBands;
  }

  void read_type() {
    // By the codes of ENVI's data types.
    static constexpr std::array<const char*, 16> kTypes = {
        "", "uint8", "int16", "int32", "float32", "float64", "",        "",
        "", "",      "",      "",      "uint16",  "uint32",  "float64", "float64"};
    const double code = number(words_, "data type");
    const char* const type = code >= 0.0 && code < 16.0 ? kTypes[static_cast<std::size_t>(code)] : "";
    if (*type == '\0' || code != std::floor(code))
      refuse(ErrorCode::kUnsupported, fmt::format("data type is {}; isohf reads 1 to 5 and 12 to 15", code));
    info_.sample_type = sample_type_from_string(type);
    if (code >= 14.0) layout_.stored_as = code == 14.0 ? StoredAs::kInt64 : StoredAs::kUint64;
    layout_.big_endian = number(words_, "byte order", 0.0) != 0.0;
  }

  /// "map info = {UTM, 1, 1, 500000, 4000000, 30, 30, 33, North, WGS-84}": a pixel's corner, counted from 1, its place,
  /// the spacing; the system is in "coordinate system string" as well, which goes before.
  void read_place() {
    const std::vector<std::string> parts = list_of(text("map info"));
    const bool has_map = words_.contains("map info");
    std::string system;
    info_.georeference.registration = Registration::kArea;
    if (has_map) {
      if (parts.size() < 7) refuse(ErrorCode::kCorrupt, "map info has fewer than seven parts");
      place_by_map(parts);
      system = system_of(parts);
      if (!system.empty()) take_system(system, info_);
    }
    std::string wkt = text("coordinate system string");
    if (wkt.starts_with("{")) wkt = trimmed(wkt.substr(1, wkt.size() - (wkt.ends_with("}") ? 2 : 1)));
    if (!wkt.empty()) return read_system_text(wkt, header_, info_);
    if (!has_map || !system.empty() || lower_case(parts[0]).starts_with("arbitrary")) return;
    info_.warnings.push_back(
        loss(fmt::format("{}: map info names \"{}\" and a datum that isohf does not take from there, and there is no "
                         "coordinate system string: the reference system is left out; give `reference_system`",
                         header_, one_line(parts[0]))));
  }

  void place_by_map(const std::vector<std::string>& parts) {
    Georeference& place = info_.georeference;
    const auto part = [&](std::size_t i) { return number(parts[i], "map info"); };
    double rotation = 0.0;
    if (lower_case(parts[0]) == "utm") place.unit = HorizontalUnit::kMetre;
    if (lower_case(parts[0]).starts_with("geographic")) place.unit = HorizontalUnit::kDegree;
    for (const std::string& each : parts) {
      const std::size_t equals = std::min(each.find('='), each.size());
      const std::string key = trimmed(lower_case(each.substr(0, equals)));
      const std::string value = trimmed(lower_case(each.substr(std::min(equals + 1, each.size()))));
      if (key == "rotation") rotation = number(value, "rotation");
      if (key == "units") take_unit(value);
    }
    // GDAL writes 180 where rows run from South to North, columns as ever, and counts a pixel's place as if they did not.
    constexpr double kSouthUp = 180.0;
    if (rotation != 0.0 && (rotation != kSouthUp || part(6) < 0.0))
      refuse(ErrorCode::kUnsupported, "the map is rotated (gdalwarp turns it)");
    layout_.from_south = rotation == kSouthUp || part(6) < 0.0;
    const double dx = part(5);
    const double dy = std::abs(part(6));
    const double first = part(4) - (1.0 - part(2)) * part(6);
    const double height = layout_.from_south ? static_cast<double>(info_.height) * dy : 0.0;
    place_by_corner(part(3) + (1.0 - part(1)) * dx, first + height, dx, dy);
  }

  /// "units=Feet", which are US survey feet: those of state planes.
  void take_unit(const std::string& unit) {
    Georeference& place = info_.georeference;
    if (const auto length = linear_unit(unit == "feet" ? "us survey foot" : unit)) {
      place.unit = HorizontalUnit::kMetre;
      place.metres_per_unit = length->metres;
    } else if (unit == "degrees") {
      place.unit = HorizontalUnit::kDegree;
    } else if (unit == "minutes" || unit == "seconds" || unit == "radians") {
      refuse(ErrorCode::kUnsupported, "its coordinates are in " + unit + "; isohf reads degrees and lengths");
    }
  }

  HeaderWords words_;
};

bool begins_with(const std::string& path, std::string_view wanted) {
  return is_file(path) && first_bytes(RawFile(path), wanted.size()) == wanted;
}

constexpr std::string_view kEnviData[] = {"", ".dat", ".img", ".bin", ".raw", ".bsq", ".bil", ".bip", ".flt", ".envi"};

/// x.hdr, or x.dat.hdr where there is none: what else x.hdr says is said of the same samples.
std::string envi_header_of(const std::string& path) {
  // Another file may have the name of the samples but for its extension.
  const std::string own = extension_of(path);
  const bool is_data = std::ranges::find(kEnviData, own) != std::end(kEnviData);
  for (const bool is_replaced : {true, false}) {
    for (const char* extension : {".hdr", ".HDR"}) {
      const std::string header =
          is_replaced ? std::filesystem::path(path).replace_extension(extension).string() : path + extension;
      if (header == path || (is_replaced && !is_data) || !is_file(header)) continue;
      return begins_with(header, "ENVI") ? header : std::string();
    }
  }
  return {};
}

bool looks_like_envi(std::span<const std::byte> head) {
  return text_of(head).starts_with("ENVI");
}

bool has_envi_header(const std::string& path) {
  return !envi_header_of(path).empty();
}

std::unique_ptr<HeightSource> open_envi(const std::string& path, const OpenOptions& options) {
  if (!begins_with(path, "ENVI")) {
    const std::string header = envi_header_of(path);
    if (header.empty()) throw Error(ErrorCode::kCorrupt, path + ": has no ENVI header beside it");
    return std::make_unique<EnviSource>(path, header, options);
  }
  // The header was named.
  for (const std::string_view extension : kEnviData) {
    const std::string data = std::filesystem::path(path).replace_extension(extension).string();
    if (data != path && is_file(data)) return std::make_unique<EnviSource>(data, path, options);
  }
  throw Error(ErrorCode::kIo,
              path + ": is an ENVI header whose samples are not beside it, under its name without .hdr");
}

}  // namespace

const Format kEnviFormat = {.name = "ENVI",
                            .extensions = {".hdr"},
                            .note = "takes `channel`",
                            .open = open_envi,
                            .recognises = looks_like_envi,
                            .described = has_envi_header};

}  // namespace isohf
