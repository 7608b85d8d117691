#pragma once

#include <cstdint>

namespace isohf::view {

/// What the operating system says of this process, bytes; zeros where it says nothing.
struct ProcessMemory {
  std::uint64_t anonymous = 0;  ///< resident and its own: not to be had from a file again
  std::uint64_t peak = 0;       ///< most that was ever resident, pages of mapped files included
};
[[nodiscard]] ProcessMemory process_memory();

}  // namespace isohf::view
