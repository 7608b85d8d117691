#pragma once

#include <string>

#include "isohf/convert/convert.h"

namespace isohf {

/// Everything that decides the bytes of an archive, as text: two runs with the same fingerprint may continue each
/// other.
[[nodiscard]] std::string job_fingerprint(const SourceInfo& info, const Plan& plan, const ConvertOptions& options);

/// The metadata that is known before a tile is cut: all but statistics, counts and hash.
[[nodiscard]] Metadata describe_job(const SourceInfo& info, const Plan& plan, const ConvertOptions& options,
                                    const Quantisation& quantisation);

}  // namespace isohf
