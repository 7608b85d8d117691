#include "output/accuracy_output.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "isohf/restore/source_size.h"
#include "options/describe.h"

namespace isohf::cli {

std::string describe_accuracy(const AccuracyInfo& info, const std::string& unit) {
  return fmt::format("rms {:.4g}{}, largest {:.4g}{} over {} input samples{}{}", info.rms, unit, info.max, unit,
                     describe_count(info.compared),
                     info.lost > 0 ? fmt::format("; {} next to nodata have no surface", describe_count(info.lost)) : "",
                     info.max_error ? fmt::format("; {}{} was allowed", *info.max_error, unit) : "");
}

nlohmann::ordered_json json_from_estimate(const ErrorEstimate& estimate) {
  if (estimate.samples == 0) return nullptr;
  return {{"rms", estimate.rms},
          {"largest_seen", estimate.largest},
          {"samples", estimate.samples},
          {"lost", estimate.lost}};
}

std::string describe_estimate(const ErrorEstimate& estimate, const std::string& unit) {
  if (estimate.samples == 0) return "error not estimated: " + estimate.why_none;
  return fmt::format(
      "error of about {:.3g}{} (rms); the largest of {} samples looked at is {:.3g}{}: an estimate{}", estimate.rms,
      unit, describe_count(estimate.samples), estimate.largest, unit,
      estimate.lost > 0 ? fmt::format("; {} more next to nodata have no surface", describe_count(estimate.lost)) : "");
}

std::string describe_size(const Metadata& metadata, std::uint64_t tile_bytes) {
  const SizeBesideSource size(metadata, tile_bytes);
  const std::string text = fmt::format("elevations take {}, {:.3f} bits a source sample", describe_bytes(tile_bytes),
                                       size.bits_per_source_sample);
  if (size.ratio_to_source == 0.0) return text;
  const bool is_smaller = size.ratio_to_source >= 1.0;
  return text + fmt::format(": {:.2f} times {} the source's {} of {}",
                            is_smaller ? size.ratio_to_source : 1.0 / size.ratio_to_source,
                            is_smaller ? "smaller than" : "as large as", describe_bytes(size.source_bytes),
                            metadata.source.sample_type);
}

}  // namespace isohf::cli
