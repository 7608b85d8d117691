#include "isohf/convert/memory_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "isohf/convert.h"
#include "isohf/error.h"
#include "support/error_of.h"
#include "support/rasters/memory_source.h"
#include "support/sanitizers.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

using testing::HasSubstr;

/// Only described, never read.
class Described : public HeightSource {
 public:
  Described(std::int64_t width, std::int64_t height, std::int64_t block_width = 0, std::int64_t block_height = 1) {
    info_.path = "described";
    info_.width = width;
    info_.height = height;
    info_.sample_type = SampleType::kInt16;
    info_.block_width = block_width == 0 ? width : block_width;
    info_.block_height = block_height;
  }
  [[nodiscard]] const SourceInfo& info() const override { return info_; }
  void read_window(const Window& /*window*/, std::span<std::byte> /*samples*/) override { FAIL() << "read"; }

 private:
  SourceInfo info_;
};

MemoryPlan plan_for(const Described& source, std::uint64_t limit, const std::string& filter = "bilinear") {
  ConvertOptions options;
  options.filter = filter_from_string(filter);
  return plan_memory(source, make_plan(source.info(), options.plan), options, {.threads = 2, .memory_bytes = limit});
}

TEST(MemoryPlan, StaysWithinEveryLimitThatIsNotRefused) {
  for (const char* filter : {"bilinear", "bspline3"}) {
    for (const std::int64_t width : {500, 65536, 1000000}) {
      for (const std::int64_t block : {std::int64_t{0}, std::int64_t{256}, std::int64_t{1024}}) {
        const Described source(width, 3000, block, block == 0 ? 1 : block);
        const std::uint64_t least = plan_for(source, 0, filter).least_bytes;
        EXPECT_GT(plan_for(source, least - 1, filter).bytes, least - 1);
        std::uint64_t before = 0;
        for (const std::uint64_t limit : {least, least * 5 / 4, 2 * least, 5 * least}) {
          const MemoryPlan memory = plan_for(source, limit, filter);
          EXPECT_LE(memory.bytes, limit) << filter << " " << width << " in blocks of " << block;
          EXPECT_EQ(memory.least_bytes, least);
          EXPECT_GE(memory.bytes, before * 9 / 10);  // what is given is used
          before = memory.bytes;
        }
      }
    }
  }
}

TEST(MemoryPlan, AMillionColumnsFitInto256Megabytes) {
  for (const char* filter : {"bilinear", "bspline3"}) {
    for (const std::int64_t block : {0, 512}) {
      const Described source(1000000, 10000, block, block == 0 ? 1 : block);
      const MemoryPlan memory = plan_for(source, 256000000, filter);
      EXPECT_LE(memory.bytes, 256000000U) << filter << " in blocks of " << block;
      EXPECT_GT(memory.scratch_bytes, 0U);
    }
  }
}

TEST(MemoryPlan, WithoutALimitNothingGoesToAScratchFileAndTheHeightDoesNotCount) {
  const MemoryPlan low = plan_for(Described(65536, 2048), 0);
  const MemoryPlan high = plan_for(Described(65536, 65536), 0);
  EXPECT_EQ(low.scratch_bytes, 0U);
  EXPECT_LE(low.bytes, 256000000U);
  // The index alone grows.
  EXPECT_LE(high.bytes, low.bytes + low.bytes / 5);
}

TEST(MemoryPlan, TheArchiveDoesNotDependOnTheLimit) {
  const test::TemporaryFolder folder;
  test::MemorySource<std::int16_t> source(SampleType::kInt16, 700, 260, [](std::int64_t c, std::int64_t r) {
    const double x = static_cast<double>(c);
    const double z = static_cast<double>(r);
    // With a hole, and voids here and there.
    if (std::hypot(x - 300.0, z - 120.0) < 20.0 || (c * 7919 + r * 104729) % 997 == 0) return -32768.0;
    return std::round(800.0 + 300.0 * std::sin(x * 0.031) * std::cos(z * 0.07) + 40.0 * std::sin(x * 1.3 + z));
  });
  source.mutable_info().void_values = {-32768.0};
  for (const bool tiled : {false, true}) {
    source.mutable_info().block_width = tiled ? 64 : 700;
    source.mutable_info().block_height = tiled ? 48 : 1;
    for (const char* filter : {"bilinear", "limited-cubic", "bspline3"}) {
      // One filter without a prefilter, one with.
      if (test::kSanitized && filter != std::string(tiled ? "bspline3" : "limited-cubic")) continue;
      ConvertOptions options;
      options.plan.shape = {20, 19};
      options.plan.levels = 4;
      options.filter = filter_from_string(filter);
      options.lossless = std::string(filter) == "bspline3";
      Job job{.threads = 2};
      job.scratch_folder = folder.path();
      options.overwrite = true;
      options.shadow_seeds.emplace();
      (void)convert(source, folder / "any.isohf", options, job);
      const std::string expected = test::read_file(folder / "any.isohf");
      const Plan plan = make_plan(source.info(), options.plan);
      const MemoryPlan free = plan_memory(source, plan, options, job);
      for (const std::uint64_t limit : {free.least_bytes, (free.least_bytes + free.bytes) / 2, 2 * free.bytes}) {
        job.memory_bytes = limit;
        (void)convert(source, folder / "bound.isohf", options, job);
        EXPECT_EQ(test::read_file(folder / "bound.isohf"), expected) << filter << " in " << limit << " bytes";
      }
      EXPECT_EQ(folder.names(), (std::vector<std::string>{"any.isohf", "bound.isohf"}));
    }
  }
}

TEST(MemoryPlan, RowsThatMemoryHasNoRoomForGoToAScratchFile) {
  const test::TemporaryFolder folder;
  test::MemorySource<std::int16_t> source(SampleType::kInt16, 20000, 400, [](std::int64_t c, std::int64_t r) {
    return static_cast<double>((c * 7919 + r * 104729) % 4999);
  });
  ConvertOptions options;
  options.plan.shape = {68, 75};
  options.plan.levels = 2;
  options.overwrite = true;
  Job job{.threads = 2};
  job.scratch_folder = folder.path();
  const Plan plan = make_plan(source.info(), options.plan);
  (void)convert(source, folder / "any.isohf", options, job);
  job.memory_bytes = plan_memory(source, plan, options, job).least_bytes;
  EXPECT_GT(plan_memory(source, plan, options, job).scratch_bytes, 0U);
  (void)convert(source, folder / "bound.isohf", options, job);
  EXPECT_EQ(test::read_file(folder / "bound.isohf"), test::read_file(folder / "any.isohf"));
  EXPECT_EQ(folder.names(), (std::vector<std::string>{"any.isohf", "bound.isohf"}));
}

TEST(MemoryPlan, ALimitThatIsTooSmallIsAnsweredWithTheSmallest) {
  const test::TemporaryFolder folder;
  test::MemorySource<std::int16_t> source(SampleType::kInt16, 90, 75,
                                          [](auto c, auto) { return static_cast<double>(c); });
  const Error error = test::error_of([&] { (void)convert(source, folder / "a.isohf", {}, {.memory_bytes = 1000000}); });
  EXPECT_EQ(error.code(), ErrorCode::kOutOfMemory);
  EXPECT_THAT(error.what(), HasSubstr("`memory_bytes` allows 1 MB, this conversion needs at least "));
  EXPECT_TRUE(folder.names().empty());
}

}  // namespace
}  // namespace isohf
