/// Mosaics of files that differ in resolution, sample type, scale or void value.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "formats/mosaic/mosaic_pieces.h"
#include "formats/mosaic/mosaic_samples.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::HasSubstr;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::vector<double> elevations(HeightSource& source) {
  const std::vector<std::byte> raw = read_whole(source);
  std::vector<double> numbers(raw.size() / size_bytes(source.info().sample_type));
  numbers_from_samples(SampleKind::of(source.info()), raw, numbers);
  for (double& number : numbers) number = number * source.info().z_scale + source.info().z_offset;
  return numbers;
}

/// The same ground with samples `times` as far apart.
RasterSpec coarser(const RasterSpec& fine, std::int64_t times) {
  RasterSpec spec = fine;
  Georeference& place = *spec.georeference;
  const bool area = place.registration == Registration::kArea;
  const double half = area ? 0.5 * (static_cast<double>(times) - 1.0) : 0.0;
  place.origin_x += half * place.spacing_x;
  place.origin_y -= half * place.spacing_y;
  place.spacing_x *= static_cast<double>(times);
  place.spacing_y *= static_cast<double>(times);
  spec.width = area ? fine.width / times : (fine.width - 1) / times + 1;
  spec.height = area ? fine.height / times : (fine.height - 1) / times + 1;
  return spec;
}

/// A plane over coordinates, so that rasters of any resolution sample the same one.
CutRaster plane(const RasterSpec& spec) {
  const Georeference place = *spec.georeference;
  return raster_of<float>(spec, [place](std::int64_t c, std::int64_t r) {
    const double x = place.origin_x + static_cast<double>(c) * place.spacing_x - 500000.0;
    const double y = place.origin_y - static_cast<double>(r) * place.spacing_y - 5200000.0;
    return 0.125 * x - 0.25 * y;
  });
}

TEST(MosaicResolution, ACoarserFileContinuesThePlaneOfAFinerOne) {
  for (const Registration registration : {Registration::kArea, Registration::kPoint}) {
    SCOPED_TRACE(to_string(registration));
    const TemporaryFolder folder;
    const RasterSpec fine =
        placed_spec(registration == Registration::kArea ? 60 : 61, 31, SampleType::kFloat32, registration);
    const CutRaster whole_plane = plane(fine);
    whole_plane.cut(folder / "fine.tif", {0, 0, 31, 31});
    const RasterSpec half = coarser(fine, 3);
    plane(half).cut(folder / "coarse.tif", {0, 0, half.width, half.height});
    const auto mosaic = open_mosaic({folder / "fine.tif", folder / "coarse.tif"});
    ASSERT_EQ(mosaic->info().width, fine.width);
    EXPECT_EQ(mosaic->info().sample_type, SampleType::kFloat32);
    const std::vector<double> found = elevations(*mosaic);
    const bool area = registration == Registration::kArea;
    for (std::int64_t r = 0; r < mosaic->info().height; ++r) {
      for (std::int64_t c = 0; c < mosaic->info().width; ++c) {
        const double height = found[static_cast<std::size_t>(r * mosaic->info().width + c)];
        // Half a coarse pixel at the outer edge repeats the edge's elevation; area rows 30 and on are in fine alone.
        if (area && (c > 57 || r < 2 || r > 27) && c > 30) continue;
        if (std::isnan(height)) {
          EXPECT_TRUE(area && r == 30 && c > 30) << c << " " << r;
          continue;
        }
        float expected = 0.0F;
        std::memcpy(&expected, whole_plane.part({c, r, 1, 1}).data(), sizeof(expected));
        // Sums of products of numbers with few binary digits, rounded to float once.
        EXPECT_NEAR(height, static_cast<double>(expected), 1e-4) << c << " " << r;
      }
    }
  }
}

