#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <nlohmann/json_fwd.hpp>  // NOLINT: names alone
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "isohf/error.h"
#include "isohf/metadata.h"

namespace isohf {

/// Text as JSON. Throws Error{kCorrupt}, also where it nests so deeply that handling it would exhaust the stack.
[[nodiscard]] nlohmann::ordered_json parse_json(const std::string& text);

/// Throws Error{kCorrupt}: "metadata: WHERE: WHY".
[[noreturn]] void refuse_metadata(const std::string& where, const std::string& why);

/// How a member stands in an object, and what numbers may be.
struct JsonRule {
  /// What is not required may be missing or null: the value then stays as it was.
  enum Presence {
    kRequired,
    kNull,   ///< null for an empty text, and for nullopt
    kAbsent  ///< then not written at all
  };
  Presence presence = kRequired;
  double least = -std::numeric_limits<double>::infinity();  ///< of integers 0
  double most = std::numeric_limits<double>::infinity();
  bool above_least = false;  ///< `least` itself is outside
};

/// The members of a JSON object, named once and in the order in which they are written. A function that goes through
/// them writes them, reads and checks them, or describes them as a JSON Schema, whichever it is called for:
///
///     void place_members(JsonMembers& json, Place& place) {
///       json("x", place.x, {.least = 0.0});
///       json("name", place.name, {.presence = JsonRule::kNull});
///     }
class JsonMembers {
 public:
  using Json = nlohmann::ordered_json;
  using Texts = std::vector<std::pair<std::string, std::string>>;  ///< an object of texts
  using Members = std::function<void(JsonMembers&)>;
  enum class Pass { kWrite, kRead, kSchema };

  JsonMembers(Pass pass, Json& object, std::string where) : pass_(pass), object_(&object), where_(std::move(where)) {}

  [[nodiscard]] bool reads() const { return pass_ == Pass::kRead; }
  /// Throws Error{kCorrupt} naming the member.
  [[noreturn]] void refuse(const char* key, const std::string& why) const;

  /// T  std::string, bool, double, an integer, std::vector<std::string>, std::vector<double> (what is not finite as
  /// "nan", "inf", "-inf"), std::pair<double, double>, Texts, or an optional one of these
  template <typename T>
  void operator()(const char* key, T& value, const JsonRule& rule = {}) {
    if constexpr (std::is_integral_v<T> && !std::is_same_v<T, bool>) {
      auto wide = static_cast<std::int64_t>(value);
      constexpr auto kMost = sizeof(T) < 8 ? std::int64_t{std::numeric_limits<std::int32_t>::max()} : INT64_MAX;
      integer(key, wide, rule, kMost);
      value = static_cast<T>(wide);
    } else {
      member(key, value, rule);
    }
  }
  template <typename T>
  void operator()(const char* key, std::optional<T>& value, const JsonRule& rule = {.presence = JsonRule::kNull}) {
    optional(key, value, rule, [&](T& known) { (*this)(key, known, rule); });
  }
  /// A value with a name: `from` throws Error for names that stand for none.
  template <typename T>
  void name(const char* key, T& value, T (*from)(const std::string&)) {
    std::string name = to_string(value);
    member(key, name, {});
    try {
      if (reads()) value = from(name);
    } catch (const Error& error) {
      refuse(key, error.what());
    }
  }
  /// The same where a build may not know the name: nullopt.
  template <typename T>
  void name(const char* key, std::optional<T>& value, T (*from)(const std::string&), const JsonRule& rule = {}) {
    std::string name = name_of(value);
    member(key, name, rule);
    try {
      if (reads()) value = from(name);
    } catch (const Error&) {
      value = std::nullopt;
    }
  }
  /// Several without rules: all("x", x, "z", z).
  template <typename T, typename... More>
  void all(const char* key, T& value, More&&... more) {
    (*this)(key, value);
    if constexpr (sizeof...(more) > 0) all(more...);
  }
  void object(const char* key, const Members& members, const JsonRule& rule = {});
  /// An object of such: object("extent", "x", x, "z", z).
  template <typename T, typename... More>
  void object(const char* key, const char* first, T& value, More&&... more) {
    object(key, [&](JsonMembers& json) { json.all(first, value, more...); });
  }
  template <typename T>
  void object(const char* key, std::optional<T>& value, void (*members)(JsonMembers&, T&), const JsonRule& rule) {
    optional(key, value, rule, [&](T& known) {
      object(
          key, [&](JsonMembers& json) { members(json, known); }, rule);
    });
  }
  /// What follows from other members, or never changes: written, not read.
  void derived(const char* key, const Json& value, const Json& schema);

 private:
  template <typename T, typename Known>
  void optional(const char* key, std::optional<T>& value, const JsonRule& rule, const Known& known) {
    if (pass_ == Pass::kWrite && !value) return leave_out(key, rule);
    if (pass_ == Pass::kRead && !has(key)) return value.reset();
    if (pass_ == Pass::kRead) value.emplace(T{});
    T none{};
    known(value ? *value : none);
  }
  void member(const char* key, std::string& value, const JsonRule& rule);
  void member(const char* key, bool& value, const JsonRule& rule);
  void member(const char* key, double& value, const JsonRule& rule);
  void member(const char* key, std::vector<std::string>& values, const JsonRule& rule);
  void member(const char* key, std::vector<double>& values, const JsonRule& rule);
  void member(const char* key, std::pair<double, double>& values, const JsonRule& rule);
  void member(const char* key, Texts& values, const JsonRule& rule);
  void integer(const char* key, std::int64_t& value, const JsonRule& rule, std::int64_t most);
  template <typename Read>
  void member(const char* key, const JsonRule& rule, Json schema, const Json& value, const Read& read);
  void leave_out(const char* key, const JsonRule& rule);
  void describe(const char* key, Json schema, JsonRule::Presence presence);
  [[nodiscard]] bool has(const char* key) const;
  [[nodiscard]] std::string path(const char* key) const { return where_.empty() ? key : where_ + "." + key; }

  Pass pass_;
  Json* object_;
  std::string where_;
};

/// An object as JSON text. Text of unknown encoding (a WKT, a file name) does not make the whole unreadable.
[[nodiscard]] std::string text_of(const nlohmann::ordered_json& object, int indent = -1);
/// The same of members.
[[nodiscard]] std::string write_members(const JsonMembers::Members& members);
/// Their JSON Schema.
[[nodiscard]] std::string schema_of_members(const JsonMembers::Members& members);
/// The JSON Schema of the metadata without extensions, which docs/schema/metadata.json holds.
[[nodiscard]] std::string metadata_schema();

template <typename T>
[[nodiscard]] std::string write_extension(T value, void (*members)(JsonMembers&, T&)) {
  return write_members([&](JsonMembers& json) { members(json, value); });
}
/// False where the metadata have no extension of that name. Throws Error{kCorrupt}.
bool read_extension(const Metadata& metadata, const char* name, const JsonMembers::Members& members);
template <typename T>
[[nodiscard]] std::optional<T> read_extension(const Metadata& metadata, const char* name,
                                              void (*members)(JsonMembers&, T&)) {
  T value;
  const bool is_there = read_extension(metadata, name, [&](JsonMembers& json) { members(json, value); });
  return is_there ? std::optional(std::move(value)) : std::nullopt;
}

}  // namespace isohf
