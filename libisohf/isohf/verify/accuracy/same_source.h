#pragma once

#include <optional>
#include <vector>

#include "isohf/archive.h"
#include "isohf/raster.h"
#include "isohf/verify.h"

namespace isohf {

/// Refuses a raster that is not what an archive was made from: one of another size, that lies elsewhere, whose samples
/// lie further apart, in another reference system or of another body, or whose heights are in another unit. Places are
/// equal to a thousandth of a sample. same_system: whether the reference systems are one, where the caller understands
/// them. Returns what could not be compared. Throws Error{kInvalidArgument}, one line with all that differs.
std::vector<Warning> check_same_source(const ArchiveReader& archive, const SourceInfo& other,
                                       std::optional<bool> same_system = std::nullopt);

/// Adds what a comparison with the source found besides how large errors are: vertices that it does not give, an error
/// that contradicts the metadata, ground that is missing or made up away from nodata.
void add_findings(const Metadata& metadata, const VertexReport& vertices, const AccuracyReport& surface,
                  VerifyReport& report);

}  // namespace isohf
