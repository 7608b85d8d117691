#include "isohf/archive/codec/coding_effort.h"

#include <array>
#include <string>

#include "isohf/archive/codec/tile_codes.h"
#include "isohf/error.h"

namespace isohf {

namespace {

//                          passes thinning predictors rounds thinning moves wide
constexpr std::array<CodingEffort, kMaxLevel> kEfforts = {{
    {.fit = {0, 1, 1, 0, 1, 0, false}, .context_thinning = 15, .has_pairs = false},
    {.fit = {1, 15, 1, 0, 1, 0, false}, .context_thinning = 15, .has_pairs = true},
    {.fit = {2, 9, 1, 0, 1, 0, false}, .context_thinning = 3, .has_pairs = true},
    {.fit = {1, 25, 2, 1, 15, 1, false}, .context_thinning = 9, .has_pairs = true},
    {.fit = {1, 15, 2, 1, 9, 1, false}, .context_thinning = 7, .has_pairs = true},
    {.fit = {1, 7, 2, 1, 5, 2, false}, .context_thinning = 5, .has_pairs = true},
    {.fit = {2, 5, 2, 1, 3, 3, false}, .context_thinning = 3, .has_pairs = true},
    {.fit = {2, 5, 2, 1, 3, 3, true}, .context_thinning = 3, .has_pairs = true},
    {.fit = {2, 5, 2, 2, 3, 3, true}, .context_thinning = 3, .has_pairs = true},
    {.fit = {2, 3, 2, 2, 1, 4, true}, .context_thinning = 1, .has_pairs = true},
    {.fit = {2, 3, 2, 4, 1, 4, true}, .context_thinning = 1, .has_pairs = true},
    {.fit = {2, 1, 2, 8, 1, 6, true}, .context_thinning = 1, .has_pairs = true},
}};

}  // namespace

CodingEffort coding_effort(int level) {
  if (level < kMinLevel || level > kMaxLevel) {
    throw Error(ErrorCode::kInvalidArgument, "level " + std::to_string(level) + ", must be " +
                                                 std::to_string(kMinLevel) + " to " + std::to_string(kMaxLevel));
  }
  return kEfforts[static_cast<std::size_t>(level - kMinLevel)];
}

}  // namespace isohf
