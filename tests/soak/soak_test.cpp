/// Random conversions of random rasters: what is made verifies, gives the samples back, is the same by any number of threads, and
/// holds what a slow oracle of its own says. ISOHF_SOAK asks for another number of them, ISOHF_SOAK_SEED for others.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <string>

#include "isohf/archive.h"
#include "isohf/convert.h"
#include "isohf/error.h"
#include "isohf/surface.h"
#include "isohf/verify.h"
#include "soak/slow_oracle.h"
#include "support/rasters/memory_source.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

std::uint64_t from_environment(const char* name, std::uint64_t otherwise) {
  const char* const wanted = std::getenv(name);
  return wanted != nullptr ? std::stoull(wanted) : otherwise;
}

class Soak : public ::testing::Test {
 protected:
  template <typename T>
  T one_of(std::initializer_list<T> values) {
    return values.begin()[random_() % values.size()];
  }
  bool chance(double of) { return std::uniform_real_distribution<double>(0.0, 1.0)(random_) < of; }
  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  std::int64_t whole(std::int64_t low, std::int64_t high) {
    return std::uniform_int_distribution<std::int64_t>(low, high)(random_);
  }

  template <typename T>
  std::unique_ptr<HeightSource> raster_of(SampleType type) {
    const std::int64_t width = chance(0.03) ? whole(500, 5000) : whole(1, chance(0.3) ? 9 : 90);
    const std::int64_t height = width > 499    ? whole(1, 3)
                                : chance(0.02) ? whole(500, 3000) / width + 1
                                               : whole(1, chance(0.3) ? 9 : 70);
    const int kind = static_cast<int>(whole(0, 5));
    const double low =
        std::is_floating_point_v<T> ? -5000.0 : std::max(-9000.0, double{std::numeric_limits<T>::lowest()});
    const double high = std::is_floating_point_v<T> ? 5000.0 : std::min(9000.0, double{std::numeric_limits<T>::max()});
    const double middle = (low + high) / 2;
    const double a = between(0.01, 0.4), b = between(0.01, 0.4), swing = (high - low) * between(0.0, 0.49);
    const double share_void = chance(0.5) ? 0.0 : between(0.0, 0.6);
    const T none = std::numeric_limits<T>::lowest();
    auto source = std::make_unique<test::MemorySource<T>>(type, width, height, [&](std::int64_t c, std::int64_t r) {
      const double x = a * static_cast<double>(c), z = b * static_cast<double>(r);
      if (share_void > 0.0 && std::sin(3.1 * x + 1.0) * std::cos(2.3 * z) > 1.0 - 2.0 * share_void) return double{none};
      switch (kind) {
        case 0:
          return std::floor(middle);
        case 1:
          return between(low, high);
        case 2:  // both ends of the type, as far as its numbers can be told apart in an archive
          return chance(0.02) ? high : chance(0.02) ? low + 1.0 : middle;
        case 3:
          return std::floor(middle +
                            swing * (x + z) / (1.0 + a * static_cast<double>(width) + b * static_cast<double>(height)));
        default:
          return middle + swing * std::sin(x) * std::cos(z);
      }
    });
    SourceInfo& info = source->mutable_info();
    if (share_void > 0.0) info.void_values = {double{none}};
    if constexpr (std::is_floating_point_v<T>) {
      for (int i = 0; i < 3 && chance(0.3); ++i) {
        source->at(whole(0, width - 1), whole(0, height - 1)) =
            one_of({std::numeric_limits<T>::quiet_NaN(), std::numeric_limits<T>::infinity(), T{-0.0}});
      }
    }
    if (chance(0.3)) info.z_scale = one_of({0.1, 2.0, -1.0, 0.3048});
    if (chance(0.3)) info.z_offset = between(-500.0, 500.0);
    if (chance(0.6)) {
      info.georeference.registration = one_of({Registration::kArea, Registration::kPoint});
      info.georeference.spacing_x = between(0.1, 90.0);
      info.georeference.spacing_y = info.georeference.spacing_x * (chance(0.5) ? 1.0 : between(0.5, 2.0));
    }
    return source;
  }
  std::unique_ptr<HeightSource> raster() {
    switch (whole(0, 7)) {
      case 0:
        return raster_of<std::uint8_t>(SampleType::kUint8);
      case 1:
        return raster_of<std::int8_t>(SampleType::kInt8);
      case 2:
        return raster_of<std::uint16_t>(SampleType::kUint16);
      case 3:
        return raster_of<std::uint32_t>(SampleType::kUint32);
      case 4:
        return raster_of<std::int32_t>(SampleType::kInt32);
      case 5:
        return raster_of<float>(SampleType::kFloat32);
      case 6:
        return raster_of<double>(SampleType::kFloat64);
      default:
        return raster_of<std::int16_t>(SampleType::kInt16);
    }
  }

