#include "isohf/restore/lossless.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>

#include "isohf/archive/container/content_hash.h"
#include "isohf/convert.h"
#include "isohf/verify.h"
#include "support/rasters/memory_source.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

ConvertSummary convert_to(HeightSource& source, const std::string& path, ConvertOptions options) {
  options.plan.shape = {20, 19};
  options.plan.levels = 4;
  options.lossless = true;
  options.overwrite = true;
  options.producer = "isohf test";
  return convert(source, path, options);
}

void expect_exact(HeightSource& source, const std::string& path, const std::string& what) {
  const SourceInfo& info = source.info();
  std::vector<std::byte> raw(static_cast<std::size_t>(info.width * info.height) * size_bytes(info.sample_type));
  source.read_window({0, 0, info.width, info.height}, raw);
  const ArchiveReader archive(path);
  const auto record = lossless_record(archive.metadata());
  ASSERT_TRUE(record.has_value()) << what;
  std::vector<std::byte> back;
  for (SourceRowReader reader(archive); !reader.at_end();) {
    const std::vector<std::byte> part = reader.read_next();
    back.insert(back.end(), part.begin(), part.end());
  }
  EXPECT_TRUE(back == raw) << what;
  EXPECT_EQ(hex(sha256(raw)), record->sha256) << what;
  const VerifyReport report = verify_archive(path, {});
  EXPECT_TRUE(report.passed()) << what << (report.findings.empty() ? "" : report.findings.front().text);
}

double hill(std::int64_t c, std::int64_t r) {
  return 800.0 + 300.0 * std::sin(static_cast<double>(c) * 0.11) * std::cos(static_cast<double>(r) * 0.07);
}

TEST(LosslessRecord, IsVoidByValueByRangeAndWhatIsNotFinite) {
  LosslessRecord record;
  record.void_values = {7.0};
  record.valid.first = -100.0;
  for (const double raw : {7.0, -100.5, HUGE_VAL, -HUGE_VAL, std::nan("")}) EXPECT_TRUE(record.is_void(raw)) << raw;
  for (const double raw : {7.5, -100.0, 1e300}) EXPECT_FALSE(record.is_void(raw)) << raw;
}

TEST(Lossless, ReturnsIntegersForEveryFilterDensityAndCodeType) {
  const test::TemporaryFolder folder;
  test::MemorySource<std::int16_t> source(SampleType::kInt16, 90, 75, [](std::int64_t c, std::int64_t r) {
    return c > 40 && c < 50 && r > 20 && r < 31 ? -32768.0 : std::round(hill(c, r));
  });
  source.mutable_info().void_values = {-32768.0};
  for (const char* filter : {"nearest", "bilinear", "limited-cubic", "bspline3"}) {
    for (const double density : {0.2, 1.0, 1.4}) {
      ConvertOptions options;
      options.filter = filter_from_string(filter);
      options.plan.density = density;
      convert_to(source, folder / "a.isohf", options);
      expect_exact(source, folder / "a.isohf", filter + std::to_string(density));
    }
  }
  for (const CodeType type : {CodeType::kU8, CodeType::kF32}) {
    ConvertOptions options;
    options.code_type = type;
    convert_to(source, folder / "a.isohf", options);
    expect_exact(source, folder / "a.isohf", to_string(type));
  }
}

TEST(Lossless, ReturnsFloatsWithTheirNansAndZeros) {
  const test::TemporaryFolder folder;
  test::MemorySource<float> source(SampleType::kFloat32, 70, 60,
                                   [](std::int64_t c, std::int64_t r) { return hill(c, r); });
  const std::uint32_t odd_nan = 0x7FA12345U;
  std::memcpy(&source.at(5, 5), &odd_nan, 4);
  source.at(6, 7) = -0.0F;
  source.at(8, 9) = std::numeric_limits<float>::infinity();
  source.at(9, 9) = -std::numeric_limits<float>::infinity();
  source.at(20, 9) = std::numeric_limits<float>::denorm_min();
  source.mutable_info().z_scale = 0.3;
  source.mutable_info().z_offset = -17.0;
  convert_to(source, folder / "a.isohf", {});
  expect_exact(source, folder / "a.isohf", "float32");
}

TEST(SourceRowReader, RefusesAnArchiveWithoutResiduals) {
  const test::TemporaryFolder folder;
  test::MemorySource<float> source(SampleType::kFloat32, 70, 60, hill);
  (void)convert(source, folder / "a.isohf");
  const ArchiveReader archive(folder / "a.isohf");
  EXPECT_THROW(SourceRowReader{archive}, Error);
}

}  // namespace
}  // namespace isohf
