#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/georeference/files_beside.h"
#include "formats/grids/described_source.h"
#include "formats/io/bands.h"
#include "formats/io/text.h"
#include "formats/readers.h"
#include "isohf/error.h"
#include "isohf/projection/length_unit.h"
#include "isohf/projection/source_system.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

class EnviSource final : public DescribedSource {
 public:
  EnviSource(const std::string& data, const std::string& header, const OpenOptions& options)
      : DescribedSource(data, "ENVI", header, options) {
    const HeaderWords words = read_header_words(header);
    set_size(number(words, "samples"), number(words, "lines"));
    const std::int64_t bands = count(number(words, "bands", 1.0), "bands");
    std::vector<std::string> names;
    if (const auto found = words.find("band names"); found != words.end()) names = list_of(found->second);
    const std::int64_t band = choose_band(info_, options, bands, names);
    read_type(words);
    if (number(words, "file compression", 0.0) != 0.0) refuse(ErrorCode::kUnsupported, "its samples are compressed");
    layout_.offset_bytes = static_cast<std::uint64_t>(count(number(words, "header offset", 0.0), "header offset", 0.0));
    layout_.take_band(info_, order_in(words), band, bands, header);
    read_place(words);
    const int number_of_band = static_cast<int>(band) + 1;
    read_auxiliary_metadata(info_, number_of_band);  // which goes before the header, as for GDAL
    if (info_.z_scale == 1.0 && info_.z_offset == 0.0) read_scale(words, static_cast<std::size_t>(band));
    if (const auto value = words.find("data ignore value"); value != words.end() && info_.void_values.empty())
      set_void(number(value->second, "data ignore value"));
    finish(options, 0);
  }

 private:
  BandOrder order_in(const HeaderWords& words) const {
    const auto found = words.find("interleave");
    const std::string order = found == words.end() ? "bsq" : lower_case(found->second);
    if (order == "bil") return BandOrder::kLines;
    if (order == "bip") return BandOrder::kSamples;
    if (order != "bsq")
      refuse(ErrorCode::kCorrupt, fmt::format("interleave is \"{}\", must be bsq, bil or bip", printable(order)));
    return BandOrder::kBands;
  }

  /// A list of both for all bands.
  void read_scale(const HeaderWords& words, std::size_t band) {
    const auto of_band = [&](const char* key, double otherwise) {
      const auto found = words.find(key);
      const std::vector<std::string> list = found == words.end() ? std::vector<std::string>() : list_of(found->second);
      return band < list.size() ? number(list[band], key) : otherwise;
    };
    set_scale(of_band("data gain values", 1.0), of_band("data offset values", 0.0), "data gain values");
  }

  void read_type(const HeaderWords& words) {
    static constexpr std::array<std::pair<int, SampleType>, 9> kTypes = {{{1, SampleType::kUint8},
                                                                          {2, SampleType::kInt16},
                                                                          {3, SampleType::kInt32},
                                                                          {4, SampleType::kFloat32},
                                                                          {5, SampleType::kFloat64},
                                                                          {12, SampleType::kUint16},
                                                                          {13, SampleType::kUint32},
                                                                          {14, SampleType::kFloat64},
                                                                          {15, SampleType::kFloat64}}};
    const double code = number(words, "data type");
    const auto* const found = std::ranges::find(kTypes, code, &std::pair<int, SampleType>::first);
    if (found == kTypes.end()) {
      refuse(ErrorCode::kUnsupported, fmt::format("data type is {}; isohf reads 1 to 5 and 12 to 15", code));
    }
    info_.sample_type = found->second;
    if (code >= 14.0) layout_.stored_as = code == 14.0 ? StoredAs::kInt64 : StoredAs::kUint64;
    layout_.big_endian = number(words, "byte order", 0.0) != 0.0;
  }

