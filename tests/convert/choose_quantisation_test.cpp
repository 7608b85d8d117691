#include "isohf/convert/stages/choose_quantisation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "isohf/error.h"
#include "support/error_of.h"

namespace isohf {
namespace {

SourceInfo info_of(SampleType type, double z_scale = 1.0) {
  SourceInfo info;
  info.sample_type = type;
  info.z_scale = z_scale;
  return info;
}

TEST(Quantiser, IntegerSourcesGetHalfAStepAndKeepWholeElevationsWhole) {
  const Quantisation q = choose_quantisation({CodeType::kU16, {}}, {-16.0, 3742.0}, info_of(SampleType::kInt16));
  EXPECT_DOUBLE_EQ(q.scale, 0.5);
  EXPECT_DOUBLE_EQ(q.offset, -16.0);
  const Quantisation wide = choose_quantisation({CodeType::kU16, {}}, {-18068.0, 21134.0}, info_of(SampleType::kInt16));
  EXPECT_DOUBLE_EQ(wide.scale, 1.0) << "doubled until 39 km fit";
  EXPECT_LE(wide.offset, -18068.0);
  EXPECT_GE(elevation_from_code(wide, wide.max_code()), 21134.0);
}

TEST(Quantiser, WholeElevationsThatTakeMoreCodesThanThereAreGetTheFinestStep) {
  const ElevationRange all{0.0, 65535.0};
  const Quantisation q = choose_quantisation({CodeType::kU16, {}}, all, info_of(SampleType::kUint16));
  EXPECT_NEAR(q.scale, 65535.0 / 65534.0, 1e-8) << "2 would lose every second elevation";
  EXPECT_GE(elevation_from_code(q, q.max_code()), 65535.0);
  EXPECT_NEAR(quantisation_of_range({CodeType::kU16, {}}, all, info_of(SampleType::kUint16)).scale, 65535.0 / 65534.0,
              1e-8);
}

TEST(Quantiser, FloatSourcesGetTheFinestStepThatSpansTheRange) {
  const Quantisation q = choose_quantisation({CodeType::kU16, {}}, {-4472.67, -4437.88}, info_of(SampleType::kFloat32));
  EXPECT_NEAR(q.scale, 34.79 / 65534.0, 1e-9);
  EXPECT_GE(elevation_from_code(q, q.max_code()), -4437.88);
  TileCodes tile;
  const std::vector<float> ends = {-4472.67F, -4437.88F};
  const QuantiserCounts counts = quantise(q, 0.0, ends, tile);
  EXPECT_EQ(counts.below + counts.above, 0);
}

TEST(Quantiser, ConstantElevationsNeedNoRange) {
  const Quantisation q = choose_quantisation({CodeType::kU16, {}}, {5.5, 5.5}, info_of(SampleType::kFloat32));
  TileCodes tile;
  quantise(q, 0.0, std::vector<float>{5.5F}, tile);
  EXPECT_DOUBLE_EQ(elevation_from_code(q, tile.codes[0]), 5.5);
}

TEST(Quantiser, AStepTooFineForTheTypeIsRefusedWithOneThatFits) {
  const Error error = test::error_of([] {
    (void)choose_quantisation({CodeType::kU8, 0.5}, {0.0, 1000.0}, info_of(SampleType::kInt16));
  });
  EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
  EXPECT_NE(std::string(error.what()).find("3.93"), std::string::npos) << error.what();
  EXPECT_THROW((void)choose_quantisation({CodeType::kU16, -1.0}, {0.0, 1.0}, info_of(SampleType::kInt16)), Error);
}

TEST(Quantiser, RoundsToTheNearestCodeAndReportsTheWorst) {
  const Quantisation q{CodeType::kU16, -100.0, 0.25};
  std::mt19937 random(3);
  std::uniform_real_distribution<float> heights(-100.0F, 16000.0F);
  std::vector<float> in(5000);
  for (float& height : in) height = heights(random);
  TileCodes tile;
  const QuantiserCounts counts = quantise(q, 0.0, in, tile);
  double worst = 0.0;
  for (std::size_t i = 0; i < in.size(); ++i) {
    worst = std::max(worst, std::abs(elevation_from_code(q, tile.codes[i]) - double{in[i]}));
  }
  EXPECT_LE(worst, 0.125);
  EXPECT_NEAR(counts.worst_rounding, worst, 1e-9);
}

TEST(Quantiser, VoidsBecomeTheVoidCodeAndOverflowIsCountedNotWrapped) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const CodeType type : {CodeType::kU16, CodeType::kU8}) {
    const Quantisation q{type, 0.0, 1.0};
    TileCodes tile;
    const QuantiserCounts counts = quantise(q, 0.0, std::vector<float>{nan, -5.0F, 1e6F, 0.4F, 0.5F}, tile);
    EXPECT_EQ(tile.codes[0], q.void_code());
    EXPECT_EQ(tile.codes[1], 0);
    EXPECT_EQ(tile.codes[2], q.max_code());
    EXPECT_EQ(tile.codes[3], 0);
    EXPECT_EQ(tile.codes[4], 1);
    EXPECT_EQ(counts.below, 1);
    EXPECT_EQ(counts.above, 1);
  }
}

TEST(Quantiser, FloatsPassThroughUnchanged) {
  TileCodes tile;
  const std::vector<float> in = {1.1F, -0.0F, 3e-40F, 8848.86F};
  const QuantiserCounts counts = quantise({CodeType::kF32, 0.0, 1.0}, 0.0, in, tile);
  EXPECT_EQ(tile.heights, in);
  EXPECT_EQ(counts.worst_rounding, 0.0);
}

TEST(Quantiser, ADatumIsAddedBack) {
  TileCodes tile;
  quantise({CodeType::kU16, 1737000.0, 0.5}, 1737400.0, std::vector<float>{-100.25F}, tile);
  EXPECT_EQ(tile.codes[0], 600);  // (1737299.75 - 1737000) / 0.5 = 599.5, halves up
}

}  // namespace
}  // namespace isohf
