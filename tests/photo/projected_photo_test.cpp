#include "isohf/photo/projected_photo.h"

#include <gtest/gtest.h>

#include <cmath>

#include "isohf/photo/srgb.h"
#include "support/rasters/memory_photo.h"

namespace isohf {
namespace {

using test::MemoryPhoto;

/// A map around a place far North, where meridians meet at an angle, and a photo of 4 degrees by 2 on it.
WarpPlace place_for(const MemoryPhoto& photo, double west, double north, double degrees) {
  WarpPlace place;
  place.projection.kind = ProjectionKind::kLocal;
  place.projection.longitude_0 = 20.0;
  place.projection.latitude_0 = 70.0;
  place.first_sample = {west, north};
  place.step_x = degrees;
  place.step_z = degrees;
  place.width = photo.info().width;
  place.height = photo.info().height;
  return place;
}

constexpr PhotoFrame kFrame{-70000.0, -100000.0, 500.0, 500.0};
constexpr std::int64_t kWidth = 300;
constexpr std::int64_t kHeight = 400;

TEST(ProjectedPhoto, PixelsDoNotDependOnTheirWindow) {
  for (const int channels : {1, 3, 4}) {
    MemoryPhoto photo(400, 200, channels, test::noise);
    ProjectedPhoto projected(photo, place_for(photo, 18.0, 71.0, 0.01), kFrame, kWidth, kHeight);
    EXPECT_EQ(projected.info().width, kWidth);
    const auto k = static_cast<std::size_t>(channels);
    std::vector<std::uint8_t> whole(kWidth * kHeight * k);
    projected.read_window({0, 0, kWidth, kHeight}, whole);
    for (const Window& window : {Window{0, 0, 1, 1}, Window{63, 64, 2, 3}, Window{17, 100, 283, 32},
                                 Window{299, 399, 1, 1}, Window{130, 5, 61, 300}}) {
      std::vector<std::uint8_t> part(static_cast<std::size_t>(window.columns * window.rows) * k);
      projected.read_window(window, part);
      for (std::int64_t r = 0; r < window.rows; ++r) {
        const auto from = whole.begin() + ((window.row + r) * kWidth + window.column) * channels;
        ASSERT_TRUE(std::equal(from, from + window.columns * channels, part.begin() + r * window.columns * channels));
      }
    }
  }
}

TEST(ProjectedPhoto, PlacesAreWithinTheirTolerance) {
  // Light rises by a whole step over each pixel: a place's error is one of light.
  constexpr std::int64_t kPixels = 200;
  for (const bool along_x : {true, false}) {
    MemoryPhoto photo(kPixels, kPixels, 1, [&](std::int64_t c, std::int64_t r, int) {
      return srgb_from_linear(static_cast<float>(along_x ? c : r) / static_cast<float>(kPixels));
    });
    const WarpPlace place = place_for(photo, 18.0, 71.0, 0.02);
    ProjectedPhoto projected(photo, place, kFrame, kWidth, kHeight);
    std::vector<std::uint8_t> found(kWidth * kHeight);
    projected.read_window({0, 0, kWidth, kHeight}, found);
    const ExactWarp exact(place);
    std::int64_t compared = 0;
    for (std::int64_t r = 0; r < kHeight; ++r) {
      for (std::int64_t c = 0; c < kWidth; ++c) {
        const SourcePosition at = exact.source_from_world({kFrame.first_pixel_x + static_cast<double>(c) * 500.0,
                                                           kFrame.first_pixel_z + static_cast<double>(r) * 500.0});
        if (std::min(at.u, at.v) < 0.0 || std::max(at.u, at.v) > kPixels - 1) continue;
        ++compared;
        const double light = (along_x ? at.u : at.v) / kPixels;
        const double encoded = light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1.0 / 2.4) - 0.055;
        // 8 bits in the photo and again in the result; a thirtieth of a pixel is less than a tenth of a step here.
        ASSERT_NEAR(found[static_cast<std::size_t>(r * kWidth + c)], 255.0 * encoded, 1.2);
      }
    }
    EXPECT_GT(compared, 50000);
  }
}

TEST(ProjectedPhoto, ShowsWhatItsMiddlesLieOn) {
  MemoryPhoto photo(100, 100, 1, test::noise);
  ProjectedPhoto projected(photo, place_for(photo, 19.5, 70.5, 0.01), kFrame, kWidth, kHeight);
  EXPECT_TRUE(projected.shows({0, 0, kWidth, kHeight}));
  EXPECT_TRUE(projected.shows({140, 200, 1, 1}));
  EXPECT_FALSE(projected.shows({0, 0, kWidth, 60}));
  EXPECT_FALSE(projected.shows({0, 0, 60, kHeight}));
}

}  // namespace
}  // namespace isohf
