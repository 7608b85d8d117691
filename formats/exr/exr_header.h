#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace isohf {

/// Bytes that looks_like_exr wants to see.
inline constexpr std::size_t kExrMagicBytes = 4;

/// Whether a file that begins with `head` is OpenEXR.
[[nodiscard]] bool looks_like_exr(std::span<const std::byte> head);

/// Walks the attributes of every header in an OpenEXR file and refuses what the OpenEXR library would believe at the
/// price of a giant allocation: attributes longer than the file, chunk tables that the file has no room for, data
/// windows and tiles whose chunks would not fit in kMaxExrChunkBytes. Reads attribute names and a few small values.
/// Throws Error without the path: kIo, kCorrupt, kUnsupported.
void check_exr_headers(const std::string& path);

/// The most bytes that one decoded chunk (a block of scan lines or a tile, all channels) may have, in a file that is
/// large enough to hold such chunks; less in small files.
inline constexpr std::uint64_t kMaxExrChunkBytes = std::uint64_t{1} << 30U;

}  // namespace isohf
