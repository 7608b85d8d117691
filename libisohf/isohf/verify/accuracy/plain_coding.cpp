#include "isohf/verify/accuracy/plain_coding.h"

#include <bit>
#include <cstddef>
#include <vector>

#include "isohf/archive/deflate/deflate.h"

namespace isohf {
namespace {

constexpr int kLevel = 6;  // what writers of such files take where nobody asks

std::byte byte_of(std::uint32_t value, unsigned index) {
  return static_cast<std::byte>((value >> (8 * index)) & 0xffU);
}

/// Predictor 2.
void add_differences(std::span<const std::uint16_t> row, std::size_t bytes_each, std::vector<std::byte>& out) {
  std::uint32_t last = 0;
  for (const std::uint16_t code : row) {
    const std::uint32_t difference = code - last;
    for (unsigned b = 0; b < bytes_each; ++b) out.push_back(byte_of(difference, b));
    last = code;
  }
}

/// Predictor 3: the bytes of the floats, most significant plane first, then differences of neighbouring bytes.
void add_planes(std::span<const float> row, std::vector<std::byte>& out) {
  unsigned last = 0;
  for (unsigned plane = 4; plane-- > 0;) {
    for (const float height : row) {
      const auto byte = std::to_integer<unsigned>(byte_of(std::bit_cast<std::uint32_t>(height), plane));
      out.push_back(static_cast<std::byte>((byte - last) & 0xffU));
      last = byte;
    }
  }
}

}  // namespace

std::uint64_t plainly_coded_bytes(const TileCodes& samples, std::span<const std::int64_t> widths) {
  std::vector<std::byte> bytes;
  std::size_t at = 0;
  for (const std::int64_t width : widths) {
    const auto count = static_cast<std::size_t>(width);
    if (samples.type == CodeType::kF32) {
      add_planes(std::span(samples.heights).subspan(at, count), bytes);
    } else {
      add_differences(std::span(samples.codes).subspan(at, count), samples.type == CodeType::kU8 ? 1 : 2, bytes);
    }
    at += count;
  }
  return deflate_bytes(bytes, kLevel).size();
}

}  // namespace isohf
