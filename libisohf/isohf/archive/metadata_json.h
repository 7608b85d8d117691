#pragma once

#include <string>

/// What reading and writing metadata share.

namespace isohf {

inline constexpr int kFormatVersion = 1;
inline constexpr const char* kFormatName = "isohf";

/// The extension that holds data_crc32() of an archive's members (docs/archive_format.md), as a string of hexadecimal
/// digits.
inline constexpr const char* kDataCrcName = "data_crc32";

/// Whether a top-level member of that name belongs to the format; any other is an extension.
[[nodiscard]] bool is_format_member(const std::string& name);

/// Throws Error{kCorrupt}: "metadata: WHERE: WHY".
[[noreturn]] void refuse_metadata(const std::string& where, const std::string& why);

/// Refuses text nested so deeply that handling it would exhaust the stack.
void check_json_depth(const std::string& text);

/// Text as one of the JSON library's types. Throws Error{kCorrupt}.
template <typename Json>
[[nodiscard]] Json parse_json(const std::string& text) {
  check_json_depth(text);
  try {
    return Json::parse(text);
  } catch (const typename Json::exception& error) {
    refuse_metadata("is no valid JSON", error.what());
  }
}

}  // namespace isohf