  ConvertOptions options() {
    ConvertOptions options;
    PlanRequest& plan = options.plan;
    plan.levels = static_cast<int>(whole(1, 3));
    if (chance(0.7)) {
      const TileShape shape =
          TileShape::nearest(static_cast<int>(whole(5, 40)), static_cast<int>(whole(5, 41)), *plan.levels);
      plan.shape = {shape.columns(), shape.rows()};
    }
    if (chance(0.4)) plan.density = between(0.2, 2.5);
    plan.fit = chance(0.3);
    options.code_type = one_of({CodeType::kU16, CodeType::kU16, CodeType::kU8, CodeType::kF32});
    options.filter = one_of({Filter::kNearest, Filter::kBilinear, Filter::kLimitedCubic, Filter::kBspline3});
    if (chance(0.15)) {
      options.acquisition = acquisition_from_string(one_of<const char*>({"box", "gaussian:0.4", "0.25,1,0.25"}));
    }
    if (options.code_type != CodeType::kF32) {
      if (chance(0.2)) options.step = one_of({0.0, 0.5, 10.0});
      if (chance(0.15)) {
        const double low = between(-6000.0, 2000.0);
        options.z_range = {low, low + between(100.0, 9000.0)};
        options.clamp_range = chance(0.8);
      }
    }
    if (chance(0.25)) {
      options.shadow_seeds = ShadowSeedRequest{between(2.0, 30.0)};
    }
    options.effort = static_cast<Effort>(whole(0, 2));
    options.planes = chance(0.7);
    options.lossless = chance(0.4);
    return options;
  }

  void try_one(const std::string& path);
  void hold_against_oracle(const ArchiveReader& archive, HeightSource& source, const ConvertOptions& options);

  std::mt19937_64 random_;
  std::int64_t made_ = 0, refused_ = 0, vertices_ = 0, voids_ = 0;
  std::map<std::string, int> reasons_;
};

