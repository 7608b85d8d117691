#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "isohf/raster.h"

namespace isohf {

/// Whether a file that begins with `head` is an ESRI or GRASS ASCII grid: its first word is one of their headers'.
[[nodiscard]] bool looks_like_ascii_grid(std::span<const std::byte> head);

/// Opens an ESRI ASCII grid: header words in any order and case, then ncols x nrows numbers from the North-West corner
/// on, broken into lines anywhere. Cells are areas, whether a corner or a centre places them. A .prj beside it is read.
/// A GRASS ASCII grid differs in its header (grass_header.h), and in that the word of null:, or *, is a void.
///
/// Numbers have a decimal point or, all of them, a decimal comma; nan and inf are void. A file of whole numbers that
/// fit 32 bits, none with an exponent, has int32 samples, any other float64 samples: the numbers as written. Opening
/// reads the file once, checks every number, and keeps the places of at most 65536 rows; windows read from the nearest
/// of them, and on from the last one's end. Throws Error naming file and line: kCorrupt (too few or too many numbers, a
/// word that is none, a contradictory header), kUnsupported (an unknown header word), kIo,
/// kInvalidArgument (a channel).
[[nodiscard]] std::unique_ptr<HeightSource> open_ascii_grid(const std::string& path, const OpenOptions& options);

}  // namespace isohf