  /// "map info = {UTM, 1, 1, 500000, 4000000, 30, 30, 33, North, WGS-84}": a pixel's corner, counted from 1, its place,
  /// the spacing; the system is in "coordinate system string".
  void read_place(const HeaderWords& words) {
    Georeference& place = info_.georeference;
    place.registration = Registration::kArea;
    const auto map = words.find("map info");
    if (map != words.end()) {
      const std::vector<std::string> parts = list_of(map->second);
      if (parts.size() < 7) refuse(ErrorCode::kCorrupt, "map info has fewer than seven parts");
      const auto part = [&](std::size_t i) { return number(parts[i], "map info"); };
      double rotation = 0.0;
      for (const std::string& each : parts) {
        if (lower_case(each).starts_with("rotation"))
          rotation = number(trimmed(each.substr(each.find('=') + 1)), "rotation");
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
      read_named_system(parts);
    }
    const auto system = words.find("coordinate system string");
    std::string wkt = system == words.end() ? std::string() : system->second;
    if (wkt.starts_with("{")) wkt = trimmed(wkt.substr(1, wkt.size() - (wkt.ends_with("}") ? 2 : 1)));
    if (wkt.empty()) {
      if (map != words.end()) tell_lost_system(list_of(map->second).front());
      return;
    }
    place.metres_per_unit = 1.0;  // the text's own unit counts
    read_system_text(wkt, header_, info_);
  }

  void tell_lost_system(const std::string& projection) {
    const std::string word = lower_case(projection);
    if (word.starts_with("arbitrary") || info_.georeference.system.epsg || !info_.georeference.system.wkt.empty())
      return;
    info_.warnings.push_back(
        loss(fmt::format("{}: map info names \"{}\" and a datum that isohf does not take from there, and there "
                         "is no coordinate system string: the reference system is left out; give `reference_system`",
                         header_, one_line(projection))));
  }

  void read_named_system(const std::vector<std::string>& parts) {
    Georeference& place = info_.georeference;
    const auto names_wgs84 = [](const std::string& part) { return part == "WGS-84" || part == "WGS84"; };
    const bool is_wgs84 = std::ranges::any_of(parts, names_wgs84);
    // Of the other datums the two that most maps of North America are on: their codes in degrees, and of zone 0 of UTM.
    const auto names = [&parts](const char* datum) {
      return std::ranges::any_of(parts, [&](const std::string& part) { return lower_case(part) == datum; });
    };
    const int degrees = names("north america 1927") ? 4267 : names("north america 1983") ? 4269 : 0;
    if (lower_case(parts[0]).starts_with("geographic")) {
      place.unit = HorizontalUnit::kDegree;
      if (is_wgs84) place.system = wgs84_system();
      if (degrees != 0) read_system_text(fmt::format("EPSG:{}", degrees), header_, info_);
    } else if (lower_case(parts[0]) == "utm" && parts.size() > 8) {
      place.unit = HorizontalUnit::kMetre;
      const double zone = number(parts[7], "map info");
      if (is_wgs84 && zone >= 1.0 && zone <= 60.0) {
        read_system_text(
            fmt::format("EPSG:{}", (lower_case(parts[8]) == "south" ? 32700 : 32600) + static_cast<int>(zone)), header_,
            info_);
      } else if (degrees != 0 && zone >= 1.0 && zone <= 22.0 && lower_case(parts[8]) == "north") {
        read_system_text(fmt::format("EPSG:{}", (degrees == 4267 ? 26700 : 26900) + static_cast<int>(zone)), header_,
                         info_);
      }
    }
    read_unit(parts);
  }

  /// "units=Feet", which are US survey feet: those of state planes.
  void read_unit(const std::vector<std::string>& parts) {
    Georeference& place = info_.georeference;
    for (const std::string& part : parts) {
      const std::size_t equals = part.find('=');
      if (equals == std::string::npos || trimmed(lower_case(part.substr(0, equals))) != "units") continue;
      const std::string unit = trimmed(lower_case(part.substr(equals + 1)));
      const auto length = linear_unit(unit == "feet" ? "us survey foot" : unit);
      if (length) {
        place.unit = HorizontalUnit::kMetre;
        place.metres_per_unit = length->metres;
      } else if (unit == "degrees") {
        place.unit = HorizontalUnit::kDegree;
      } else if (unit == "minutes" || unit == "seconds" || unit == "radians") {
        refuse(ErrorCode::kUnsupported, "its coordinates are in " + unit + "; isohf reads degrees and lengths");
      }
    }
  }
};

bool begins_with(const std::string& path, std::string_view wanted) {
  std::string head(wanted.size(), '\0');
  return is_file(path) && RawFile(path).read_some(0, std::as_writable_bytes(std::span(head))) == head.size() &&
         head == wanted;
}

constexpr std::string_view kEnviData[] = {"", ".dat", ".img", ".bin", ".raw", ".bsq", ".bil", ".bip", ".flt", ".envi"};

/// x.hdr, or x.dat.hdr where there is none: what else x.hdr says is said of the same samples.
std::string envi_header_of(const std::string& path) {
  // Another file may have the name of the samples but for its extension.
  const std::string own = lower_case(std::filesystem::path(path).extension().string());
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

}  // namespace

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

}  // namespace isohf
