#include "output/svg_chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

namespace isohf::chart {
namespace {

constexpr double kWidth = 760;
constexpr double kHeight = 560;
constexpr double kPolarSize = 640;
constexpr double kLeft = 90;
constexpr double kRight = 24;
constexpr double kTop = 56;
constexpr double kBottom = 126;
constexpr const char* kGrid = "#d8d8d8";
constexpr const char* kInk = "#222222";

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&') {
      out += "&amp;";
    } else if (c == '<') {
      out += "&lt;";
    } else {
      out += c;
    }
  }
  return out;
}

/// The text of an SVG file as it grows. y runs downwards.
class Drawing {
 public:
  Drawing(double width, double height) {
    out_ = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:g} {1:g}\" width=\"{0:g}\" height=\"{1:g}\" "
        "font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
        width, height);
  }
  void line(double x0, double y0, double x1, double y1, const char* colour) {
    out_ +=
        fmt::format("<path d=\"M{:.2f} {:.2f}L{:.2f} {:.2f}\" stroke=\"{}\" fill=\"none\"/>\n", x0, y0, x1, y1, colour);
  }
  void circle(double x, double y, double radius, const char* stroke, const std::string& fill) {
    out_ += fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{:.2f}\" stroke=\"{}\" fill=\"{}\"/>\n", x, y, radius,
                        stroke, fill);
  }
  /// A label that stays readable over lines.
  void label_over(double x, double y, const std::string& words) {
    out_ += fmt::format(
        "<text x=\"{:.2f}\" y=\"{:.2f}\" text-anchor=\"middle\" font-size=\"11\" fill=\"{}\" stroke=\"white\" "
        "stroke-width=\"4\" stroke-linejoin=\"round\" paint-order=\"stroke\">{}</text>\n",
        x, y, kInk, escaped(words));
  }
  void text(double x, double y, const std::string& words, const char* anchor, double size = 13, bool upwards = false) {
    const std::string turn = upwards ? fmt::format(" transform=\"rotate(-90 {:.2f} {:.2f})\"", x, y) : "";
    out_ +=
        fmt::format("<text x=\"{:.2f}\" y=\"{:.2f}\" text-anchor=\"{}\" font-size=\"{:g}\" fill=\"{}\"{}>{}</text>\n",
                    x, y, anchor, size, kInk, turn, escaped(words));
  }
  void curve(const Curve& style, const std::vector<double>& x, const std::vector<double>& y, bool closed) {
    std::string path;
    for (std::size_t i = 0; i < x.size(); ++i) path += fmt::format("{}{:.2f} {:.2f}", i == 0 ? "M" : "L", x[i], y[i]);
    out_ += fmt::format("<path d=\"{}{}\" stroke=\"{}\" stroke-width=\"2\" fill=\"none\"{}/>\n", path,
                        closed ? "Z" : "", style.colour, style.dashed ? " stroke-dasharray=\"7 4\"" : "");
  }
  /// Two curves a line, the first at (x, y).
  void legend(const std::vector<Curve>& curves, double x, double y) {
    for (std::size_t i = 0; i < curves.size(); ++i) {
      const double left = x + (i % 2 == 0 ? 0.0 : 280.0);
      const std::size_t line = i / 2;
      const double base = y + 19.0 * static_cast<double>(line);
      curve(curves[i], {left, left + 30}, {base - 4, base - 4}, false);
      text(left + 38, base, curves[i].label, "start");
    }
  }
  std::string finish() { return out_ + "</svg>\n"; }

 private:
  std::string out_;
};

/// A power of ten as people write it: 100, 10⁵.
std::string power_label(double power) {
  static constexpr const char* kDigits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  const auto exponent = std::lround(std::log10(power));
  if (exponent < 4 || exponent > 99) return fmt::format("{:g}", power);
  return std::string("10") + (exponent > 9 ? kDigits[exponent / 10] : "") + kDigits[exponent % 10];
}

/// A step of 1, 2 or 5 times a power of ten with at most `most` steps up to `extent`.
double tick_step(double extent, int most) {
  const double power = std::pow(10.0, std::floor(std::log10(extent / most)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power * most >= extent) return factor * power;
  }
  return 10.0 * power;
}

double largest_y(const Chart& chart) {
  double largest = 0.0;
  for (const Curve& c : chart.curves) {
    for (const double y : c.y) largest = std::max(largest, y);
  }
  return largest > 0.0 ? largest : 1.0;
}

/// Value -> place on the vertical axis, with its ticks.
struct VerticalAxis {
  double low;
  double high;
  bool logarithmic;
  std::vector<double> ticks;

  [[nodiscard]] double place(double value) const {
    const double v = logarithmic ? std::log10(value) : value;
    return kHeight - kBottom - (v - low) / (high - low) * (kHeight - kBottom - kTop);
  }
};

VerticalAxis vertical_axis(const Chart& chart, Scale scale) {
  VerticalAxis axis = {0.0, 1.0, scale == Scale::kLogarithmic, {}};
  const double largest = largest_y(chart);
  if (!axis.logarithmic) {
    const double step = tick_step(largest, 6);
    axis.high = step * std::ceil(1.02 * largest / step);
    for (int i = 0; i * step <= axis.high * 1.0001; ++i) axis.ticks.push_back(i * step);
    return axis;
  }
  double smallest = largest;
  for (const Curve& c : chart.curves) {
    for (const double y : c.y) smallest = std::min(smallest, y);
  }
  axis.low = std::floor(std::log10(smallest));
  axis.high = std::ceil(std::log10(largest));
  for (double power = axis.low; power <= axis.high; power += 1.0) axis.ticks.push_back(std::pow(10.0, power));
  return axis;
}

}  // namespace

