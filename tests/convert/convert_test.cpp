#include "isohf/convert.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <numbers>
#include <string>

#include "isohf/archive.h"
#include "isohf/error.h"
#include "isohf/surface.h"
#include "isohf/verify.h"
#include "support/error_of.h"
#include "support/rasters/memory_source.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class Convert : public testing::Test {
 protected:
  [[nodiscard]] std::string path(const std::string& name) const { return folder_ / name; }

  static ConvertOptions small_tiles(Filter filter = Filter::kBilinear) {
    ConvertOptions options;
    options.plan.shape = {20, 19};
    options.plan.levels = 4;
    options.filter = filter;
    options.producer = "isohf test";
    return options;
  }

  const test::TemporaryFolder folder_;
};

test::MemorySource<std::int16_t> hills(std::int64_t width = 90, std::int64_t height = 75) {
  return {SampleType::kInt16, width, height, [](std::int64_t c, std::int64_t r) {
            return std::round(800.0 + 300.0 * std::sin(static_cast<double>(c) * 0.11) *
                                          std::cos(static_cast<double>(r) * 0.07));
          }};
}

/// What a caller gets wrong is one error, before a file is made.
TEST_F(Convert, RefusesWhatCallersGetWrong) {
  const auto message = [&](HeightSource& source, const ConvertOptions& options, const Job& job = {}) -> std::string {
    const Error error = test::error_of([&] { convert(source, path("wrong.isohf"), options, job); });
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument) << error.what();
    return error.what();
  };
  const auto of_source = [&](const std::function<void(SourceInfo&)>& change) {
    auto source = hills();
    change(source.mutable_info());
    return message(source, small_tiles());
  };
  EXPECT_THAT(of_source([](SourceInfo& info) { info.z_scale = 0.0; }),
              HasSubstr("z_scale is 0, must be a number other"));
  EXPECT_THAT(of_source([](SourceInfo& info) { info.georeference.spacing_x = -1.0; }),
              HasSubstr("spacing of columns is -1"));
  EXPECT_THAT(of_source([](SourceInfo& info) { info.georeference.origin_x = std::nan(""); }),
              HasSubstr("first easting is nan"));
  EXPECT_THAT(of_source([](SourceInfo& info) { info.georeference.system.epsg = -5; }), HasSubstr("EPSG code is -5"));
  const auto of_options = [&](const std::function<void(ConvertOptions&)>& change) {
    auto source = hills();
    ConvertOptions options = small_tiles();
    change(options);
    return message(source, options);
  };
  EXPECT_THAT(of_options([](ConvertOptions& options) { options.texture = TextureRequest{}; }), HasSubstr("no photo"));
  EXPECT_THAT(of_options([](ConvertOptions& options) { options.max_error = std::nan(""); }),
              HasSubstr("`max_error` is nan"));
  EXPECT_THAT(of_options([](ConvertOptions& options) { options.acquisition.kind = Acquisition::Kind::kTaps; }),
              HasSubstr("there are 0"));
  for (const int threads : {-7, 1 << 30}) {
    auto source = hills();
    Job job;
    job.threads = threads;
    EXPECT_THAT(message(source, small_tiles(), job), HasSubstr("must be 1 to 1024"));
  }
  EXPECT_FALSE(fs::exists(path("wrong.isohf")));
  EXPECT_THROW(ArchiveReader(nullptr, "none"), Error);
}

/// A texture: its first column comes behind its last.
TEST_F(Convert, APatternWithoutAPlaceIsJoined) {
  constexpr std::int64_t kColumns = 64;
  test::MemorySource<float> pattern(SampleType::kFloat32, kColumns, 48, [](std::int64_t c, std::int64_t r) {
    return 10.0 * std::sin(2.0 * std::numbers::pi * static_cast<double>(c) / kColumns) + static_cast<double>(r);
  });
  ConvertOptions options = small_tiles(Filter::kLimitedCubic);
  options.plan.ground.wrap = Wrap::kAlways;
  const ConvertSummary summary = convert(pattern, path("a.isohf"), options);
  EXPECT_TRUE(summary.metadata.wraps_x);
  EXPECT_NEAR(summary.metadata.grid.world_width(), kColumns, 1e-9) << "a period, not one spacing less";
  EXPECT_TRUE(verify_archive(path("a.isohf")).passed());
  const ArchiveReader archive(path("a.isohf"));
  EXPECT_EQ(check_vertices(archive, pattern).wrong, 0);
  Surface surface(archive);
  for (double z = 0.5; z < 47.0; z += 5.0) {
    EXPECT_EQ(surface.at(WorldPoint{0.0, z}).elevation, surface.at(WorldPoint{double{kColumns}, z}).elevation);
  }
  // What has a place is not all the way round because it is wished for.
  pattern.mutable_info().georeference.has_origin = true;
  EXPECT_THROW(convert(pattern, path("b.isohf"), options), Error);
}

