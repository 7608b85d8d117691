#include "isohf/verify/accuracy/ortho_twin.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "isohf/archive/codec/quantise.h"
#include "isohf/surface/resample/acquisition.h"
#include "isohf/surface/resample/prefilter.h"
#include "isohf/surface/source/source_axis.h"
#include "support/memory_source.h"
#include "support/trigonometric_field.h"

namespace isohf {
namespace {

constexpr float kVoid = std::numeric_limits<float>::quiet_NaN();

struct RoughLand : test::MemorySource<float> {
  RoughLand(std::int64_t width, std::int64_t height, bool with_voids)
      : MemorySource(SampleType::kFloat32, width, height, [](std::int64_t c, std::int64_t r) {
          const auto x = static_cast<double>(c);
          const auto z = static_cast<double>(r);
          return 100.0 + 30.0 * std::sin(0.5 * x + 0.3 * z) + 20.0 * std::cos(0.9 * z - 0.2 * x) +
                 std::fmod(7.0 * x * z, 5.0);
        }) {
    if (!with_voids) return;
    for (std::int64_t i = 5; i < 12; ++i) at(i, 9) = at(i, 10) = at(i + 6, 40) = kVoid;
    at(0, 0) = at(width - 1, height - 1) = at(3, 30) = kVoid;
  }
};

/// What an archive of this source would say of itself; only what measure_ortho_twin reads.
struct Job {
  Registration registration = Registration::kPoint;
  double spacing_x = 10.0;
  double spacing_z = 10.0;
  Filter filter = Filter::kBilinear;
  std::string acquisition = "point";
  Quantisation quantisation{CodeType::kF32, 0.0, 1.0};
  Outside outside = Outside::kClamp;
};

Metadata describe(const Job& job, std::int64_t width, std::int64_t height) {
  const double extent = 300.0;
  const auto tiles = [&](std::int64_t samples, double spacing) {
    return static_cast<std::int64_t>(std::ceil(static_cast<double>(samples) * spacing / extent));
  };
  Metadata metadata(TileGrid::make(TileShape::make(24, 27, 2), tiles(width, job.spacing_x),
                                   tiles(height, job.spacing_z), extent, extent));
  metadata.quantisation = job.quantisation;
  metadata.outside = job.outside;
  metadata.filter = job.filter;
  metadata.acquisition = acquisition_from_string(job.acquisition);
  metadata.source.width = width;
  metadata.source.height = height;
  metadata.source.registration = job.registration;
  metadata.source.spacing_x = job.spacing_x;
  metadata.source.spacing_z = job.spacing_z;
  if (job.registration == Registration::kArea) {
    metadata.source.first_sample_x = job.spacing_x / 2.0;
    metadata.source.first_sample_z = job.spacing_z / 2.0;
  }
  metadata.statistics.min = 40.0;
  metadata.statistics.max = 160.0;
  return metadata;
}

OrthoErrors measure(const Metadata& metadata, HeightSource& source, double spacing, bool in_full = true) {
  return measure_ortho_twin(metadata, source, spacing, in_full, "ortho 1", {});
}

/// The same figures, straight from their definition: the whole raster at once, vertex by vertex, in double.
struct BruteForce {
  struct Sums {
    double squares = 0.0;
    double max = 0.0;
    std::int64_t count = 0;
  };
  std::array<std::array<Sums, 2>, 4> sums{};  ///< [phase][diagonal]

