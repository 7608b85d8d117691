#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "isohf/archive/codec/simd/batch_rows.h"
#include "isohf/archive/codec/tile_payload.h"

/// The residuals of tiles that are decoded side by side: taken from the streams of their contexts, row by row.

namespace isohf {

/// One tile's payload, its residuals put together. Zigzagged: uint16 for codes, uint32 for floats.
template <typename Zigzagged>
struct BatchPayload {
  PayloadHeader header;
  std::vector<std::uint8_t> is_void;                        ///< in row order; empty where nothing is void
  std::unique_ptr<Zigzagged[]> zigzagged;                   ///< context by context, and a row's worth of zeros
  std::array<const Zigzagged*, kMaxContexts + 1> starts{};  ///< of the contexts; all past the last one end there

  /// False where the payload is not for this decoder. Throws Error where it is broken.
  [[nodiscard]] bool open(const TileShape& shape, CodeType type, std::span<const std::byte> payload);
  /// A row's voids by column, or nullptr where it has none.
  [[nodiscard]] const std::uint8_t* void_row(int columns, int r) const;

 private:
  [[nodiscard]] bool expand(int columns, std::span<const std::span<const std::byte>> symbols,
                            std::span<const std::byte> extra, std::size_t count);
};

/// Residuals of all lanes, side by side at each place.
template <typename Zigzagged>
class BatchResiduals {
 public:
  explicit BatchResiduals(int columns);

  /// Lanes are opened in order. The payload must outlive this.
  void open(const BatchPayload<Zigzagged>& payload);

  /// Takes the residuals of row r. A lane that a context has run out of is no longer good.
  void take_row(int r);

  /// By place and lane: the row's residuals; and which are void, where has_voids() says that some are.
  [[nodiscard]] const Zigzagged* zigzagged() const { return zigzagged_.data(); }
  [[nodiscard]] const std::uint8_t* is_void() const { return is_void_.data(); }
  [[nodiscard]] bool has_voids() const { return has_voids_; }
  [[nodiscard]] const std::uint8_t* void_row(std::size_t lane) const { return void_rows_[lane]; }
  /// The residual of a slid vertex of an even row: 0 West, 1 East.
  [[nodiscard]] std::uint32_t slid(std::size_t lane, int side) const {
    return slid_[static_cast<std::size_t>(side)][lane];
  }
  [[nodiscard]] bool is_good(std::size_t lane) const { return is_good_[lane]; }

 private:
  using Streams = std::array<const Zigzagged*, kMaxContexts>;

  void take_places(int first, int last);
  void take_around_voids(std::size_t lane, int r, int first, int last);
  void take_slid(std::size_t lane);
  void find_magnitudes(std::ptrdiff_t begin, std::ptrdiff_t end);
  void close_row(int first, int last);
  [[nodiscard]] std::uint8_t* magnitudes(std::size_t back);

  int columns_;
  std::size_t count_ = 0;
  PerLane<const BatchPayload<Zigzagged>*> payloads_{};
  std::vector<std::uint8_t> tables_;  ///< kEnergyLimit of each lane
  PerLane<Streams> next_{};
  PerLane<std::int32_t> shifts_{};
  PerLane<bool> is_good_{};
  PerLane<const std::uint8_t*> void_rows_{};
  std::array<PerLane<Zigzagged>, 2> slid_{};
  std::array<std::vector<std::uint8_t>, 3> magnitudes_;  ///< of the row, and of the two above it
  std::vector<std::uint16_t> energies_;
  std::vector<Zigzagged> zigzagged_;
  std::vector<Zigzagged> nothing_;  ///< what lanes without a tile take
  std::vector<std::uint8_t> is_void_;
  bool has_voids_ = false;
};

}  // namespace isohf
