#include "isohf/archive/codec/void_mask.h"

#include <fmt/format.h>

#include <algorithm>

#include "isohf/error.h"

namespace isohf {

std::vector<std::byte> pack_void_mask(std::span<const std::uint8_t> is_void) {
  std::vector<std::byte> packed;
  std::uint8_t of = 0;
  for (auto at = is_void.begin(); at != is_void.end(); of ^= 1U) {
    const auto end = std::find(at, is_void.end(), static_cast<std::uint8_t>(of ^ 1U));
    auto run = static_cast<std::size_t>(end - at);
    for (; run >= 128; run >>= 7U) packed.push_back(static_cast<std::byte>(128 | (run & 127)));
    packed.push_back(static_cast<std::byte>(run));
    at = end;
  }
  return packed;
}

std::vector<std::uint8_t> unpack_void_mask(std::span<const std::byte> packed, std::size_t samples) {
  const auto refuse = [](const std::string& why) { throw Error(ErrorCode::kCorrupt, "void mask: " + why); };
  std::vector<std::uint8_t> is_void(samples);
  std::size_t filled = 0;
  std::uint8_t of = 0;
  for (std::size_t i = 0; i < packed.size(); of ^= 1U) {
    std::uint64_t run = 0;
    unsigned shift = 0;
    const std::size_t start = i;
    unsigned byte = 128;
    while (byte >= 128) {
      if (i == packed.size()) refuse("its last run is cut off");
      if (shift > 28) refuse(fmt::format("its run at byte {} is too long a number", start));
      byte = std::to_integer<unsigned>(packed[i++]);
      run |= std::uint64_t{byte & 127U} << shift;
      shift += 7;
    }
    if (byte == 0 && (start != 0 || i - start > 1))
      refuse(fmt::format("its run at byte {} is not in shortest form", start));
    if (run > samples - filled) refuse(fmt::format("its runs add up to more than {} samples", samples));
    std::fill_n(is_void.begin() + static_cast<std::ptrdiff_t>(filled), run, of);
    filled += run;
  }
  if (filled != samples) refuse(fmt::format("its runs add up to {} of {} samples", filled, samples));
  return is_void;
}

}  // namespace isohf
