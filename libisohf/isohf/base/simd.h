#pragma once

#include <atomic>
#include <type_traits>

/// The one means by which loops use what a machine has beyond its base instruction set. A kernel is written once, as a
/// plain loop or with the vector types that GCC and clang share (vector_size), and compiled for x86-64-v3 (AVX2) and
/// for the base set; the better one is chosen at run time. Elsewhere, as on ARM, the base set has vectors already.
///
///   ISOHF_KERNEL void add(const float* a, int count, float* __restrict sum) {
///     for (int i = 0; i < count; ++i) sum[i] += a[i];
///   }
///   vectorised<add>(a, count, sum);
///
/// Only for arithmetic whose results are the same either way: integers, and single IEEE operations (fused ones are off
/// everywhere). `__restrict` belongs to every pointer that is written through: without it most loops stay scalar.
#define ISOHF_KERNEL [[gnu::always_inline]] inline
#if defined(__x86_64__)
#define ISOHF_TARGET_WIDE __attribute__((target("arch=x86-64-v3")))
#define ISOHF_TARGET_WIDEST __attribute__((target("avx512f")))
#if !defined(__clang__)
/// Kernels may use GCC's builtins of AVX2 where their parameter kIsWide is true; clang finds the instructions itself.
#define ISOHF_HAS_WIDE_BUILTINS 1
#endif
#endif

namespace isohf {

/// Whether this machine has what wide kernels need.
[[nodiscard]] bool machine_has_simd();

/// Switches to the kernels of the base set, or back; on at the start. They give the same bits: the switch is for tests
/// and for finding faults, and is the library's only state. Takes effect for calls that begin after it.
void set_simd(bool is_on);

namespace detail {

enum class SimdLevel : int { kBase, kWide, kWidest };
/// What the machine has, or kBase where it is switched off.
extern std::atomic<SimdLevel> simd_level;

template <auto kFunction>
struct Kernel;
template <typename Result, typename... Parameters, Result (*kFunction)(Parameters...)>
struct Kernel<kFunction> {
  [[gnu::noinline]] static Result run(Parameters... parameters) { return kFunction(parameters...); }
#if defined(ISOHF_TARGET_WIDE)
  [[gnu::noinline]] ISOHF_TARGET_WIDE static Result run_wide(Parameters... parameters) {
    return kFunction(parameters...);
  }
  [[gnu::noinline]] ISOHF_TARGET_WIDEST static Result run_widest(Parameters... parameters) {
    return kFunction(parameters...);
  }
#endif
};

}  // namespace detail

/// Runs a kernel. One that is a template over `bool kIsWide` is given as kernel<false>, kernel<true>; the third, if any,
/// is for machines with registers of 64 bytes (AVX-512).
template <auto kBase, auto kWide = kBase, auto kWidest = nullptr, typename... Arguments>
inline auto vectorised(Arguments&&... arguments) {
#if defined(ISOHF_TARGET_WIDE)
  const detail::SimdLevel level = detail::simd_level.load(std::memory_order_relaxed);
  if constexpr (!std::is_null_pointer_v<decltype(kWidest)>) {
    if (level == detail::SimdLevel::kWidest) return detail::Kernel<kWidest>::run_widest(arguments...);
  }
  if (level != detail::SimdLevel::kBase) return detail::Kernel<kWide>::run_wide(arguments...);
#endif
  return detail::Kernel<kBase>::run(arguments...);
}

/// A vector (vector_size) that may lie at any address.
template <typename Vector>
struct [[gnu::packed, gnu::may_alias]] Unaligned {
  Vector value;
};

/// The elements of an array from `place` on as one vector, wherever they lie: `unaligned<Ints>(samples + 3).value`.
/// An alias of the vector type with aligned(4) says the same to GCC, but clang may take it for aligned all the same.
template <typename Vector>
ISOHF_KERNEL const Unaligned<Vector>& unaligned(const void* place) {
  return *static_cast<const Unaligned<Vector>*>(place);
}
template <typename Vector>
ISOHF_KERNEL Unaligned<Vector>& unaligned(void* place) {
  return *static_cast<Unaligned<Vector>*>(place);
}

}  // namespace isohf
