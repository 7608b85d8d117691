#include "isohf/convert/job_description.h"
#include "isohf/archive/tile/tile_codes.h"

#include <gtest/gtest.h>

#include <functional>
#include <set>
#include <string>

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

TEST(JobFingerprint, TellsEffortsApart) {
  const SourceInfo info = source_info();
  std::set<std::string> found;
  for (const Effort effort : {Effort::kFast, Effort::kDefault, Effort::kBest}) {
    ConvertOptions options;
    options.effort = effort;
    EXPECT_TRUE(found.insert(job_fingerprint(info, make_plan(info, options.plan), options)).second) << level_of(effort);
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
