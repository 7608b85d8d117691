#pragma once

#include <memory>
#include <span>
#include <string>

#include "isohf/raster.h"

namespace isohf {

/// Whether these first bytes are a DTED cell's: its user header label, behind a tape's header record or none.
[[nodiscard]] bool looks_like_dted(std::span<const std::byte> head);

/// Opens a DTED cell of any level (MIL-PRF-89020B): columns of posts from South to North, each a record with a
/// checksum, sign-magnitude metres, void -32767. A column's record is checked whole when it is first touched, and a
/// wrong sentinel, number or checksum is an error that names the column; later windows read only their rows, so memory
/// is one record. Throws Error: kIo, kCorrupt, kUnsupported (a rotated cell), kInvalidArgument (a channel other than
/// 0).
[[nodiscard]] std::unique_ptr<HeightSource> open_dted(const std::string& path, const OpenOptions& options);

}  // namespace isohf
