#include "isohf/archive/tile/simd/slanted_rows.h"

#include <algorithm>

#include "isohf/base/simd.h"

namespace isohf {
namespace {

ISOHF_KERNEL void turn_band(SlantedRows& slanted, const std::array<std::uint16_t*, 8>& codes, int times) {
  constexpr auto kStride = static_cast<std::ptrdiff_t>(sizeof(SlantedRows::Time) / sizeof(std::int32_t));
  for (int t = 0; t < times; t += 8) turn_square<kStride>(&slanted.at(t + 1).pair(0), codes, t);
}

}  // namespace

const std::uint8_t* voids_of_band(const std::vector<std::uint8_t>& is_void, int top, int rows, int columns) {
  if (is_void.empty()) return nullptr;
  const std::uint8_t* const first = is_void.data() + static_cast<std::ptrdiff_t>(top) * columns;
  const std::uint8_t* const end = first + static_cast<std::ptrdiff_t>(rows) * columns;
  return std::find(first, end, 1) == end ? nullptr : first;
}

void BandCodes::store(const SlantedBand& band, std::uint16_t* codes) {
  std::array<std::uint16_t*, 8> rows{};
  for (int lane = 0; lane < SlantedRows::kLanes; ++lane) {
    rows[static_cast<std::size_t>(lane)] = codes_.data() + lane * stride_ + kSpare - delay(lane);
  }
  vectorised<turn_band>(band.slanted, rows, columns_ + delay(SlantedRows::kLanes - 1));
  for (int lane = 0; lane < band.rows; ++lane) {
    const std::uint16_t* const from = codes_.data() + lane * stride_ + kSpare;
    std::uint16_t* const row =
        std::copy_n(from, columns_, codes + static_cast<std::ptrdiff_t>(lane) * columns_) - columns_;
    if (lane % 2 == 0) {
      row[0] = from[first_of(lane)];
      row[columns_ - 1] = from[last_of(lane, columns_)];
    }
    if (band.is_void == nullptr) continue;
    const std::uint8_t* const is_void = band.is_void + static_cast<std::ptrdiff_t>(lane) * columns_;
    for (int c = 0; c < columns_; ++c) row[c] = is_void[c] != 0 ? void_ : row[c];
  }
}

}  // namespace isohf
