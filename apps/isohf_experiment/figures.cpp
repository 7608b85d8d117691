#include "figures.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "output/svg_chart.h"

namespace isohf::experiment {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr double kFigure3Triangles = 5000;
constexpr double kFigure3Frequency = 0.9;

chart::Curve curve_of(MeshKind kind) {
  switch (kind) {
    case MeshKind::kIso:
      return {"isometric", "#c0392b", false, {}, {}};
    case MeshKind::kOrthoConsistent:
      return {"ortho, consistent diagonal", "#1f5fbf", false, {}, {}};
    case MeshKind::kOrthoAlternating:
      return {"ortho, alternating diagonal", "#1f8f5f", true, {}, {}};
    case MeshKind::kOrthoBest:
      return {"ortho, best diagonal", "#555555", true, {}, {}};
  }
  return {};
}

/// Fig. 3's trials of one mesh, in the order of their orientation.
std::vector<Trial> figure3_trials(const ExperimentResult& result, MeshKind mesh) {
  const Figure3Case at = figure3_case(result);
  std::vector<Trial> trials;
  for (const Trial& trial : result.trials) {
    if (trial.mesh == mesh && trial.triangles == at.triangles && trial.frequency == at.frequency) {
      trials.push_back(trial);
    }
  }
  return trials;
}

}  // namespace

std::string trials_csv(const ExperimentResult& result) {
  std::string csv =
      "mesh,triangles,mesh_triangles,frequency,cycles_per_sample,orientation_deg,mean_error,rms_error,"
      "normal_error_deg,shading_error,vertex_normal_error_deg,vertex_shading_error,angle_defect_deg,phase_spread\n";
  for (const Trial& t : result.trials) {
    csv += fmt::format("{},{},{},{:.2f},{:.6f},{:.2f},{:.6e},{:.6e},{:.6e},{:.6e},{:.6e},{:.6e},{:.6e},{:.3e}\n",
                       to_string(t.mesh), t.triangles, t.mesh_triangles, t.frequency, t.cycles_per_sample,
                       t.angle_rad * kDegrees, t.errors.mean, t.errors.rms, t.errors.normal_rad * kDegrees,
                       t.errors.shading, t.errors.vertex_normal_rad * kDegrees, t.errors.vertex_shading,
                       t.errors.defect_rad * kDegrees, t.phase_spread);
  }
  return csv;
}

std::string figure2_csv(const ExperimentResult& result) {
  std::string csv = "triangles,mesh,mean_error,rms_error,normal_error_deg,shading_error,iso_to_this_shading\n";
  for (const std::int64_t triangles : result.settings.triangles) {
    const Errors iso = average_errors(result, MeshKind::kIso, triangles);
    for (const MeshKind kind : kMeshKinds) {
      const Errors e = average_errors(result, kind, triangles);
      csv += fmt::format("{},{},{:.6e},{:.6e},{:.6e},{:.6e},{:.4f}\n", triangles, to_string(kind), e.mean, e.rms,
                         e.normal_rad * kDegrees, e.shading, iso.shading / e.shading);
    }
  }
  return csv;
}

std::string figure2_svg(const ExperimentResult& result) {
  chart::Chart drawing = {
      "Mean shading error (the paper's Fig. 2)",
      "triangles",
      "mean |difference of Lambert shading|",
      "averaged over the waves below each mesh's Nyquist frequency; coarse meshes leave the short ones out",
      {}};
  for (const MeshKind kind : kMeshKinds) {
    chart::Curve curve = curve_of(kind);
    for (const std::int64_t triangles : result.settings.triangles) {
      curve.x.push_back(static_cast<double>(triangles));
      curve.y.push_back(average_errors(result, kind, triangles).shading);
    }
    drawing.curves.push_back(std::move(curve));
  }
  return chart::line_chart(drawing, chart::Scale::kFromZero);
}

Figure3Case figure3_case(const ExperimentResult& result) {
  Figure3Case best = {0, 0.0};
  for (const Trial& t : result.trials) {
    const auto distance = [](std::int64_t triangles, double frequency) {
      return std::pair(std::abs(static_cast<double>(triangles) - kFigure3Triangles),
                       std::abs(frequency - kFigure3Frequency));
    };
    if (best.triangles == 0 || distance(t.triangles, t.frequency) < distance(best.triangles, best.frequency)) {
      best = {t.triangles, t.frequency};
    }
  }
  return best;
}

std::string figure3_csv(const ExperimentResult& result) {
  std::string csv = "orientation_deg";
  std::vector<std::vector<Trial>> columns;
  for (const MeshKind kind : kMeshKinds) {
    csv += std::string(",") + to_string(kind);
    columns.push_back(figure3_trials(result, kind));
  }
  csv += "\n";
  for (const double half_turn : {0.0, 180.0}) {
    for (std::size_t i = 0; i < columns[0].size(); ++i) {
      csv += fmt::format("{:.2f}", half_turn + columns[0][i].angle_rad * kDegrees);
      for (const std::vector<Trial>& column : columns) csv += fmt::format(",{:.6e}", column[i].errors.mean);
      csv += "\n";
    }
  }
  return csv;
}

