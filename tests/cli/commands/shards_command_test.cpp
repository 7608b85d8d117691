/// `convert --shard`, `merge` and `extract` as a user meets them: what is refused, and how.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "support/rasters/degree_grid.h"
#include "support/rasters/plain_tiff.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using Words = std::vector<std::string>;

class ShardsCommand : public testing::Test {
 protected:
  ShardsCommand() {
    write_int16_tiff(folder / "land.tif", 300, 400, [](std::int64_t c, std::int64_t r) {
      return static_cast<std::int16_t>(200.0 +
                                       90.0 * std::sin(static_cast<double>(c) * 0.05 + static_cast<double>(r) * 0.03));
    });
  }
  RunResult run(const Words& words) {
    RunOptions options;
    options.folder = folder.path();
    return run_isohf(words, options);
  }
  Words words_of(const std::string& number, const std::string& output, const Words& more = {}) {
    return with_more({"convert", "land.tif", "-o", output, "--shard", number, "--shape", "28x35", "--z-range", "0:500",
                      "--shadow-seeds"},
                     more);
  }
  void make_shards(const std::string& stem, const Words& more = {}) {
    for (const char* k : {"1", "2", "3"}) {
      const RunResult made = run(words_of(std::string(k) + "/3", stem + k + ".isohf", more));
      ASSERT_EQ(made.exit_code, 0) << made.err;
      EXPECT_EQ(made.err, "");
      EXPECT_THAT(made.out, HasSubstr(std::string("shard ") + k + "/3    done: " + stem + k + ".isohf, "));
    }
  }
  /// One line on standard error, nothing on the other, and no file more or less.
  void expect_refused(const Words& words, int exit_code, const std::string& why) {
    const Words before = folder.names();
    const RunResult result = run(words);
    EXPECT_EQ(result.exit_code, exit_code) << why;
    EXPECT_THAT(result.err, HasSubstr(why));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_EQ(result.out, "");
    EXPECT_EQ(folder.names(), before);
  }

  TemporaryFolder folder;
};

TEST_F(ShardsCommand, MakeTheBytesOfOneRunAndAreNotMadeTwice) {
  make_shards("p-");
  EXPECT_THAT(run({"info", "p-3.isohf"}).out, HasSubstr("3 of 3, rows "));
  const RunResult again = run(words_of("2/3", "p-2.isohf"));
  EXPECT_EQ(again.exit_code, 0);
  EXPECT_THAT(again.out, HasSubstr("shard 2/3    done already: p-2.isohf, "));
  expect_refused(words_of("1/3", "p-2.isohf"), 2, "p-2.isohf");
  EXPECT_EQ(run({"merge", "p-1.isohf", "p-2.isohf", "p-3.isohf", "-o", "land.isohf"}).exit_code, 0);
  EXPECT_EQ(run({"convert", "land.tif", "single.isohf", "--shadow-seeds", "--shape", "28x35", "--z-range", "0:500"})
                .exit_code,
            0);
  EXPECT_EQ(read_file(folder / "land.isohf"), read_file(folder / "single.isohf"));
  fs::remove(folder / "p-1.isohf");
  fs::resize_file(folder / "p-3.isohf", 5000);
  const RunResult missing = run({"merge", "p-2.isohf", "p-3.isohf", "--missing"});
  EXPECT_EQ(missing.exit_code, 0);
  EXPECT_EQ(missing.out, "1,3\n");
  const json document = json::parse(run({"merge", "p-2.isohf", "p-3.isohf", "--missing", "--json"}).out);
  EXPECT_EQ(document.at("missing"), json({1, 3}));
  EXPECT_EQ(document.at("shards"), 3);
  expect_refused({"merge", "p-3.isohf", "--missing"}, 1, "p-3.isohf: ");
}

TEST_F(ShardsCommand, AreRefusedByNumberAndOptions) {
  expect_refused(words_of("4/3", "a.isohf"), 2, "there is no shard 4 of 3");
  expect_refused(words_of("1/999", "a.isohf"), 2, "999 shards are too many");
  expect_refused(words_of("0/3", "a.isohf"), 2, "--shard");
  expect_refused(words_of("one", "a.isohf"), 2, "must be K/N, as in 3/16");
  expect_refused({"convert", "land.tif", "-o", "a.isohf", "--shard", "1/3"}, 2,
                 "--shard needs --z-range MIN:MAX, or --type f32, as no shard sees all elevations; isohf plan INPUT "
                 "--shard K/N prints the range");
  for (const Words& more : {Words{"--resume"}, {"--max-error", "3"}})
    expect_refused(words_of("1/3", "a.isohf", more), 2, more.front() + " cannot be combined with --shard");
  const RunResult floats = run({"convert", "land.tif", "-o", "a.isohf", "--shard", "1/3", "--type", "f32"});
  EXPECT_EQ(floats.exit_code, 0) << floats.err;
}

