#include "isohf/photo/srgb.h"

#include <cmath>
#include <cstddef>

namespace isohf {
namespace {

double decoded(double value) {
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

/// Where one value ends and the next begins, and where to begin to look.
struct Encoder {
  static constexpr int kSteps = 4096;
  std::array<float, 256> above;  ///< light from which on the value is one more
  std::array<std::uint8_t, kSteps + 1> start;

  Encoder() : above(), start() {
    for (std::size_t i = 0; i < 256; ++i)
      above[i] = static_cast<float>(decoded((static_cast<double>(i) + 0.5) / 255.0));
    std::uint8_t value = 0;
    for (int step = 0; step <= kSteps; ++step) {
      const float light = static_cast<float>(step) / kSteps;
      while (value < 255 && light >= above[value]) ++value;
      start[static_cast<std::size_t>(step)] = value;
    }
  }
};

}  // namespace

const std::array<float, 256>& linear_from_srgb() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> light{};
    for (std::size_t i = 0; i < 256; ++i) light[i] = static_cast<float>(decoded(static_cast<double>(i) / 255.0));
    return light;
  }();
  return table;
}

std::uint8_t srgb_from_linear(float light) {
  static const Encoder encoder;
  if (!(light > 0.0F)) return 0;
  if (light >= 1.0F) return 255;
  std::uint8_t value = encoder.start[static_cast<std::size_t>(light * static_cast<float>(Encoder::kSteps))];
  while (value < 255 && light >= encoder.above[value]) ++value;
  return value;
}

}  // namespace isohf
