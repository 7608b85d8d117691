#include "isohf/archive/accuracy_info.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "isohf/archive/metadata_json.h"

namespace isohf {
namespace {

using Json = nlohmann::ordered_json;

[[noreturn]] void refuse(const char* member, const std::string& why) {
  refuse_metadata(fmt::format("{}.{}", kAccuracyName, member), why);
}

double number(const Json& json, const char* member) {
  const auto found = json.find(member);
  if (found == json.end() || !found->is_number()) refuse(member, "is no number");
  const auto value = found->get<double>();
  if (!(std::isfinite(value) && value >= 0.0)) refuse(member, "is no finite number of at least 0");
  return value;
}

}  // namespace

std::string format_accuracy_info(const AccuracyInfo& info) {
  return Json{{"samples_compared", info.compared},
              {"samples_lost", info.lost},
              {"rms", info.rms},
              {"max", info.max},
              {"max_error", info.max_error ? Json(*info.max_error) : Json(nullptr)},
              {"max_rounding", info.rounding}}
      .dump();
}

std::optional<AccuracyInfo> accuracy_info(const Metadata& metadata) {
  for (const auto& [name, text] : metadata.extensions) {
    if (name != kAccuracyName) continue;
    const auto json = parse_json<Json>(text);
    if (!json.is_object()) refuse_metadata(kAccuracyName, "is no object");
    AccuracyInfo info;
    const double samples = static_cast<double>(metadata.source.width) * static_cast<double>(metadata.source.height);
    const double compared = number(json, "samples_compared");
    const double lost = number(json, "samples_lost");
    if (compared + lost > samples) {
      refuse("samples_compared", fmt::format("is {}, and {} are lost, of {} in all", compared, lost, samples));
    }
    info.compared = static_cast<std::int64_t>(compared);
    info.lost = static_cast<std::int64_t>(lost);
    info.rms = number(json, "rms");
    info.max = number(json, "max");
    if (info.rms > info.max * (1.0 + 1e-9)) refuse("rms", fmt::format("is {}, above max, {}", info.rms, info.max));
    if (json.contains("max_error") && !json["max_error"].is_null()) {
      info.max_error = number(json, "max_error");
      if (info.max > *info.max_error) {
        refuse("max", fmt::format("is {}, above max_error, {}", info.max, *info.max_error));
      }
    }
    info.rounding = number(json, "max_rounding");
    return info;
  }
  return std::nullopt;
}

}  // namespace isohf
