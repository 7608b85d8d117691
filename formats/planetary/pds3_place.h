#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "formats/planetary/label_text.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {

/// What a PDS3 label says of a raster's place.
struct Pds3Place {
  Georeference georeference;
  std::vector<Warning> warnings;
};

enum class LabelOf { kPds3, kVicar };

/// Interprets TARGET_NAME and IMAGE_MAP_PROJECTION of a label (PDS Standards Reference 3.8, appendix B).
///
/// Simple cylindrical maps, and equirectangular ones true at the equator, are placed in degrees, East positive; all
/// others in metres of their own projection, whose name is carried. The projection offsets count from the middle of
/// sample (1, 1); MOLA's labels count that sample as 1 instead, and old ones turn the sign. MAXIMUM_LATITUDE and
/// WESTERNMOST_LONGITUDE, which name edges of pixels, tell which is meant; what they do not confirm is said in a
/// warning. Of VICAR, whose property MAP has the same words, all maps are placed in metres, and the offsets are as PDS3
/// has them.
[[nodiscard]] Pds3Place place_from_pds3(const std::string& path, const LabelBlock& root, std::int64_t columns,
                                        std::int64_t rows, LabelOf label);

}  // namespace isohf
