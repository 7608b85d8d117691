#include "isohf/projection/length_unit.h"

#include <gtest/gtest.h>

namespace isohf {
namespace {

TEST(LinearUnit, IsKnownByCodeAndByName) {
  EXPECT_EQ(linear_unit(9001)->name, "metre");
  EXPECT_EQ(linear_unit("Meters")->metres, 1.0);
  EXPECT_EQ(linear_unit("FT")->metres, 0.3048);
  EXPECT_EQ(linear_unit("ftUS")->name, "US survey foot");
  EXPECT_FALSE(linear_unit(1));
  EXPECT_FALSE(linear_unit(""));
  EXPECT_FALSE(linear_unit("parsec"));
}

}  // namespace
}  // namespace isohf
