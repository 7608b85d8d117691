#include "isohf/projection/length_unit.h"

#include <gtest/gtest.h>

namespace isohf {
namespace {

TEST(LinearUnit, IsKnownByItsSpellings) {
  struct Row {
    const char* text;
    const char* name;
    double metres;
  };
  for (const Row& row :
       {Row{"Meters", "metre", 1.0}, Row{"FT", "foot", 0.3048}, Row{"ftUS", "US survey foot", 1200.0 / 3937.0},
        Row{"US survey foot", "US survey foot", 1200.0 / 3937.0}, Row{"dm", "decimetre", 0.1},
        Row{"dam", "decametre", 10.0}, Row{"fathom", "fathom", 1.8288},
        Row{"Clarke's foot", "Clarke's foot", 0.3047972654}, Row{"0.1 m", "decimetre", 0.1},
        Row{"1/10 m", "decimetre", 0.1}, Row{"10 cm", "decimetre", 0.1}, Row{"0.25 metre", "0.25 metre", 0.25},
        Row{"0.125m", "0.125 metre", 0.125}}) {
    const auto unit = linear_unit(row.text);
    ASSERT_TRUE(unit) << row.text;
    EXPECT_EQ(unit->name, row.name);
    EXPECT_NEAR(unit->metres, row.metres, 1e-15);
    EXPECT_EQ(linear_unit(unit->name)->metres, unit->metres) << "what is written is read";
  }
  for (const char* text : {"", "parsec", "10", "-1 m", "1/0 m", "m/s", "0.1 0.1 parsec", "degrees"}) {
    EXPECT_FALSE(linear_unit(text)) << text;
  }
}

TEST(LinearUnit, IsKnownByItsLength) {
  EXPECT_EQ(length_unit(0.304800609601219).metres, 1200.0 / 3937.0);  // as PROJ's database has it
  EXPECT_EQ(length_unit(0.304800609601219).name, "US survey foot");
  EXPECT_EQ(length_unit(3.0).name, "unit");
}

}  // namespace
}  // namespace isohf
