#include "reading/hud.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace isohf::view {
namespace {

/// What is in the hand: the slider's knob, a measured way.
constexpr OverlayColour kMark{1.0F, 0.8F, 0.35F, 1.0F};

struct Slider {
  double x, y, width, height;
};

float text_size(int height, double scale) {
  return static_cast<float>(std::clamp(height / 440.0, 1.3 * scale, 2.5 * scale));
}

Slider slider_of(int width, int height, double scale) {
  const double size = text_size(height, scale);
  return {0.28 * width, height - 20.0 * size, 0.44 * width, 6.0 * size};
}

/// Lines of at most so many letters, cut between words where there are any.
std::vector<std::string> wrapped(const std::vector<std::string>& lines, std::size_t most) {
  std::vector<std::string> all;
  for (std::string_view rest : lines) {
    while (rest.size() > most) {
      const std::size_t space = rest.substr(0, most + 1).rfind(' ');
      const bool between = space != std::string_view::npos && space > 0;
      all.emplace_back(rest.substr(0, between ? space : most));
      rest.remove_prefix(between ? space + 1 : most);
    }
    all.emplace_back(rest);
  }
  return all;
}

std::string number(double value) {
  return std::abs(value) < 1e9 ? fmt::format("{:.10g}", value + 0.0) : fmt::format("{:.6g}", value);
}

}  // namespace

OverlayColour colour_at(const std::vector<ColourStop>& stops, double elevation) {
  if (stops.empty()) return kInk;
  const auto behind = std::upper_bound(stops.begin(), stops.end(), elevation,
                                       [](double value, const ColourStop& stop) { return value < stop.elevation; });
  const ColourStop& low = behind == stops.begin() ? *behind : *(behind - 1);
  const ColourStop& high = behind == stops.end() ? stops.back() : *behind;
  const double range = high.elevation - low.elevation;
  const double share = range > 0.0 ? std::clamp((elevation - low.elevation) / range, 0.0, 1.0) : 0.0;
  const auto mix = [share](std::uint8_t a, std::uint8_t b) {
    return static_cast<float>((a + share * (b - a)) / 255.0);
  };
  return {mix(low.red, high.red), mix(low.green, high.green), mix(low.blue, high.blue), 1.0F};
}

double round_length(double most) {
  const double power = std::pow(10.0, std::floor(std::log10(most) + 1e-9));
  return power * (most >= 5.0 * power ? 5.0 : most >= 2.0 * power ? 2.0 : 1.0);
}

std::string short_unit(const std::string& unit) {
  return unit == "metre" ? "m" : unit == "foot" ? "ft" : unit;
}

std::string describe_length(double length, const std::string& unit) {
  if (unit == "metre" && length >= 1000.0) return fmt::format("{:.5g} km", length / 1000.0);
  return fmt::format("{:.5g} {}", length, unit.empty() ? "world units" : short_unit(unit));
}

void Hud::draw(const Reading& reading, int width, int height, double scale) {
  overlay_.begin(width, height, text_size(height, scale));
  const auto w = static_cast<float>(width);
  const auto h = static_cast<float>(height);
  const float edge = 4.0F * overlay_.size();
  draw_way(reading.way);
  if (!reading.colours.empty()) draw_legend(reading, w, h);
  if (reading.world_per_px > 0.0) draw_scale(reading, h);
  if (reading.heading_rad) draw_north(*reading.heading_rad, w, h);
  if (reading.profile) draw_profile(*reading.profile, reading, w, h);
  if (reading.hours) draw_slider(*reading.hours, width, height, scale);
  const std::vector<std::string>& lines = reading.help.empty() ? reading.figures : reading.help;
  const float letters = (w - 4.0F * edge) / overlay_.width_of("M");
  if (!lines.empty()) overlay_.panel(edge, edge, wrapped(lines, static_cast<std::size_t>(std::max(letters, 8.0F))));
  overlay_.finish();
}

