#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstdlib>

#include "isohf/archive/tile/residuals/residual_symbols.h"

/// Predictions in eighths of a code, residuals turned by them, and the contexts that follow: how codec version 2 sees a
/// sample (docs/archive_format.md, "Payload version 2").

namespace isohf {

inline constexpr int kEighthsBits = 3;
inline constexpr std::int32_t kMaxDeviation = 0xffff;

/// What a prediction in eighths says of a sample: the code next to it, on which side of that it lies, and how far from
/// the middle between two codes.
struct FinePrediction {
  std::int32_t code;
  bool is_above;          ///< the code above is likelier than the one below
  std::uint32_t quarter;  ///< 0: on the code ... 3: half-way to the next

  explicit FinePrediction(std::int32_t eighths) : code((eighths + 4) >> kEighthsBits) {
    const std::int32_t off = eighths - (code << kEighthsBits);  // -4..3
    is_above = off >= 0;
    quarter = static_cast<std::uint32_t>(is_above ? off : -1 - off);
  }

  /// The zigzagged residual of a sample, and the sample of a residual; both modulo 2^16.
  [[nodiscard]] std::uint32_t residual_of(std::int32_t sample) const {
    const auto turned = static_cast<std::int16_t>(is_above ? code - sample : sample - code);
    return zigzag(turned) & 0xffffU;
  }
  [[nodiscard]] std::int32_t sample_of(std::uint32_t residual) const {
    const auto turned = static_cast<std::int32_t>(unzigzag(residual));
    return (is_above ? code - turned : code + turned) & 0xffff;
  }
};

/// How far a sample lies from its prediction, in eighths.
[[nodiscard]] inline std::int32_t deviation(std::int32_t sample, std::int32_t eighths) {
  return std::min(std::abs((sample << kEighthsBits) - eighths), kMaxDeviation);
}

/// Classes of energies, two an octave.
inline constexpr std::uint32_t kClasses = 45;
inline constexpr std::uint32_t kLastSmoothClass = 15;  ///< up to it quarters and patterns count
[[nodiscard]] inline std::uint32_t class_of(std::uint32_t energy) {
  if (energy == 0) return 0;
  const auto octave = static_cast<std::uint32_t>(std::bit_width(energy)) - 1;
  return 1 + 2 * octave + (octave == 0 ? 0 : (energy >> (octave - 1)) & 1U);
}
/// Low bits of residuals that are stored as they are.
[[nodiscard]] inline std::uint32_t plain_bits_of(std::uint32_t of_class) {
  return of_class <= kLastSmoothClass ? 0 : (of_class - kLastSmoothClass) / 2;
}

/// How four neighbours compare with NE: base 3, each 0 below, 1 equal, 2 above; turned as the residual is.
inline constexpr std::uint32_t kPatterns = 81;
inline constexpr std::uint32_t kLevelPattern = 40;
[[nodiscard]] inline std::uint32_t pattern_of(std::int32_t w, std::int32_t nw, std::int32_t nee, std::int32_t nww,
                                              std::int32_t ne, bool is_above) {
  const auto compared = [ne](std::int32_t sample) { return (sample > ne ? 1 : 0) - (sample < ne ? 1 : 0); };
  const std::int32_t pattern = 27 * compared(w) + 9 * compared(nw) + 3 * compared(nee) + compared(nww);
  return kLevelPattern + static_cast<std::uint32_t>(is_above ? pattern : -pattern);
}

/// Contexts: first those that know no pattern, by class and, of smooth ones, quarter; then those that do.
inline constexpr std::uint32_t kSmoothContexts = 4 * (kLastSmoothClass + 1);
inline constexpr std::uint32_t kPlainContexts = kSmoothContexts + kClasses - kLastSmoothClass - 1;
inline constexpr std::uint32_t kAllContexts = kPlainContexts + kSmoothContexts * kPatterns;
[[nodiscard]] inline std::uint32_t context_of(std::uint32_t of_class, std::uint32_t quarter, std::uint32_t pattern) {
  if (of_class > kLastSmoothClass) return kSmoothContexts + of_class - kLastSmoothClass - 1;
  return kPlainContexts + (4 * of_class + quarter) * kPatterns + pattern;
}
[[nodiscard]] inline std::uint32_t parent_of(std::uint32_t context) {
  return context < kPlainContexts ? context : (context - kPlainContexts) / kPatterns;
}

/// The energy of a place from the deviations around: `own` W and WW, `north` and `far` as in prediction.
template <typename Deviation>
[[nodiscard]] inline std::uint32_t fine_energy(const Deviation* own, const Deviation* north, const Deviation* far,
                                               int place) {
  const auto* const n = north + place;
  const auto* const f = far + place;
  return static_cast<std::uint32_t>(4 * (n[0] + n[-1] + f[0]) + 3 * n[1] + 2 * (n[2] + n[-2] + f[1] + f[-1]) + n[-3] +
                                    f[2] + f[-2] + 6 * own[place - 1] + 3 * own[place - 2]);
}
/// The same of a slid vertex, from the two places beside it.
[[nodiscard]] inline std::uint32_t fine_energy_of_slid(std::int32_t west, std::int32_t east) {
  return static_cast<std::uint32_t>(17 * (west + east));
}

/// The order in which a tile's samples are coded: bands of eight rows, in each row by row seven half places behind the
/// row above, so that the rows of a band can be worked on at once.
inline constexpr int kBandRows = 8;
inline constexpr int kMostBandDelay = (7 * (kBandRows - 1) + 1) / 2;
[[nodiscard]] constexpr int delay_of_row(int row_in_band) {
  return (7 * row_in_band + 1) / 2;
}

}  // namespace isohf
