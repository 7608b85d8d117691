#include "isohf/archive/deflate/byte_counts.h"

namespace isohf {

// Four tables: one alone would wait for its own counts where bytes repeat.
ByteCounts count_bytes(std::span<const std::byte> bytes) {
  std::array<ByteCounts, 4> counts{};
  const auto count = [&](std::size_t lane, std::size_t i) { ++counts[lane][std::to_integer<std::size_t>(bytes[i])]; };
  std::size_t i = 0;
  for (; i + 4 <= bytes.size(); i += 4) {
    for (std::size_t lane = 0; lane < 4; ++lane) count(lane, i + lane);
  }
  for (; i < bytes.size(); ++i) count(0, i);
  for (std::size_t byte = 0; byte < 256; ++byte) {
    counts[0][byte] += counts[1][byte] + counts[2][byte] + counts[3][byte];
  }
  return counts[0];
}

}  // namespace isohf
