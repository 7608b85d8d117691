#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "support/rasters/plain_tiff.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

class ConvertCommand : public testing::Test {
 protected:
  ConvertCommand() {
    write_int16_tiff(folder / "a.tif", 300, 200, [](std::int64_t c, std::int64_t r) {
      return static_cast<std::int16_t>(
          std::lround(700 + 300 * std::sin(0.05 * static_cast<double>(c)) * std::cos(0.04 * static_cast<double>(r))));
    });
  }

  /// Converts a.tif and returns the archive's bytes.
  std::string convert(const std::string& name, std::vector<std::string> more) {
    const RunResult result = run_isohf(with_more({"convert", folder / "a.tif", folder / name}, more));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.err, "");
    return read_file(folder / name);
  }

  TemporaryFolder folder;
};

TEST_F(ConvertCommand, JsonIsOneDocumentAndAgreesWithTheArchive) {
  const RunResult result = run_isohf({"convert", folder / "a.tif", "-o", folder / "a.isohf", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  const json summary = json::parse(result.out);
  EXPECT_EQ(summary.at("tiles_written"), summary.at("tiles_expected"));
  EXPECT_EQ(summary.at("archive_bytes"), read_file(folder / "a.isohf").size());
  EXPECT_EQ(summary.at("source_samples"), 300 * 200);
  EXPECT_GT(summary.at("ratio_to_source").get<double>(), 1.0);
  EXPECT_GT(summary.at("peak_memory_bytes").get<double>(), 0.0);
  EXPECT_LE(summary.at("worst_rounding").get<double>(), summary.at("step").get<double>());
  const json info = json::parse(run_isohf({"info", folder / "a.isohf", "--json"}).out);
  EXPECT_EQ(info.at("bytes"), summary.at("archive_bytes"));
  EXPECT_EQ(info.at("metadata"), summary.at("metadata"));
}

TEST_F(ConvertCommand, PrintsSixLinesAndMoreWithV) {
  const auto lines = [&](const std::vector<std::string>& more) {
    const RunResult result =
        run_isohf(with_more({"convert", folder / "a.tif", folder / "a.isohf", "--overwrite", "--lossless"}, more));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return std::count(result.out.begin(), result.out.end(), '\n');
  };
  EXPECT_LE(lines({}), 6);
  EXPECT_GT(lines({"-v"}), lines({}));
}

TEST_F(ConvertCommand, AForgottenOutputAndAForgottenSignAreNamed) {
  const RunResult no_output = run_isohf({"convert", folder / "a.tif", folder / "b.tif"});
  EXPECT_EQ(no_output.exit_code, 2);
  EXPECT_THAT(no_output.err, HasSubstr("no OUTPUT given: " + (folder / "b.tif") + " is an input"));
  const RunResult fill = run_isohf({"convert", "--fill", "50", folder / "a.tif", folder / "a.isohf"});
  EXPECT_EQ(fill.exit_code, 2);
  EXPECT_THAT(fill.err, HasSubstr("--fill=50"));
}

TEST_F(ConvertCommand, QuietPrintsNothing) {
  const RunResult result = run_isohf({"convert", folder / "a.tif", folder / "a.isohf", "-q", "--progress", "plain"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(result.err, "");
}

TEST_F(ConvertCommand, ProgressGoesToStandardErrorInTheFormAskedFor) {
  const RunResult plain = run_isohf({"convert", folder / "a.tif", folder / "1.isohf", "--progress", "plain"});
  EXPECT_THAT(plain.err, HasSubstr("isohf convert: tiles 100 %"));
  EXPECT_EQ(plain.err.find('\r'), std::string::npos);
  const RunResult lines = run_isohf({"convert", folder / "a.tif", folder / "2.isohf", "--progress", "json", "--json"});
  EXPECT_TRUE(json::accept(lines.out));
  std::istringstream stream(lines.err);
  json last;
  for (std::string line; std::getline(stream, line);) last = json::parse(line);
  EXPECT_EQ(last.at("progress"), "tiles");
  EXPECT_EQ(last.at("done"), last.at("total"));
}

TEST_F(ConvertCommand, NumbersAreRecordedAsValuesHoweverTheyAreTyped) {
  const std::string peaks = ISOHF_SOURCE_DIR "/testdata/peaks_256x256_uint16.png";
  const TemporaryFolder other;
  std::string first;
  for (const auto& [scale, range, voids] :
       {std::array{"0.05", "-10:3000", "7,8.5,nan"}, std::array{".05", "-1e1:3000.0", "+7,8.50,nan"}}) {
    const RunResult result = run_isohf({"convert", peaks, other / "a.isohf", "--z-scale", scale, "--valid-range", range,
                                        "--nodata", voids, "--overwrite", "-q"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const std::string bytes = read_file(other / "a.isohf");
    if (first.empty()) first = bytes;
    EXPECT_TRUE(bytes == first) << scale;
  }
}

TEST_F(ConvertCommand, FractionsAreWarnedOfUnlessScaled) {
  write_float_tiff(folder / "unit.tif", 60, 60,
                   [](std::int64_t c, std::int64_t r) { return static_cast<float>(c * r) / 3600.0F; });
  const RunResult warned = run_isohf({"convert", folder / "unit.tif", folder / "1.isohf"});
  EXPECT_EQ(warned.exit_code, 0);
  EXPECT_THAT(warned.err, testing::StartsWith("isohf convert: warning: "));
  EXPECT_THAT(warned.err, HasSubstr("--z-scale"));
  const RunResult scaled = run_isohf({"convert", folder / "unit.tif", folder / "2.isohf", "--z-scale", "1200"});
  EXPECT_EQ(scaled.exit_code, 0);
  EXPECT_EQ(scaled.err, "");
}

TEST_F(ConvertCommand, EveryOptionChangesWhatItSays) {
  const auto metadata = [&](const std::string& name, const std::vector<std::string>& more) {
    convert(name, more);
    return json::parse(run_isohf({"info", folder / name, "--json"}).out);
  };
  const json tiles = metadata("tiles.isohf", {"--shape", "28x35", "--levels", "2"});
  EXPECT_EQ(tiles.at("shape").at("columns"), 28);
  EXPECT_EQ(tiles.at("shape").at("levels"), 2);
  const json spaced = metadata("spaced.isohf", {"--sample-spacing", "30", "--spacing", "45", "--registration", "area"});
  EXPECT_NEAR(spaced.at("grid").at("column_spacing").get<double>(), 45.0, 1e-9);
  const json floats = metadata("floats.isohf", {"--type", "f32"});
  EXPECT_EQ(floats.at("metadata").at("samples").at("type"), "f32");
  EXPECT_EQ(floats.at("grid").at("extent_x"), floats.at("grid").at("extent_z"));
  const json fitted = metadata("fitted.isohf", {"--fit", "--registration", "area"});
  EXPECT_NEAR(fitted.at("grid").at("world_width").get<double>(), 300.0, 1e-9);
  EXPECT_NEAR(fitted.at("grid").at("world_height").get<double>(), 200.0, 1e-9);
}

TEST_F(ConvertCommand, EffortsStoreTheSameElevationsInFewerBytes) {
  const auto content = [&](const std::string& name, const std::vector<std::string>& more) {
    convert(name, more);
    return json::parse(run_isohf({"info", folder / name, "--json"}).out).at("metadata");
  };
  const json fast = content("fast.isohf", {"--quiet", "--effort", "fast"});
  const json usual = content("usual.isohf", {"--quiet"});
  const json small = content("small.isohf", {"--quiet", "--effort", "best"});
  EXPECT_EQ(fast.at("level"), 2);
  EXPECT_EQ(small.at("level"), 6);
  EXPECT_EQ(fast.at("content_sha256"), usual.at("content_sha256"));
  EXPECT_EQ(small.at("content_sha256"), usual.at("content_sha256"));
  EXPECT_GT(std::filesystem::file_size(folder / "fast.isohf"), std::filesystem::file_size(folder / "small.isohf"));
  EXPECT_EQ(run_isohf({"convert", folder / "a.tif", folder / "x.isohf", "--effort", "more"}).exit_code, 2);
}

TEST_F(ConvertCommand, MaxRoundingBoundsEveryVertex) {
  convert("a.isohf", {"--quiet", "--max-rounding", "0.125", "--filter", "bspline3"});
  const json report =
      json::parse(run_isohf({"verify", folder / "a.isohf", "--against", folder / "a.tif", "--json"}).out);
  const json& vertices = report.at("against").at("vertices");
  EXPECT_GT(vertices.at("checked").get<int>(), 10000);
  EXPECT_EQ(vertices.at("wrong"), 0);
  EXPECT_LE(vertices.at("worst").get<double>(), 0.125 + 1e-3);  // heights are floats of some hundred units
  EXPECT_GT(vertices.at("worst").get<double>(), 0.12);
  EXPECT_LE(vertices.at("bound").get<double>(), 0.125 + 1e-3);
  // With a finer step too; a coarser one cannot hold it.
  convert("b.isohf", {"--quiet", "--max-rounding", "1", "--step", "1.4"});
  const json of_finer =
      json::parse(run_isohf({"verify", folder / "b.isohf", "--against", folder / "a.tif", "--json"}).out);
  EXPECT_EQ(of_finer.at("against").at("vertices").at("wrong"), 0);
  EXPECT_GT(of_finer.at("against").at("vertices").at("worst").get<double>(), 0.75) << "codes were chosen";
  const RunResult both =
      run_isohf({"convert", folder / "a.tif", folder / "c.isohf", "--max-rounding", "1", "--step", "3"});
  EXPECT_EQ(both.exit_code, 2);
  EXPECT_THAT(both.err, HasSubstr("--max-rounding"));
}

TEST_F(ConvertCommand, MemoryThatRunsOutIsOneLine) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "AddressSanitizer needs more address space than this test leaves";
#endif
  int refused = 0;
  int made = 0;
  // From what does not even load the libraries, exit code 127, to what is enough: by small steps where the first line
  // of the program has no memory yet.
  for (std::uint64_t kibibytes = 16U << 10U; made == 0 && kibibytes < 400U << 10U;
       kibibytes += refused < 4 ? 32 : 2048) {
    RunOptions small;
    small.address_space_bytes = kibibytes << 10U;
    const RunResult result = run_isohf({"convert", folder / "a.tif", folder / "a.isohf", "-j", "1"}, small);
    // A library that is loaded gives up before the program begins.
    const bool is_begun = result.exit_code != 127 && result.err.find("GnuTLS") == std::string::npos &&
                          result.err != "terminate called without an active exception\n";
    if (!is_begun) continue;
    if (result.exit_code == 0) {
      ++made;
      continue;
    }
    ++refused;
    EXPECT_EQ(result.exit_code, 1) << kibibytes;
    EXPECT_THAT(result.err, testing::AllOf(testing::StartsWith("isohf"), HasSubstr("memory")));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_EQ(folder.names(), std::vector<std::string>{"a.tif"});
  }
  EXPECT_GT(refused, 0);
  EXPECT_EQ(made, 1);
}

}  // namespace
}  // namespace isohf::test
