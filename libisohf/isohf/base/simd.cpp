#include "isohf/base/simd.h"

namespace isohf {

bool machine_has_simd() {
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
  // The parts of x86-64-v3 that compilers use; __builtin_cpu_supports asks the system for its consent as well.
  static const bool has = [] {
    __builtin_cpu_init();
    return __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0 &&
           __builtin_cpu_supports("bmi") != 0 && __builtin_cpu_supports("bmi2") != 0 &&
           __builtin_cpu_supports("popcnt") != 0;
  }();
  return has;
#else
  return false;
#endif
}

namespace detail {
std::atomic<bool> simd_is_on{machine_has_simd()};
}  // namespace detail

void set_simd(bool is_on) {
  detail::simd_is_on.store(is_on && machine_has_simd(), std::memory_order_relaxed);
}

}  // namespace isohf
