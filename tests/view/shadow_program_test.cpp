// The real programs: what convert stores, the viewer draws and checks.
#include <gtest/gtest.h>

#include <cstdlib>

#include "program_fixture.h"

namespace isohf::test {
namespace {

class ShadowProgramTest : public ProgramFixture {};

TEST_F(ShadowProgramTest, NeedsNoSeeds) {
  convert({"--shadow-seeds"});
  const std::string seeded = picture({"--sun", "200,6"});
  convert({});
  EXPECT_EQ(picture({"--sun", "200,6"}), seeded);
  const RunResult verified = view({"--verify"});
  EXPECT_EQ(verified.exit_code, 0) << verified.out;
  EXPECT_NE(verified.out.find("\nshadows: suns of 3, 7, 15, 35 degrees"), std::string::npos);
}

}  // namespace
}  // namespace isohf::test
