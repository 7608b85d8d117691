#include "formats/georeference/wkt.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <initializer_list>
#include <locale>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "formats/georeference/reference_system.h"
#include "formats/georeference/units.h"
#include "formats/io/text.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr int kDeepest = 32;
constexpr double kRadiansPerDegree = 0.017453292519943295;
// Files give 12 to 17 digits of it.
constexpr double kDegreeTolerance = 1e-10;

/// KEYWORD["text", number, KEYWORD[...], ...]
struct Node {
  std::string keyword;  // upper case
  std::vector<std::string> texts;
  std::vector<double> numbers;
  std::vector<Node> children;

  [[nodiscard]] bool is(std::initializer_list<std::string_view> words) const {
    return std::find(words.begin(), words.end(), keyword) != words.end();
  }
  [[nodiscard]] const Node* child(std::initializer_list<std::string_view> words) const {
    for (const Node& node : children) {
      if (node.is(words)) return &node;
    }
    return nullptr;
  }
  /// The first one anywhere below.
  [[nodiscard]] const Node* below(std::initializer_list<std::string_view> words) const {
    if (const Node* direct = child(words)) return direct;
    for (const Node& node : children) {
      if (const Node* found = node.below(words)) return found;
    }
    return nullptr;
  }
};

class Parser {
 public:
  explicit Parser(std::string_view text) : text_(text) {}

  /// The systems in a row: ESRI's dialect has that of heights behind the other, with a comma between.
  std::optional<Node> whole() {
    Node row;
    for (bool is_first = true; is_first || at_ < text_.size(); is_first = false) {
      if (!is_first && text_[at_++] != ',') return std::nullopt;
      if (!read_node(row.children.emplace_back(), 0)) return std::nullopt;
      skip_blanks();
    }
    return row;
  }

