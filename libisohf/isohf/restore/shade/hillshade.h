#pragma once

#include "isohf/shade.h"

namespace isohf {

/// Rows of ShadeKind::kHillshade: Horn's formula on the elevations that the surface has in the middle of each pixel and
/// of its eight neighbours, which are those of a RowReader by kBarycentric. Options are within their ranges.
void hillshade_rows(const ArchiveReader& archive, const ShadeOptions& options, const GridSize& size,
                    const TakeShadedRows& take, const Job& job);

}  // namespace isohf
