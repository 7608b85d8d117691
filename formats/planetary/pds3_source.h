#pragma once

#include <memory>
#include <span>
#include <string>

#include "isohf/raster.h"

namespace isohf {

/// Whether these first bytes of a file are a PDS3 label's: PDS_VERSION_ID, behind an SFDU line or none.
[[nodiscard]] bool looks_like_pds3(std::span<const std::byte> head);

/// Whether `path` is a data file (.img) whose PDS3 label lies beside it: the same name with .lbl, in any case.
[[nodiscard]] bool has_pds3_label(const std::string& path);

/// Opens the IMAGE of a PDS3 product (PDS Standards Reference 3.8): a label with the samples behind it, a label (.lbl)
/// that names the data file beside it, or that data file. Integers of 8, 16, 32 bits and IEEE floats of 32, 64, in both
/// byte orders; line prefixes and suffixes; bands in any order, of which `options.channel` picks one by its number from
/// 0. SCALING_FACTOR and OFFSET are the vertical scale and offset; MISSING_CONSTANT and its kin are voids, and so is
/// what lies below ISIS's valid range in 32 bit floats. The place is place_from_pds3's. Throws Error naming file and
/// label line: kIo, kCorrupt, kUnsupported (compressed, VAX floats), kInvalidArgument.
[[nodiscard]] std::unique_ptr<HeightSource> open_pds3(const std::string& path, const OpenOptions& options);

}  // namespace isohf
