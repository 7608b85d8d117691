#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

/// What chooses the context of a residual (docs/archive_format.md, "Tile payload").

namespace isohf {

/// How rough the tile is around a place, from the residuals of the two rows above it: a weighted sum of these, shifted
/// and limited, so that it needs no more than 12 bits. The rows above alone: a decoder knows the contexts of a whole
/// row before it reads a residual of it.
///
///     1 . 2 . 4 . 2 . 1      row r-2
///   1 . 2 . 4 . 4 . 3 . 2    row r-1
///              (x)
inline constexpr unsigned kEnergyLimit = 4096;  ///< energies are below this
inline constexpr unsigned kEnergyWeight = 26;   ///< sum of the weights
inline constexpr std::uint32_t kMagnitudeLimit = (kEnergyLimit - 1) / kEnergyWeight;

/// What a zigzagged residual counts in energies.
[[nodiscard]] inline std::uint8_t magnitude(std::uint32_t zigzagged, unsigned shift) {
  const std::uint32_t shifted = zigzagged >> shift;
  return static_cast<std::uint8_t>(shifted < kMagnitudeLimit ? shifted : kMagnitudeLimit);
}
/// `north` as in prediction, so that north[place] is NE's; far[place] is NN's.
[[nodiscard]] inline std::uint16_t context_energy(const std::uint8_t* north, const std::uint8_t* far, int place) {
  const std::uint8_t* const n = north + place;
  const std::uint8_t* const f = far + place;
  return static_cast<std::uint16_t>(4 * (n[0] + n[-1] + f[0]) + 3 * n[1] + 2 * (n[2] + n[-2] + f[1] + f[-1]) + n[-3] +
                                    f[2] + f[-2]);
}
/// The same for a slid vertex, from the two lattice places beside it.
[[nodiscard]] inline std::uint16_t context_energy_of_slid(std::uint8_t west, std::uint8_t east) {
  return static_cast<std::uint16_t>(kEnergyWeight / 2 * (unsigned{west} + east));
}

/// Energies of places first to last of a row.
void find_energies(const std::uint8_t* north, const std::uint8_t* far, int first, int last,
                   std::uint16_t* __restrict energies);

/// The context of every energy: how many thresholds it reaches.
[[nodiscard]] std::array<std::uint8_t, kEnergyLimit> context_table(std::span<const std::uint16_t> thresholds);

/// Magnitudes of the row that is worked on and the two above it, with margins of three places.
class MagnitudeRows {
 public:
  explicit MagnitudeRows(int columns) : columns_(columns) {
    for (auto& row : rows_) row.resize(static_cast<std::size_t>(columns) + 2 * kMargin);
  }

  [[nodiscard]] std::uint8_t* current() { return rows_[0].data() + kMargin; }
  [[nodiscard]] const std::uint8_t* above() const { return rows_[1].data() + kMargin; }
  [[nodiscard]] const std::uint8_t* far_above() const { return rows_[2].data() + kMargin; }

  /// After a row: its margins repeat the outermost magnitudes, and it becomes the one above.
  void close_row(int first, int last) {
    std::uint8_t* const row = current();
    for (int place = -kMargin; place < first; ++place) row[place] = row[first];
    for (int place = last + 1; place < columns_ + kMargin; ++place) row[place] = row[last];
    rows_[2].swap(rows_[1]);
    rows_[1].swap(rows_[0]);
  }

 private:
  static constexpr int kMargin = 3;
  int columns_;
  std::array<std::vector<std::uint8_t>, 3> rows_;
};

}  // namespace isohf