/// What plan prints is pasted; the shards have the codes of a run without --z-range, and nothing lies outside.
TEST_F(ShardsCommand, NeedTheOptionsThatPlanPrints) {
  for (const Words& more : {Words{},
                            {"--filter", "bspline3"},
                            {"--step", "0.3"},
                            {"--type", "u8"},
                            {"--type", "f32"},
                            {"--max-rounding", "0.2", "--acquisition", "box"}}) {
    const RunResult text = run(with_more({"plan", "land.tif", "--shape", "28x35", "--shard", "1/2"}, more));
    ASSERT_EQ(text.exit_code, 0) << text.err;
    const json plan =
        json::parse(run(with_more({"plan", "land.tif", "--shape", "28x35", "--shard", "1/2", "--json"}, more)).out);
    const std::string printed = plan.at("shard_options");
    EXPECT_THAT(text.out, HasSubstr("\nshards       " + printed + "\n"));
    std::istringstream words(printed);
    const Words options = with_more(more, Words(std::istream_iterator<std::string>(words), {}));
    const auto convert = [&](const Words& what, const Words& how) {
      const RunResult made = run(with_more(with_more({"convert", "land.tif", "--shape", "28x35", "-q"}, what), how));
      EXPECT_EQ(made.exit_code, 0) << printed << made.err;
    };
    convert({"-o", "1.isohf", "--shard", "1/2", "--overwrite"}, options);
    convert({"-o", "2.isohf", "--shard", "2/2", "--overwrite"}, options);
    ASSERT_EQ(run({"merge", "1.isohf", "2.isohf", "-o", "land.isohf", "--overwrite"}).exit_code, 0);
    convert({"single.isohf", "--overwrite"}, options);
    EXPECT_EQ(read_file(folder / "land.isohf"), read_file(folder / "single.isohf")) << printed;
    convert({"free.isohf", "--overwrite"}, more);
    const auto samples = [&](const char* name) {
      return json::parse(run({"info", name, "--json"}).out).at("metadata").at("samples");
    };
    EXPECT_NEAR(samples("land.isohf").at("scale"), samples("free.isohf").at("scale"), 0.01) << printed;
  }
}

TEST_F(ShardsCommand, AreJoinedOnlyWithTheirOwnAndNothingIsLost) {
  make_shards("p-");
  make_shards("o-", {"--effort", "fast"});
  const std::string kept = read_file(folder / "p-1.isohf");
  expect_refused({"merge", "p-1.isohf", "o-2.isohf", "p-3.isohf", "-o", "a.isohf"}, 2,
                 "o-2.isohf: is a shard of another conversion than p-1.isohf; of 3 shards these are missing: 2");
  expect_refused({"merge", "p-1.isohf", "p-2.isohf", "p-3.isohf", "-o", "p-1.isohf"}, 2, "p-1.isohf: ");
  expect_refused({"merge", "p-1.isohf", "p-2.isohf", "p-3.isohf", "-o", "p-1.isohf", "--overwrite"}, 2, "p-1.isohf: ");
  EXPECT_EQ(read_file(folder / "p-1.isohf"), kept);
  expect_refused({"merge", "p-1.isohf", "p-1.isohf", "p-2.isohf", "-o", "a.isohf"}, 2,
                 "p-1.isohf: is shard 1, as p-1.isohf is; of 3 shards these are missing: 3");
  expect_refused({"merge", "p-1.isohf", "land.tif", "-o", "a.isohf"}, 1, "land.tif: ");
  // Bytes that were changed in two of them: both are named, and what stands under the output's name stays.
  for (const char* name : {"p-2.isohf", "p-3.isohf"}) {
    std::string bytes = read_file(folder / name);
    char& code = bytes[bytes.find(".tile") + 20];
    code = static_cast<char>(code ^ 4);
    write_file(folder / name, bytes);
  }
  write_file(folder / "a.isohf", kept);
  const RunResult damaged = run({"merge", "p-1.isohf", "p-2.isohf", "p-3.isohf", "-o", "a.isohf", "--overwrite"});
  EXPECT_EQ(damaged.exit_code, 1);
  EXPECT_THAT(damaged.err, AllOf(HasSubstr("p-2.isohf: "), HasSubstr("p-3.isohf: "), HasSubstr("missing: 2-3")));
  EXPECT_EQ(read_file(folder / "a.isohf"), kept);
  EXPECT_FALSE(fs::exists(folder / "a.isohf.part"));
  // A source that was changed: as many bytes, another time.
  fs::last_write_time(folder / "land.tif", fs::last_write_time(folder / "land.tif") + std::chrono::seconds(5));
  EXPECT_EQ(run(words_of("3/3", "new.isohf")).exit_code, 0);
  expect_refused({"merge", "p-1.isohf", "new.isohf", "-o", "b.isohf"}, 2,
                 "new.isohf: is a shard of another conversion than p-1.isohf");
}