std::string line_chart(const Chart& chart, Scale y_scale) {
  Drawing drawing(kWidth, kHeight);
  const VerticalAxis axis = vertical_axis(chart, y_scale);
  double x_low = chart.curves.at(0).x.front();
  double x_high = x_low;
  for (const Curve& c : chart.curves) {
    x_low = std::min(x_low, c.x.front());
    x_high = std::max(x_high, c.x.back());
  }
  if (x_high == x_low) x_high = x_low + 1.0;
  const double pad = 0.03 * (x_high - x_low);
  const auto across = [&](double x) {
    return kLeft + (x - x_low + pad) / (x_high - x_low + 2.0 * pad) * (kWidth - kLeft - kRight);
  };
  for (const double tick : axis.ticks) {
    drawing.line(kLeft, axis.place(tick), kWidth - kRight, axis.place(tick), kGrid);
    drawing.text(kLeft - 8, axis.place(tick) + 4, axis.logarithmic ? power_label(tick) : fmt::format("{:g}", tick),
                 "end");
  }
  const double step = tick_step(x_high - x_low, 10);
  for (double x = step * std::ceil(x_low / step); x <= x_high + 1e-9 * step; x += step) {
    drawing.line(across(x), kHeight - kBottom, across(x), kHeight - kBottom + 5, kInk);
    drawing.text(across(x), kHeight - kBottom + 20, fmt::format("{:g}", x), "middle");
  }
  drawing.line(kLeft, kTop, kLeft, kHeight - kBottom, kInk);
  drawing.line(kLeft, kHeight - kBottom, kWidth - kRight, kHeight - kBottom, kInk);
  drawing.text(kWidth / 2, 26, chart.title, "middle", 16);
  drawing.text((kLeft + kWidth - kRight) / 2, kHeight - kBottom + 42, chart.x_label, "middle");
  drawing.text(22, (kTop + kHeight - kBottom) / 2, chart.y_label, "middle", 13, true);
  drawing.text(kWidth / 2, kHeight - 14, chart.note, "middle", 11);
  for (const Curve& c : chart.curves) {
    std::vector<double> x;
    std::vector<double> y;
    std::transform(c.x.begin(), c.x.end(), std::back_inserter(x), across);
    std::transform(c.y.begin(), c.y.end(), std::back_inserter(y), [&](double v) { return axis.place(v); });
    drawing.curve(c, x, y, false);
    for (std::size_t i = 0; i < x.size(); ++i) drawing.circle(x[i], y[i], 3, c.colour.c_str(), "white");
  }
  drawing.legend(chart.curves, kLeft + 60, kHeight - kBottom + 68);
  return drawing.finish();
}

std::string polar_chart(const Chart& chart) {
  constexpr double kMiddleX = kPolarSize / 2;
  constexpr double kMiddleY = kPolarSize / 2 + 10;
  constexpr double kRadius = 240;
  Drawing drawing(kPolarSize, kPolarSize + 66);
  const double step = tick_step(largest_y(chart), 5);
  const double high = step * std::ceil(largest_y(chart) / step);
  for (int degrees = 0; degrees < 360; degrees += 30) {
    const double angle = degrees * std::numbers::pi / 180.0;
    drawing.line(kMiddleX, kMiddleY, kMiddleX + kRadius * std::cos(angle), kMiddleY - kRadius * std::sin(angle), kGrid);
    drawing.text(kMiddleX + (kRadius + 20) * std::cos(angle), kMiddleY - (kRadius + 16) * std::sin(angle) + 4,
                 fmt::format("{}°", degrees), "middle");
  }
  for (int i = 1; i * step <= high * 1.0001; ++i) {
    drawing.circle(kMiddleX, kMiddleY, kRadius * i * step / high, kGrid, "none");
  }
  for (const Curve& c : chart.curves) {
    std::vector<double> x;
    std::vector<double> y;
    for (std::size_t i = 0; i < c.x.size(); ++i) {
      x.push_back(kMiddleX + kRadius * c.y[i] / high * std::cos(c.x[i]));
      y.push_back(kMiddleY - kRadius * c.y[i] / high * std::sin(c.x[i]));
    }
    drawing.curve(c, x, y, true);
  }
  // Radii are labelled last, over the curves, between two spokes.
  for (int i = 1; i * step <= high * 1.0001; ++i) {
    const double radius = kRadius * i * step / high;
    drawing.label_over(kMiddleX + radius * std::cos(1.31), kMiddleY - radius * std::sin(1.31) + 4,
                       fmt::format("{:g}", i * step));
  }
  drawing.text(kMiddleX, 26, chart.title, "middle", 16);
  drawing.text(kMiddleX, 46, chart.y_label, "middle");
  drawing.legend(chart.curves, 70, kPolarSize - 2);
  drawing.text(kMiddleX, kPolarSize + 50, chart.note, "middle", 11);
  return drawing.finish();
}

}  // namespace isohf::chart
