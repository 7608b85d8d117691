#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

/// The void mask of a tile as run lengths: samples that are known, samples that are void, and so on in turn, in
/// storage order; each length as a LEB128 number. Only the first may be 0; they add up to the number of samples.

namespace isohf {

/// `is_void` holds 0 or 1 for each sample.
[[nodiscard]] std::vector<std::byte> pack_void_mask(std::span<const std::uint8_t> is_void);

/// Throws Error{kCorrupt} where the runs do not add up to `samples` or are not as pack_void_mask makes them.
[[nodiscard]] std::vector<std::uint8_t> unpack_void_mask(std::span<const std::byte> packed, std::size_t samples);

}  // namespace isohf
