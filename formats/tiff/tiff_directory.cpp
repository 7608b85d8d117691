#include "formats/tiff/tiff_directory.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <span>

namespace isohf {

std::optional<std::uint64_t> tiff_stored_count(const RawFile& file, const TiffDirectoryPlace& place,
                                               std::uint16_t wanted) {
  const auto number = [&](std::uint64_t offset, std::size_t bytes) {
    std::array<std::byte, 8> stored = {};
    file.read(offset, std::span(stored).first(bytes));
    if (place.swapped) std::reverse(stored.begin(), stored.begin() + static_cast<std::ptrdiff_t>(bytes));
    return std::bit_cast<std::uint64_t>(stored);  // little-endian, which base/bytes.h asserts
  };
  const std::uint64_t entries = number(place.offset_bytes, place.big_tiff ? 8 : 2);
  for (std::uint64_t i = 0; i < entries; ++i) {
    const std::uint64_t entry = place.offset_bytes + (place.big_tiff ? 8 + 20 * i : 2 + 12 * i);
    if (number(entry, 2) == wanted) return number(entry + 4, place.big_tiff ? 8 : 4);
  }
  return std::nullopt;
}

}  // namespace isohf
