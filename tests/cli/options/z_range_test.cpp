/// --z-range MIN:MAX: both ends hold, whatever the step and the type.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "isohf/archive.h"
#include "isohf/archive/tile_statistics.h"
#include "isohf/lattice.h"
#include "support/rasters/plain_tiff.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

class ZRange : public testing::Test {
 protected:
  /// A slope from 0 to 858, a step a column, with a few rows of -7 in the South and a hole.
  ZRange() {
    write_int16_tiff(folder / "slope.tif", 859, 120, [](std::int64_t c, std::int64_t r) {
      if (r >= 40 && r < 47 && c >= 20 && c < 27) return std::int16_t{-32768};
      return static_cast<std::int16_t>(r >= 110 ? -7 : c);
    });
  }

  RunResult convert(std::vector<std::string> more, const std::string& filter = "bilinear") {
    return run_isohf(with_more(
        {"convert", folder / "slope.tif", folder / "a.isohf", "--overwrite", "--nodata", "-32768", "--filter", filter},
        more));
  }

  /// Every stored elevation, padding included.
  struct Stored {
    double least = HUGE_VAL;
    double most = -HUGE_VAL;
  };
  [[nodiscard]] Stored stored() const {
    const ArchiveReader archive(folder / "a.isohf");
    Stored found;
    for (std::int64_t tile = 0; tile < archive.grid().tile_count(); ++tile) {
      const std::vector<double> elevations = archive.read_elevations(archive.grid().tile_at(tile));
      for (const double at : elevations) {  // NaN compares false
        found.least = at < found.least ? at : found.least;
        found.most = at > found.most ? at : found.most;
      }
    }
    return found;
  }

  TemporaryFolder folder;
};

TEST_F(ZRange, BothEndsHoldWhateverTheStepAndTheType) {
  const std::vector<std::vector<std::string>> ways = {
      {},
      {"--type", "u8"},
      {"--type", "f32"},
      {"--step", "finest"},
      {"--step", "4"},
      {"--step", "0.1"},
      {"--max-rounding", "0.3"},
  };
  for (std::size_t i = 0; i <= ways.size(); ++i) {
    const std::vector<std::string> way = i < ways.size() ? ways[i] : std::vector<std::string>{};
    std::vector<std::string> more = {"--z-range", "0:100", "--clamp-range", "--json"};
    more.insert(more.end(), way.begin(), way.end());
    const std::string filter = i < ways.size() ? "bilinear" : "limited-cubic";
    const std::string named = way.empty() ? filter : way.front() + " " + way.back();
    const RunResult result = convert(more, filter);
    ASSERT_EQ(result.exit_code, 0) << named << result.err;
    const Stored found = stored();
    EXPECT_GE(found.least, 0.0) << named;
    EXPECT_LE(found.most, 100.0) << named;
    EXPECT_NEAR(found.most, 100.0, 1e-9) << named;
    const json metadata = json::parse(result.out).at("metadata");
    EXPECT_EQ(metadata.at("samples").at("range"), json({0.0, 100.0})) << named;
    EXPECT_GT(metadata.at("statistics").at("voids").get<int>(), 0) << named;
    const RunResult verified = run_isohf({"verify", folder / "a.isohf", "--against", folder / "slope.tif", "--json"});
    EXPECT_EQ(verified.exit_code, 0) << named << verified.out;
  }
}

TEST_F(ZRange, ClampedVerticesAreCountedExactly) {
  // Nearest: a vertex holds a sample, so those beyond the range are those of the same lattice without it. Each counts
  // once, however many tiles share it.
  ASSERT_EQ(convert({}, "nearest").exit_code, 0);
  const ArchiveReader free(folder / "a.isohf");
  const TileShape& shape = free.grid().shape();
  const CountedVertices counted(free.metadata());
  std::int64_t beyond = 0;
  for (std::int64_t tile = 0; tile < free.grid().tile_count(); ++tile) {
    const std::vector<double> elevations = free.read_elevations(free.grid().tile_at(tile));
    for (std::size_t i = 0; i < elevations.size(); ++i) {
      const GridVertex vertex{static_cast<int>(i) % shape.columns(), static_cast<int>(i) / shape.columns()};
      if (vertex.row == 0 || vertex.row + 1 == shape.rows()) continue;
      const auto [first, last] = counted.of_row(free.grid().tile_at(tile), vertex.row);
      if (vertex.column < first || vertex.column > last) continue;
      beyond += elevations[i] < 0.0 || elevations[i] > 100.0 ? 1 : 0;
    }
  }
  const RunResult result = convert({"--z-range", "0:100", "--clamp-range", "--json"}, "nearest");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(json::parse(result.out).at("metadata").at("statistics").at("clamped"), beyond);
}

TEST_F(ZRange, AnElevationOutsideIsRefusedWithTheRangeAsTypedAndItsPlace) {
  for (const char* type : {"u16", "u8", "f32"}) {
    const RunResult result = convert({"--z-range=-7:100", "--type", type});
    EXPECT_EQ(result.exit_code, 2) << type;
    EXPECT_THAT(result.err, HasSubstr("lies outside --z-range -7:100")) << type;
    EXPECT_THAT(result.err, testing::ContainsRegex("elevation [0-9.]+ at x [0-9.]+ z -?[0-9.]+, in tile \\(.*\\)"));
    EXPECT_EQ(folder.names(), std::vector<std::string>{"slope.tif"});
    EXPECT_EQ(convert({"--z-range=-7:100", "--type", type, "--threads", "1"}).err, result.err) << type;
  }
  // Half a step beyond is beyond.
  EXPECT_EQ(convert({"--z-range=-7:857.75", "--step", "finest"}).exit_code, 2);
  EXPECT_EQ(convert({"--z-range=-7:858"}).exit_code, 0);
}

TEST_F(ZRange, AStepMustDivideTheRange) {
  const RunResult result = convert({"--z-range=-7:900", "--step", "4"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("--step 4 does not divide --z-range -7:900"));
  EXPECT_THAT(result.err, HasSubstr("--z-range -7:901"));
  EXPECT_EQ(convert({"--z-range=-7:901", "--step", "4"}).exit_code, 0);
}

}  // namespace
}  // namespace isohf::test