 private:
  void skip_blanks() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) != 0) ++at_;
  }

  std::string read_word() {
    std::string word;
    for (; at_ < text_.size(); ++at_) {
      const auto c = static_cast<unsigned char>(text_[at_]);
      if (std::isalnum(c) == 0 && c != '_') break;
      word.push_back(static_cast<char>(std::toupper(c)));
    }
    return word;
  }

  bool read_text(std::string& text) {
    for (++at_; at_ < text_.size(); ++at_) {
      if (text_[at_] != '"') {
        text.push_back(text_[at_]);
      } else if (at_ + 1 < text_.size() && text_[at_ + 1] == '"') {
        text.push_back(text_[at_++]);
      } else {
        ++at_;
        return true;
      }
    }
    return false;
  }

  bool read_node(Node& node, int depth) {
    if (depth > kDeepest) return false;
    skip_blanks();
    node.keyword = read_word();
    skip_blanks();
    if (node.keyword.empty() || at_ == text_.size() || (text_[at_] != '[' && text_[at_] != '(')) return false;
    const char closing = text_[at_] == '[' ? ']' : ')';
    for (++at_;; ++at_) {
      if (!read_item(node, depth)) return false;
      skip_blanks();
      if (at_ == text_.size()) return false;
      if (text_[at_] == closing) break;
      if (text_[at_] != ',') return false;
    }
    ++at_;
    return true;
  }

  bool read_item(Node& node, int depth) {
    skip_blanks();
    if (at_ == text_.size()) return false;
    if (text_[at_] == '"') return read_text(node.texts.emplace_back());
    double number = 0.0;
    const char* end = text_.data() + text_.size();
    const auto [stop, error] = std::from_chars(text_.data() + at_, end, number);
    if (error == std::errc{} && (stop == end || std::isalpha(static_cast<unsigned char>(*stop)) == 0)) {
      at_ = static_cast<std::size_t>(stop - text_.data());
      node.numbers.push_back(number);
      return true;
    }
    const std::size_t begin = at_;
    (void)read_word();  // AXIS["x", EAST]: a bare word is passed over
    skip_blanks();
    if (at_ > begin && at_ < text_.size() && text_[at_] != '[' && text_[at_] != '(') return true;
    at_ = begin;
    return read_node(node.children.emplace_back(), depth + 1);
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

std::optional<int> epsg_of(const Node& system) {
  const Node* code = system.child({"AUTHORITY", "ID"});
  if (code == nullptr || code->texts.empty() || code->texts[0] != "EPSG") return std::nullopt;
  if (!code->numbers.empty()) return static_cast<int>(code->numbers[0]);
  int value = 0;
  if (code->texts.size() < 2) return std::nullopt;
  const std::string& text = code->texts[1];
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

/// The system's own unit, or that of its axes (ISO 19162); nullptr where none is given.
const Node* unit_of(const Node& system) {
  const Node* unit = system.child({"UNIT", "LENGTHUNIT", "ANGLEUNIT"});
  if (unit == nullptr) {
    if (const Node* axis = system.below({"AXIS"})) unit = axis->child({"UNIT", "LENGTHUNIT", "ANGLEUNIT"});
  }
  return unit == nullptr || unit->numbers.empty() || !(unit->numbers[0] > 0.0) ? nullptr : unit;
}

void read_unit(const Node& system, bool projected, Georeference& place) {
  const Node* const unit = unit_of(system);
  if (!projected) {
    const Node* const meridian = system.below({"PRIMEM", "PRIMEMERIDIAN"});
    const bool is_degree = unit == nullptr || std::abs(unit->numbers[0] - kRadiansPerDegree) < kDegreeTolerance;
    if (!is_degree || (meridian != nullptr && !meridian->numbers.empty() && meridian->numbers[0] != 0.0)) {
      throw Error(
          ErrorCode::kUnsupported,
          fmt::format("the reference system \"{}\" counts no degrees from Greenwich; gdalwarp brings the raster "
                      "to one that does",
                      system.texts[0]));
    }
    if (unit != nullptr) place.unit = HorizontalUnit::kDegree;
  } else if (unit != nullptr) {
    place.unit = HorizontalUnit::kMetre;
    place.metres_per_unit = unit->numbers[0];
  }
}

void read_heights(const Node& system, SourceInfo& info) {
  ReferenceSystem& reference = info.georeference.system;
  if (!system.texts.empty()) reference.vertical_datum = system.texts[0];
  if (const auto code = epsg_of(system)) reference.vertical_epsg = code;
  // OGC 01-009 has the type 2002 for it; ESRI a datum of longitudes and latitudes where others have a vertical one.
  constexpr double kOfEllipsoid = 2002.0;
  const Node* const datum = system.below({"VERT_DATUM"});
  if ((datum != nullptr && !datum->numbers.empty() && datum->numbers[0] == kOfEllipsoid) ||
      (datum == nullptr && system.below({"VDATUM", "VERTICALDATUM"}) == nullptr &&
       system.below({"DATUM"}) != nullptr)) {
    reference.vertical_datum = kAboveEllipsoid;
  }
  const Node* const unit = unit_of(system);
  if (unit == nullptr) return;
  info.metres_per_vertical_unit = unit->numbers[0];
  const std::string name = unit->texts.empty() ? std::string() : unit->texts[0];
  const auto known = linear_unit(name);
  info.vertical_unit = known ? known->name : name;
  if (known) info.metres_per_vertical_unit = known->metres;
}

}  // namespace

bool read_wkt(std::string_view text, SourceInfo& info) {
  const std::optional<Node> root = Parser(text).whole();
  if (!root) return false;
  const std::initializer_list<std::string_view> projected = {"PROJCS", "PROJCRS", "PROJECTEDCRS"};
  const std::initializer_list<std::string_view> geographic = {"GEOGCS", "GEOGCRS", "GEOGRAPHICCRS"};
  const Node* system = root->below(projected);
  if (system == nullptr) system = root->below(geographic);
  if (system == nullptr || system->texts.empty()) return false;
  if (system->is(geographic) && system->below({"DERIVINGCONVERSION"}) != nullptr) {
    throw Error(
        ErrorCode::kUnsupported,
        fmt::format("the reference system \"{}\" counts degrees about a rotated pole; gdalwarp -t_srs EPSG:4326 "
                    "makes longitudes and latitudes of them",
                    printable(system->texts[0])));
  }
  read_unit(*system, system->is(projected), info.georeference);
  ReferenceSystem& reference = info.georeference.system;
  reference.name = system->texts[0];
  reference.epsg = epsg_of(*system);
  reference.wkt = std::string(text);
  const Node* ellipsoid = system->below({"SPHEROID", "ELLIPSOID"});
  if (ellipsoid != nullptr && ellipsoid->numbers.size() >= 2 && ellipsoid->numbers[0] > 0.0 &&
      std::isfinite(ellipsoid->numbers[0]) && ellipsoid->numbers[1] >= 0.0) {
    reference.semi_major_axis_m = ellipsoid->numbers[0];
    reference.inverse_flattening = ellipsoid->numbers[1];
  }
  reference.body = body_of(reference.name, reference.semi_major_axis_m);
  const Node* const heights = root->below({"VERT_CS", "VERTCS", "VERTCRS", "VERTICALCRS"});
  const Node* const axes = system->below({"CS"});
  if (heights != nullptr) {
    read_heights(*heights, info);
  } else if (axes != nullptr && !axes->numbers.empty() && axes->numbers[0] == 3.0) {
    reference.vertical_datum = kAboveEllipsoid;
  }
  return true;
}

DatumNames datum_names(std::string_view wkt) {
  const std::optional<Node> root = Parser(wkt).whole();
  if (!root) return {};
  const auto name = [&](std::initializer_list<std::string_view> words) {
    const Node* const node = root->below(words);
    return node == nullptr || node->texts.empty() ? std::string() : node->texts[0];
  };
  return {name({"GEOGCS", "GEOGCRS", "BASEGEOGCRS", "BASEGEODCRS", "GEODCRS"}),
          name({"DATUM", "GEODETICDATUM", "TRF", "ENSEMBLE"}), name({"SPHEROID", "ELLIPSOID"}),
          name({"PRIMEM", "PRIMEMERIDIAN"})};
}

std::optional<KeyedMap> keyed_map(std::string_view wkt) {
  const std::optional<Node> root = Parser(wkt).whole();
  const Node* const method = root ? root->below({"PROJECTION", "METHOD"}) : nullptr;
  const Node* const ellipsoid = root ? root->below({"SPHEROID", "ELLIPSOID"}) : nullptr;
  const int code = method == nullptr ? 0 : epsg_of(*method).value_or(0);
  if ((code != 1028 && code != 9810) || ellipsoid == nullptr || ellipsoid->numbers.size() < 2) return std::nullopt;
  KeyedMap map{code, datum_names(wkt), ellipsoid->numbers[0], ellipsoid->numbers[1], {}};
  MapParameters& found = map.parameters;
  const std::map<std::string, double*> names = {{"standard_parallel_1", &found.parallel_1},
                                                {"latitude of 1st standard parallel", &found.parallel_1},
                                                {"central_meridian", &found.longitude},
                                                {"longitude of natural origin", &found.longitude},
                                                {"latitude_of_origin", &found.latitude},
                                                {"latitude of natural origin", &found.latitude},
                                                {"scale_factor", &found.scale},
                                                {"scale factor at natural origin", &found.scale},
                                                {"false_easting", &found.easting},
                                                {"false easting", &found.easting},
                                                {"false_northing", &found.northing},
                                                {"false northing", &found.northing}};
  const Node* const conversion = root->below({"CONVERSION"});
  for (const Node& node : (conversion != nullptr ? conversion : root->below({"PROJCS"}))->children) {
    if (!node.is({"PARAMETER"}) || node.texts.empty() || node.numbers.empty()) continue;
    if (const auto known = names.find(lower_case(node.texts[0])); known != names.end())
      *known->second = node.numbers[0];
  }
  return map;
}

namespace {

/// A .prj of before WKT: "Projection UTM", "Zone 11", "Datum NAD27", "Units METERS", a line each, and behind
/// "Parameters" numbers in the order that the projection has, degrees with minutes and seconds.
class OldPrj {
 public:
  explicit OldPrj(std::string_view text) {
    std::istringstream lines{std::string(text)};
    for (std::string line; std::getline(lines, line);) {
      line = upper_case(line.substr(0, line.find("/*")));
      std::istringstream words(line);
      std::string key;
      if (!(words >> key)) continue;
      if (is_number(key)) {
        parameters_.push_back(number_in(line));
      } else {
        std::string& value = values_[key];
        std::getline(words >> std::ws, value);
        while (!value.empty() && std::isspace(static_cast<unsigned char>(value.back())) != 0) value.pop_back();
      }
    }
  }

  [[nodiscard]] std::string value(const std::string& key) const {
    const auto found = values_.find(key);
    return found == values_.end() ? std::string() : found->second;
  }

  /// Of degrees; empty where neither datum nor spheroid is known.
  [[nodiscard]] std::string geographic() const {
    static const std::map<std::string, const char*> kCodes = {
        {"NAD83", "EPSG:4269"}, {"NAD27", "EPSG:4267"}, {"WGS72", "EPSG:4322"}};
    const auto known = kCodes.find(value("DATUM"));
    if (known != kCodes.end()) return known->second;
    const std::string figure = figure_of();
    return figure.empty() ? figure : "+proj=longlat " + figure;
  }

  /// Of what is no geographic system; empty where it is none that is known.
  [[nodiscard]] std::string proj_string() const {
    const std::string kind = value("PROJECTION");
    std::string text;
    if (kind == "UTM") {
      const int zone = std::atoi(value("ZONE").c_str());
      text = fmt::format("+proj=utm +zone={}{}", std::abs(zone), zone < 0 ? " +south" : "");
    } else {
      // Names of PROJ's parameters, in the order in which the lines come.
      static const std::map<std::string, std::pair<const char*, std::vector<const char*>>> kKinds = {
          {"ALBERS", {"aea", {"lat_1", "lat_2", "lon_0", "lat_0", "x_0", "y_0"}}},
          {"LAMBERT", {"lcc", {"lat_1", "lat_2", "lon_0", "lat_0", "x_0", "y_0"}}},
          {"EQUIDISTANT_CONIC", {"eqdc", {"lat_1", "lat_2", "lon_0", "lat_0", "x_0", "y_0"}}},
          {"TRANSVERSE", {"tmerc", {"k_0", "lon_0", "lat_0", "x_0", "y_0"}}},
          {"MERCATOR", {"merc", {"lon_0", "lat_ts", "x_0", "y_0"}}},
          {"POLAR", {"stere", {"lon_0", "lat_ts", "x_0", "y_0"}}},
          {"POLYCONIC", {"poly", {"lon_0", "lat_0", "x_0", "y_0"}}},
      };
      const auto known = kKinds.find(kind);
      if (known == kKinds.end() || parameters_.size() < known->second.second.size()) return {};
      text = fmt::format("+proj={}", known->second.first);
      for (std::size_t i = 0; i < known->second.second.size(); ++i) {
        text += fmt::format(" +{}={}", known->second.second[i], parameters_[i]);
      }
      if (kind == "POLAR") text += parameters_[1] < 0.0 ? " +lat_0=-90" : " +lat_0=90";
    }
    const std::string figure = figure_of();
    if (figure.empty()) return {};
    text += ' ' + figure;
    const std::string units = value("UNITS");
    if (units == "FEET") return text + " +units=us-ft";
    return units == "METERS" || units.empty() ? text + " +units=m" : std::string();
  }

 private:
  /// The datum, else the spheroid, as PROJ's parameters; empty where neither is known.
  [[nodiscard]] std::string figure_of() const {
    const std::string datum = value("DATUM");
    static const std::map<std::string, const char*> kDatums = {
        {"WGS84", "+datum=WGS84"}, {"NAD83", "+datum=NAD83"}, {"NAD27", "+datum=NAD27"}, {"WGS72", "+ellps=WGS72"}};
    static const std::map<std::string, const char*> kSpheroids = {{"CLARKE1866", "+ellps=clrk66"},
                                                                  {"GRS1980", "+ellps=GRS80"},
                                                                  {"WGS84", "+ellps=WGS84"},
                                                                  {"INTERNATIONAL1909", "+ellps=intl"},
                                                                  {"BESSEL", "+ellps=bessel"}};
    const auto by_datum = kDatums.find(datum);
    const auto by_spheroid = kSpheroids.find(value("SPHEROID"));
    if (by_datum != kDatums.end()) return by_datum->second;
    return by_spheroid != kSpheroids.end() ? by_spheroid->second : "";
  }
  static bool is_number(const std::string& word) {
    return word.find_first_not_of("+-0123456789.") == std::string::npos &&
           word.find_first_of("0123456789") != std::string::npos;
  }
  /// "-96 30 0.0": degrees, minutes, seconds, or a number alone.
  static double number_in(const std::string& text) {
    std::istringstream words(text);
    words.imbue(std::locale::classic());
    double parts[3] = {0.0, 0.0, 0.0};
    for (double& part : parts) {
      if (!(words >> part)) break;
    }
    const double rest = parts[1] / 60.0 + parts[2] / 3600.0;
    return text.find('-') < text.find_first_of("0123456789") ? parts[0] - rest : parts[0] + rest;
  }

  std::map<std::string, std::string> values_;
  std::vector<double> parameters_;
};

/// False, and nothing changed, where it says anything else.
bool read_old_prj(std::string_view text, SourceInfo& info) {
  const OldPrj prj(text);
  if (prj.value("PROJECTION").empty()) return false;
  if (prj.value("PROJECTION") != "GEOGRAPHIC") {
    const std::string system = prj.proj_string();
    if (system.empty()) return false;
    take_system(system, info);
    return true;
  }
  if (prj.value("UNITS") != "DD") return false;
  info.georeference.unit = HorizontalUnit::kDegree;
  if (prj.value("DATUM") == "WGS84") {
    info.georeference.system = wgs84_system();
  } else if (const std::string system = prj.geographic(); !system.empty()) {
    try {
      take_system(system, info);
    } catch (const Error& error) {
      info.warnings.push_back(
          loss(fmt::format("its .prj says degrees, of a datum that is not kept: {}", error.what())));
    }
  }
  return true;
}

}  // namespace

bool read_prj(std::string_view text, SourceInfo& info) {
  return read_wkt(text, info) || read_old_prj(text, info);
}

}  // namespace isohf
