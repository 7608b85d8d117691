#include "isohf/lattice/tile_shape.h"

#include <gtest/gtest.h>

#include "isohf/base/error.h"

namespace isohf {
namespace {

TEST(TileShape, Table1RowsAreValidButForE1) {
  for (const Table1Row& row : table1()) {
    const std::string why = TileShape::why_invalid(row.columns, row.rows, row.levels);
    EXPECT_EQ(why.empty(), row.valid) << row.columns << "x" << row.rows << ": " << why;
  }
}

}  // namespace
}  // namespace isohf
