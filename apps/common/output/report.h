#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "common.h"

namespace isohf::cli {

/// What a command has to say, once: printed as lines of text, or with --json as a document.
class Report {
 public:
  /// json  members that come first
  explicit Report(nlohmann::ordered_json json = nlohmann::ordered_json::object()) : json_(std::move(json)) {}

  /// A member of the document, and the line that says the same: "label        words". Without words there is no line.
  void add(const std::string& key, nlohmann::ordered_json value, const std::string& label = {},
           std::string words = {}) {
    json_[key] = std::move(value);
    if (!words.empty()) line(label, std::move(words));
  }
  /// A line alone.
  void line(const std::string& label, std::string words) { lines_.push_back({label, std::move(words), false}); }
  /// A line for -v.
  void detail(const std::string& label, std::string words) { lines_.push_back({label, std::move(words), true}); }

  [[nodiscard]] const nlohmann::ordered_json& json() const { return json_; }
  /// verbose  with the lines for -v
  [[nodiscard]] std::string text(bool verbose) const;
  /// On standard output: nothing with -q, unless it is a document. One of many documents takes a line.
  void print(const Common& common, bool is_one_of_many = false) const;

 private:
  struct Line {
    std::string label;
    std::string words;
    bool is_detail;
  };
  nlohmann::ordered_json json_;
  std::vector<Line> lines_;
};

}  // namespace isohf::cli