/// Lines of sample with elevations and normals alone.
std::string without_tiles(const std::string& lines) {
  return std::regex_replace(lines, std::regex(" [0-9]+ [0-9]+\n"), "\n");
}

/// Places that are named alike have one elevation, and so has what is exported. Splines reach beyond the tiles.
TEST_F(ShardsCommand, OfAnExtractEverythingIsWhereItWas) {
  write_degrees(folder / "west", 240, 200, 6.0, 44.0, 0.01,
                [](double longitude, double latitude) { return 900.0 + 400.0 * std::sin(longitude * 9.0) * latitude; });
  for (const char* projection : {"equirectangular", "utm"}) {
    ASSERT_EQ(run({"convert", "west.flt", "-o", "whole.isohf", "--shape", "28x35", "--to-crs", projection,
                   "--overwrite", "-q"})
                  .exit_code,
              0);
    const RunResult made =
        run({"extract", "whole.isohf", "-o", "cut.isohf", "--bbox", "6.7,44.6,7.6,45.4", "--overwrite"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    EXPECT_EQ(run({"verify", "cut.isohf"}).exit_code, 0) << run({"verify", "cut.isohf"}).out;
    EXPECT_EQ(run({"verify", "cut.isohf", "--against", "west.flt"}).exit_code, 0);
    std::string places;
    for (int i = 0; i < 200; ++i)
      places += std::to_string(6.71 + 0.00437 * i) + " " + std::to_string(44.61 + 0.0391 * (i % 20)) + "\n";
    const auto sampled = [&](const char* archive) {
      RunOptions options;
      options.folder = folder.path();
      options.input = places;
      return run_isohf({"sample", archive, "--in", "crs"}, options);
    };
    const RunResult before = sampled("whole.isohf");
    ASSERT_EQ(before.exit_code, 0) << before.err;
    EXPECT_EQ(without_tiles(sampled("cut.isohf").out), without_tiles(before.out));
    const auto exported = [&](const std::string& archive) {
      const RunResult result = run({"export", archive + ".isohf", archive + ".npy", "--bbox", "6.75,44.65,7.55,45.35",
                                    "--spacing", "500", "--method", "barycentric", "--overwrite", "-q"});
      EXPECT_EQ(result.exit_code, 0) << result.err;
      return read_file(folder / (archive + ".npy"));
    };
    EXPECT_EQ(exported("cut"), exported("whole"));
  }
}

TEST_F(ShardsCommand, OfAnArchiveACoarsePlaneIsAnArchiveOfItsOwn) {
  EXPECT_EQ(
      run({"convert", "land.tif", "single.isohf", "--shadow-seeds", "--shape", "12x19", "--levels", "2", "--lossless"})
          .exit_code,
      0);
  const json whole = json::parse(run({"info", "single.isohf", "--json"}).out);
  ASSERT_GE(whole.at("metadata").at("planes").at("count").get<int>(), 2) << whole.dump(1);
  const RunResult made = run({"extract", "single.isohf", "-o", "afar.isohf", "--overview", "1"});
  EXPECT_EQ(made.exit_code, 0) << made.err;
  EXPECT_EQ(made.err, "");
  EXPECT_EQ(run({"verify", "afar.isohf"}).exit_code, 0) << run({"verify", "afar.isohf"}).out;
  const json afar = json::parse(run({"info", "afar.isohf", "--json"}).out);
  EXPECT_EQ(afar.at("metadata").at("planes").at("count").get<int>(),
            whole.at("metadata").at("planes").at("count").get<int>() - 1);
  EXPECT_FALSE(afar.at("metadata").contains("shadow_seeds"));
  EXPECT_EQ(run({"extract", "single.isohf", "-o", "corner.isohf", "--overview", "1", "--tiles", "0:1,0:2"}).exit_code,
            0);
  EXPECT_EQ(run({"verify", "corner.isohf"}).exit_code, 0);
  expect_refused({"extract", "single.isohf", "-o", "a.isohf", "--overview", "9"}, 2, "overviews, not an overview 9");
  expect_refused({"extract", "single.isohf", "-o", "a.isohf", "--overview", "1", "--tiles", "0:1000,0:1"}, 2,
                 "of tiles are asked for, it holds");
  expect_refused({"extract", "single.isohf", "-o", "a.isohf", "--overview", "0"}, 2, "--overview");
}

}  // namespace
}  // namespace isohf::test
