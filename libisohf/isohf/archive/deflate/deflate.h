#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

/// Deflate (RFC 1951) of members that are not tiles, and exact inflation of all; the ZIP file's checksum.

namespace isohf {

/// Raw Deflate of any bytes, at one of libdeflate's levels, 1 to 12.
[[nodiscard]] std::vector<std::byte> deflate_bytes(std::span<const std::byte> bytes, int level = 9);

/// Inflates a raw Deflate stream that must fill `out` exactly and use up `deflated` exactly. Throws Error{kCorrupt}.
/// Thread-safe.
void inflate_exactly(std::span<const std::byte> deflated, std::span<std::byte> out);

/// Inflates in pieces that `take` may refuse: true if all of `deflated` is one stream and every piece is taken.
[[nodiscard]] bool inflate_in_pieces(std::span<const std::byte> deflated,
                                     const std::function<bool(std::span<const std::byte>)>& take);

/// CRC-32 as ZIP has it; `seed` continues an earlier one.
[[nodiscard]] std::uint32_t crc32(std::span<const std::byte> bytes, std::uint32_t seed = 0);
/// The same of a checksum's four bytes, little-endian: of many checksums in turn one for all.
[[nodiscard]] std::uint32_t crc32_of_crc32(std::uint32_t crc, std::uint32_t seed);

}  // namespace isohf