TEST_F(Convert, RowsAreReadOnceFromNorthToSouth) {
  auto source = hills();
  ConvertOptions options = small_tiles();
  options.lossless = true;
  (void)convert(source, path("hills.isohf"), options);
  const ArchiveReader archive(path("hills.isohf"));
  const SampleGrid grid = natural_grid(archive.metadata());
  RowReader rows(archive, grid);
  std::vector<double> some(static_cast<std::size_t>(2 * grid.width));
  const auto row = std::span(some).first(static_cast<std::size_t>(grid.width));
  rows.read(50, 1, row);
  EXPECT_THROW(rows.read(0, 1, row), Error) << "back";
  EXPECT_THROW(rows.read(51, 1, some), Error) << "room for two";
  EXPECT_THROW(rows.read(51, -1, {}), Error);
  EXPECT_THROW(rows.read(grid.height, 1, row), Error) << "beyond the last";
  rows.read(grid.height - 1, 1, row);
  SourceRowReader own(archive);
  while (!own.at_end()) (void)own.read_next();
  EXPECT_EQ(test::error_of([&] { (void)own.read_next(); }).code(), ErrorCode::kInvalidArgument);
}

TEST_F(Convert, WritesAnArchiveThatVerifies) {
  auto source = hills();
  const ConvertSummary summary = convert(source, path("hills.isohf"), small_tiles());
  EXPECT_EQ(summary.tiles_written, summary.tiles_expected);
  EXPECT_EQ(summary.tiles_expected, summary.metadata.grid.tile_count());
  EXPECT_EQ(summary.archive_bytes, fs::file_size(path("hills.isohf")));
  const VerifyReport report = verify_archive(path("hills.isohf"), {});
  for (const Finding& finding : report.findings) ADD_FAILURE() << finding_name(finding.id) << " " << finding.text;
  EXPECT_TRUE(report.passed());
  EXPECT_EQ(report.tiles_checked, summary.tiles_expected);
  EXPECT_GT(report.shared_vertices_checked, 0);
  EXPECT_FALSE(fs::exists(path("hills.isohf.part")));
}

TEST_F(Convert, APlaneGoesOnOverTheOuterHalfPixels) {
  test::MemorySource<std::int16_t> source(SampleType::kInt16, 40, 30,
                                          [](std::int64_t c, std::int64_t) { return 16.0 * static_cast<double>(c); });
  source.mutable_info().georeference.registration = Registration::kArea;
  (void)convert(source, path("plane.isohf"), small_tiles());
  const ArchiveReader archive(path("plane.isohf"));
  const std::vector<double> elevations = archive.read_elevations({0, 0});
  // Vertex (1, 1) lies on the West edge, half a sample before the first.
  const auto columns = static_cast<std::size_t>(archive.grid().shape().columns());
  EXPECT_DOUBLE_EQ(elevations[columns + 1], -8.0);
}

TEST_F(Convert, AQuadraticComesBackWithinTheBilinearBound) {
  constexpr double kCurvature = 0.01;
  test::MemorySource<float> source(SampleType::kFloat32, 100, 100, [](std::int64_t c, std::int64_t r) {
    return 0.5 * kCurvature * static_cast<double>(c * c + r * r);
  });
  const ConvertSummary summary = convert(source, path("bowl.isohf"), small_tiles());
  const ArchiveReader archive(path("bowl.isohf"));
  const AccuracyReport report = compare_with_source(archive, source);
  EXPECT_EQ(report.samples_compared, 100 * 100);
  // Linear interpolation of a parabola of second derivative k errs by at most k/8 times the square of the longest side:
  // once bilinearly from the source (both axes), once over the triangles (sides up to 1.08 spacings).
  const double bound = kCurvature / 8.0 * (2.0 + 2.0 * 1.08 * 1.08) + summary.step / 2;
  EXPECT_LE(report.max, bound);
  EXPECT_GT(report.max, 0.0);
}

TEST_F(Convert, TheBytesAreTheSameForAnyNumberOfThreads) {
  auto source = hills(400, 300);
  for (const Filter filter : {Filter::kBilinear, Filter::kLimitedCubic, Filter::kBspline3}) {
    std::string first;
    for (const int threads : {1, 2, 3, 7}) {
      ConvertOptions options = small_tiles(filter);
      options.overwrite = true;
      (void)convert(source, path("t.isohf"), options, {.threads = threads});
      const std::string bytes = test::read_file(path("t.isohf"));
      if (first.empty()) first = bytes;
      EXPECT_TRUE(bytes == first) << threads << " threads, " << to_string(filter);
    }
  }
}

