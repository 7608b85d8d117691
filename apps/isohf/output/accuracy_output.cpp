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

const char* to_word(Diagonal diagonal) {
  return diagonal == Diagonal::kFalling ? "nw-se" : "sw-ne";
}

double ratio(double a, double b) {
  return b > 0.0 ? a / b : 0.0;
}

ordered_json members_of(const MeshErrors& ortho) {
  return {{"spacing", ortho.layout.spacing_x},
          {"vertices", ortho.vertices},
          {"triangles", 2 * ortho.vertices},
          {"samples_compared", ortho.compared},
          {"diagonal", to_word(ortho.diagonal)},
          {"rms", ortho.rms},
          {"rms_other_diagonal", ortho.rms_of_other},
          {"rms_least_curvature", ortho.rms_least_curvature},
          {"rms_best_diagonals", ortho.rms_best},
          {"max", ortho.max},
          {"p99", ortho.p99},
          {"psnr_db", ortho.psnr_db},
          {"clamped", ortho.clamped},
          {"plain_bytes", ortho.plain_bytes}};
}

void add_lattice(const LatticeReport& lattice, ordered_json& json) {
  json["iso"] = {{"vertices", lattice.vertices},
                 {"triangles", lattice.triangles},
                 {"rms_regular", lattice.regular_rms},
                 {"tile_bytes", lattice.tile_bytes},
                 {"plain_bytes", lattice.plain_bytes}};
  json["ortho"] = members_of(lattice.twin);
  json["ortho_at_equal_rms"] = lattice.equal ? members_of(*lattice.equal) : ordered_json(nullptr);
  json["decimated"] = nullptr;
  if (lattice.decimated) {
    const MeshErrors& mesh = lattice.decimated->mesh;
    json["decimated"] = {{"stride", lattice.decimated->stride},
                         {"vertices", mesh.vertices},
                         {"triangles", 2 * mesh.vertices},
                         {"diagonal", to_word(mesh.diagonal)},
                         {"rms", mesh.rms},
                         {"rms_least_curvature", mesh.rms_least_curvature},
                         {"rms_best_diagonals", mesh.rms_best},
                         {"rms_iso", lattice.decimated->iso_rms}};
  }
}

std::string line(const char* what, const std::string& value) {
  return fmt::format("{:<12} {}\n", what, value);
}

/// "12.3 % less" or "more".
std::string difference(double share) {
  return fmt::format("{:.1f} % {}", 100.0 * std::abs(share - 1.0), share <= 1.0 ? "less" : "more");
}

std::string ordinal(std::int64_t n) {
  return n == 2 ? "second" : n == 3 ? "third" : fmt::format("{}th", n);
}

std::string text_from(const LatticeReport& lattice, double iso_rms) {
  const MeshErrors& twin = lattice.twin;
  std::string text = line("iso", fmt::format("{} triangles, {} vertices; {} of tiles, {} coded plainly",
                                             describe_count(lattice.triangles), describe_count(lattice.vertices),
                                             describe_bytes(lattice.tile_bytes), describe_bytes(lattice.plain_bytes)));
  text +=
      line("ortho", fmt::format("as many: squares of {:.6g} cut {}: rms {:.6g}, 99 % within {:.6g}, largest {:.6g}, "
                                "PSNR {:.1f} dB; {} coded plainly",
                                twin.layout.spacing_x, twin.diagonal == Diagonal::kFalling ? "NW-SE" : "SW-NE",
                                twin.rms, twin.p99, twin.max, twin.psnr_db, describe_bytes(twin.plain_bytes)));
  if (twin.rms > 0.0) {
    text += line("", fmt::format("iso errs by {} than ortho (rms)", difference(iso_rms / twin.rms)));
    text +=
        line("diagonals", fmt::format("iso, placed as they are, errs by {} than squares cut one way, {} than those cut "
                                      "by least curvature, {} than those cut as suits the input best",
                                      difference(lattice.regular_rms / twin.rms),
                                      difference(lattice.regular_rms / twin.rms_least_curvature),
                                      difference(lattice.regular_rms / twin.rms_best)));
  }
  if (lattice.decimated && lattice.decimated->mesh.rms_best > 0.0) {
    const MeshErrors& kept = lattice.decimated->mesh;
    const double iso = lattice.decimated->iso_rms;
    text +=
        line("decimated", fmt::format("iso errs by {} than as many of the input's own samples, every {} of each row "
                                      "and column, cut one way; {} than by least curvature, {} than by best diagonals",
                                      difference(iso / kept.rms), ordinal(lattice.decimated->stride),
                                      difference(iso / kept.rms_least_curvature), difference(iso / kept.rms_best)));
  }
  if (lattice.equal) {
    const MeshErrors& equal = *lattice.equal;
    const auto plain_bytes = static_cast<double>(equal.plain_bytes);
    text += line("equal rms",
                 fmt::format("ortho takes {} triangles, {:.3f} times iso's (squares of {:.6g}, rms {:.6g}); {} coded "
                             "plainly, {:.3f} times iso's",
                             describe_count(2 * equal.vertices),
                             ratio(static_cast<double>(equal.vertices), static_cast<double>(lattice.vertices)),
                             equal.layout.spacing_x, equal.rms, describe_bytes(equal.plain_bytes),
                             ratio(plain_bytes, static_cast<double>(lattice.plain_bytes))));
  } else if (iso_rms > 0.0 && twin.rms > 0.0) {
    text += line("equal rms", "not met by ortho with a quarter to four times the triangles");
  }
  return text;
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
  std::string text = line("against", fmt::format("{}: {} of {} samples compared, {} void in the input", input,
                                                 describe_count(report.samples_compared),
                                                 describe_count(report.samples), describe_count(report.samples_void)));
  if (report.samples_lost + report.samples_invented > 0) {
    text += line("voids", fmt::format("{} samples lie in voids of the surface, {} voids lie on it; {} and {} of them "
                                      "away from borders of voids",
                                      describe_count(report.samples_lost), describe_count(report.samples_invented),
                                      describe_count(report.lost_inside), describe_count(report.invented_inside)));
  }
  text +=
      line("error", fmt::format("rms {:.6g}, 99 % within {:.6g}, largest {:.6g} at x {:.9g} z {:.9g}, PSNR {:.1f} dB",
                                report.rms, report.p99, report.max, report.worst.x, report.worst.z, report.psnr_db));
  if (report.random_points > 0) {
    text += line("between", fmt::format("rms {:.6g}, largest {:.6g} at {} random places", report.random_rms,
                                        report.random_max, describe_count(report.random_points)));
  }
  return text;
}