TEST(MosaicResolution, CoarserFilesHaveNoSeamBetweenThem) {
  for (const Registration registration : {Registration::kArea, Registration::kPoint}) {
    SCOPED_TRACE(to_string(registration));
    const TemporaryFolder folder;
    const RasterSpec fine = placed_spec(121, 81, SampleType::kInt16, registration);
    raster_of<std::int16_t>(fine, [](auto, auto) { return 7; }).cut(folder / "fine.tif", {0, 0, 5, 5});
    RasterSpec rough = coarser(fine, 2);
    rough.georeference->origin_x += 11.0;  // off the fine grid: interpolated wherever it lies
    const CutRaster coarse =
        raster_of<std::int16_t>(rough, [](auto c, auto r) { return (c * c * 31 + r * 17 * c) % 977; });
    coarse.cut(folder / "whole.tif", {0, 0, rough.width, rough.height});
    const auto of_whole = open_mosaic({folder / "fine.tif", folder / "whole.tif"});
    std::vector<std::string> paths = write_pieces(coarse, folder / "", ragged_cut(rough.width, rough.height, 2, 12));
    paths.push_back(folder / "fine.tif");
    const auto of_pieces = open_mosaic(paths);
    ASSERT_EQ(of_pieces->info().width, of_whole->info().width);
    ASSERT_EQ(of_pieces->info().height, of_whole->info().height);
    EXPECT_TRUE(read_whole(*of_pieces) == read_whole(*of_whole));
    // The bytes do not depend on how they are read either.
    const SourceInfo& info = of_pieces->info();
    const std::vector<std::byte> all = read_whole(*of_whole);
    for (std::int64_t row = 0; row < info.height; row += 9) {
      const Window window{3, row, info.width - 5, std::min<std::int64_t>(9, info.height - row)};
      const std::vector<std::byte> part = read_window(*of_pieces, window);
      const std::size_t bytes = size_bytes(info.sample_type);
      for (std::int64_t r = 0; r < window.rows; ++r) {
        const auto from = part.begin() + r * window.columns * static_cast<std::ptrdiff_t>(bytes);
        ASSERT_TRUE(std::equal(from, from + window.columns * static_cast<std::ptrdiff_t>(bytes),
                               all.begin() + ((row + r) * info.width + 3) * static_cast<std::ptrdiff_t>(bytes)));
      }
    }
  }
}

TEST(MosaicResolution, FinerFilesLieOverCoarserOnesWhateverTheOrder) {
  const TemporaryFolder folder;
  const RasterSpec fine = placed_spec(20, 20, SampleType::kInt16, Registration::kPoint);
  raster_of<std::int16_t>(fine, [](auto, auto) { return 7; }).cut(folder / "fine.tif", {0, 0, 10, 10});
  const RasterSpec rough = coarser(placed_spec(21, 21, SampleType::kInt16, Registration::kPoint), 2);
  raster_of<std::int16_t>(rough, [](auto, auto) { return 3; }).cut(folder / "coarse.tif", {0, 0, 11, 11});
  for (const OverlapRule rule : {OverlapRule::kLast, OverlapRule::kFirst}) {
    const auto mosaic = open_mosaic({folder / "fine.tif", folder / "coarse.tif"}, rule);
    const std::vector<double> found = elevations(*mosaic);
    EXPECT_EQ(found.front(), 7.0);
    EXPECT_EQ(found.back(), 3.0);
    EXPECT_EQ(mosaic->plan().samples_missing, 0);
  }
}

