#include "isohf/archive/codec/predict/activities.h"

#include "isohf/base/vectorised.h"

namespace isohf {
namespace {

ISOHF_VECTORISED(void, sum_magnitudes,
                 (const std::uint8_t* north, const std::uint8_t* far, int first, int last,
                  std::uint16_t* __restrict activities),
                 (north, far, first, last, activities)) {
  for (int place = first; place <= last; ++place) activities[place] = activity_of(north, far, place);
}

}  // namespace

void find_activities(const std::uint8_t* north, const std::uint8_t* far, int first, int last,
                     std::uint16_t* __restrict activities) {
  sum_magnitudes(north, far, first, last, activities);
}

std::array<std::uint8_t, kActivityLimit> context_table(std::span<const std::uint16_t> thresholds) {
  std::array<std::uint8_t, kActivityLimit> table{};
  for (const std::uint16_t threshold : thresholds) {
    for (std::size_t activity = threshold; activity < table.size(); ++activity) ++table[activity];
  }
  return table;
}

}  // namespace isohf