  BruteForce(const Metadata& metadata, test::MemorySource<float>& source, double spacing) {
    const SourceRecord& record = metadata.source;
    std::vector<float> samples;
    for (std::int64_t r = 0; r < record.height; ++r) {
      for (std::int64_t c = 0; c < record.width; ++c) samples.push_back(source.at(c, r));
    }
    std::vector<float> coefficients = samples;
    const Kernel kernel = Kernel::make(*metadata.filter, *metadata.edges);
    Prefilter::make(kernel.filter(), *metadata.acquisition, kernel.edges())
        .filter({coefficients.data(), record.width, record.height});
    const View2D<const float> sample_view(samples.data(), record.width, record.height);
    const View2D<const float> view(coefficients.data(), record.width, record.height);
    const auto vertex = [&](double x, double z) {
      const double u = std::clamp((x - record.first_sample_x) / record.spacing_x, 0.0, double(record.width - 1));
      const double v = std::clamp((z - record.first_sample_z) / record.spacing_z, 0.0, double(record.height - 1));
      const double exact = evaluate(kernel, view, sample_view, u, v);
      const Quantisation& codes = metadata.quantisation;
      if (codes.type == CodeType::kF32 || std::isnan(exact)) return exact;
      return elevation_from_code(codes, static_cast<std::uint32_t>((exact - codes.offset) / codes.scale + 0.5));
    };
    for (std::size_t p = 0; p < 4; ++p) {
      const double first_x = -kOrthoPhases[p].x * spacing;
      const double first_z = -kOrthoPhases[p].z * spacing;
      for (std::int64_t r = 0; r < record.height; ++r) {
        for (std::int64_t c = 0; c < record.width; ++c) {
          const double x = (record.first_sample_x + double(c) * record.spacing_x - first_x) / spacing;
          const double z = (record.first_sample_z + double(r) * record.spacing_z - first_z) / spacing;
          const double u = x - std::floor(x);
          const double v = z - std::floor(z);
          const auto corner = [&](int east, int south) {
            return vertex(first_x + (std::floor(x) + east) * spacing, first_z + (std::floor(z) + south) * spacing);
          };
          const double nw = corner(0, 0);
          const double ne = corner(1, 0);
          const double sw = corner(0, 1);
          const double se = corner(1, 1);
          const double falling = u >= v ? nw + u * (ne - nw) + v * (se - ne) : nw + v * (sw - nw) + u * (se - sw);
          const double rising =
              u + v <= 1.0 ? nw + u * (ne - nw) + v * (sw - nw) : se + (1 - u) * (sw - se) + (1 - v) * (ne - se);
          add(sums[p][0], falling - double{source.at(c, r)});
          add(sums[p][1], rising - double{source.at(c, r)});
        }
      }
    }
  }

