#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "isohf/surface.h"

/// Source samples as what is left after predicting them from the archive's surface (docs/archive_format.md, residuals).
///
/// A sample and its prediction are mapped to unsigned integers in the order of their values; the residual is the
/// difference modulo 2^bits, folded so that small ones of both signs are small. Residuals are sorted into streams by
/// the size of the two before them (West and North), their bytes into planes. Samples without an elevation, and those
/// where the surface has none, are kept as they are.

namespace isohf {

/// A member's bytes and where its parts end, so that each can have a Huffman table of its own.
struct ResidualPayload {
  std::vector<std::byte> bytes;
  std::vector<std::size_t> part_ends;

  void end_part() {
    if (part_ends.empty() || part_ends.back() != bytes.size()) part_ends.push_back(bytes.size());
  }
};

/// Codes whole rows. raw [n] source samples, little-endian   predicted [n] elevations, NaN where there is none
/// is_void [n]  1 where the source sample is no elevation   width  samples a row
[[nodiscard]] ResidualPayload encode_residuals(const SampleMapping& mapping, std::int64_t width,
                                               std::span<const std::byte> raw, std::span<const char> is_void,
                                               std::span<const double> predicted);

/// The samples again: raw [n] out. Throws Error{kCorrupt} for whatever does not fill them exactly.
void decode_residuals(const SampleMapping& mapping, std::int64_t width, std::span<const std::byte> payload,
                      std::span<const double> predicted, std::span<std::byte> raw);

}  // namespace isohf
