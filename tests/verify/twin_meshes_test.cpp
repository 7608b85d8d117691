#include "isohf/verify/accuracy/twin_meshes.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "isohf/archive/codec/quantise.h"
#include "isohf/surface/resample/acquisition.h"
#include "isohf/surface/resample/prefilter.h"
#include "isohf/surface/source/source_axis.h"
#include "support/rasters/memory_source.h"
#include "support/rasters/trigonometric_field.h"

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

/// What an archive of this source would say of itself; only what measure_meshes reads.
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

MeshErrors measure(const Metadata& metadata, HeightSource& source, double spacing, bool in_full = true) {
  return measure_meshes(metadata, source, std::array{MeshLayout::squares(spacing, in_full)}, "ortho 1", {}).front();
}

/// The elevation of a vertex anywhere, straight from the definition: the whole raster at once, in double.
class ExactVertices {
 public:
  ExactVertices(const Metadata& metadata, test::MemorySource<float>& source)
      : metadata_(metadata), kernel_(Kernel::make(*metadata.filter, *metadata.edges)) {
    const SourceRecord& record = metadata.source;
    for (std::int64_t r = 0; r < record.height; ++r) {
      for (std::int64_t c = 0; c < record.width; ++c) samples_.push_back(source.at(c, r));
    }
    coefficients_ = samples_;
    Prefilter::make(kernel_.filter(), *metadata.acquisition, kernel_.edges())
        .filter({coefficients_.data(), record.width, record.height});
  }

  [[nodiscard]] double operator()(double x, double z) const {
    const SourceRecord& record = metadata_.source;
    const View2D<const float> samples(samples_.data(), record.width, record.height);
    const View2D<const float> coefficients(coefficients_.data(), record.width, record.height);
    const double u = std::clamp((x - record.first_sample_x) / record.spacing_x, 0.0, double(record.width - 1));
    const double v = std::clamp((z - record.first_sample_z) / record.spacing_z, 0.0, double(record.height - 1));
    const double exact = evaluate(kernel_, coefficients, samples, u, v);
    const Quantisation& codes = metadata_.quantisation;
    if (codes.type == CodeType::kF32 || std::isnan(exact)) return exact;
    return elevation_from_code(codes, static_cast<std::uint32_t>((exact - codes.offset) / codes.scale + 0.5));
  }

 private:
  const Metadata& metadata_;
  Kernel kernel_;
  std::vector<float> samples_;
  std::vector<float> coefficients_;
};

/// The same figures, straight from their definition, vertex by vertex.
struct BruteForce {
  struct Sums {
    double squares = 0.0;
    double max = 0.0;
    std::int64_t count = 0;
  };
  std::array<std::array<Sums, 2>, 4> sums{};  ///< [placement][diagonal]
  Sums least_curvature;
  double best_squares = 0.0;

