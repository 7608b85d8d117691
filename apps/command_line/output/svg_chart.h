#pragma once

#include <string>
#include <vector>

/// Small charts as SVG text. Deterministic: the same data give the same bytes.

namespace isohf::chart {

struct Curve {
  std::string label;
  std::string colour;  ///< of SVG
  bool dashed = false;
  std::vector<double> x;  ///< radians in a polar chart
  std::vector<double> y;  ///< >= 0 and finite
};

struct Chart {
  std::string title;
  std::string x_label;
  std::string y_label;
  std::string note;  ///< small, below
  std::vector<Curve> curves;
};

enum class Scale { kFromZero, kLogarithmic };

/// Lines with marks; x ascending. kLogarithmic needs y > 0.
[[nodiscard]] std::string line_chart(const Chart& chart, Scale y_scale);
/// Closed curves about the origin: y is the radius, x the angle from the right towards the top.
[[nodiscard]] std::string polar_chart(const Chart& chart);

}  // namespace isohf::chart
