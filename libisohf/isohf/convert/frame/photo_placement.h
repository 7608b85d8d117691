#pragma once

#include <optional>
#include <string>
#include <vector>

#include "isohf/convert/frame/plan.h"
#include "isohf/photo/texture_cutter.h"
#include "isohf/picture.h"

namespace isohf {

/// Where a photo lies over the source's ground.
struct PhotoPlacement {
  PhotoFrame frame;    ///< in the middle of the source, where projected
  WorldBounds bounds;  ///< outer edges of its pixels; a rectangle around what it shows of the source, where projected
  std::optional<WarpPlace> warp;  ///< where rows of the photo are no rows of the world
  bool by_georeference = false;
  bool is_part = false;  ///< some of the source's ground lies beyond it, by half a pixel and more
  std::vector<Warning> warnings;
};

/// Both georeferenced: as they say. Else the photo covers exactly what the source covers: its pixel edges lie on the
/// outer edges of area pixels, or on the first and last posts; but where a source on posts has as many samples as the
/// photo has pixels, their middles lie on the posts. A side without a named reference system is taken to be in the
/// other's. same_system as TextureRequest has it. Throws Error{kInvalidArgument} where the reference systems differ or the
/// photo shows no ground of the source.
[[nodiscard]] PhotoPlacement place_photo(const PhotoInfo& photo, const SourceInfo& source, const SourceFrame& frame,
                                         std::optional<bool> same_system = std::nullopt);

}  // namespace isohf