TEST_F(Convert, ReadsTheSourceTwiceAtMost) {
  auto source = hills(200, 400);
  (void)convert(source, path("once.isohf"), small_tiles());
  EXPECT_LE(source.rows_read, 2 * 400);
}

TEST_F(Convert, VoidsStayVoidAndAreCounted) {
  auto source = hills();
  source.mutable_info().void_values = {-32768.0};
  for (std::int64_t r = 20; r < 50; ++r) {
    for (std::int64_t c = 30; c < 60; ++c) source.at(c, r) = -32768;
  }
  for (const CodeType type : {CodeType::kU16, CodeType::kU8, CodeType::kF32}) {
    ConvertOptions options = small_tiles();
    options.code_type = type;
    options.overwrite = true;
    const ConvertSummary summary = convert(source, path("voids.isohf"), options);
    EXPECT_GT(summary.metadata.statistics.voids, 0);
    EXPECT_GE(*summary.metadata.statistics.min, 400.0) << "the void value never becomes an elevation";
    const VerifyReport report = verify_archive(path("voids.isohf"), {});
    for (const Finding& finding : report.findings) ADD_FAILURE() << finding_name(finding.id) << " " << finding.text;
    const ArchiveReader archive(path("voids.isohf"));
    const AccuracyReport accuracy = compare_with_source(archive, source);
    EXPECT_EQ(accuracy.samples_void, 30 * 30);
    EXPECT_EQ(accuracy.lost_inside, 0);
    EXPECT_EQ(accuracy.invented_inside, 0);
  }
}

TEST_F(Convert, AHoleOnOneSideAloneIsCountedAsAFault) {
  auto whole = hills();
  auto holed = hills();
  holed.mutable_info().void_values = {-32768.0};
  for (std::int64_t r = 20; r < 50; ++r) {
    for (std::int64_t c = 30; c < 60; ++c) holed.at(c, r) = -32768;
  }
  (void)convert(whole, path("whole.isohf"), small_tiles());
  (void)convert(holed, path("holed.isohf"), small_tiles());
  const AccuracyReport invented = compare_with_source(ArchiveReader(path("whole.isohf")), holed);
  EXPECT_GT(invented.invented_inside, 400);  // of 30 x 30, but for a few samples at each side
  EXPECT_EQ(invented.lost_inside, 0);
  const AccuracyReport lost = compare_with_source(ArchiveReader(path("holed.isohf")), whole);
  EXPECT_GT(lost.lost_inside, 400);
  EXPECT_EQ(lost.invented_inside, 0);
}

TEST_F(Convert, EveryFilterStaysInsideItsCodes) {
  // Steps of full height make every kernel with negative lobes overshoot.
  test::MemorySource<float> source(SampleType::kFloat32, 64, 64, [](std::int64_t c, std::int64_t r) {
    return (c / 8 + r / 8) % 2 == 0 ? 0.0 : 1000.0;
  });
  for (const char* filter : {"nearest", "bilinear", "limited-cubic", "bspline3"}) {
    for (const double step : {0.0, 0.125}) {
      ConvertOptions options = small_tiles();
      options.filter = filter_from_string(filter);
      options.step = step;
      options.overwrite = true;
      const ConvertSummary summary = convert(source, path("checker.isohf"), options);
      EXPECT_EQ(summary.metadata.statistics.clamped, 0) << filter;
      EXPECT_TRUE(verify_archive(path("checker.isohf"), {}).passed()) << filter;
    }
  }
}

TEST_F(Convert, NothingButVoidsIsRefusedAndLeavesNothing) {
  test::MemorySource<float> source(SampleType::kFloat32, 30, 30,
                                   [](std::int64_t, std::int64_t) { return std::numeric_limits<double>::quiet_NaN(); });
  EXPECT_THROW((void)convert(source, path("nan.isohf"), small_tiles()), Error);
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

TEST_F(Convert, RadiiOfAWholeMoonKeepTheirDecimals) {
  test::MemorySource<double> source(SampleType::kFloat64, 40, 40, [](std::int64_t c, std::int64_t r) {
    return 1737400.0 + 0.001 * static_cast<double>(c) + 0.002 * static_cast<double>(r);
  });
  const ConvertSummary summary = convert(source, path("moon.isohf"), small_tiles());
  const ArchiveReader archive(path("moon.isohf"));
  EXPECT_LE(compare_with_source(archive, source).max, summary.step + 1e-7);
}

}  // namespace
}  // namespace isohf
