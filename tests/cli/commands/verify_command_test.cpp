#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <regex>

#include "support/rasters/plain_tiff.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

class VerifyCommand : public testing::Test {
 protected:
  VerifyCommand() {
    write_int16_tiff(folder / "a.tif", 150, 120, height);
    const RunResult result =
        run_isohf({"convert", folder / "a.tif", folder / "a.isohf", "--shape", "28x35", "--levels", "2"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
  }

  static std::int16_t height(std::int64_t c, std::int64_t r) {
    return static_cast<std::int16_t>(
        std::lround(700 + 300 * std::sin(0.05 * static_cast<double>(c)) * std::cos(0.04 * static_cast<double>(r))));
  }

  TemporaryFolder folder;
};

TEST_F(VerifyCommand, FilesAfterTheFirstInputWantAnAgainstOfTheirOwn) {
  const RunResult result = run_isohf({"verify", folder / "a.isohf", "--against", folder / "a.tif", folder / "a.tif"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("--against a.tif --against b.tif"));
}

TEST_F(VerifyCommand, ComparesWithTheSource) {
  const json report =
      json::parse(run_isohf({"verify", folder / "a.isohf", "--against", folder / "a.tif", "--json"}).out);
  EXPECT_EQ(report.at("against").at("samples"), 150 * 120);
  const double rms = report.at("against").at("rms").get<double>();
  const double max = report.at("against").at("max").get<double>();
  EXPECT_GT(rms, 0.0);
  EXPECT_LT(max, 5.0);  // a smooth surface of 300 units in waves of 126 samples, rounded to whole units

  const std::vector<std::string> base = {"verify", folder / "a.isohf", "--against", folder / "a.tif"};
  const auto code_with = [&](const std::string& option, double limit) {
    return run_isohf(with_more(base, {option, std::to_string(limit)})).exit_code;
  };
  EXPECT_EQ(code_with("--max-error", max * 1.01), 0);
  EXPECT_EQ(code_with("--max-error", max * 0.99), 3);
  EXPECT_EQ(code_with("--max-rms", rms * 1.01), 0);
  EXPECT_EQ(code_with("--max-rms", rms * 0.99), 3);
}

TEST_F(VerifyCommand, FindsAVertexThatTheSourceDoesNotGive) {
  // One sample in the middle is raised by 3: four lattice vertices or so are off, the others are not.
  write_int16_tiff(folder / "b.tif", 150, 120, [](std::int64_t c, std::int64_t r) {
    return static_cast<std::int16_t>(height(c, r) + (c == 75 && r == 60 ? 3 : 0));
  });
  const RunResult result = run_isohf({"verify", folder / "a.isohf", "--against", folder / "b.tif", "--json"});
  EXPECT_EQ(result.exit_code, 3);
  const json report = json::parse(result.out);
  ASSERT_EQ(report.at("checks").at("findings").size(), 1U) << result.out;
  const json& found = report.at("checks").at("findings")[0];
  EXPECT_EQ(found.at("id"), "ISOHF-0022");
  EXPECT_FALSE(found.at("tile").is_null());
  const json& vertices = report.at("against").at("vertices");
  EXPECT_GE(vertices.at("wrong").get<int>(), 2);
  EXPECT_LE(vertices.at("wrong").get<int>(), 24);  // in up to four tiles' padding as well
  EXPECT_GT(vertices.at("worst").get<double>(), 1.0);
}

TEST_F(VerifyCommand, DamageIsFoundWithExitCode3) {
  std::string bytes = read_file(folder / "a.isohf");
  const json info = json::parse(run_isohf({"info", folder / "a.isohf", "--json", "--tiles"}).out);
  // The largest tile, well behind its Huffman tables: a flipped length of a symbol that never occurs changes nothing.
  const json& tiles = info.at("tiles");
  const json& tile = *std::max_element(tiles.begin(), tiles.end(), [](const json& a, const json& b) {
    return a.at("compressed_bytes") < b.at("compressed_bytes");
  });
  bytes[tile.at("offset_bytes").get<std::size_t>() + tile.at("compressed_bytes").get<std::size_t>() - 20] ^= 0x10;
  write_file(folder / "bad.isohf", bytes);
  const RunResult result = run_isohf({"verify", folder / "bad.isohf"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_EQ(result.err, "");
  EXPECT_TRUE(std::regex_search(result.out, std::regex("ISOHF-[0-9]{4} error tile \\([0-9]+,[0-9]+\\): ")))
      << result.out;
  EXPECT_THAT(result.out, HasSubstr("FAILED"));
  const json report = json::parse(run_isohf({"verify", folder / "bad.isohf", "--json"}).out);
  EXPECT_FALSE(report.at("passed").get<bool>());
  EXPECT_EQ(report.at("checks").at("findings").at(0).at("tile").at("column"), tile.at("column"));
  const RunResult against = run_isohf({"verify", folder / "bad.isohf", "--against", folder / "a.tif"});
  EXPECT_EQ(against.exit_code, 3);
  EXPECT_THAT(against.out, HasSubstr("not compared"));
}

}  // namespace
}  // namespace isohf::test
