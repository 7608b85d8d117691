#include "isohf/archive/tile/tile_payload.h"

#include <gtest/gtest.h>

#include "isohf/error.h"

namespace isohf {
namespace {

TEST(VoidMask, BringsBackEveryMaskOfTenSamplesSomeOfThemVoid) {
  for (unsigned mask = 1; mask < 1023; ++mask) {
    std::vector<std::uint8_t> is_void;
    for (unsigned i = 0; i < 10; ++i) is_void.push_back(static_cast<std::uint8_t>(mask >> i & 1U));
    EXPECT_EQ(unpack_void_mask(pack_void_mask(is_void), 10), is_void);
  }
}

TEST(VoidMask, BringsBackLongRuns) {
  std::vector<std::uint8_t> is_void(100000);
  std::fill(is_void.begin() + 127, is_void.begin() + 60000, std::uint8_t{1});
  EXPECT_EQ(unpack_void_mask(pack_void_mask(is_void), is_void.size()), is_void);
}

TEST(VoidMask, RefusesRunsThatDoNotAddUpOrAreOfOneKind) {
  const auto refuses = [](std::vector<int> runs, std::size_t samples) {
    std::vector<std::byte> packed;
    for (const int run : runs) packed.push_back(static_cast<std::byte>(run));
    EXPECT_THROW(static_cast<void>(unpack_void_mask(packed, samples)), Error);
  };
  refuses({}, 10);
  refuses({10}, 10);  // no void, all voids
  refuses({0, 10}, 10);
  refuses({9}, 10);
  refuses({11}, 10);
  refuses({5, 6}, 10);
  refuses({5, 0, 5}, 10);      // an empty run inside
  refuses({5, 128 + 5}, 10);   // cut off
  refuses({128 + 10, 0}, 10);  // not the shortest form
  refuses({255, 255, 255, 255, 255, 255, 1}, 10);
  refuses({255, 255, 255, 255, 15}, 10);
}

}  // namespace
}  // namespace isohf
