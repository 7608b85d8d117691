#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace isohf {

/// Checks every header of an OpenEXR file for what would make the OpenEXR library allocate more than the file can fill:
/// attributes longer than the file, tables of chunks that it has no room for, chunks larger than kMaxExrChunkBytes.
/// Returns the rows of a chunk of each part, 0 for tiles. Throws Error without the path: kCorrupt, kUnsupported.
[[nodiscard]] std::vector<std::int64_t> check_exr_headers(const std::string& path);

/// Gives the OpenEXR library its own threads, once: they code the chunks of one request side by side. Four of them
/// already outrun what stands before and behind them.
void start_exr_threads();

/// Whether a file begins as OpenEXR does.
[[nodiscard]] bool looks_like_exr(std::span<const std::byte> head);

}  // namespace isohf
