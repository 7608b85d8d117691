#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace isohf::cli {

/// A document on one line, in ASCII: terminals obey no character of it. Bytes that are no UTF-8 are replaced, as file
/// names may hold any.
[[nodiscard]] inline std::string json_line(const nlohmann::ordered_json& document) {
  return document.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

/// The same, indented.
[[nodiscard]] inline std::string json_text(const nlohmann::ordered_json& document) {
  return document.dump(2, ' ', true, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace isohf::cli
