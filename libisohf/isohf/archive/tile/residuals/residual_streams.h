#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "isohf/archive/tile/tile_payload.h"
#include "isohf/base/memory/scratch.h"

/// A tile's residuals, from the order in which they are coded to the streams in which they are stored.

namespace isohf {

/// Zigzagged: 16 bits for codes, 32 for floats.
template <typename Zigzagged>
struct Residuals {
  Scratch<Zigzagged> zigzagged;  ///< in coding order
  Scratch<std::uint16_t> energies;
  std::vector<std::uint8_t> is_void;  ///< empty where no sample is void
  std::size_t count = 0;

  Residuals(std::size_t samples, bool has_voids)
      : zigzagged(samples), energies(samples), is_void(has_voids ? samples : 0), count(samples) {}

  void drop_voids() {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
      zigzagged.data()[kept] = zigzagged.data()[i];
      energies.data()[kept] = energies.data()[i];
      kept += is_void[i] == 0 ? 1 : 0;
    }
    count = kept;
  }
};

/// How much work the streams are worth.
struct StreamEffort {
  std::size_t context_thinning = 3;  ///< one residual in so many decides on the contexts of a large tile; odd
  bool has_pairs = true;             ///< symbols may be paired
};

/// The streams as they are stored: symbols by context, paired where that pays, and the extra bits.
struct Streams {
  std::vector<std::span<const std::byte>> symbols;  ///< of `single` or `paired`
  std::unique_ptr<std::uint8_t[]> single;
  std::vector<std::vector<std::byte>> paired;
  std::vector<std::byte> extra;
};

/// The shift that brings residuals to a mean below 2^4.
template <typename Zigzagged>
[[nodiscard]] std::uint8_t choose_energy_shift(const Residuals<Zigzagged>& residuals);

/// Puts the residuals context by context into `sorted`, each context's in order, and returns how many there are of
/// each; `histogram` is count_energies of them. The last half is sorted from its end, beside the first: one alone
/// would wait for its own pointers.
template <typename Zigzagged>
[[nodiscard]] std::vector<std::uint32_t> sort_by_context(const Residuals<Zigzagged>& residuals,
                                                         std::span<const std::uint16_t> thresholds,
                                                         std::span<const std::uint32_t> histogram, Zigzagged* sorted);

/// Cuts the residuals into contexts, as many as pay; completes the header's thresholds, counts and pairs.
template <typename Zigzagged>
[[nodiscard]] Streams make_streams(const Residuals<Zigzagged>& residuals, const StreamEffort& effort,
                                   PayloadHeader& header);

/// How many residuals there are of each energy: [kEnergyLimit].
[[nodiscard]] std::vector<std::uint32_t> count_energies(std::span<const std::uint16_t> energies);

/// Thresholds between contexts, ascending, for residuals given as symbols and energies in the same order, `histogram`
/// being count_energies of these. In large tiles one residual in `thinning` takes part. Deterministic; integers only.
[[nodiscard]] std::vector<std::uint16_t> choose_thresholds(std::span<const std::uint8_t> symbols,
                                                           std::span<const std::uint16_t> energies,
                                                           std::span<const std::uint32_t> histogram,
                                                           std::size_t thinning);

}  // namespace isohf
