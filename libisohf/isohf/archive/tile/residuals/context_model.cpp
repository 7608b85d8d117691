#include "isohf/archive/tile/residuals/residual_streams.h"

#include <algorithm>

#include "isohf/archive/tile/predict/context_energy.h"
#include "isohf/archive/tile/residuals/code_cost.h"
#include "isohf/archive/tile/tile_payload.h"

namespace isohf {
namespace {

constexpr std::size_t kSymbols = 256;
constexpr std::uint64_t kTableBits = 150;      // of a context beside its code lengths: threshold, count, block header
constexpr std::size_t kSymbolsToThin = 16384;  // below, all take part
constexpr std::uint64_t kBitsPerSymbol = 3;    // of a code length in a block header

/// The symbols of one range of energies and what coding them takes.
struct Group {
  unsigned end;  ///< first energy that is not in it
  std::array<std::uint32_t, kSymbols> counts{};

  [[nodiscard]] std::uint64_t bits_with(const Group& other) const {
    std::uint64_t total = 0;
    std::uint64_t parts = 0;
    std::uint64_t used = 0;
    for (std::size_t symbol = 0; symbol < kSymbols; ++symbol) {
      const std::uint64_t count = std::uint64_t{counts[symbol]} + other.counts[symbol];
      if (count == 0) continue;
      total += count;
      parts += n_log_n(count);
      ++used;
    }
    // A code has no less than one bit a symbol.
    return std::max((n_log_n(total) - parts) >> 16U, total / 4) + kTableBits + kBitsPerSymbol * used;
  }
};

}  // namespace

std::vector<std::uint32_t> count_energies(std::span<const std::uint16_t> energies) {
  // Two tables: one alone would wait for its own counts where energies repeat.
  std::vector<std::uint32_t> histogram(kEnergyLimit);
  std::vector<std::uint32_t> odd(kEnergyLimit);
  std::size_t i = 0;
  for (; i + 2 <= energies.size(); i += 2) {
    ++histogram[energies[i]];
    ++odd[energies[i + 1]];
  }
  if (i < energies.size()) ++odd[energies[i]];
  for (std::size_t energy = 0; energy < histogram.size(); ++energy) histogram[energy] += odd[energy];
  return histogram;
}

std::vector<std::uint16_t> choose_thresholds(std::span<const std::uint8_t> symbols,
                                             std::span<const std::uint16_t> energies,
                                             std::span<const std::uint32_t> histogram, std::size_t thinning) {
  // Start from ranges of about equal count...
  std::vector<Group> groups;
  std::vector<std::uint8_t> group_of(kEnergyLimit);
  const std::uint64_t share = symbols.size() / kMaxContexts + 1;
  std::uint64_t in_group = 0;
  for (unsigned at = 0; at < kEnergyLimit; ++at) {
    group_of[at] = static_cast<std::uint8_t>(groups.size());
    in_group += histogram[at];
    if (in_group >= share && groups.size() + 1 < kMaxContexts) {
      groups.push_back({at + 1, {}});
      in_group = 0;
    }
  }
  groups.push_back({kEnergyLimit, {}});
  const std::size_t step = symbols.size() >= kSymbolsToThin ? thinning : 1;
  for (std::size_t i = 0; i < symbols.size(); i += step) {
    groups[group_of[energies[i]]].counts[symbols[i]] += static_cast<std::uint32_t>(step);
  }

  // ... and join the two neighbours whose joining saves most, while any does.
  const Group nothing{};
  std::vector<std::uint64_t> alone;
  std::vector<std::uint64_t> joined;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    alone.push_back(groups[i].bits_with(nothing));
    if (i > 0) joined.push_back(groups[i - 1].bits_with(groups[i]));
  }
  while (groups.size() > 1) {
    std::size_t best = 0;
    std::int64_t best_gain = -1;
    for (std::size_t i = 0; i + 1 < groups.size(); ++i) {
      const std::int64_t gain =
          static_cast<std::int64_t>(alone[i] + alone[i + 1]) - static_cast<std::int64_t>(joined[i]);
      if (gain > best_gain) {
        best = i;
        best_gain = gain;
      }
    }
    if (best_gain < 0) break;
    Group& kept = groups[best];
    const auto next = static_cast<std::ptrdiff_t>(best) + 1;
    for (std::size_t symbol = 0; symbol < kSymbols; ++symbol) kept.counts[symbol] += groups[best + 1].counts[symbol];
    kept.end = groups[best + 1].end;
    alone[best] = joined[best];
    groups.erase(groups.begin() + next);
    alone.erase(alone.begin() + next);
    joined.erase(joined.begin() + next - 1);
    if (best > 0) joined[best - 1] = groups[best - 1].bits_with(groups[best]);
    if (best + 1 < groups.size()) joined[best] = groups[best].bits_with(groups[best + 1]);
  }
  std::vector<std::uint16_t> thresholds;
  for (std::size_t i = 0; i + 1 < groups.size(); ++i) thresholds.push_back(static_cast<std::uint16_t>(groups[i].end));
  return thresholds;
}

}  // namespace isohf
