#include "output/void_counts_output.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "options/describe.h"

namespace isohf::cli {

std::optional<VoidCounts> counts_of_voids(const HeightSource& source, std::optional<std::int64_t> voids) {
  const std::int64_t rows = source.info().height;
  if (const auto* filled = dynamic_cast<const FilledSource*>(&source)) {
    if (filled->counts().rows != rows) return std::nullopt;
    return filled->counts();
  }
  if (!voids) return std::nullopt;
  VoidCounts counts;
  counts.rows = rows;
  counts.found = counts.left = *voids;
  return counts;
}

std::string text_from_voids(const VoidCounts& counts) {
  std::string text = fmt::format("{} samples of the input", describe_count(counts.found));
  if (counts.by_valid_range > 0) text += fmt::format(", {} by --valid-range", describe_count(counts.by_valid_range));
  if (counts.filled > 0) {
    text += fmt::format("; {} filled, {} left", describe_count(counts.filled), describe_count(counts.left));
  }
  return text;
}

nlohmann::ordered_json json_from_voids(const std::optional<VoidCounts>& counts) {
  if (!counts) return nullptr;
  return {{"found", counts->found},
          {"by_valid_range", counts->by_valid_range},
          {"filled", counts->filled},
          {"left", counts->left}};
}

}  // namespace isohf::cli
