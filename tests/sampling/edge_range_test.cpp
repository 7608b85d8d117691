#include "isohf/sampling/source/edge_range.h"

#include <gtest/gtest.h>

#include <random>

#include "isohf/sampling/source/read_step.h"
#include "support/rasters/memory_source.h"

namespace isohf {
namespace {

test::MemorySource<float> noise(std::int64_t width, std::int64_t height) {
  std::mt19937_64 random(23);
  return {SampleType::kFloat32, width, height,
          [&](auto, auto) { return 100.0 * (static_cast<double>(random() >> 11U) * 0x1p-53); }};
}

ElevationRange widened_by(HeightSource& source, const ReadStep& step, std::int64_t depth_columns) {
  EdgeRange edge(source.info(), depth_columns, 2);
  std::vector<std::byte> raw;
  for (std::int64_t row = 0; row < source.info().height; row += step.rows) {
    for (const Window& window : step.windows(source.info(), row)) {
      raw.resize(static_cast<std::size_t>(window.columns * window.rows) * sizeof(float));
      source.read_window(window, raw);
      edge.add_window(window, raw);
    }
  }
  // So wide that neither end is cut off at an eighth of it.
  const ElevationRange bound = edge.bound();
  return {EdgeRange::widen({0.0, 10000.0}, bound).min, EdgeRange::widen({-10000.0, 100.0}, bound).max};
}

TEST(EdgeRange, DoesNotDependOnHowTheSourceIsCutIntoWindows) {
  auto source = noise(400, 60);
  for (const std::int64_t depth : {3, 62, 258, 1000}) {
    const ElevationRange whole = widened_by(source, {60, 400}, depth);
    // From 0 to 100, corners reach 5 a - 4 b.
    EXPECT_LT(whole.min, -100.0);
    EXPECT_GE(whole.min, -401.0);
    EXPECT_GT(whole.max, 200.0);
    EXPECT_LE(whole.max, 501.0);
    for (const ReadStep& step : {ReadStep{1, 400}, ReadStep{7, 400}, ReadStep{60, 64}, ReadStep{16, 80},
                                 ReadStep{3, 199}, ReadStep{60, 1}, ReadStep{11, 16}}) {
      const ElevationRange found = widened_by(source, step, depth);
      EXPECT_EQ(found.min, whole.min) << depth << ": " << step.rows << " " << step.columns;
      EXPECT_EQ(found.max, whole.max) << depth << ": " << step.rows << " " << step.columns;
    }
  }
}

}  // namespace
}  // namespace isohf
