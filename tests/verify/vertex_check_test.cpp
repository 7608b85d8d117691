#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "isohf/archive.h"
#include "isohf/convert.h"
#include "isohf/sampling/resample/kernels.h"
#include "isohf/sampling/resample/prefilter.h"
#include "isohf/verify.h"
#include "support/rasters/memory_source.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

constexpr std::int64_t kSide = 160;
/// Samples from the source's edge from which on no filter here reads beyond it.
constexpr double kInner = 30.0;

/// Rough ground of about `relief` metres above `base`.
double ground(std::int64_t c, std::int64_t r, double base, double relief) {
  const auto x = static_cast<double>(c);
  const auto z = static_cast<double>(r);
  return base + relief * (0.5 * std::sin(x * 0.031) * std::cos(z * 0.043) + 0.3 * std::sin(x * 0.71 + z * 0.37) +
                          0.2 * std::sin(x * 2.3 - z * 1.9));
}

/// The surface that samples and filter mean, in doubles; above the first sample, as impulse responses are cut off at
/// 1e-9 of what they act on.
class ExactSurface {
 public:
  ExactSurface(Filter filter, std::vector<double> samples) : kernel_(Kernel::make(filter)), datum_(samples.front()) {
    for (double& sample : samples) sample -= datum_;
    samples_ = samples;
    coefficients_ = samples;
    const std::vector<double> p = Prefilter::make(filter, {}).impulse_response();
    const auto reach = static_cast<std::int64_t>(p.size()) - 1;
    for (const bool along : {true, false}) {
      const std::vector<double> from = coefficients_;
      for (std::int64_t i = 0; i < kSide; ++i) {
        for (std::int64_t k = reach; k < kSide - reach; ++k) {
          double sum = 0.0;
          for (std::int64_t j = -reach; j <= reach; ++j) {
            sum += p[static_cast<std::size_t>(std::abs(j))] * from[along ? at(k + j, i) : at(i, k + j)];
          }
          coefficients_[along ? at(k, i) : at(i, k)] = sum;
        }
      }
    }
  }

  [[nodiscard]] double height(double u, double v) const {
    const auto column = static_cast<std::int64_t>(std::floor(u));
    const auto row = static_cast<std::int64_t>(std::floor(v));
    double sum = 0.0;
    for (std::int64_t r = row - 3; r <= row + 4; ++r) {
      for (std::int64_t c = column - 3; c <= column + 4; ++c) {
        sum += kernel_.value(u - static_cast<double>(c)) * kernel_.value(v - static_cast<double>(r)) *
               coefficients_[at(c, r)];
      }
    }
    if (!kernel_.is_limited()) return datum_ + sum;
    const auto [least, most] = std::minmax({samples_[at(column, row)], samples_[at(column + 1, row)],
                                            samples_[at(column, row + 1)], samples_[at(column + 1, row + 1)]});
    return datum_ + std::clamp(sum, least, most);
  }

 private:
  static std::size_t at(std::int64_t c, std::int64_t r) { return static_cast<std::size_t>(r * kSide + c); }

  Kernel kernel_;
  double datum_;
  std::vector<double> samples_;
  std::vector<double> coefficients_;
};

/// The largest distance of a vertex away from the source's edge from what it should be.
double worst_error(const ArchiveReader& archive, const ExactSurface& exact) {
  const SourceRecord& source = archive.metadata().source;
  const TileGrid& grid = archive.grid();
  double worst = 0.0;
  for (std::int64_t flat = 0; flat < grid.tile_count(); ++flat) {
    const TileIndex tile = grid.tile_at(flat);
    const std::vector<double> stored = archive.read_elevations(tile);
    for (int r = 0; r < grid.shape().rows(); ++r) {
      for (int c = 0; c < grid.shape().columns(); ++c) {
        const WorldPoint world = grid.world_from_lattice(grid.lattice_vertex(tile, {c, r}));
        const double u = (world.x - source.first_sample_x) / source.spacing_x;
        const double v = (world.z - source.first_sample_z) / source.spacing_z;
        if (std::min(u, v) < kInner || std::max(u, v) > static_cast<double>(kSide) - 1.0 - kInner) continue;
        const auto i = static_cast<std::size_t>(r * grid.shape().columns() + c);
        worst = std::max(worst, std::abs(stored[i] - exact.height(u, v)));
      }
    }
  }
  return worst;
}

