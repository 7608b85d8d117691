// The real programs: what convert stores, the viewer draws and checks.
#include <gtest/gtest.h>

#include <cstdlib>

#include "program_fixture.h"

namespace isohf::test {
namespace {

class ShadowProgramTest : public ProgramFixture {};

TEST_F(ShadowProgramTest, DrawsShadowsUnlessToldNotTo) {
  convert({"--shadow-seeds", "--type", "f32"});
  const std::string lit = picture({"--sun", "90,6"});
  EXPECT_EQ(picture({"--sun", "90,6", "--shadows", "on"}), lit);
  const std::string plain = picture({"--sun", "90,6", "--shadows", "off"});
  EXPECT_NE(plain, lit);
  EXPECT_NE(picture({"--sun", "90,6", "--shadow-softness", "200"}), lit);
  // From a sun anywhere, but none at night.
  EXPECT_NE(picture({"--sun", "180,6"}), picture({"--sun", "180,6", "--shadows", "off"}));
  EXPECT_EQ(picture({"--sun", "90,-3"}), picture({"--sun", "90,-3", "--shadows", "off"}));
}

TEST_F(ShadowProgramTest, NeedsNoSeeds) {
  convert({"--shadow-seeds"});
  const std::string seeded = picture({"--sun", "200,6"});
  convert({});
  EXPECT_EQ(picture({"--sun", "200,6"}), seeded);
  EXPECT_EQ(view({"--shadows", "dim", "--screenshot", folder_ / "b.png"}).exit_code, 2);
  const RunResult verified = view({"--verify"});
  EXPECT_EQ(verified.exit_code, 0) << verified.out;
  EXPECT_NE(verified.out.find("\nshadows: suns of 3, 7, 15, 35 degrees"), std::string::npos);
}

TEST_F(ShadowProgramTest, ObeysKeysInAWindow) {
  if (std::system("command -v xvfb-run >/dev/null 2>&1 && command -v xdotool >/dev/null 2>&1") != 0) {
    GTEST_SKIP() << "xvfb-run or xdotool is not installed";
  }
  convert({"--shadow-seeds"});
  // Pictures with shadows, without, and with them again; then every other key, and Escape.
  write_file(folder_ / "keys.sh", R"sh(
    cd "$1" || exit 9
    "$2" a.isohf --window --no-overlay --size 200x150 --sun 90,6 2>log & viewer=$!
    id=$(timeout 30 xdotool search --sync --onlyvisible --name isohf-view | head -1)
    xdotool windowfocus "$id" sleep 2
    picture() {
      xdotool key "$@"
      count=$((count + 1))
      for i in $(seq 200); do grep -q "isohf-000$count.png" log && return; sleep 0.1; done
    }
    picture p
    picture u p
    picture u p
    picture k k k m m m m x y Home plus minus bracketleft bracketright f h h r j l i w a s d q e p
    xdotool key Escape
    wait $viewer
  )sh");
  const RunResult result = run_program({"/usr/bin/env", "xvfb-run", "-a", "-s", "-screen 0 800x600x24", "sh",
                                        folder_ / "keys.sh", folder_.path(), ISOHF_BIN_DIR "/isohf-view"});
  EXPECT_EQ(result.exit_code, 0) << result.err << read_file(folder_ / "log");
  const std::string lit = read_file(folder_ / "isohf-0001.png");
  const std::string plain = read_file(folder_ / "isohf-0002.png");
  EXPECT_FALSE(lit.empty());
  EXPECT_FALSE(plain.empty());
  EXPECT_NE(lit, plain);
  EXPECT_EQ(read_file(folder_ / "isohf-0003.png"), lit);
  EXPECT_NE(read_file(folder_ / "isohf-0004.png"), "");
}

}  // namespace
}  // namespace isohf::test
