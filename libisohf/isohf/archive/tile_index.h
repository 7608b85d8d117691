#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "isohf/archive.h"

/// The member index.bin of version 1: one record for each tile of the grid, by flat index, and a footer that is the last
/// thing before the ZIP directory (docs/archive_format.md, "Version 1").

namespace isohf {

inline constexpr std::size_t kIndexRecordBytes = 32;
inline constexpr std::size_t kIndexFooterBytes = 64;

/// What the footer says.
struct IndexFooter {
  std::uint64_t record_count = 0;
  std::uint64_t stored_count = 0;       ///< tiles that are stored
  std::uint64_t directory_entries = 0;  ///< of the ZIP directory, index.bin's own not counted
  std::uint64_t directory_bytes = 0;    ///< of these entries
  std::uint32_t directory_crc32 = 0;    ///< of these entries
  std::uint32_t records_crc32 = 0;
};

/// What records of both versions begin with, into `entry`; returns the flags behind it.
[[nodiscard]] std::uint32_t read_record(std::span<const std::byte> record, TileEntry& entry);
/// The record as it stands; reserved bits and the rules for absent tiles are checked: nullopt where they are broken.
[[nodiscard]] std::optional<TileEntry> parse_index_record(std::span<const std::byte> record);
/// nullopt where there is no valid footer of a known version.
[[nodiscard]] std::optional<IndexFooter> parse_index_footer(std::span<const std::byte> footer);

/// What no index says and nobody knows without decoding, as of repacked archives: voids, and the widest range.
void set_unknown_range(const Quantisation& quantisation, TileEntry& entry);
[[nodiscard]] bool has_unknown_range(const Quantisation& quantisation, const TileEntry& entry);

}  // namespace isohf