ordered_json members_of(const AccuracyReport& report) {
  return {{"samples", report.samples},
          {"samples_void", report.samples_void},
          {"samples_compared", report.samples_compared},
          {"samples_lost", report.samples_lost},
          {"lost_inside", report.lost_inside},
          {"samples_invented", report.samples_invented},
          {"invented_inside", report.invented_inside},
          {"rms", report.rms},
          {"max", report.max},
          {"p99", report.p99},
          {"psnr_db", report.psnr_db},
          {"worst", {{"x", report.worst.x}, {"z", report.worst.z}}},
          {"random_points", report.random_points},
          {"random_rms", report.random_rms},
          {"random_max", report.random_max}};
}

}  // namespace

Accuracy measure_accuracy(const std::string& archive, HeightSource& source, std::int64_t random_points, bool with_ortho,
                          const Job& job) {
  ArchiveReader reader(archive);
  const bool on_another_map = is_warped(reader.metadata());
  if (on_another_map) understand_source(reader);
  Accuracy accuracy{check_vertices(reader, source, job), compare_with_source(reader, source, job, random_points), {}};
  // An ortho mesh of the map would have to be resampled through the projection as well.
  if (with_ortho && !on_another_map) accuracy.lattice = compare_lattices(reader, source, accuracy.surface.rms, job);
  return accuracy;
}

std::string describe_accuracy(const AccuracyInfo& info, const std::string& unit) {
  return fmt::format("rms {:.4g}{}, largest {:.4g}{} over {} input samples{}{}", info.rms, unit, info.max, unit,
                     describe_count(info.compared),
                     info.lost > 0 ? fmt::format("; {} beside voids have no surface", describe_count(info.lost)) : "",
                     info.max_error ? fmt::format("; {}{} was allowed", *info.max_error, unit) : "");
}

ordered_json json_from_estimate(const std::optional<ErrorEstimate>& estimate) {
  if (!estimate) return nullptr;
  return {{"rms", estimate->rms}, {"largest_seen", estimate->largest}, {"samples", estimate->samples}};
}

std::string describe_estimate(const std::optional<ErrorEstimate>& estimate, const std::string& unit) {
  if (!estimate)
    return "error not estimated: memory is limited, or the input cannot be read here and there in little time";
  return fmt::format("error of about {:.3g}{} (rms); the largest of {} samples looked at is {:.3g}{}: an estimate",
                     estimate->rms, unit, describe_count(estimate->samples), estimate->largest, unit);
}

ordered_json json_from(const Accuracy& accuracy) {
  ordered_json json = members_of(accuracy.surface);
  json["vertices"] = members_of(accuracy.vertices);
  if (accuracy.lattice) add_lattice(*accuracy.lattice, json);
  return json;
}

std::string text_from(const Accuracy& accuracy, const std::string& input) {
  std::string text = text_from(accuracy.surface, input) + text_from(accuracy.vertices);
  if (accuracy.lattice) text += text_from(*accuracy.lattice, accuracy.surface.rms);
  return text;
}

}  // namespace isohf::cli