void Hud::draw_legend(const Reading& reading, float width, float height) {
  const float size = overlay_.size();
  const double range = std::max(reading.high - reading.low, 1e-9);
  const double step = round_length(range / 3.0);
  std::vector<std::pair<double, std::string>> ticks;
  for (double value = std::ceil(reading.low / step - 1e-9) * step; value <= reading.high + 1e-9 * range;
       value += step) {
    ticks.emplace_back(value, number(std::round(value / step) * step));
  }
  const std::string unit = short_unit(reading.height_unit);
  float widest = overlay_.width_of(unit);
  for (const auto& tick : ticks) widest = std::max(widest, overlay_.width_of(tick.second));
  const float bar = 8.0F * size;
  const float top = 0.30F * height;
  const float bottom = 0.70F * height;
  const float panel = widest + bar + 14.0F * size;
  const float left = width - panel - 4.0F * size;
  overlay_.box(left, top - 2.0F * overlay_.line_height(), panel, bottom - top + 3.0F * overlay_.line_height(), kPanel);
  overlay_.text(left + 5.0F * size, top - 1.5F * overlay_.line_height(), unit);
  const float x = width - 9.0F * size - bar;
  constexpr int kSteps = 96;
  const float each = (bottom - top) / kSteps;
  for (int i = 0; i < kSteps; ++i) {
    const double value = reading.high - (i + 0.5) / kSteps * range;
    overlay_.box(x, top + static_cast<float>(i) * each, bar, each + 0.5F, colour_at(reading.colours, value));
  }
  for (const auto& [value, text] : ticks) {
    const auto y = static_cast<float>(bottom - (value - reading.low) / range * (bottom - top));
    overlay_.box(x - 2.0F * size, y - 0.5F * size, 2.0F * size, size, kInk);
    overlay_.text(x - 4.0F * size - overlay_.width_of(text), y - 3.5F * size, text);
  }
}

void Hud::draw_scale(const Reading& reading, float height) {
  const float size = overlay_.size();
  const double most = reading.world_per_px * 90.0 * size;
  const double length = round_length(most);
  const auto px = static_cast<float>(length / reading.world_per_px);
  const std::string text = describe_length(length, reading.ground_unit);
  const float x = 10.0F * size;
  const float y = height - 12.0F * size;
  const float panel = std::max(px, overlay_.width_of(text)) + 12.0F * size;
  overlay_.box(4.0F * size, y - 14.0F * size, panel, 22.0F * size, kPanel);
  overlay_.text(x, y - 10.0F * size, text);
  overlay_.box(x, y + 2.0F * size, px, 1.5F * size, kInk);
  for (const float end : {0.0F, px - size}) overlay_.box(x + end, y, size, 5.0F * size, kInk);
}

void Hud::draw_north(double heading_rad, float width, float height) {
  const float size = overlay_.size();
  const float radius = 15.0F * size;
  const float x = width - radius - 8.0F * size;
  const float y = height - radius - 8.0F * size;
  overlay_.box(x - radius - 4.0F * size, y - radius - 4.0F * size, 2.0F * radius + 8.0F * size,
               2.0F * radius + 8.0F * size, kPanel);
  const auto along_x = static_cast<float>(-std::sin(heading_rad));
  const auto along_y = static_cast<float>(-std::cos(heading_rad));
  const auto at = [&](float ahead, float aside) {
    return std::array<float, 2>{x + radius * (ahead * along_x - aside * along_y),
                                y + radius * (ahead * along_y + aside * along_x)};
  };
  const auto join = [&](std::array<float, 2> from, std::array<float, 2> to) {
    overlay_.line(from[0], from[1], to[0], to[1], 1.4F * size, kInk);
  };
  const auto tip = at(0.4F, 0.0F);
  join(at(-0.9F, 0.0F), tip);
  join(at(0.1F, 0.22F), tip);
  join(at(0.1F, -0.22F), tip);
  const auto letter = at(0.9F, 0.0F);
  overlay_.text(letter[0] - 2.5F * size, letter[1] - 3.5F * size, "N");
}

