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

#include "formats/io/text.h"
#include "isohf/error.h"
#include "isohf/projection/body.h"
#include "isohf/projection/crs.h"
#include "isohf/projection/length_unit.h"
#include "isohf/projection/source_system.h"

namespace isohf {
namespace {

constexpr int kDeepest = 32;

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

}  // namespace

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

}  // namespace isohf
