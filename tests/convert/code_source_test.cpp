#include "isohf/convert/stages/code_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "isohf/archive.h"
#include "isohf/error.h"
#include "isohf/parts.h"
#include "isohf/shards.h"
#include "isohf/verify.h"
#include "support/error_of.h"
#include "support/rasters/memory_source.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

using ::testing::HasSubstr;

constexpr double kMost = 2.5;

/// A plain that rises slowly, with the noise of radar; a hole in it.
struct NoisyPlain : test::MemorySource<std::int16_t> {
  explicit NoisyPlain(std::mt19937 random = std::mt19937(7))
      : MemorySource(SampleType::kInt16, 420, 400, [&random](std::int64_t c, std::int64_t r) {
          const bool is_void = c > 100 && c < 130 && r > 40 && r < 70;
          const double noise = std::normal_distribution<double>(0.0, 1.0)(random);
          return is_void ? -32768.0 : std::round(80.0 + 0.02 * static_cast<double>(c + r) + noise);
        }) {
    mutable_info().void_values = {-32768.0};
  }
};

ConvertOptions options_of(std::optional<double> step, Filter filter = Filter::kBilinear) {
  ConvertOptions options;
  options.plan.shape = {100, 99};
  options.overwrite = true;
  options.plan.levels = 4;
  options.filter = filter;
  options.step = step;
  options.max_rounding = kMost;
  options.producer = "isohf test";
  return options;
}

class CodeSourceTest : public testing::Test {
 protected:
  ConvertSummary run(const std::string& name, const ConvertOptions& options, const Job& job = {}) {
    NoisyPlain source;
    return convert(source, folder_ / name, options, job);
  }
  const test::TemporaryFolder folder_;
};

TEST_F(CodeSourceTest, CodesWithinReachVaryLessThanTheNearestAndKeepTheBound) {
  for (const Filter filter : {Filter::kBilinear, Filter::kLimitedCubic, Filter::kBspline3}) {
    ConvertOptions floats = options_of({}, filter);
    floats.max_rounding.reset();
    floats.code_type = CodeType::kF32;
    run("exact.isohf", floats);
    const ConvertSummary nearest = run("nearest.isohf", options_of({}, filter));
    const ConvertSummary chosen = run("chosen.isohf", options_of(1.4 * kMost, filter));
    EXPECT_LT(static_cast<double>(chosen.tile_bytes), 0.92 * static_cast<double>(nearest.tile_bytes));
    EXPECT_GT(chosen.worst_rounding, 0.75 * kMost);
    EXPECT_FALSE(nearest.metadata.rounding.has_value());

    const ArchiveReader archive(folder_ / "chosen.isohf");
    const ArchiveReader exact(folder_ / "exact.isohf");
    ASSERT_TRUE(archive.metadata().rounding.has_value());
    EXPECT_NEAR(*archive.metadata().rounding, kMost, 1e-3);
    EXPECT_EQ(archive.metadata().quantisation.scale, 1.4 * kMost);
    double worst = 0.0;
    for (std::int64_t flat = 0; flat < archive.grid().tile_count(); ++flat) {
      const std::vector<double> stored = archive.read_elevations(archive.grid().tile_at(flat));
      const std::vector<double> wanted = exact.read_elevations(archive.grid().tile_at(flat));
      for (std::size_t i = 0; i < stored.size(); ++i) {
        ASSERT_EQ(std::isnan(stored[i]), std::isnan(wanted[i]));
        if (!std::isnan(stored[i])) worst = std::max(worst, std::abs(stored[i] - wanted[i]));
      }
    }
    EXPECT_LE(worst, kMost + 1e-4);
    // Vertices that tiles share are the same in each, and are held against the source by the same bound.
    EXPECT_TRUE(verify_archive(folder_ / "chosen.isohf").passed());
    NoisyPlain source;
    const VertexReport vertices = check_vertices(archive, source);
    EXPECT_EQ(vertices.wrong, 0);
    EXPECT_GT(vertices.vertices, 10000);
  }
}

TEST_F(CodeSourceTest, TheBytesAreThoseOfAnyThreadsMemoryAndShards) {
  ConvertOptions options = options_of(1.4 * kMost);
  options.z_range = {0.0, 40 * 1.4 * kMost};
  run("a.isohf", options);
  const std::string bytes = test::read_file(folder_ / "a.isohf");
  for (const int threads : {1, 3}) {
    Job job;
    job.threads = threads;
    job.memory_bytes = threads == 1 ? std::uint64_t{30} << 20U : 0;
    run("b.isohf", options, job);
    EXPECT_TRUE(test::read_file(folder_ / "b.isohf") == bytes) << threads;
  }
  NoisyPlain source;
  std::vector<std::string> files;
  for (int number = 1; number <= 3; ++number) {
    files.push_back(folder_ / ("shard" + std::to_string(number)));
    (void)convert_shard(source, {number, 3}, files.back(), options);
  }
  (void)merge_shards(files, folder_ / "c.isohf", {});
  EXPECT_TRUE(test::read_file(folder_ / "c.isohf") == bytes);
}

TEST_F(CodeSourceTest, AStepThatRoundsByMoreThanTheBoundIsRefused) {
  const Error error = test::error_of([&] { run("a.isohf", options_of(2.1 * kMost)); });
  EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
  EXPECT_THAT(error.what(), HasSubstr("step 5.25 rounds by up to 2.6"));
  EXPECT_THROW(run("a.isohf", options_of(0.0)), Error);
}

TEST(QuantiseWithin, TakesTheCodeNearestToTheSmoothedHeightWithinReach) {
  const Quantisation codes{CodeType::kU16, 0.0, 1.0};
  const float nan = std::numeric_limits<float>::quiet_NaN();
  //                                 free: 4, 5    5 alone  NaN: nearest  void  beyond the first and the last code
  const std::vector<float> heights = {4.4F, 4.6F, 5.0F, 4.4F, nan, -0.4F, 65534.4F};
  const std::vector<float> smooth = {5.2F, 3.0F, 9.0F, nan, 5.0F, 1.0F, 65530.0F};
  TileCodes tile;
  const QuantiserCounts counts = quantise_within(codes, code_limits(codes), 0.0, 0.7, heights, smooth, tile);
  EXPECT_THAT(tile.codes, testing::ElementsAre(5, 4, 5, 4, 65535, 0, 65534));
  EXPECT_NEAR(counts.worst_rounding, 0.6, 1e-6);
  EXPECT_EQ(counts.below + counts.above, 0);
}

}  // namespace
}  // namespace isohf
