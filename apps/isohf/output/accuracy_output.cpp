#include "output/accuracy_output.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "isohf/archive.h"
#include "isohf/surface.h"
#include "options/describe.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

std::string line(const char* what, const std::string& value) {
  return fmt::format("{:<12} {}\n", what, value);
}

std::string text_from(const VertexReport& report) {
  return line("vertices", fmt::format("{} resampled once more: largest difference {:.6g}, at most {:.6g} is rounding{}",
                                      describe_count(report.vertices), report.worst, report.bound,
                                      report.clamped > 0 ? fmt::format("; {} clamped", describe_count(report.clamped))
                                                         : std::string()));
}

ordered_json members_of(const VertexReport& report) {
  return {{"checked", report.vertices}, {"voids", report.voids}, {"clamped", report.clamped},
          {"wrong", report.wrong},      {"bound", report.bound}, {"worst", report.worst}};
}

std::string text_from(const AccuracyReport& report, const std::string& input) {
  std::string text = line(
      "against", fmt::format("{}: {} of {} samples compared, {} void in the input{}", input,
                             describe_count(report.samples_compared), describe_count(report.samples),
                             describe_count(report.samples_void),
                             report.samples_off_map > 0
                                 ? fmt::format(", {} not on the archive's map", describe_count(report.samples_off_map))
                                 : ""));
  if (report.samples_lost + report.samples_invented > 0) {
    text += line("voids", fmt::format("{} samples lie in voids of the surface, {} voids lie on it; {} and {} of them "
                                      "away from borders of voids",
                                      describe_count(report.samples_lost), describe_count(report.samples_invented),
                                      describe_count(report.lost_inside), describe_count(report.invented_inside)));
  }
  text +=
      line("error", fmt::format("rms {:.6g}, 99 % within {:.6g}, largest {:.6g} at x {:.9g} z {:.9g}, PSNR {:.1f} dB",
                                report.rms, report.p99, report.max, report.worst.x, report.worst.z, report.psnr_db));
  return text;
}

ordered_json members_of(const AccuracyReport& report) {
  return {{"samples", report.samples},
          {"samples_void", report.samples_void},
          {"samples_compared", report.samples_compared},
          {"samples_off_map", report.samples_off_map},
          {"samples_lost", report.samples_lost},
          {"lost_inside", report.lost_inside},
          {"samples_invented", report.samples_invented},
          {"invented_inside", report.invented_inside},
          {"rms", report.rms},
          {"max", report.max},
          {"p99", report.p99},
          {"psnr_db", report.psnr_db},
          {"worst", {{"x", report.worst.x}, {"z", report.worst.z}}}};
}

}  // namespace

Accuracy measure_accuracy(const std::string& archive, HeightSource& source, const Job& job) {
  ArchiveReader reader(archive);
  if (is_warped(reader.metadata())) understand_source(reader);
  return {check_vertices(reader, source, job), compare_with_source(reader, source, job)};
}

std::string describe_accuracy(const AccuracyInfo& info, const std::string& unit) {
  return fmt::format("rms {:.4g}{}, largest {:.4g}{} over {} input samples{}{}", info.rms, unit, info.max, unit,
                     describe_count(info.compared),
                     info.lost > 0 ? fmt::format("; {} beside voids have no surface", describe_count(info.lost)) : "",
                     info.max_error ? fmt::format("; {}{} was allowed", *info.max_error, unit) : "");
}

ordered_json json_from_estimate(const ErrorEstimate& estimate) {
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
      estimate.lost > 0 ? fmt::format("; {} more beside voids have no surface", describe_count(estimate.lost)) : "");
}

ordered_json json_from(const Accuracy& accuracy) {
  ordered_json json = members_of(accuracy.surface);
  json["vertices"] = members_of(accuracy.vertices);
  return json;
}

std::string text_from(const Accuracy& accuracy, const std::string& input) {
  return text_from(accuracy.surface, input) + text_from(accuracy.vertices);
}

}  // namespace isohf::cli
