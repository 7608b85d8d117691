#include "isohf/archive/metadata/json_members.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace isohf {
namespace {

using Json = JsonMembers::Json;

/// JSON has no numbers that are not finite.
Json number_or_name(double value) {
  return std::isfinite(value) ? Json(value) : Json(std::isnan(value) ? "nan" : value > 0 ? "inf" : "-inf");
}

Json array_of(const char* type) {
  return {{"type", "array"}, {"items", {{"type", type}}}};
}

Json schema_of(const JsonMembers::Members& members) {
  Json schema = {{"type", "object"}, {"properties", Json::object()}, {"required", Json::array()}};
  JsonMembers json(JsonMembers::Pass::kSchema, schema, "");
  members(json);
  return schema;
}

}  // namespace

Json parse_json(const std::string& text) {
  static constexpr int kMaxDepth = 64;
  // A member is looked for among all of its object's, so that their number counts twice; a value takes 16 bytes and more.
  static constexpr int kMaxNames = 10000;
  static constexpr int kMaxValues = 1000000;
  int names = 0;
  int values = 0;
  try {
    return Json::parse(text, [&](int depth, Json::parse_event_t event, const Json&) {
      if (depth > kMaxDepth) refuse_metadata("JSON", fmt::format("nests deeper than {}", kMaxDepth));
      if (event == Json::parse_event_t::key && ++names > kMaxNames)
        refuse_metadata("JSON", fmt::format("names more than {} members", kMaxNames));
      if (event != Json::parse_event_t::key && ++values > kMaxValues)
        refuse_metadata("JSON", fmt::format("holds more than {} values", kMaxValues));
      return true;
    });
  } catch (const Json::parse_error& error) {
    refuse_metadata("JSON", fmt::format("ends or breaks off its grammar at byte {}", error.byte));
  } catch (const Json::exception&) {
    refuse_metadata("JSON", "has a number that no float64 holds");
  }
}

void refuse_metadata(const std::string& where, const std::string& why) {
  throw Error(ErrorCode::kCorrupt, fmt::format("metadata: {}: {}", where, why));
}

void JsonMembers::refuse(const char* key, const std::string& why) const {
  refuse_metadata(path(key), why);
}

bool JsonMembers::has(const char* key) const {
  const auto found = object_->find(key);
  return found != object_->end() && !found->is_null();
}

void JsonMembers::describe(const char* key, Json schema, JsonRule::Presence presence) {
  if (presence == JsonRule::kNull) schema["type"] = {schema["type"], "null"};
  (*object_)["properties"][key] = std::move(schema);
  if (presence == JsonRule::kRequired || presence == JsonRule::kNull) (*object_)["required"].push_back(key);
}

void JsonMembers::leave_out(const char* key, const JsonRule& rule) {
  if (rule.presence != JsonRule::kAbsent) (*object_)[key] = nullptr;
}

template <typename Read>
void JsonMembers::member(const char* key, const JsonRule& rule, Json schema, const Json& value, const Read& read) {
  if (pass_ == Pass::kSchema) return describe(key, std::move(schema), rule.presence);
  if (pass_ == Pass::kWrite) {
    (*object_)[key] = value;
    return;
  }
  const auto found = object_->find(key);
  if (rule.presence == JsonRule::kRequired && found == object_->end()) refuse(key, "is missing");
  if (rule.presence == JsonRule::kRequired || has(key)) read(*found);
}

void JsonMembers::member(const char* key, std::string& value, const JsonRule& rule) {
  if (pass_ == Pass::kWrite && value.empty() && rule.presence >= JsonRule::kNull) return leave_out(key, rule);
  member(key, rule, {{"type", "string"}}, value, [&](const Json& json) {
    if (!json.is_string()) refuse(key, "is no string");
    value = json.get<std::string>();
  });
}

void JsonMembers::member(const char* key, bool& value, const JsonRule& rule) {
  member(key, rule, {{"type", "boolean"}}, value, [&](const Json& json) {
    if (!json.is_boolean()) refuse(key, "is neither true nor false");
    value = json.get<bool>();
  });
}

void JsonMembers::member(const char* key, double& value, const JsonRule& rule) {
  Json schema = {{"type", "number"}};
  if (std::isfinite(rule.least)) schema[rule.above_least ? "exclusiveMinimum" : "minimum"] = rule.least;
  if (std::isfinite(rule.most)) schema["maximum"] = rule.most;
  member(key, rule, std::move(schema), value, [&](const Json& json) {
    if (!json.is_number()) refuse(key, "is no number");
    value = json.get<double>();
    if (!std::isfinite(value)) refuse(key, "is not finite");
    if (value < rule.least || value > rule.most || (rule.above_least && value == rule.least)) {
      refuse(key, fmt::format("is {}, must be {} {}{}", value, rule.above_least ? "above" : "at least", rule.least,
                              std::isfinite(rule.most) ? fmt::format(" and at most {}", rule.most) : ""));
    }
  });
}

