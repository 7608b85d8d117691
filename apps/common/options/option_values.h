#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "isohf/shade.h"
#include "isohf/tile_range.h"

namespace isohf::cli {

/// Text of an option's value -> value. All of them read the whole text, clamp nothing, and throw
/// Error{kInvalidArgument} "found 'abc', must be ...".

[[nodiscard]] double parse_number(const std::string& text);
[[nodiscard]] double parse_positive_number(const std::string& text);
[[nodiscard]] double parse_number_in(const std::string& text, double least, double most);
/// `what` names the thing, for the message: "a whole number from 1 to 1024".
[[nodiscard]] std::int64_t parse_whole_number(const std::string& text, std::int64_t least, std::int64_t most);
/// "COLUMNSxROWS", as in 212x243; each part as parse_whole_number.
[[nodiscard]] std::pair<std::int64_t, std::int64_t> parse_size(const std::string& text, std::int64_t least,
                                                               std::int64_t most);
/// "MIN:MAX" or "MIN,MAX", MIN < MAX.
[[nodiscard]] std::pair<double, double> parse_range(const std::string& text);
[[nodiscard]] ShadePalette parse_palette(const std::string& text);
/// A day of the calendar, "2026-06-21": year, month, day.
[[nodiscard]] std::array<int, 3> parse_date(const std::string& text);
/// A time of day, "14" or "14:30": hours from 0 to 24.
[[nodiscard]] double parse_time(const std::string& text);
/// "5,15,30": numbers, at least one.
[[nodiscard]] std::vector<double> parse_numbers(const std::string& text);
/// Bytes: 400M, 1.5GiB, 2GB; K, M, G, T and KiB... are powers of 1024, KB, MB, GB, TB powers of 1000.
[[nodiscard]] std::uint64_t parse_bytes(const std::string& text);
/// "A:B,C:D": columns A to B-1 and rows C to D-1 of tiles.
[[nodiscard]] TileRange parse_tile_range(const std::string& text);
/// One of `words`; returns its place.
[[nodiscard]] std::size_t parse_word(const std::string& text, const std::vector<std::string>& words);

/// "; did you mean NEAREST?" of the candidate that was probably meant by `text`: a slip or two of the fingers away, or
/// begun with it. Empty if there is none.
[[nodiscard]] std::string did_you_mean(const std::string& text, const std::vector<std::string>& candidates);

}  // namespace isohf::cli
