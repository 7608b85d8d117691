#pragma once

#include <memory>
#include <span>
#include <string>

#include "isohf/raster.h"

namespace isohf {

/// Whether these first bytes are a NumPy array's: \x93NUMPY.
[[nodiscard]] bool looks_like_npy(std::span<const std::byte> head);

/// Opens an array that numpy.save wrote (NEP 1, versions 1 to 3): two dimensions, rows from North to South, C or
/// Fortran order, integers of 8 to 32 bits and floats of 16 to 64 in either byte order. The file says nothing of place
/// or units. Throws Error: kIo, kCorrupt, kUnsupported (other shapes and types), kInvalidArgument.
[[nodiscard]] std::unique_ptr<HeightSource> open_npy(const std::string& path, const OpenOptions& options);

/// Opens one array of an archive that numpy.savez wrote, stored or deflated: the one that options.channel names, else
/// the first that open_npy would read, with a warning when there are others.
[[nodiscard]] std::unique_ptr<HeightSource> open_npz(const std::string& path, const OpenOptions& options);

}  // namespace isohf
