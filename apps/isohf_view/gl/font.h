#pragma once

#include <array>
#include <cstdint>

namespace isohf::view {

inline constexpr int kGlyphWidth = 5;
inline constexpr int kGlyphHeight = 7;
inline constexpr int kFirstGlyph = 32;  ///< space
inline constexpr int kGlyphCount = 95;  ///< to '~'

/// One glyph's rows from the top; bit 4 is the leftmost pixel. Characters outside the set give the empty box.
[[nodiscard]] std::array<std::uint8_t, kGlyphHeight> glyph_rows(char character);

}  // namespace isohf::view