std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void Soak::hold_against_oracle(const ArchiveReader& archive, HeightSource& source, const ConvertOptions& options) {
  static const std::map<Filter, soak::Kernel> kKernels = {{Filter::kNearest, soak::Kernel::kNearest},
                                                          {Filter::kBilinear, soak::Kernel::kBilinear},
                                                          {Filter::kLimitedCubic, soak::Kernel::kLimitedCubic}};
  const auto kernel = kKernels.find(*options.filter);
  if (kernel == kKernels.end() || options.acquisition.kind != Acquisition::Kind::kPoint) return;
  const SourceInfo& info = source.info();
  const Metadata& metadata = archive.metadata();
  // Where samples lie is what the file says of itself: half a spacing inside for areas.
  const Georeference& place = info.georeference;
  const bool areas = place.registration == Registration::kArea;
  soak::Ground ground{info.width,
                      info.height,
                      test::values_of(source),
                      areas ? 0.5 * place.spacing_x : 0.0,
                      areas ? 0.5 * place.spacing_y : 0.0,
                      place.spacing_x,
                      place.spacing_y};
  double largest = 0.0;
  for (double& sample : ground.elevations) {
    const bool is_void = test::is_void(info, sample);
    sample = is_void ? std::nan("") : sample * info.z_scale + info.z_offset;
    if (is_void) ground.has_voids = true;
    if (!is_void) largest = std::max(largest, std::abs(sample));
  }
  const TileGrid& grid = archive.grid();
  const soak::Tiles tiles{grid.shape().columns(), grid.shape().rows(), grid.extent_x(), grid.extent_z()};
  const double step = metadata.quantisation.scale;
  // Half a step, and the rounding of heights and weights to single precision, sixteen taps of them.
  const double tolerance =
      (metadata.quantisation.type == CodeType::kF32 ? 0.0 : 0.5 * step * (1.0 + 1e-9)) + 2e-6 * largest;
  for (std::int64_t row = 0; row < grid.tile_rows(); ++row) {
    for (std::int64_t column = 0; column < grid.tile_columns(); ++column) {
      const std::vector<double> stored = archive.read_elevations({column, row});
      for (int r = 0; r < tiles.rows; ++r) {
        for (int c = 0; c < tiles.columns; ++c) {
          if (r % 2 == 1 && c == tiles.columns - 1) continue;  // the place without a use
          const soak::Place world = soak::place_of(tiles, column, row, c, r);
          const double u = (world.x - ground.first_x) / ground.spacing_x;
          const double v = (world.z - ground.first_z) / ground.spacing_z;
          // What the source covers.
          const double rim = areas ? 0.5 - 1e-9 : -1e-9;
          if (u < -rim || v < -rim || u > static_cast<double>(info.width - 1) + rim ||
              v > static_cast<double>(info.height - 1) + rim)
            continue;
          // Half a pixel around an area source is covered ground, where the slope goes on, held at the ends of the codes.
          const double inner_u = std::clamp(u, 0.0, static_cast<double>(info.width - 1));
          const double inner_v = std::clamp(v, 0.0, static_cast<double>(info.height - 1));
          const bool goes_on = u != inner_u || v != inner_v;
          soak::Answer answer = goes_on ? soak::elevation_at(ground, kernel->second, u, v)
                                        : soak::elevation_at(ground, kernel->second, inner_u, inner_v);
          if (goes_on && metadata.quantisation.type != CodeType::kF32) {
            const double top = metadata.quantisation.offset + step * metadata.quantisation.max_code();
            answer.least =
                std::isnan(answer.least) ? answer.least : std::clamp(answer.least, metadata.quantisation.offset, top);
            answer.most = std::clamp(answer.most, metadata.quantisation.offset, top);
          }
          if (!answer.is_known) continue;
          const double found = stored[static_cast<std::size_t>(r * tiles.columns + c)];
          ++vertices_;
          if (std::isnan(answer.least) || std::isnan(found)) {
            ++voids_;
            ASSERT_EQ(std::isnan(answer.least), std::isnan(found))
                << "tile " << column << "," << row << " vertex " << c << "," << r << " at " << u << "," << v << ": "
                << found << " for " << answer.least;
            continue;
          }
          if (options.clamp_range) {
            const double top = metadata.z_range ? metadata.z_range->second : std::numeric_limits<double>::infinity();
            answer.least =
                std::isnan(answer.least) ? answer.least : std::clamp(answer.least, metadata.quantisation.offset, top);
            answer.most = std::clamp(answer.most, metadata.quantisation.offset, top);
          }
          ASSERT_TRUE(found >= answer.least - tolerance && found <= answer.most + tolerance)
              << "tile " << column << "," << row << " vertex " << c << "," << r << " at " << u << "," << v << ": "
              << found << " for " << answer.least << " to " << answer.most << " within " << tolerance
              << "; codes begin at " << metadata.quantisation.offset << ", " << metadata.statistics.clamped
              << " were clamped";
        }
      }
    }
  }
}

std::string described(const SourceInfo& info, const ConvertOptions& options) {
  std::string text = fmt::format(
      "{} x {} {}, {}, {}, filter {}, {}, type {}, level {}", info.width, info.height, to_string(info.sample_type),
      to_string(info.georeference.registration), info.georeference.spacing_x, to_string(*options.filter),
      to_string(options.acquisition), to_string(options.code_type), level_of(options.effort));
  if (options.z_range) text += fmt::format(", z_range {}:{}", options.z_range->first, options.z_range->second);
  if (options.step) text += fmt::format(", step {}", *options.step);
  return text;
}