std::string azimuth_csv(const ExperimentResult& result) {
  const std::int64_t triangles = figure3_case(result).triangles;
  std::string csv = "azimuth_deg";
  std::vector<Errors> columns;
  for (const MeshKind kind : kMeshKinds) {
    csv += std::string(",") + to_string(kind);
    columns.push_back(average_errors(result, kind, triangles));
  }
  csv += "\n";
  for (std::size_t i = 0; i < kAzimuths; ++i) {
    csv += fmt::format("{}", 180 * i / kAzimuths);
    for (const Errors& column : columns) csv += fmt::format(",{:.6e}", column.azimuth_shading[i]);
    csv += "\n";
  }
  return csv;
}

std::string azimuth_svg(const ExperimentResult& result) {
  const std::int64_t triangles = figure3_case(result).triangles;
  const double elevation_deg = result.settings.light.elevation_rad * kDegrees;
  chart::Chart drawing = {
      "Mean shading error against the azimuth of a light that stands still",
      "",
      "",
      fmt::format("{} triangles, vertex normals, light {:.0f} degrees high; East to the right, North up", triangles,
                  elevation_deg),
      {}};
  for (const MeshKind kind : kMeshKinds) {
    chart::Curve curve = curve_of(kind);
    const Errors errors = average_errors(result, kind, triangles);
    for (std::size_t i = 0; i < 2 * kAzimuths; ++i) {
      // The chart counts from the right towards the top, azimuths from the top to the right.
      curve.x.push_back(std::numbers::pi * static_cast<double>(i) / kAzimuths);
      curve.y.push_back(errors.azimuth_shading[(kAzimuths / 2 + 2 * kAzimuths - i) % kAzimuths]);
    }
    drawing.curves.push_back(std::move(curve));
  }
  return chart::polar_chart(drawing);
}

std::string figure3_svg(const ExperimentResult& result) {
  const Figure3Case at = figure3_case(result);
  chart::Chart drawing = {
      "Mean elevation error against orientation (the paper's Fig. 3)",
      "",
      fmt::format("frequency {:.2f}, {} triangles; radius: error in amplitudes", at.frequency, at.triangles),
      "angle: direction of the wave seen from the grid's rows; consistent diagonals run along 45°",
      {}};
  for (const MeshKind kind : kMeshKinds) {
    chart::Curve curve = curve_of(kind);
    const std::vector<Trial> trials = figure3_trials(result, kind);
    for (const double half_turn : {0.0, std::numbers::pi}) {
      for (const Trial& trial : trials) {
        curve.x.push_back(half_turn + trial.angle_rad);
        curve.y.push_back(trial.errors.mean);
      }
    }
    drawing.curves.push_back(std::move(curve));
  }
  return chart::polar_chart(drawing);
}

double share_of_lower_orientations(const ExperimentResult& result, MeshKind other, std::int64_t triangles,
                                   double frequency) {
  int lower = 0;
  int all = 0;
  for (std::size_t i = 0; i + kMeshKinds.size() <= result.trials.size(); i += kMeshKinds.size()) {
    const Trial& iso = result.trials[i];
    if (iso.triangles != triangles || iso.frequency != frequency) continue;
    ++all;
    lower += iso.errors.mean < result.trials[i + static_cast<std::size_t>(other)].errors.mean ? 1 : 0;
  }
  return all > 0 ? static_cast<double>(lower) / all : 0.0;
}

std::string figure8_csv(const TileShape& shape) {
  std::string csv = "level,strip_triangles,stitch_triangles,triangles\n";
  for (int level = 0; level < shape.levels(); ++level) {
    const std::int64_t strip = shape.strip_triangle_count(level);
    const std::int64_t stitch = shape.stitch_triangle_count(level);
    csv += fmt::format("{},{},{},{}\n", level, strip, stitch, strip + stitch);
  }
  return csv;
}

std::string figure8_svg(const TileShape& shape) {
  chart::Chart drawing = {fmt::format("Triangles against level of detail, C = {}, R = {} (the paper's Fig. 8)",
                                      shape.columns(), shape.rows()),
                          "level",
                          "triangles",
                          "Eq. 4 and Eq. 5; level 0 needs no stitch",
                          {}};
  chart::Curve total = {"total", "#c0392b", false, {}, {}};
  chart::Curve strip = {"strip", "#1f5fbf", true, {}, {}};
  chart::Curve stitch = {"stitch", "#1f8f5f", true, {}, {}};
  for (int level = 0; level < shape.levels(); ++level) {
    const auto in_strip = static_cast<double>(shape.strip_triangle_count(level));
    const auto in_stitch = static_cast<double>(shape.stitch_triangle_count(level));
    for (chart::Curve* curve : {&total, &strip}) curve->x.push_back(level);
    total.y.push_back(in_strip + in_stitch);
    strip.y.push_back(in_strip);
    if (level == 0) continue;
    stitch.x.push_back(level);
    stitch.y.push_back(in_stitch);
  }
  drawing.curves = {total, strip};
  if (!stitch.x.empty()) drawing.curves.push_back(stitch);
  return chart::line_chart(drawing, chart::Scale::kLogarithmic);
}

}  // namespace isohf::experiment
