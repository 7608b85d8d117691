#pragma once

#include <string>

#include "isohf/archive/metadata/shard_record.h"
#include "isohf/convert.h"
#include "isohf/convert/frame/plan.h"
#include "isohf/metadata.h"

namespace isohf {

/// Everything that decides the bytes of an archive, as text: two runs with the same fingerprint may continue each
/// other.
[[nodiscard]] std::string job_fingerprint(const SourceInfo& info, const Plan& plan, const ConvertOptions& options);

/// The metadata that is known before a tile is cut: all but statistics, counts and hash.
[[nodiscard]] Metadata describe_job(const SourceInfo& info, const Plan& plan, const ConvertOptions& options,
                                    const Quantisation& quantisation);

/// In which way a finished archive with these metadata is another one than the job would make, as "filter "bilinear",
/// not "nearest""; empty where there is none. The source's samples are not looked at.
[[nodiscard]] std::string difference_from_job(const std::string& metadata_json, const SourceInfo& info,
                                              const Plan& plan, const ConvertOptions& options);

}  // namespace isohf
