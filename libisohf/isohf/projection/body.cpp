#include "isohf/projection/body.h"

#include <array>
#include <cctype>

#include "isohf/base/text/text.h"

namespace isohf {
namespace {

struct BodyRow {
  const char* name;
  double smallest_m;  // bounds of the semi-major axis; 0, 0 where the size says nothing
  double largest_m;
};

constexpr std::array<BodyRow, 19> kBodies = {{
    {"Earth", 6.35e6, 6.38e6},
    {"Mars", 3.3895e6, 3.3985e6},
    {"Moon", 1.7370e6, 1.7385e6},
    {"Mercury", 2.4390e6, 2.4410e6},
    {"Venus", 6.0510e6, 6.0525e6},
    {"Phobos", 0.0, 0.0},
    {"Deimos", 0.0, 0.0},
    {"Ceres", 0.0, 0.0},
    {"Vesta", 0.0, 0.0},
    {"Europa", 0.0, 0.0},
    {"Ganymede", 2.6310e6, 2.6330e6},
    {"Callisto", 2.4095e6, 2.4105e6},
    {"Titan", 2.5745e6, 2.5760e6},
    {"Enceladus", 0.0, 0.0},
    {"Triton", 0.0, 0.0},
    {"Pluto", 0.0, 0.0},
    {"Charon", 0.0, 0.0},
    {"Bennu", 0.0, 0.0},
    {"Ryugu", 0.0, 0.0},
}};

/// Whether `word` stands in `text` as a word of its own: "Mars_2000" and "GCS Mars" yes, "marsh" no.
bool has_word(const std::string& text, const std::string& word) {
  const auto is_letter = [&](std::size_t i) {
    return i < text.size() && std::isalpha(static_cast<unsigned char>(text[i])) != 0;
  };
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) {
    if ((at == 0 || !is_letter(at - 1)) && !is_letter(at + word.size())) return true;
  }
  return false;
}

}  // namespace

std::string body_of(std::string_view name, std::optional<double> semi_major_axis_m) {
  const std::string text = lower_case(name);
  for (const BodyRow& body : kBodies) {
    if (has_word(text, lower_case(body.name))) return body.name;
  }
  if (has_word(text, "lunar")) return "Moon";
  if (!semi_major_axis_m || !(*semi_major_axis_m > 0.0)) return {};
  for (const BodyRow& body : kBodies) {
    if (*semi_major_axis_m >= body.smallest_m && *semi_major_axis_m <= body.largest_m) return body.name;
  }
  return {};
}

Ellipsoid ellipsoid_of(const ReferenceSystem& system) {
  if (!system.semi_major_axis_m) return {};
  return {*system.semi_major_axis_m, system.inverse_flattening.value_or(0.0)};
}

}  // namespace isohf
