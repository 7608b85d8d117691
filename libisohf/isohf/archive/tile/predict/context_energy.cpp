#include "isohf/archive/tile/predict/context_energy.h"

#include "isohf/base/simd.h"

namespace isohf {
namespace {

ISOHF_KERNEL void sum_magnitudes(const std::uint8_t* north, const std::uint8_t* far, int first, int last,
                                 std::uint16_t* __restrict energies) {
  for (int place = first; place <= last; ++place) energies[place] = context_energy(north, far, place);
}

}  // namespace

void find_energies(const std::uint8_t* north, const std::uint8_t* far, int first, int last,
                   std::uint16_t* __restrict energies) {
  vectorised<sum_magnitudes>(north, far, first, last, energies);
}

std::array<std::uint8_t, kEnergyLimit> context_table(std::span<const std::uint16_t> thresholds) {
  std::array<std::uint8_t, kEnergyLimit> table{};
  for (const std::uint16_t threshold : thresholds) {
    for (std::size_t energy = threshold; energy < table.size(); ++energy) ++table[energy];
  }
  return table;
}

}  // namespace isohf
