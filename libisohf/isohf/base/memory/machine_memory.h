#pragma once

#include <cstdint>

namespace isohf {

/// Memory that this process may use, in bytes: the least of the machine's, the limits of its control groups, and those
/// of the process (ulimit -v, -d). 0 if none of them can be read.
[[nodiscard]] std::uint64_t machine_memory_bytes();

}  // namespace isohf