  BruteForce(const Metadata& metadata, test::MemorySource<float>& source, double spacing) {
    const SourceRecord& record = metadata.source;
    const ExactVertices vertex(metadata, source);
    for (std::size_t p = 0; p < 4; ++p) {
      const double first_x = -kMeshPlacements[p].x * spacing;
      const double first_z = -kMeshPlacements[p].z * spacing;
      const auto corner = [&](double column, double row) {
        return vertex(first_x + column * spacing, first_z + row * spacing);
      };
      std::map<std::pair<double, double>, std::array<double, 2>> squares;
      for (std::int64_t r = 0; r < record.height; ++r) {
        for (std::int64_t c = 0; c < record.width; ++c) {
          const double x = (record.first_sample_x + double(c) * record.spacing_x - first_x) / spacing;
          const double z = (record.first_sample_z + double(r) * record.spacing_z - first_z) / spacing;
          const double i = std::floor(x);
          const double j = std::floor(z);
          const double u = x - i;
          const double v = z - j;
          const double nw = corner(i, j);
          const double ne = corner(i + 1, j);
          const double sw = corner(i, j + 1);
          const double se = corner(i + 1, j + 1);
          const double falling = u >= v ? nw + u * (ne - nw) + v * (se - ne) : nw + v * (sw - nw) + u * (se - sw);
          const double rising =
              u + v <= 1.0 ? nw + u * (ne - nw) + v * (sw - nw) : se + (1 - u) * (sw - se) + (1 - v) * (ne - se);
          const std::array<double, 2> error = {falling - double{source.at(c, r)}, rising - double{source.at(c, r)}};
          add(sums[p][0], error[0]);
          add(sums[p][1], error[1]);
          if (std::isnan(error[0] + error[1])) continue;
          for (std::size_t d = 0; d < 2; ++d) squares[{i, j}][d] += error[d] * error[d];
          const double last_x = std::floor((metadata.grid.world_width() - first_x) / spacing) + 1;
          const double last_z = std::floor((metadata.grid.world_height() - first_z) / spacing) + 1;
          double bends_falling = kVoid;
          double bends_rising = kVoid;
          if (i > 0 && j > 0 && i + 2 <= last_x && j + 2 <= last_z) {
            bends_falling = std::abs(corner(i - 1, j - 1) - 2 * nw + se) + std::abs(nw - 2 * se + corner(i + 2, j + 2));
            bends_rising = std::abs(corner(i - 1, j + 2) - 2 * sw + ne) + std::abs(sw - 2 * ne + corner(i + 2, j - 1));
          }
          if (std::isnan(bends_falling + bends_rising)) {
            bends_falling = std::abs(nw - se);
            bends_rising = std::abs(ne - sw);
          }
          add(least_curvature, bends_falling <= bends_rising ? error[0] : error[1]);
        }
      }
      for (const auto& [place, of] : squares) best_squares += std::min(of[0], of[1]);
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

void expect_equal(const MeshErrors& found, const BruteForce& expected, double tolerance) {
  const std::size_t best = found.diagonal == Diagonal::kFalling ? 0 : 1;
  EXPECT_LE(expected.rms(best), expected.rms(1 - best) + tolerance);
  EXPECT_NEAR(found.rms, expected.rms(best), tolerance);
  EXPECT_NEAR(found.rms_of_other, expected.rms(1 - best), tolerance);
  EXPECT_NEAR(found.rms_best, std::sqrt(expected.best_squares / double(expected.least_curvature.count)), tolerance);
  // Where both diagonals bend alike, a rounding decides: a few samples of thousands.
  const double least = std::sqrt(expected.least_curvature.squares / double(expected.least_curvature.count));
  EXPECT_NEAR(found.rms_least_curvature, least, std::max(tolerance, 0.002 * least));
  EXPECT_NEAR(found.max, expected.max(best), tolerance);
  EXPECT_EQ(found.compared, expected.count(best));
}

// Heights near 100 are floats and so are the kernels' weights: 1e-5 each. No vertex lies on a side of another's square.
constexpr double kFloats = 1e-4;

TEST(TwinMeshes, IsWhatItsDefinitionSaysAtAnySpacingVoidsIncluded) {
  for (const bool with_voids : {false, true}) {
    RoughLand source(61, 75, with_voids);
    for (const double spacing : {4.1, 9.87, 10.0, 13.3, 37.0}) {
      SCOPED_TRACE(spacing);
      const Metadata metadata = describe({}, 61, 75);
      expect_equal(measure(metadata, source, spacing), BruteForce(metadata, source, spacing), kFloats);
    }
  }
}

TEST(TwinMeshes, KnowsPixelsThatAreNotSquareAndThoseThatAreAreas) {
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

TEST(TwinMeshes, UsesTheSurfacesFilterAndAcquisition) {
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

TEST(TwinMeshes, UsesTheSurfacesQuantisation) {
  RoughLand source(61, 75, true);
  Job job;
  job.quantisation = {CodeType::kU16, 10.0, 4.0};
  const Metadata metadata = describe(job, 61, 75);
  // A vertex whose height lies half way between codes may be rounded otherwise: 4 units for a few of 4575 samples.
  expect_equal(measure(metadata, source, 13.3), BruteForce(metadata, source, 13.3), 0.02);
}

// The nearest three vertices by their places alone: no rows, squares or diagonals.
TEST(TwinMeshes, OfTheIsoLatticeAreItsTriangles) {
  for (const bool with_voids : {false, true}) {
    RoughLand source(61, 75, with_voids);
    const Metadata metadata = describe({}, 61, 75);
    const ExactVertices vertex(metadata, source);
    const MeshLayout layout = MeshLayout::equilateral(13.3 * 17.1);
    EXPECT_NEAR(layout.spacing_z / layout.spacing_x, std::sqrt(0.75), 1e-12);
    double squares = 0.0;
    std::int64_t count = 0;
    for (const MeshPlacement& placement : kMeshPlacements) {
      for (std::int64_t r = 0; r < 75; ++r) {
        for (std::int64_t c = 0; c < 61; ++c) {
          // In units of the lattice's side, from a vertex; q counts rows, p along them.
          const double x = 10.0 * double(c) / layout.spacing_x + placement.x;
          const double q = 10.0 * double(r) / layout.spacing_z + placement.z;
          const auto elevation = [&](double p, double row) {
            const double slid = p + 0.5 * (row - 2.0 * std::floor(row / 2.0));  // odd rows
            return vertex((slid - placement.x) * layout.spacing_x, (row - placement.z) * layout.spacing_z);
          };
          struct Near {
            double distance, x, z, height;
          };
          std::vector<Near> near;
          for (double row = std::floor(q) - 1; row <= std::floor(q) + 2; ++row) {
            for (double p = std::floor(x) - 2; p <= std::floor(x) + 2; ++p) {
              const double at = p + 0.5 * (row - 2.0 * std::floor(row / 2.0));
              const double dz = (row - q) * std::sqrt(0.75);
              near.push_back({std::hypot(at - x, dz), at - x, dz, elevation(p, row)});
            }
          }
          std::sort(near.begin(), near.end(), [](const Near& a, const Near& b) { return a.distance < b.distance; });
          const auto& [n0, n1, n2] = std::tie(near[0], near[1], near[2]);
          const double cross = (n1.x - n0.x) * (n2.z - n0.z) - (n2.x - n0.x) * (n1.z - n0.z);
          const double b = (n0.z * (n2.x - n0.x) - n0.x * (n2.z - n0.z)) / cross;
          const double a = (n0.x * (n1.z - n0.z) - n0.z * (n1.x - n0.x)) / cross;
          const double error =
              n0.height + b * (n1.height - n0.height) + a * (n2.height - n0.height) - double{source.at(c, r)};
          if (std::isnan(error)) continue;
          squares += error * error;
          ++count;
        }
      }
    }
    const MeshErrors found = measure_meshes(metadata, source, std::array{layout}, "iso", {}).front();
    EXPECT_EQ(found.compared, count / 4);
    EXPECT_NEAR(found.rms, std::sqrt(squares / double(count)), kFloats);
  }
}

TEST(TwinMeshes, OfEverySecondSampleKeepThoseSamples) {
  RoughLand source(61, 75, false);
  const Metadata metadata = describe({}, 61, 75);
  const auto of = [&](std::int64_t stride) {
    return measure_meshes(metadata, source, std::array{MeshLayout::every(stride, metadata.source)}, "kept", {}).front();
  };
  EXPECT_EQ(of(1).rms, 0.0);
  EXPECT_EQ(of(1).compared, 61 * 75);
  // A quarter of the samples is kept: what is left of the others' error is more than that of all by 4/3.
  double squares = 0.0;
  std::int64_t others = 0;
  for (const auto& [east, south] : {std::pair{0, 0}, {0, 1}, {1, 0}, {1, 1}}) {
    for (std::int64_t r = 2; r < 73; ++r) {
      for (std::int64_t c = 2; c < 59; ++c) {
        const bool between_columns = (c - east) % 2 != 0;
        const bool between_rows = (r - south) % 2 != 0;
        const auto mean = [&](std::int64_t x, std::int64_t z) {
          return 0.5 * (double{source.at(c - x, r - z)} + double{source.at(c + x, r + z)});
        };
        if (!between_columns && !between_rows) continue;
        if (between_columns && between_rows) {
          const double falling = mean(1, 1) - double{source.at(c, r)};
          const double rising = mean(1, -1) - double{source.at(c, r)};
          squares += std::min(falling * falling, rising * rising);
        } else {
          const double error = (between_columns ? mean(1, 0) : mean(0, 1)) - double{source.at(c, r)};
          squares += error * error;
        }
        ++others;
      }
    }
  }
  // Without the rim, which the brute force leaves out; squares' sums hold the sides' errors for either diagonal alike.
  const double inside = std::sqrt(squares / double(4 * 71 * 57));
  EXPECT_NEAR(of(2).rms_best, inside, 0.02 * inside);
  EXPECT_LE(of(2).rms_best, of(2).rms_least_curvature);
  EXPECT_LE(of(2).rms_best, of(2).rms);
  EXPECT_GT(others, 0);
}

TEST(TwinMeshes, CountsWhatLeavesTheCodes) {
  RoughLand source(30, 30, false);
  Job job;
  job.quantisation = {CodeType::kU8, 40.0, 0.1};
  EXPECT_GT(measure(describe(job, 30, 30), source, 10.0).clamped, 100);
  EXPECT_EQ(measure(describe({}, 30, 30), source, 10.0).clamped, 0);
}

TEST(TwinMeshes, IsExactOnPlanesUpToTheSourcesEdge) {
  test::MemorySource<float> source(SampleType::kFloat32, 45, 38, [](std::int64_t c, std::int64_t r) {
    return 50.0 + 1.5 * static_cast<double>(c) + 0.75 * static_cast<double>(r);
  });
  Job job;
  job.outside = Outside::kCover;
  const MeshErrors errors = measure(describe(job, 45, 38), source, 11.3);
  EXPECT_EQ(errors.compared, 45 * 38);
  EXPECT_LT(errors.max, 1e-4);  // floats
}

TEST(TwinMeshes, ResultsAreTheSameBitsForAnyNumberOfThreads) {
  RoughLand source(300, 200, true);
  Job job;
  job.filter = Filter::kBspline3;
  const Metadata metadata = describe(job, 300, 200);
  std::vector<MeshErrors> found;
  for (const int threads : {1, 2, 5}) {
    oneapi::tbb::task_arena arena(threads);
    arena.execute([&] { found.push_back(measure(metadata, source, 9.1)); });
  }
  for (const MeshErrors& other : found) {
    EXPECT_EQ(other.rms, found[0].rms);
    EXPECT_EQ(other.rms_of_other, found[0].rms_of_other);
    EXPECT_EQ(other.rms_least_curvature, found[0].rms_least_curvature);
    EXPECT_EQ(other.rms_best, found[0].rms_best);
    EXPECT_EQ(other.max, found[0].max);
    EXPECT_EQ(other.p99, found[0].p99);
    EXPECT_EQ(other.plain_bytes, found[0].plain_bytes);
    EXPECT_EQ(other.compared, found[0].compared);
  }
}

TEST(TwinMeshes, ReadsEverySourceRowOnce) {
  RoughLand source(60, 200, false);
  (void)measure(describe({}, 60, 200), source, 10.7);
  EXPECT_EQ(source.rows_read, 200);
}

TEST(TwinMeshes, HasAsManyTrianglesAsTheTiles) {
  const TileGrid grid = TileGrid::make(TileShape::make(212, 243, 4), 3, 2, 1000.0, 1000.0);
  EXPECT_NEAR(2.0 * 3000.0 * 2000.0 / vertex_area(grid), double(6 * grid.shape().triangle_count()), 1e-6);
}

}  // namespace
}  // namespace isohf
