#pragma once

#include <vector>

#include "formats/mosaic/mosaic_plan.h"

namespace isohf {

/// A member and where its own file puts it.
struct PlacedMember {
  MosaicMember member;
  double origin_x = 0.0;  ///< coordinates of its sample (0, 0)
  double origin_y = 0.0;
  double spacing_x = 1.0;
  double spacing_y = 1.0;
};

/// A rectangle of the mosaic's samples.
struct SampleRectangle {
  std::int64_t column = 0;
  std::int64_t row = 0;
  std::int64_t columns = 0;
  std::int64_t rows = 0;
};

/// Moves members by whole turns so that those on both sides of the 180th meridian lie side by side: where more than
/// half a turn lies empty between them, all West of the gap go East of the others. Nothing else moves.
void join_antimeridian(std::vector<PlacedMember>& members);

/// Puts members on grids: fills plan.layers and size, spacing and origin of plan.info, whose georeference says unit and
/// registration. plan.info.warnings gains a line where rounding was taken away that is worth a word.
/// Throws Error{kInvalidArgument} naming a member that lies off the grid of its resolution.
void place_members(std::vector<PlacedMember> members, MosaicPlan& plan);

/// The samples of the mosaic that a member of `layer` stands for; `reach`: how far its outermost samples do, in samples
/// of the layer's own, 0 or 0.5.
[[nodiscard]] SampleRectangle ground_of(const MosaicPlan& plan, const MosaicLayer& layer, const MosaicMember& member,
                                        double reach);

/// What lies in no member.
[[nodiscard]] MosaicHoles find_holes(const MosaicPlan& plan);

}  // namespace isohf
