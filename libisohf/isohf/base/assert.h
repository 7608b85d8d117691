#pragma once

#include <cstdio>
#include <cstdlib>

/// Asserts a fact that only a bug of ours can break; never used on input. Active in every build type.
#define ISOHF_ASSERT(condition) \
  ((condition)                  \
       ? static_cast<void>(0)   \
       : (std::fprintf(stderr, "%s:%d: broken invariant: %s\n", __FILE__, __LINE__, #condition), std::abort()))
