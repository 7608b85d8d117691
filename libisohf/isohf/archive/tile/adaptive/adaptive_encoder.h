#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "isohf/archive/tile/adaptive/adaptive_payload.h"
#include "isohf/archive/tile/predict/sample_lattice.h"

namespace isohf {

/// A payload of version 2 of samples in lattice order, all rows closed, voids filled. `payload` says all that comes
/// before the states. Deterministic; O(C*R).
[[nodiscard]] std::vector<std::byte> encode_adaptive(Lattice<std::int32_t>& lattice, AdaptivePayload payload);

}  // namespace isohf
