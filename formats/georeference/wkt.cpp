#include "formats/georeference/wkt.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

#include "formats/georeference/units.h"

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

  std::optional<Node> whole() {
    Node node;
    if (!read_node(node, 0)) return std::nullopt;
    skip_blanks();
    return at_ == text_.size() ? std::optional(std::move(node)) : std::nullopt;
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

void read_unit(const Node& system, bool projected, Georeference& place) {
  // The system's own unit, or that of its axes (ISO 19162).
  const Node* unit = system.child({"UNIT", "LENGTHUNIT", "ANGLEUNIT"});
  if (unit == nullptr) {
    if (const Node* axis = system.child({"AXIS"})) unit = axis->child({"UNIT", "LENGTHUNIT", "ANGLEUNIT"});
  }
  if (unit == nullptr || unit->numbers.empty() || !(unit->numbers[0] > 0.0)) return;
  if (projected) {
    place.unit = HorizontalUnit::kMetre;
    place.metres_per_unit = unit->numbers[0];
  } else if (std::abs(unit->numbers[0] - kRadiansPerDegree) < kDegreeTolerance) {
    place.unit = HorizontalUnit::kDegree;
  }
}

}  // namespace

bool read_wkt(std::string_view text, Georeference& place) {
  const std::optional<Node> root = Parser(text).whole();
  if (!root) return false;
  const std::initializer_list<std::string_view> projected = {"PROJCS", "PROJCRS", "PROJECTEDCRS"};
  const std::initializer_list<std::string_view> geographic = {"GEOGCS", "GEOGCRS", "GEOGRAPHICCRS"};
  const Node* system = root->is(projected) || root->is(geographic) ? &*root : root->below(projected);
  if (system == nullptr) system = root->below(geographic);
  if (system == nullptr || system->texts.empty()) return false;
  ReferenceSystem& reference = place.system;
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
  read_unit(*system, system->is(projected), place);
  return true;
}

namespace {

/// "Projection GEOGRAPHIC", "Datum WGS84", "Units DD", a line each: what stood in a .prj before WKT did (GTOPO30).
/// False, and nothing changed, where it says anything else.
bool read_old_prj(std::string_view text, Georeference& place) {
  std::string words;
  for (const char c : text) {
    if (std::isspace(static_cast<unsigned char>(c)) == 0) {
      words += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    } else if (!words.empty() && words.back() != ' ') {
      words += ' ';
    }
  }
  const auto says = [&](std::string_view what) { return words.find(what) != std::string::npos; };
  if (words.rfind("PROJECTION GEOGRAPHIC", 0) != 0 || !says("UNITS DD")) return false;
  place.unit = HorizontalUnit::kDegree;
  if (!says("DATUM WGS84")) return true;
  place.system = wgs84_system();
  return true;
}

}  // namespace

bool read_prj(std::string_view text, Georeference& place) {
  return read_wkt(text, place) || read_old_prj(text, place);
}

}  // namespace isohf
