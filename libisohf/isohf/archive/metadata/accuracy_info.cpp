#include "isohf/archive/metadata/accuracy_info.h"

#include <fmt/format.h>

#include "isohf/archive/metadata/json_members.h"

namespace isohf {

void accuracy_members(JsonMembers& json, AccuracyInfo& info) {
  constexpr JsonRule kNotNegative{.least = 0.0};
  json("samples_compared", info.compared);
  json("samples_lost", info.lost);
  json("rms", info.rms, kNotNegative);
  json("max", info.max, kNotNegative);
  json("max_error", info.max_error, {.presence = JsonRule::kNull, .least = 0.0});
  json("max_rounding", info.rounding, kNotNegative);
  if (info.rms > info.max * (1.0 + 1e-9)) json.refuse("rms", fmt::format("is {}, above max, {}", info.rms, info.max));
  if (info.max_error && info.max > *info.max_error)
    json.refuse("max", fmt::format("is {}, above max_error, {}", info.max, *info.max_error));
}

std::string format_accuracy_info(const AccuracyInfo& info) {
  return write_extension(info, accuracy_members);
}

std::optional<AccuracyInfo> accuracy_info(const Metadata& metadata) {
  const auto info = read_extension(metadata, kAccuracyName, accuracy_members);
  if (!info) return info;
  const double samples = static_cast<double>(metadata.source.width) * static_cast<double>(metadata.source.height);
  if (static_cast<double>(info->compared) + static_cast<double>(info->lost) > samples) {
    refuse_metadata(fmt::format("{}.samples_compared", kAccuracyName),
                    fmt::format("is {}, and {} are lost, of {} in all", info->compared, info->lost, samples));
  }
  return info;
}

}  // namespace isohf