void JsonMembers::integer(const char* key, std::int64_t& value, const JsonRule& rule, std::int64_t most) {
  const std::int64_t least = std::isfinite(rule.least) ? static_cast<std::int64_t>(rule.least) : 0;
  Json schema = {{"type", "integer"}, {"minimum", least}};
  if (std::isfinite(rule.most)) schema["maximum"] = most = static_cast<std::int64_t>(rule.most);
  member(key, rule, std::move(schema), value, [&](const Json& json) {
    if (!json.is_number_integer()) refuse(key, "is no whole number");
    value = json.get<std::int64_t>();
    const bool is_too_large = json.is_number_unsigned() && json.get<std::uint64_t>() > static_cast<std::uint64_t>(most);
    if (is_too_large || value < least || value > most)
      refuse(key, fmt::format("is {}, must lie in {}..{}", json.dump(), least, most));
  });
}

void JsonMembers::member(const char* key, std::vector<std::string>& values, const JsonRule& rule) {
  member(key, rule, array_of("string"), values, [&](const Json& json) {
    if (!json.is_array()) refuse(key, "is no array");
    values.clear();
    for (const Json& value : json) {
      if (!value.is_string()) refuse(key, "holds something that is no string");
      values.push_back(value.get<std::string>());
    }
  });
}

void JsonMembers::member(const char* key, std::vector<double>& values, const JsonRule& rule) {
  Json schema = array_of("number");
  schema["items"]["type"] = {"number", "string"};
  Json written = Json::array();
  for (const double value : values) written.push_back(number_or_name(value));
  member(key, rule, std::move(schema), written, [&](const Json& json) {
    if (!json.is_array()) refuse(key, "is no array");
    values.clear();
    for (const Json& value : json) {
      const bool is_name = value == "nan" || value == "inf" || value == "-inf";
      if (!is_name && !value.is_number()) refuse(key, "holds something that is no number");
      values.push_back(!is_name ? value.get<double>() : value == "nan" ? NAN : value == "inf" ? HUGE_VAL : -HUGE_VAL);
    }
  });
}

void JsonMembers::member(const char* key, std::pair<double, double>& values, const JsonRule& rule) {
  member(key, rule, array_of("number"), {values.first, values.second}, [&](const Json& json) {
    const bool is_pair = json.is_array() && json.size() == 2 && json[0].is_number() && json[1].is_number();
    if (!is_pair) refuse(key, "is no array of two numbers");
    values = {json[0].get<double>(), json[1].get<double>()};
  });
}

void JsonMembers::member(const char* key, Texts& values, const JsonRule& rule) {
  Json written = Json::object();
  for (const auto& [name, text] : values) written[name] = text;
  member(key, rule, {{"type", "object"}, {"additionalProperties", {{"type", "string"}}}}, written,
         [&](const Json& json) {
           if (!json.is_object()) refuse(key, "is no object");
           for (const auto& [name, value] : json.items()) {
             if (!value.is_string()) refuse(key, "holds something that is no string");
             values.emplace_back(name, value.template get<std::string>());
           }
         });
}

void JsonMembers::derived(const char* key, const Json& value, const Json& schema) {
  if (!reads()) member(key, {}, schema, value, [](const Json&) {});
}

void JsonMembers::object(const char* key, const Members& members, const JsonRule& rule) {
  if (pass_ == Pass::kSchema) return describe(key, schema_of(members), rule.presence);
  member(key, rule, {}, Json::object(), [&](const Json& json) {
    if (!json.is_object()) refuse(key, "is no object");
  });
  if (!has(key)) return;
  JsonMembers inner(pass_, (*object_)[key], path(key));
  members(inner);
}

std::string write_members(const JsonMembers::Members& members) {
  Json object = Json::object();
  JsonMembers json(JsonMembers::Pass::kWrite, object, "");
  members(json);
  return text_of(object);
}

std::string text_of(const Json& object, int indent) {
  return object.dump(indent, ' ', false, Json::error_handler_t::replace);
}

std::string schema_of_members(const JsonMembers::Members& members) {
  return schema_of(members).dump(1);
}

bool read_extension(const Metadata& metadata, const char* name, const JsonMembers::Members& members) {
  for (const auto& [extension, text] : metadata.extensions) {
    if (extension != name) continue;
    Json object = parse_json(text);
    if (!object.is_object()) refuse_metadata(name, "is no object");
    JsonMembers json(JsonMembers::Pass::kRead, object, name);
    members(json);
    return true;
  }
  return false;
}

}  // namespace isohf
