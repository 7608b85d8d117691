#pragma once

#include "isohf/error.h"
#include "isohf/metadata.h"
#include "isohf/sampling/resample/tile_resampler.h"

namespace isohf {

/// What metadata name as `member`. Throws Error{kUnsupported} where this build does not know the name.
template <typename T>
[[nodiscard]] const T& known(const std::optional<T>& value, const char* member) {
  if (value) return *value;
  throw Error(ErrorCode::kUnsupported,
              std::string("metadata: ") + member + ": is a name that this build does not know");
}

/// Where the samples of an archive's source lie in its world, as the metadata have it. Throws Error{kCorrupt} where the
/// metadata name a projection without the source's origin, and Error{kUnsupported} where the source's map has to be
/// understood first.
[[nodiscard]] SourceGeometry archive_geometry(const Metadata& metadata);

}  // namespace isohf
