#pragma once

#include <memory>
#include <string>

#include "isohf/raster.h"

namespace isohf {

/// Whether a file of this name is meant to be SRTM HGT: it ends in .hgt, .hgt.gz or .hgt.zip, in any case. HGT has no
/// signature.
[[nodiscard]] bool is_hgt_name(const std::string& path);

/// Whether the file is called .zip and is an archive with an .hgt inside, as NASADEM_HGT_n44e006.zip is.
[[nodiscard]] bool is_zip_of_hgt(const std::string& path);

/// Opens an SRTM tile, plain, in gzip, or as the one .hgt member of a zip archive (NASA, SRTM topography, 2005):
/// big-endian 16 bit metres above EGM96 on posts, n x n of one degree (1201: 3", 3601: 1") or 1801 x 3601, void -32768.
/// The name says where: N44E006.hgt has its South-West post at 44 N, 6 E; a name that does not leaves the origin
/// unknown, with a warning. Throws Error: kIo, kCorrupt (a length that
/// no tile has; a damaged archive), kUnsupported, kInvalidArgument.
[[nodiscard]] std::unique_ptr<HeightSource> open_hgt(const std::string& path, const OpenOptions& options);

}  // namespace isohf
