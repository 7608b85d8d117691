#pragma once

/// Marks a free function to be compiled twice, for machines with AVX2 and for all, the better one chosen at start-up.
/// Only for arithmetic whose results are the same either way: integers, and single IEEE operations.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define ISOHF_VECTORISED __attribute__((target_clones("arch=x86-64-v3", "default")))
#else
#define ISOHF_VECTORISED
#endif
