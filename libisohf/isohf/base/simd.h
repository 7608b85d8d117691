#pragma once

#include <atomic>

namespace isohf {

/// What this machine can do beyond its base instruction set, as far as the kernels of vectorised.h make use of it.
[[nodiscard]] bool machine_has_simd();

/// Switches the kernels of vectorised.h to their plain twins, or back; on at the start. The twins give the same bits:
/// the switch is for tests and for finding faults, and is the library's only state. Takes effect for calls that begin
/// after it.
void set_simd(bool is_on);

namespace detail {
/// Whether kernels use what the machine has: machine_has_simd() and not switched off.
extern std::atomic<bool> simd_is_on;
}  // namespace detail

}  // namespace isohf