template <typename T>
void expect_bounds_held(SampleType type, double base, double relief, double bound) {
  const test::TemporaryFolder folder;
  test::MemorySource<T> source(type, kSide, kSide, [&](std::int64_t c, std::int64_t r) {
    return type == SampleType::kInt16 ? std::round(ground(c, r, base, relief)) : ground(c, r, base, relief);
  });
  std::vector<double> samples;
  for (std::int64_t r = 0; r < kSide; ++r) {
    for (std::int64_t c = 0; c < kSide; ++c) samples.push_back(static_cast<double>(source.at(c, r)));
  }
  for (const Filter filter : {Filter::kBilinear, Filter::kLimitedCubic, Filter::kBspline3}) {
    ConvertOptions options;
    options.filter = filter;
    options.max_rounding = bound;
    options.overwrite = true;
    (void)convert(source, folder / "a.isohf", options);
    const ArchiveReader archive(folder / "a.isohf");
    EXPECT_LE(worst_error(archive, ExactSurface(filter, samples)), bound) << to_string(filter);
    const VertexReport report = check_vertices(archive, source);
    EXPECT_EQ(report.wrong, 0) << to_string(filter);
    EXPECT_LE(report.bound, 1.01 * bound);  // the surface reaches a little further than its samples
  }
}

TEST(VertexCheck, BoundsOfRoundingHoldForEveryVertex) {
  expect_bounds_held<std::int16_t>(SampleType::kInt16, 2500.0, 2200.0, 0.05);
  expect_bounds_held<float>(SampleType::kFloat32, 3.39e6, 40.0, 0.002);
  expect_bounds_held<double>(SampleType::kFloat64, -4455.0, 17.0, 0.0005);
  expect_bounds_held<float>(SampleType::kFloat32, 100.0, 4000.0, 0.1);
}

TEST(VertexCheck, SeesOneSampleThatIsOffByAFloatsLastBit) {
  const test::TemporaryFolder folder;
  test::MemorySource<float> source(SampleType::kFloat32, kSide, kSide,
                                   [](std::int64_t c, std::int64_t r) { return ground(c, r, 3.39e6, 40.0); });
  ConvertOptions options;
  options.max_rounding = 0.01;
  (void)convert(source, folder / "a.isohf", options);
  const ArchiveReader archive(folder / "a.isohf");
  EXPECT_EQ(check_vertices(archive, source).wrong, 0);
  source.at(70, 80) = std::nextafter(source.at(70, 80), HUGE_VALF);
  EXPECT_GT(check_vertices(archive, source).wrong, 0);
}

/// Heights of a stated range are summed above its middle, however little of it there is.
TEST(VertexCheck, HoldsHeightsOfAStatedRangeAgainstTheRoundingThatTheyHave) {
  const test::TemporaryFolder folder;
  std::mt19937_64 random(7);
  for (int i = 0; i < 20; ++i) {
    test::MemorySource<std::int8_t> source(SampleType::kInt8, 40, 52, [&](std::int64_t, std::int64_t) {
      return static_cast<double>(static_cast<int>(random() % 200) - 100);
    });
    ConvertOptions options;
    options.filter = Filter::kBspline3;
    options.z_range = {-49790.25 - 7.0 * i, 31736.4};
    options.step = 0.0;
    options.overwrite = true;
    (void)convert(source, folder / "a.isohf", options);
    EXPECT_EQ(check_vertices(ArchiveReader(folder / "a.isohf"), source).wrong, 0) << i;
  }
}

/// The step is a last bit less than a whole part of the range, so that the last code does not lie beyond it.
TEST(VerifyArchive, TakesTheLastCodeOfAStatedRangeForOne) {
  const test::TemporaryFolder folder;
  test::MemorySource<float> source(SampleType::kFloat32, 20, 20,
                                   [](std::int64_t c, std::int64_t r) { return 1000.0 + static_cast<double>(c * r); });
  for (const auto& [low, high] : std::vector<std::pair<double, double>>{{243.9251386680371, 8579.8573802898},
                                                                        {371.866902078179, 9239.989095354056},
                                                                        {-3661.648081427241, 4939.154602649878}}) {
    ConvertOptions options;
    options.code_type = CodeType::kU8;
    options.z_range = {low, high};
    options.clamp_range = true;
    options.overwrite = true;
    (void)convert(source, folder / "a.isohf", options);
    const VerifyReport report = verify_archive(folder / "a.isohf");
    EXPECT_TRUE(report.passed()) << low << ": " << (report.findings.empty() ? "" : report.findings.front().text);
  }
}

}  // namespace
}  // namespace isohf
