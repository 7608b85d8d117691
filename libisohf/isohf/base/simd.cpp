#include "isohf/base/simd.h"

namespace isohf {
namespace {

using detail::SimdLevel;

SimdLevel level_of_machine() {
#if defined(ISOHF_TARGET_WIDE)
  // The parts of x86-64-v3 that compilers use; __builtin_cpu_supports asks the system for its consent as well.
  static const SimdLevel level = [] {
    __builtin_cpu_init();
    const bool has_wide = __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0 &&
                          __builtin_cpu_supports("bmi") != 0 && __builtin_cpu_supports("bmi2") != 0 &&
                          __builtin_cpu_supports("popcnt") != 0;
    if (!has_wide) return SimdLevel::kBase;
    return __builtin_cpu_supports("avx512f") != 0 ? SimdLevel::kWidest : SimdLevel::kWide;
  }();
  return level;
#else
  return SimdLevel::kBase;
#endif
}

}  // namespace

bool machine_has_simd() {
  return level_of_machine() != SimdLevel::kBase;
}

namespace detail {
std::atomic<SimdLevel> simd_level{level_of_machine()};
}  // namespace detail

void set_simd(bool is_on) {
  detail::simd_level.store(is_on ? level_of_machine() : SimdLevel::kBase, std::memory_order_relaxed);
}

}  // namespace isohf
