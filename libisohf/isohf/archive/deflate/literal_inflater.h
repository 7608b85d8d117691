#pragma once

#include <cstddef>
#include <span>

namespace isohf {

/// Inflates raw Deflate streams of the kind that DeflateWriter makes, literals and runs of one byte, two literals at a
/// look-up: a tile's codes are short, and a decoder for all of Deflate waits for each literal's look-up alone.
///
/// True where `deflated` is such a stream, fills `out` exactly and is used up. False for any other stream, valid or
/// not, of which a general decoder has to judge; `out` then holds nothing of use. O(bytes), no allocation, cannot fail.
[[nodiscard]] bool inflate_literals(std::span<const std::byte> deflated, std::span<std::byte> out);

}  // namespace isohf