TEST(MosaicResolution, FilesOfSeveralTypesScalesAndVoidsKeepTheirElevations) {
  const TemporaryFolder folder;
  RasterSpec spec = placed_spec(30, 5, SampleType::kUint8, Registration::kArea);
  spec.void_value = 255.0;
  raster_of<std::uint8_t>(spec, [](auto c, auto) { return c == 3 ? 255 : c; }).cut(folder / "a.tif", {0, 0, 10, 5});
  spec.sample_type = SampleType::kInt16;
  spec.void_value = -9999.0;
  raster_of<std::int16_t>(spec, [](auto c, auto) {
    return c == 13 ? -9999 : c == 14 ? 255 : -c;
  }).cut(folder / "b.tif", {10, 0, 10, 5});
  {
    const auto mosaic = open_mosaic({folder / "a.tif", folder / "b.tif"});
    EXPECT_EQ(mosaic->info().sample_type, SampleType::kInt32);
    EXPECT_EQ(mosaic->info().void_values, std::vector<double>{-2147483648.0});
    EXPECT_THAT(mosaic->info().warnings,
                ::testing::ElementsAre(HasSubstr("differ in sample type; samples become int32")));
    const std::vector<double> found = elevations(*mosaic);
    for (int c = 0; c < 20; ++c) {
      if (c == 3 || c == 13) {
        EXPECT_TRUE(std::isnan(found[static_cast<std::size_t>(c)]));
      } else {
        EXPECT_EQ(found[static_cast<std::size_t>(c)], c < 10 ? c : c == 14 ? 255 : -c);
      }
    }
  }
  spec.z_scale = 0.1;
  spec.z_offset = 50.0;
  raster_of<std::int16_t>(spec, [](auto c, auto) { return c == 23 ? -9999 : c; }).cut(folder / "c.tif", {20, 0, 10, 5});
  const auto mosaic = open_mosaic({folder / "a.tif", folder / "b.tif", folder / "c.tif"});
  EXPECT_EQ(mosaic->info().sample_type, SampleType::kFloat64);
  EXPECT_EQ(mosaic->info().z_scale, 1.0);
  const std::vector<double> found = elevations(*mosaic);
  EXPECT_EQ(found[5], 5.0);
  EXPECT_TRUE(std::isnan(found[13]));
  EXPECT_TRUE(std::isnan(found[23]));
  EXPECT_EQ(found[24], 24.0 * 0.1 + 50.0);
}

SampleKind kind_of(SampleType type, std::vector<double> voids = {}) {
  return {type, std::move(voids), -kInfinity, kInfinity, 1.0, 0.0};
}

TEST(MosaicSamples, HoldEveryNumberOfAllFilesAndAVoidOfTheirOwn) {
  using enum SampleType;
  struct Case {
    std::vector<SampleKind> kinds;
    bool gaps;
    SampleType type;
    std::vector<double> voids;
  };
  const std::vector<double> lowest = {-2147483648.0};
  for (const Case& one : {
           Case{{kind_of(kUint8)}, false, kUint8, {}},
           Case{{kind_of(kUint8)}, true, kInt32, lowest},
           Case{{kind_of(kInt32)}, true, kFloat64, {}},
           Case{{kind_of(kInt16, {-32768.0}), kind_of(kInt16, {-32768.0})}, true, kInt16, {-32768.0}},
           Case{{kind_of(kInt16, {-32768.0}), kind_of(kInt16, {-9999.0})}, false, kInt32, lowest},
           Case{{kind_of(kInt16, {-9999.0, -32768.0}), kind_of(kInt16, {-32768.0})}, true, kInt16, {-32768.0}},
           Case{{kind_of(kUint8), kind_of(kInt8)}, false, kInt32, lowest},
           Case{{kind_of(kInt8), kind_of(kInt32, lowest)}, false, kInt32, lowest},
           Case{{kind_of(kInt8), kind_of(kInt32)}, false, kFloat64, {}},
           Case{{kind_of(kUint32), kind_of(kInt8)}, false, kFloat64, {}},
           Case{{kind_of(kFloat16), kind_of(kInt8)}, false, kFloat32, {}},
           Case{{kind_of(kInt16), kind_of(kFloat32)}, false, kFloat32, {}},
           Case{{kind_of(kInt32), kind_of(kFloat32)}, false, kFloat64, {}},
           Case{{kind_of(kFloat32, {-9999.0}), kind_of(kFloat32, {0.0})}, true, kFloat32, {}},
       }) {
    for (const bool reversed : {false, true}) {
      std::vector<SampleKind> kinds = one.kinds;
      if (reversed) std::ranges::reverse(kinds);
      const MosaicSamples samples = choose_mosaic_samples(kinds, one.gaps, nullptr);
      EXPECT_EQ(samples.kind.type, one.type) << to_string(kinds[0].type);
      EXPECT_EQ(samples.kind.void_values, one.voids) << to_string(kinds[0].type);
    }
  }
}

}  // namespace
}  // namespace isohf::test
