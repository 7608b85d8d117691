#pragma once

#include <string>
#include <vector>

#include "isohf/archive/metadata/shard_record.h"
#include "isohf/convert.h"
#include "isohf/convert/frame/plan.h"
#include "isohf/metadata.h"

namespace isohf {

/// Everything that decides the bytes of an archive, versions of libraries included, as text: two runs with the same
/// fingerprint may continue each other.
[[nodiscard]] std::string job_fingerprint(const SourceInfo& info, const Plan& plan, const ConvertOptions& options);

/// The metadata that is known before a tile is cut: all but statistics, counts and hash.
[[nodiscard]] Metadata describe_job(const SourceInfo& info, const Plan& plan, const ConvertOptions& options,
                                    const Quantisation& quantisation);

/// Whether `output` is the archive that the job would make now, complete; then what a killed run left beside it is
/// removed. Samples are not compared. Throws Error{kInvalidArgument} with the difference, as "filter "bilinear", not
/// "nearest"", and as opening the archive does; with options.overwrite it returns false instead.
/// files  that the source is read from
[[nodiscard]] bool is_converted(const std::string& output, const SourceInfo& info,
                                const std::vector<std::string>& files, const ConvertOptions& options);

}  // namespace isohf
