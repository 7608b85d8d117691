#include "isohf/convert/job_description.h"
#include "isohf/archive/tile/tile_codes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "support/rasters/memory_photo.h"

namespace isohf::test {
namespace {

SourceInfo source_info() {
  SourceInfo info;
  info.path = "nowhere.tif";
  info.width = 300;
  info.height = 200;
  info.block_width = 300;
  return info;
}

std::string fingerprint(const SourceInfo& info) {
  const ConvertOptions options;
  return job_fingerprint(info, make_plan(info, options.plan), options);
}

TEST(JobFingerprint, TellsTreatmentsOfVoidsApart) {
  const std::vector<std::function<void(SourceInfo&)>> treatments = {
      [](SourceInfo&) {},
      [](SourceInfo& info) { info.void_values = {-9999.0}; },
      [](SourceInfo& info) {
        info.void_values = {-9999.0, 0.0};
      },
      [](SourceInfo& info) { info.valid_min = 0.0; },
      [](SourceInfo& info) { info.valid_max = 9000.0; },
      [](SourceInfo& info) { info.fill_distance = 100; },
      [](SourceInfo& info) { info.fill_distance = 50; },
  };
  std::set<std::string> found;
  for (const auto& treat : treatments) {
    SourceInfo info = source_info();
    treat(info);
    EXPECT_TRUE(found.insert(fingerprint(info)).second);
    EXPECT_EQ(fingerprint(info), fingerprint(info));
  }
}

TEST(JobFingerprint, TellsEffortsSeedsTexturesAndTapsApart) {
  const SourceInfo info = source_info();
  MemoryPhoto photo(3, 2, 3, [](auto, auto, int) { return 0; });
  std::vector<ConvertOptions> all(9);
  all[1].effort = Effort::kFast;
  all[2].effort = Effort::kBest;
  all[3].shadow_seeds = ShadowSeedRequest{2.0};
  all[4].shadow_seeds = ShadowSeedRequest{3.0};
  all[5].texture = TextureRequest{&photo, {}, 64};
  all[6].texture = TextureRequest{&photo, {}, 128};
  for (const std::size_t i : {7U, 8U}) all[i].acquisition.kind = Acquisition::Kind::kTaps;
  all[7].acquisition.taps = {0.1, 0.8, 0.1};
  all[8].acquisition.taps = {0.1, 0.8000000000000002, 0.1};
  std::set<std::string> found;
  for (const ConvertOptions& options : all) {
    EXPECT_TRUE(found.insert(job_fingerprint(info, make_plan(info, options.plan), options)).second) << found.size();
  }
}

TEST(JobFingerprint, NamesTheLibrariesThatDecideBytes) {
  const std::string found = fingerprint(source_info());
  EXPECT_THAT(found, testing::HasSubstr(std::string("zlib ") + zlibVersion()));
  for (const char* library : {"libdeflate 1", "PROJ Rel. ", "GeographicLib "}) {
    EXPECT_THAT(found, testing::HasSubstr(library));
  }
}

TEST(DescribeJob, RecordsTheTreatmentOfVoids) {
  SourceInfo info = source_info();
  info.void_values = {-9999.0};
  info.valid_range = {-500.0, 9000.0};
  info.fill_distance = 64;
  const ConvertOptions options;
  const Metadata metadata = describe_job(info, make_plan(info, options.plan), options, {});
  EXPECT_EQ(metadata.source.void_values, info.void_values);
  EXPECT_EQ(metadata.source.valid_range, info.valid_range);
  EXPECT_EQ(metadata.source.fill_distance, 64);
}

}  // namespace
}  // namespace isohf::test
