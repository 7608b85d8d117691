#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "support/plain_tiff.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

class InfoCommand : public testing::Test {
 protected:
  InfoCommand() {
    // The East half is void.
    write_float_tiff(folder / "a.tif", 200, 100, [](std::int64_t c, std::int64_t r) {
      return c < 100 ? static_cast<float>(c + 2 * r) : std::numeric_limits<float>::quiet_NaN();
    });
    const RunResult result = run_isohf({"convert", folder / "a.tif", folder / "a.isohf", "--shape", "28x35", "--levels",
                                        "2", "--type", "f32", "--outside", "void"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
  }

  TemporaryFolder folder;
};

TEST_F(InfoCommand, SaysWhatTheArchiveHolds) {
  const RunResult result = run_isohf({"info", folder / "a.isohf"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err, "");
  for (const char* part : {"28x35 (C x R), 2 levels", "a.tif", "200 x 100 float32", "bilinear", "wholly void",
                           "bits a stored sample", "sha256 "}) {
    EXPECT_THAT(result.out, HasSubstr(part));
  }
}

TEST_F(InfoCommand, SaysThatTheSourcesSamplesAreKept) {
  EXPECT_THAT(run_isohf({"info", folder / "a.isohf"}).out, testing::Not(HasSubstr("lossless")));
  ASSERT_EQ(run_isohf({"convert", folder / "a.tif", folder / "b.isohf", "--lossless", "-q"}).exit_code, 0);
  const std::string text = run_isohf({"info", folder / "b.isohf"}).out;
  EXPECT_THAT(text, HasSubstr("restore gives the float32 samples bit for bit; residuals of "));
  EXPECT_THAT(text, HasSubstr("residual/ (1 members, "));
}

TEST_F(InfoCommand, TilesAreListedOneALine) {
  const json info = json::parse(run_isohf({"info", folder / "a.isohf", "--json", "--tiles"}).out);
  const std::size_t count = info.at("grid").at("tiles").get<std::size_t>();
  EXPECT_EQ(info.at("tiles").size(), count);
  std::size_t stored = 0;
  std::uint64_t bytes = 0;
  for (const json& tile : info.at("tiles")) {
    if (!tile.at("stored").get<bool>()) continue;
    ++stored;
    bytes += tile.at("compressed_bytes").get<std::uint64_t>();
    EXPECT_GE(tile.at("min").get<double>(), 0.0);
    EXPECT_LE(tile.at("max").get<double>(), 99.0 + 2 * 99.0 + 1e-3);
    EXPECT_LE(tile.at("min").get<double>(), tile.at("max").get<double>());
  }
  EXPECT_GT(stored, 0U);
  EXPECT_LT(stored, count);  // the void half stores nothing
  EXPECT_EQ(info.at("tile_bytes"), bytes);

  const RunResult text = run_isohf({"info", folder / "a.isohf", "--tiles"});
  EXPECT_EQ(static_cast<std::size_t>(std::count(text.out.begin(), text.out.end(), '\n')), count + 1);
  EXPECT_THAT(text.out, HasSubstr(" 0 void void all\n"));
}

TEST_F(InfoCommand, WhatIsNoArchiveIsRefusedInOneLine) {
  write_file(folder / "empty.isohf", "");
  write_file(folder / "short.isohf", read_file(folder / "a.isohf").substr(0, 500));
  for (const char* name : {"none.isohf", "empty.isohf", "short.isohf", "a.tif"}) {
    for (const char* command : {"info", "sample"}) {
      const RunResult result = run_isohf({command, folder / name});
      EXPECT_EQ(result.exit_code, 1) << name;
      EXPECT_EQ(result.out, "");
      EXPECT_THAT(result.err, HasSubstr(name));
      EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    }
  }
}

}  // namespace
}  // namespace isohf::test
