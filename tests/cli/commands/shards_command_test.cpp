/// `plan --write`, `convert --plan`, `merge` and `extract` as a user meets them: what is refused, and how.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

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
    plan("land.plan", {"--shadow-seeds"});
  }
  RunResult run(const Words& words) {
    RunOptions options;
    options.folder = folder.path();
    return run_isohf(words, options);
  }
  void plan(const std::string& name, const Words& more = {}, const std::string& input = "land.tif") {
    Words words = {"plan", input, "--write", name, "--shards", "3", "--shape", "28x35", "-q"};
    words.insert(words.end(), more.begin(), more.end());
    const RunResult made = run(words);
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  RunResult shard(const std::string& name, const std::string& number, const std::string& output) {
    return run({"convert", "--plan", name, "--shard", number, "-o", output});
  }
  void make_shards(const std::string& name, const std::string& stem) {
    for (const char* k : {"1", "2", "3"}) {
      const RunResult made = shard(name, std::string(k) + "/3", stem + k + ".isohf");
      ASSERT_EQ(made.exit_code, 0) << made.err;
      EXPECT_EQ(made.err, "");
      EXPECT_THAT(made.out, HasSubstr(std::string("shard ") + k + "/3 done: " + stem + k + ".isohf, "));
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
  make_shards("land.plan", "p-");
  const RunResult again = shard("land.plan", "2/3", "p-2.isohf");
  EXPECT_EQ(again.exit_code, 0);
  EXPECT_THAT(again.out, HasSubstr("shard 2/3 done already: p-2.isohf, "));
  EXPECT_EQ(run({"merge", "land.plan", "p-1.isohf", "p-2.isohf", "p-3.isohf", "-o", "land.isohf"}).exit_code, 0);
  EXPECT_EQ(run({"convert", "land.tif", "single.isohf", "--shadow-seeds", "--shape", "28x35"}).exit_code, 0);
  EXPECT_EQ(read_file(folder / "land.isohf"), read_file(folder / "single.isohf"));
  fs::remove(folder / "p-1.isohf");
  fs::resize_file(folder / "p-3.isohf", 5000);
  const RunResult missing = run({"merge", "land.plan", "p-2.isohf", "p-3.isohf", "--missing"});
  EXPECT_EQ(missing.exit_code, 0);
  EXPECT_EQ(missing.out, "1,3\n");
  const json document = json::parse(run({"merge", "land.plan", "p-2.isohf", "p-3.isohf", "--missing", "--json"}).out);
  EXPECT_EQ(document.at("missing"), json({1, 3}));
  EXPECT_EQ(document.at("shards"), 3);
}

TEST_F(ShardsCommand, AreRefusedByNumberPlanAndSource) {
  expect_refused({"convert", "--plan", "land.plan", "--shard", "4/3", "-o", "a.isohf"}, 2,
                 "--shard 4/3: land.plan has shards 1/3 to 3/3");
  expect_refused({"convert", "--plan", "land.plan", "--shard", "1/4", "-o", "a.isohf"}, 2,
                 "--shard 1/4: land.plan has shards 1/3 to 3/3");
  expect_refused({"convert", "--plan", "land.plan", "--shard", "0/3", "-o", "a.isohf"}, 2, "--shard");
  expect_refused({"convert", "--plan", "land.plan", "--shard", "one", "-o", "a.isohf"}, 2, "must be K/N, as in 3/16");
  expect_refused({"convert", "--plan", "land.plan", "-o", "a.isohf"}, 2, "which shard? Give --shard K/N");
  expect_refused({"convert", "--plan", "land.plan", "--shard", "1/3", "-o", "a.isohf", "--level", "9"}, 2,
                 "--level is settled by the plan; isohf plan takes it");
  expect_refused({"convert", "--plan", "none.plan", "--shard", "1/3", "-o", "a.isohf"}, 1, "none.plan: ");
  expect_refused({"convert", "--plan", "land.tif", "--shard", "1/3", "-o", "a.isohf"}, 1,
                 "land.tif: is no plan of a conversion");
  std::string text = read_file(folder / "land.plan");
  text.replace(text.find("\"version\": 2"), 12, "\"version\": 7");
  write_file(folder / "newer.plan", text);
  expect_refused({"convert", "--plan", "newer.plan", "--shard", "1/3", "-o", "a.isohf"}, 1,
                 "newer.plan: is a plan of version 7, 2 is read");
  expect_refused({"merge", "newer.plan", "land.tif", "-o", "a.isohf"}, 1,
                 "newer.plan: is a plan of version 7, 2 is read");
  // A source that was changed: as many bytes, another time.
  fs::last_write_time(folder / "land.tif", fs::last_write_time(folder / "land.tif") + std::chrono::seconds(5));
  expect_refused({"convert", "--plan", "land.plan", "--shard", "1/3", "-o", "a.isohf"}, 2,
                 "land.tif: source, options or program are not those that were planned");
}

TEST_F(ShardsCommand, AreJoinedOnlyWithTheirOwnAndNothingIsLost) {
  plan("other.plan", {"--z-range", "0,500"});
  make_shards("land.plan", "p-");
  make_shards("other.plan", "o-");
  const std::string kept = read_file(folder / "p-1.isohf");
  expect_refused({"merge", "land.plan", "p-1.isohf", "o-2.isohf", "p-3.isohf", "-o", "a.isohf"}, 2,
                 "o-2.isohf: is a shard of another plan; of the plan's 3 shards these are missing: 2");
  expect_refused({"merge", "land.plan", "p-1.isohf", "p-2.isohf", "p-3.isohf", "-o", "p-1.isohf"}, 2, "p-1.isohf: ");
  expect_refused({"merge", "land.plan", "p-1.isohf", "p-2.isohf", "p-3.isohf", "-o", "p-1.isohf", "--overwrite"}, 2,
                 "p-1.isohf: ");
  EXPECT_EQ(read_file(folder / "p-1.isohf"), kept);
  expect_refused({"merge", "land.plan", "p-1.isohf", "p-1.isohf", "p-2.isohf", "-o", "a.isohf"}, 2,
                 "p-1.isohf: is shard 1, as p-1.isohf is; of the plan's 3 shards these are missing: 3");
  expect_refused({"merge", "land.plan", "p-1.isohf", "land.tif", "-o", "a.isohf"}, 1, "land.tif: ");
  expect_refused({"merge", "p-1.isohf", "p-2.isohf", "p-3.isohf", "-o", "a.isohf"}, 2, "name its plan first");
  // Bytes that were changed in two of them: both are named, and what stands under the output's name stays.
  for (const char* name : {"p-2.isohf", "p-3.isohf"}) {
    std::string bytes = read_file(folder / name);
    bytes[bytes.size() / 3] = static_cast<char>(bytes[bytes.size() / 3] ^ 4);
    write_file(folder / name, bytes);
  }
  write_file(folder / "a.isohf", kept);
  const RunResult damaged =
      run({"merge", "land.plan", "p-1.isohf", "p-2.isohf", "p-3.isohf", "-o", "a.isohf", "--overwrite"});
  EXPECT_EQ(damaged.exit_code, 1);
  EXPECT_THAT(damaged.err, AllOf(HasSubstr("p-2.isohf: "), HasSubstr("p-3.isohf: "), HasSubstr("missing: 2-3")));
  EXPECT_EQ(read_file(folder / "a.isohf"), kept);
  EXPECT_FALSE(fs::exists(folder / "a.isohf.part"));
}

/// Four files of one degree each, of 40x40 samples.
class ShardsOfAMosaic : public ShardsCommand {
 protected:
  ShardsOfAMosaic() {
    fs::create_directory(folder / "tiles");
    for (int i = 0; i < 4; ++i) {
      write_degrees(folder / ("tiles/t" + std::to_string(i)), 40, 40, 10.0 + i % 2, 50.0 - i / 2, 0.025,
                    [](double longitude, double latitude) { return 100.0 * std::sin(longitude * 9.0) + latitude; });
    }
    plan("tiles.plan", {}, "tiles");
  }
};

TEST_F(ShardsOfAMosaic, AreRefusedWhereAFileThatTheyReadWasChanged) {
  fs::last_write_time(folder / "tiles/t0.flt", fs::last_write_time(folder / "tiles/t0.flt") + std::chrono::seconds(5));
  expect_refused({"convert", "--plan", "tiles.plan", "--shard", "1/3", "-o", "n.isohf"}, 2,
                 "are not those that were planned");
}

TEST_F(ShardsCommand, OfAnArchiveACoarsePlaneIsAnArchiveOfItsOwn) {
  EXPECT_EQ(
      run({"convert", "land.tif", "single.isohf", "--shadow-seeds", "--shape", "12x19", "--levels", "2", "--lossless"})
          .exit_code,
      0);
  const json whole = json::parse(run({"info", "single.isohf", "--json"}).out);
  ASSERT_GE(whole.at("metadata").at("planes").at("count").get<int>(), 2) << whole.dump(1);
  const RunResult made = run({"extract", "single.isohf", "-o", "afar.isohf", "--plane", "1"});
  EXPECT_EQ(made.exit_code, 0) << made.err;
  EXPECT_EQ(made.err, "");
  EXPECT_EQ(run({"verify", "afar.isohf"}).exit_code, 0) << run({"verify", "afar.isohf"}).out;
  const json afar = json::parse(run({"info", "afar.isohf", "--json"}).out);
  EXPECT_EQ(afar.at("metadata").at("planes").at("count").get<int>(),
            whole.at("metadata").at("planes").at("count").get<int>() - 1);
  EXPECT_FALSE(afar.at("metadata").contains("shadow_seeds"));
  EXPECT_EQ(run({"extract", "single.isohf", "-o", "corner.isohf", "--plane", "1", "--tiles", "0:1,0:2"}).exit_code, 0);
  EXPECT_EQ(run({"verify", "corner.isohf"}).exit_code, 0);
  expect_refused({"extract", "single.isohf", "-o", "a.isohf", "--plane", "9"}, 2,
                 "coarse planes, plane 9 is asked for");
  expect_refused({"extract", "single.isohf", "-o", "a.isohf", "--plane", "1", "--tiles", "0:1000,0:1"}, 2,
                 "of tiles are asked for, it holds");
  expect_refused({"extract", "single.isohf", "-o", "a.isohf", "--plane", "0"}, 2, "--plane");
}

}  // namespace
}  // namespace isohf::test
