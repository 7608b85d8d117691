#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "isohf/raster.h"

namespace isohf {

/// What channels of elevations are called, in lower case, the likeliest first.
inline constexpr std::array kHeightWords = {"height",    "elevation",    "altitude", "dem",
                                            "heightmap", "displacement", "disp"};
/// The first of the bands whose name, but for a unit in brackets, says elevations, as kHeightWords do, else "z"; else the
/// first.
[[nodiscard]] std::size_t band_of_heights(const std::vector<std::string>& names);

/// The band that `options.channel` picks among `bands`, by one of `names`, which may be fewer and empty, or by its number
/// from 0, else that of heights, with a warning when there are others; bands without a name have the one that lies beside
/// the file, if any. Fills info.channel.
/// Throws Error{kInvalidArgument} where there is no such band.
[[nodiscard]] std::int64_t choose_band(SourceInfo& info, const OpenOptions& options, std::int64_t bands,
                                       std::vector<std::string> names = {});

}  // namespace isohf
