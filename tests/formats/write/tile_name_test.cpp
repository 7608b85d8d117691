#include "formats/write/tile_name.h"

#include <gtest/gtest.h>

namespace isohf::test {
namespace {

TEST(TileName, IsThatOfExportAlone) {
  for (const char* path : {"u_x0_y0.r16", "a/b_x1_x12_y345.tif", "./_x1_y2.raw", "a.b_x9999999999_y1.png"}) {
    const auto name = TileName::of(path);
    ASSERT_TRUE(name) << path;
    EXPECT_EQ(name->path(), path);
  }
  EXPECT_EQ(TileName::of("a/b_x1_x12_y345.tif")->column, 12);
  EXPECT_EQ(TileName::of("a/b_x1_x12_y345.tif")->stem, "a/b_x1");
  for (const char* path :
       {"u.raw", "u_x1.raw", "u_y1_x1.raw", "u_x01_y1.raw", "u_x1_y.raw", "u_x_y1.raw", "u_x-1_y1.raw", "u_x1_y1a.raw",
        "u_x+1_y1.raw", "u_x1_y99999999999999999999.raw", "u_x1.5_y1.raw", ""}) {
    EXPECT_FALSE(TileName::of(path)) << path;
  }
}

}  // namespace
}  // namespace isohf::test
