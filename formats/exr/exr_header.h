#pragma once

#include <cstdint>
#include <string>

namespace isohf {

/// Walks the attributes of every header in an OpenEXR file and refuses what the OpenEXR library would believe at the
/// price of a giant allocation: attributes longer than the file, chunk tables that the file has no room for, data
/// windows and tiles whose chunks would not fit in kMaxExrChunkBytes. Reads attribute names and a few small values.
/// Throws Error without the path: kIo, kCorrupt, kUnsupported.
void check_exr_headers(const std::string& path);

/// Rows of a chunk of scan lines, by the number of its compression. Throws Error{kUnsupported} for an unknown one.
[[nodiscard]] std::int64_t scan_lines_per_chunk(std::uint8_t compression);

/// Gives the OpenEXR library its own threads, once: they code the chunks of one request side by side. Four of them
/// already outrun what stands before and behind them.
void start_exr_threads();

}  // namespace isohf