void Soak::try_one(const std::string& path) {
  const std::unique_ptr<HeightSource> source = raster();
  const ConvertOptions wanted = options();
  SCOPED_TRACE(described(source->info(), wanted));
  try {
    (void)convert(*source, path, wanted, {.threads = static_cast<int>(whole(1, 3))});
  } catch (const Error& error) {
    ++refused_;
    const std::string said = error.what();
    ++reasons_[said.substr(0, 60)];
    ASSERT_EQ(said.find_first_of("\n\r"), std::string::npos) << said;
    ASSERT_NE(said.find(' '), std::string::npos) << said;
    for (const char* internal : {"internal", "std::", "vector::"})
      ASSERT_EQ(said.find(internal), std::string::npos) << said;
    ASSERT_FALSE(std::filesystem::exists(path)) << said;
    std::filesystem::remove(path + ".part");
    std::filesystem::remove(path + ".part.journal");
    return;
  }
  ++made_;
  const VerifyReport report = verify_archive(path, {.threads = 2});
  for (const Finding& found : report.findings) {
    ASSERT_EQ(found.severity, Severity::kNote) << finding_name(found.id) << " " << found.text;
  }
  const ArchiveReader archive(path);
  ASSERT_NO_FATAL_FAILURE(hold_against_oracle(archive, *source, wanted));
  if (wanted.lossless) {
    SourceRowReader reader(archive);
    std::vector<std::byte> samples;
    while (!reader.at_end()) {
      const std::vector<std::byte> rows = reader.read_next();
      samples.insert(samples.end(), rows.begin(), rows.end());
    }
    ASSERT_EQ(samples, test::read_whole(*source));
  }
  const VertexReport vertices = check_vertices(archive, *source);
  // A spike between vertices, which a prefilter spreads, is in no statistics, from which the check has its bound.
  double largest = 0.0;
  for (const double sample : test::values_of(*source)) {
    if (!test::is_void(source->info(), sample)) {
      largest = std::max(largest, std::abs(sample * source->info().z_scale + source->info().z_offset));
    }
  }
  ASSERT_TRUE(vertices.wrong == 0 || vertices.worst <= vertices.bound + 2e-6 * largest)
      << vertices.wrong << " vertices, off by " << vertices.worst << ", bound " << vertices.bound;
  if (chance(0.2)) {
    ConvertOptions again = wanted;
    (void)convert(*source, path + "2", again, {.threads = static_cast<int>(whole(1, 4))});
    ASSERT_EQ(bytes_of(path), bytes_of(path + "2"));
    std::filesystem::remove(path + "2");
  }
  Surface surface(archive);
  for (int i = 0; i < 3; ++i) {
    (void)surface.at(WorldPoint{between(-0.2, 1.2) * archive.grid().world_width(),
                                between(-0.2, 1.2) * archive.grid().world_height()});
  }
  std::filesystem::remove(path);
}

TEST_F(Soak, RandomConversionsHoldWhatASlowOracleSays) {
  const test::TemporaryFolder folder;
  const std::uint64_t count = from_environment("ISOHF_SOAK", 60);
  const std::uint64_t first = from_environment("ISOHF_SOAK_SEED", 1);
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    SCOPED_TRACE("ISOHF_SOAK=1 ISOHF_SOAK_SEED=" + std::to_string(seed));
    random_.seed(seed);
    try_one(folder / "soak.isohf");
    const int parts = ::testing::UnitTest::GetInstance()->current_test_info()->result()->total_part_count();
    if (parts > 40) break;  // what is wrong once is wrong often
    std::filesystem::remove(folder / "soak.isohf");
  }
  std::cout << made_ << " conversions made, " << refused_ << " refused; " << vertices_
            << " vertices held against the oracle, " << voids_ << " of them void\n";
  for (const auto& [reason, times] : reasons_) std::cout << times << " x " << reason << "\n";
  EXPECT_LT(refused_, made_);
}

}  // namespace
}  // namespace isohf