  static void add(Sums& to, double error) {
    if (std::isnan(error)) return;
    to.squares += error * error;
    to.max = std::max(to.max, std::abs(error));
    ++to.count;
  }
  [[nodiscard]] double rms(std::size_t d) const {
    double squares = 0.0;
    std::int64_t count = 0;
    for (const auto& phase : sums) {
      squares += phase[d].squares;
      count += phase[d].count;
    }
    return std::sqrt(squares / double(count));
  }
  [[nodiscard]] double max(std::size_t d) const {
    return (sums[0][d].max + sums[1][d].max + sums[2][d].max + sums[3][d].max) / 4.0;
  }
  [[nodiscard]] std::int64_t count(std::size_t d) const {
    return (sums[0][d].count + sums[1][d].count + sums[2][d].count + sums[3][d].count) / 4;
  }
};

void expect_equal(const OrthoErrors& found, const BruteForce& expected, double tolerance) {
  const std::size_t best = found.diagonal == Diagonal::kFalling ? 0 : 1;
  EXPECT_LE(expected.rms(best), expected.rms(1 - best) + tolerance);
  EXPECT_NEAR(found.rms, expected.rms(best), tolerance);
  EXPECT_NEAR(found.rms_of_other, expected.rms(1 - best), tolerance);
  EXPECT_NEAR(found.max, expected.max(best), tolerance);
  EXPECT_EQ(found.compared, expected.count(best));
}

// Heights near 100 are floats and so are the kernels' weights: 1e-5 each. No vertex lies on a side of another's square.
constexpr double kFloats = 1e-4;

TEST(OrthoTwin, IsWhatItsDefinitionSaysAtAnySpacingVoidsIncluded) {
  for (const bool with_voids : {false, true}) {
    RoughLand source(61, 75, with_voids);
    for (const double spacing : {4.1, 9.87, 10.0, 13.3, 37.0}) {
      SCOPED_TRACE(spacing);
      const Metadata metadata = describe({}, 61, 75);
      expect_equal(measure(metadata, source, spacing), BruteForce(metadata, source, spacing), kFloats);
    }
  }
}

TEST(OrthoTwin, KnowsPixelsThatAreNotSquareAndThoseThatAreAreas) {
  RoughLand source(50, 70, true);
  Job job;
  job.spacing_x = 7.3;
  job.spacing_z = 11.9;
  for (const Registration registration : {Registration::kPoint, Registration::kArea}) {
    job.registration = registration;
    const Metadata metadata = describe(job, 50, 70);
    expect_equal(measure(metadata, source, 12.1), BruteForce(metadata, source, 12.1), kFloats);
  }
}

TEST(OrthoTwin, UsesTheSurfacesFilterAndAcquisition) {
  for (const Filter filter : {Filter::kCatmullRom, Filter::kBspline3, Filter::kBspline5}) {
    for (const char* acquisition : {"point", "box"}) {
      if (filter == Filter::kCatmullRom && std::string(acquisition) == "box") continue;
      SCOPED_TRACE(to_string(filter) + " " + acquisition);
      for (const bool with_voids : {false, true}) {
        RoughLand source(40, 67, with_voids);
        Job job;
        job.filter = filter;
        job.acquisition = acquisition;
        const Metadata metadata = describe(job, 40, 67);
        expect_equal(measure(metadata, source, 14.7), BruteForce(metadata, source, 14.7), 1e-3);  // coefficients grow
      }
    }
  }
}

TEST(OrthoTwin, UsesTheSurfacesQuantisation) {
  RoughLand source(61, 75, true);
  Job job;
  job.quantisation = {CodeType::kU16, 10.0, 4.0};
  const Metadata metadata = describe(job, 61, 75);
  // A vertex whose height lies half way between codes may be rounded otherwise: 4 units for a few of 4575 samples.
  expect_equal(measure(metadata, source, 13.3), BruteForce(metadata, source, 13.3), 0.02);
}

TEST(OrthoTwin, CountsWhatLeavesTheCodes) {
  RoughLand source(30, 30, false);
  Job job;
  job.quantisation = {CodeType::kU8, 40.0, 0.1};
  EXPECT_GT(measure(describe(job, 30, 30), source, 10.0).clamped, 100);
  EXPECT_EQ(measure(describe({}, 30, 30), source, 10.0).clamped, 0);
}

TEST(OrthoTwin, IsExactOnPlanesUpToTheSourcesEdge) {
  test::MemorySource<float> source(SampleType::kFloat32, 45, 38, [](std::int64_t c, std::int64_t r) {
    return 50.0 + 1.5 * static_cast<double>(c) + 0.75 * static_cast<double>(r);
  });
  Job job;
  job.outside = Outside::kCover;
  const OrthoErrors errors = measure(describe(job, 45, 38), source, 11.3);
  EXPECT_EQ(errors.compared, 45 * 38);
  EXPECT_LT(errors.max, 1e-4);  // floats
}

TEST(OrthoTwin, ResultsAreTheSameBitsForAnyNumberOfThreads) {
  RoughLand source(300, 200, true);
  Job job;
  job.filter = Filter::kBspline3;
  const Metadata metadata = describe(job, 300, 200);
  std::vector<OrthoErrors> found;
  for (const int threads : {1, 2, 5}) {
    oneapi::tbb::task_arena arena(threads);
    arena.execute([&] { found.push_back(measure(metadata, source, 9.1)); });
  }
  for (const OrthoErrors& other : found) {
    EXPECT_EQ(other.rms, found[0].rms);
    EXPECT_EQ(other.rms_of_other, found[0].rms_of_other);
    EXPECT_EQ(other.max, found[0].max);
    EXPECT_EQ(other.p99, found[0].p99);
    EXPECT_EQ(other.plain_bytes, found[0].plain_bytes);
    EXPECT_EQ(other.compared, found[0].compared);
  }
}

TEST(OrthoTwin, ReadsEverySourceRowOnce) {
  RoughLand source(60, 200, false);
  (void)measure(describe({}, 60, 200), source, 10.7);
  EXPECT_EQ(source.rows_read, 200);
}

TEST(OrthoTwin, HasAsManyTrianglesAsTheTiles) {
  const TileGrid grid = TileGrid::make(TileShape::make(212, 243, 4), 3, 2, 1000.0, 1000.0);
  const double spacing = ortho_spacing(grid);
  EXPECT_NEAR(2.0 * 3000.0 * 2000.0 / (spacing * spacing), double(6 * grid.shape().triangle_count()), 1e-6);
}

}  // namespace
}  // namespace isohf
