#pragma once

#include "isohf/base/simd.h"

/// Defines a function that is compiled twice, for machines with AVX2 and for all, the better one chosen at run time:
///
///   ISOHF_VECTORISED(void, add, (const float* __restrict a, int count, float* __restrict sum), (a, count, sum)) {
///     for (int i = 0; i < count; ++i) sum[i] += a[i];
///   }
///
/// Only for arithmetic whose results are the same either way: integers, and single IEEE operations (fused ones are off
/// everywhere). `__restrict` belongs to every pointer that is written through: without it most loops stay scalar.
///
/// ISOHF_TWO_WAYS is for loops that need an instruction which compilers do not find by themselves: its body is a
/// template over `bool kIsWide`, which tells the two apart. Where ISOHF_HAS_WIDE is not defined, kIsWide is never true.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define ISOHF_HAS_WIDE 1
#define ISOHF_VECTORISED(result, name, parameters, arguments)                                    \
  [[gnu::always_inline]] inline result name##_kernel parameters;                                 \
  [[gnu::target("arch=x86-64-v3"), gnu::noinline]] result name##_wide parameters {               \
    return name##_kernel arguments;                                                              \
  }                                                                                              \
  [[gnu::noinline]] result name##_plain parameters {                                             \
    return name##_kernel arguments;                                                              \
  }                                                                                              \
  inline result name parameters {                                                                \
    return ::isohf::detail::simd_is_on.load(std::memory_order_relaxed) ? name##_wide arguments   \
                                                                       : name##_plain arguments; \
  }                                                                                              \
  inline result name##_kernel parameters
#define ISOHF_TWO_WAYS(result, name, parameters, arguments)                                      \
  template <bool kIsWide>                                                                        \
  [[gnu::always_inline]] inline result name##_kernel parameters;                                 \
  [[gnu::target("arch=x86-64-v3"), gnu::noinline]] result name##_wide parameters {               \
    return name##_kernel<true> arguments;                                                        \
  }                                                                                              \
  [[gnu::noinline]] result name##_plain parameters {                                             \
    return name##_kernel<false> arguments;                                                       \
  }                                                                                              \
  inline result name parameters {                                                                \
    return ::isohf::detail::simd_is_on.load(std::memory_order_relaxed) ? name##_wide arguments   \
                                                                       : name##_plain arguments; \
  }                                                                                              \
  template <bool kIsWide>                                                                        \
  inline result name##_kernel parameters
#else
#define ISOHF_VECTORISED(result, name, parameters, arguments) inline result name parameters
#define ISOHF_TWO_WAYS(result, name, parameters, arguments) \
  template <bool kIsWide>                                   \
  inline result name##_kernel parameters;                   \
  inline result name parameters {                           \
    return name##_kernel<false> arguments;                  \
  }                                                         \
  template <bool kIsWide>                                   \
  inline result name##_kernel parameters
#endif
