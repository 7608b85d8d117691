#include "formats/georeference/auxiliary_metadata.h"

#include <expat.h>
#include <fmt/core.h>

#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/georeference/place_beside.h"
#include "formats/georeference/wkt.h"
#include "formats/tiff/gdal_tags.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::size_t kChunk = 65536;
/// No reference system is longer; histograms and tables are, and are not kept.
constexpr std::size_t kLongestText = 65536;

/// The texts of interest, by their place in the document: "SRS", "GeoTransform", "AREA_OR_POINT", and "1/NoDataValue"
/// and so on for a band.
using Texts = std::map<std::string, std::string, std::less<>>;

/// What expat calls while it reads.
class Document {
 public:
  void begin(std::string_view element, const XML_Char** attributes) {
    const auto attribute = [&](std::string_view name) {
      for (const XML_Char** at = attributes; *at != nullptr; at += 2) {
        if (name == at[0]) return std::string(at[1]);
      }
      return std::string();
    };
    ++depth_;
    text_.clear();
    key_.clear();
    if (depth_ == 2) {
      in_metadata_ = element == "Metadata" && *attributes == nullptr;  // those of a domain are other things
      band_ = element == "PAMRasterBand" ? attribute("band") : std::string();
      if (element == "SRS" || element == "GeoTransform") key_ = element;
    } else if (depth_ == 3 && in_metadata_ && element == "MDI") {
      if (attribute("key") == "AREA_OR_POINT") key_ = "AREA_OR_POINT";
    } else if (depth_ == 3 && !band_.empty()) {
      key_ = fmt::format("{}/{}", band_, element);
    }
  }
  void add(std::string_view text) {
    if (!key_.empty() && text_.size() + text.size() <= kLongestText) text_ += text;
  }
  void end() {
    if (!key_.empty()) texts_.emplace(key_, text_);
    key_.clear();
    --depth_;
  }
  [[nodiscard]] const Texts& texts() const { return texts_; }

 private:
  int depth_ = 0;
  bool in_metadata_ = false;
  std::string band_;
  std::string key_;  ///< of the element that is open and of interest
  std::string text_;
  Texts texts_;
};

Texts read(const std::string& path) {
  Document document;
  const std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> parser(XML_ParserCreate(nullptr), &XML_ParserFree);
  XML_SetUserData(parser.get(), &document);
  XML_SetElementHandler(
      parser.get(),
      [](void* to, const XML_Char* element, const XML_Char** attributes) {
        static_cast<Document*>(to)->begin(element, attributes);
      },
      [](void* to, const XML_Char*) { static_cast<Document*>(to)->end(); });
  XML_SetCharacterDataHandler(parser.get(), [](void* to, const XML_Char* text, int length) {
    static_cast<Document*>(to)->add({text, static_cast<std::size_t>(length)});
  });
  std::ifstream in(path, std::ios::binary);
  std::vector<char> chunk(kChunk);
  bool at_end = false;
  while (!at_end) {
    in.read(chunk.data(), static_cast<std::streamsize>(chunk.size()));
    at_end = !in;
    if (XML_Parse(parser.get(), chunk.data(), static_cast<int>(in.gcount()), at_end ? 1 : 0) == XML_STATUS_ERROR) {
      throw Error(ErrorCode::kCorrupt,
                  fmt::format("{}: line {}: {}; remove the file or have GDAL write it anew", path,
                              XML_GetCurrentLineNumber(parser.get()), XML_ErrorString(XML_GetErrorCode(parser.get()))));
    }
  }
  return document.texts();
}

/// "x0, dx, turn, y0, turn, dy": where the outer corner of the first pixel lies, and how far it is to the next ones.
std::array<double, 6> six_numbers(const std::string& path, std::string_view text) {
  std::array<double, 6> numbers{};
  const char* at = text.data();
  const char* const end = at + text.size();
  for (double& number : numbers) {
    while (at != end && (*at == ' ' || *at == ',' || *at == '\n' || *at == '+')) ++at;
    const auto [after, failure] = std::from_chars(at, end, number);
    if (failure != std::errc() || !std::isfinite(number)) {
      throw Error(ErrorCode::kCorrupt, fmt::format("{}: GeoTransform is \"{}\", must be six numbers", path, text));
    }
    at = after;
  }
  return numbers;
}

void place_by_transform(const std::string& path, const std::string& text, Georeference& place) {
  const auto [x0, dx, turn_x, y0, turn_y, dy] = six_numbers(path, text);
  if (turn_x != 0.0 || turn_y != 0.0 || !(dx > 0.0) || !(dy < 0.0)) {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("{}: GeoTransform is \"{}\": isohf reads pictures whose columns run from West to East and "
                            "whose rows run from North to South",
                            path, text));
  }
  place.has_origin = true;
  place.spacing_x = dx;
  place.spacing_y = -dy;
  place.origin_x = x0 + dx / 2;
  place.origin_y = y0 + dy / 2;
}

}  // namespace

void read_auxiliary_metadata(SourceInfo& info, int band) {
  const std::string path = info.path + ".aux.xml";
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return;
  const Texts texts = read(path);
  const auto text = [&](const std::string& key) {
    const auto found = texts.find(key);
    return found == texts.end() ? std::string() : found->second;
  };
  Georeference& place = info.georeference;
  if (const std::string transform = text("GeoTransform"); !place.has_origin && !transform.empty()) {
    place_by_transform(path, transform, place);
  }
  if (const std::string system = text("SRS"); !has_reference_system(place) && !system.empty()) {
    (void)read_wkt(system, place);
  }
  if (place.registration == Registration::kUnknown) {
    const std::string kind = text("AREA_OR_POINT");
    if (kind == "Area") place.registration = Registration::kArea;
    if (kind == "Point") place.registration = Registration::kPoint;
  }
  if (band == 0) return;
  const auto of_band = [&](const char* element) { return text(fmt::format("{}/{}", band, element)); };
  if (info.void_values.empty()) read_gdal_nodata(of_band("NoDataValue"), info);
  const auto item = [&](const char* role, const char* element, bool known) {
    if (const std::string value = of_band(element); !known && !value.empty()) read_gdal_item(role, value, info);
  };
  item("unittype", "UnitType", !info.vertical_unit.empty());
  const bool scaled = info.z_scale != 1.0 || info.z_offset != 0.0;
  item("scale", "Scale", scaled);
  item("offset", "Offset", scaled);
}

}  // namespace isohf
