#pragma once

namespace isohf::test {

/// Whether the tests run under the sanitizers, where everything takes five to ten times as long: the longest tests make
/// do with fewer cases there. What they claim is tested in full in the ordinary build.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace isohf::test