void Hud::draw_slider(double hours, int width, int height, double scale) {
  const float size = overlay_.size();
  const Slider bar = slider_of(width, height, scale);
  const auto x = static_cast<float>(bar.x);
  const auto y = static_cast<float>(bar.y);
  const auto across = static_cast<float>(bar.width);
  overlay_.box(x - 6.0F * size, y - 14.0F * size, across + 12.0F * size, 32.0F * size, kPanel);
  overlay_.box(x, y + 2.0F * size, across, 2.0F * size, kInk);
  for (const int hour : {0, 6, 12, 18, 24}) {
    const float at = x + across * static_cast<float>(hour) / 24.0F;
    overlay_.box(at - 0.5F * size, y, size, 6.0F * size, kInk);
    const std::string text = std::to_string(hour);
    overlay_.text(at - 0.5F * overlay_.width_of(text), y + 8.0F * size, text);
  }
  const float at = x + across * static_cast<float>(hours / 24.0);
  overlay_.box(at - 2.0F * size, y - size, 4.0F * size, 8.0F * size, kMark);
  const auto minutes = static_cast<int>(std::lround(hours * 60.0));
  const std::string text = fmt::format("{:02}:{:02}", minutes / 60, minutes % 60);
  const float left = std::clamp(at - 0.5F * overlay_.width_of(text), x, x + across - overlay_.width_of(text));
  overlay_.text(left, y - 11.0F * size, text);
}

std::optional<double> Hud::slider_hours(double x, double y, int width, int height, double scale) {
  const Slider bar = slider_of(width, height, scale);
  if (y < bar.y - 2.0 * bar.height || y > bar.y + 2.5 * bar.height || x < bar.x - bar.height ||
      x > bar.x + bar.width + bar.height) {
    return std::nullopt;
  }
  return std::clamp((x - bar.x) / bar.width * 24.0, 0.0, 24.0);
}

void Hud::draw_way(const std::vector<std::optional<PicturePoint>>& way) {
  const float size = overlay_.size();
  const auto x_of = [](const PicturePoint& at) { return static_cast<float>(at.x); };
  const auto y_of = [](const PicturePoint& at) { return static_cast<float>(at.y); };
  // A dark rim, so that it is seen on snow.
  for (const auto& [rim, colour] : {std::pair{1.0F, kPanel}, std::pair{0.0F, kMark}}) {
    for (std::size_t i = 0; i + 1 < way.size(); ++i) {
      if (!way[i] || !way[i + 1]) continue;
      overlay_.line(x_of(*way[i]), y_of(*way[i]), x_of(*way[i + 1]), y_of(*way[i + 1]), (1.2F + 2.0F * rim) * size,
                    colour);
    }
    for (const std::size_t end : {std::size_t{0}, way.size() - 1}) {
      if (way.empty() || !way[end]) continue;
      const float half = (2.5F + rim) * size;
      overlay_.box(x_of(*way[end]) - half, y_of(*way[end]) - half, 2.0F * half, 2.0F * half, colour);
    }
  }
}

void Hud::draw_profile(const Profile& profile, const Reading& reading, float width, float height) {
  const float size = overlay_.size();
  double low = 1e300;
  double high = -1e300;
  for (const double value : profile.heights) {
    if (std::isnan(value)) continue;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  if (low > high) return;
  const std::string unit = short_unit(reading.height_unit);
  const auto height_text = [&unit](double value) {
    return fmt::format("{:.6g} {}", std::round(value * 100.0) / 100.0 + 0.0, unit);
  };
  const float left = 0.26F * width;
  const float across = 0.48F * width;
  const float top = 0.70F * height;
  const float deep = 0.17F * height;
  overlay_.box(left, top, across, deep, kPanel);
  overlay_.text(left + 4.0F * size, top + 4.0F * size, height_text(high));
  overlay_.text(left + 4.0F * size, top + deep - 11.0F * size, height_text(low));
  const std::string length = describe_length(profile.length, reading.ground_unit);
  overlay_.text(left + across - overlay_.width_of(length) - 4.0F * size, top + 4.0F * size, length);
  const double range = std::max(high - low, 1e-9);
  const float inner = deep - 30.0F * size;
  const auto last = static_cast<float>(profile.heights.size() - 1);
  const auto y_of = [&](double value) {
    return top + 15.0F * size + inner * static_cast<float>((high - value) / range);
  };
  for (std::size_t i = 0; i + 1 < profile.heights.size(); ++i) {
    if (std::isnan(profile.heights[i]) || std::isnan(profile.heights[i + 1])) continue;
    const float x = left + 6.0F * size;
    const float whole = across - 12.0F * size;
    overlay_.line(x + whole * static_cast<float>(i) / last, y_of(profile.heights[i]),
                  x + whole * static_cast<float>(i + 1) / last, y_of(profile.heights[i + 1]), 1.2F * size, kInk);
  }
}

}  // namespace isohf::view
