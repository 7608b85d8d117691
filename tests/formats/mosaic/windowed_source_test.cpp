#include "formats/adapters/windowed_source.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "isohf/fill/filled_source.h"
#include "isohf/fill/geoid_source.h"
#include "support/rasters/memory_source.h"
#include "support/rasters/place_at.h"
#include "support/rasters/small_geoid.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

/// A globe of int16 samples, 5 degrees apart, the first column once more behind the last, with a hole. Remembers what
/// it was asked to keep.
class GlobeSource final : public MemorySource<std::int16_t> {
 public:
  GlobeSource()
      : MemorySource(SampleType::kInt16, 73, 37,
                     [](std::int64_t c, std::int64_t r) { return static_cast<double>(100 + 3 * (c % 72) + 5 * r); }) {
    for (std::int64_t r = 10; r < 13; ++r) {
      for (std::int64_t c = 20; c < 24; ++c) at(c, r) = -32768;
    }
    SourceInfo& info = mutable_info();
    info.void_values = {-32768.0};
    info.block_width = 8;
    info.block_height = 4;
    info.georeference = place_at(Registration::kPoint, HorizontalUnit::kDegree, -180.0, 90.0, 5.0);
  }
  [[nodiscard]] std::uint64_t buffer_bytes() const override { return kKept; }

  static constexpr std::uint64_t kKept = 4096;
};

std::vector<std::int16_t> read(HeightSource& source, const Window& window) {
  std::vector<std::int16_t> samples(static_cast<std::size_t>(window.columns * window.rows));
  source.read_window(window, std::as_writable_bytes(std::span(samples)));
  return samples;
}

std::unique_ptr<HeightSource> filled(std::unique_ptr<HeightSource> source) {
  VoidTreatment treatment;
  treatment.fill_distance = 10;
  return std::make_unique<FilledSource>(std::move(source), treatment);
}

TEST(WindowedSource, HasTheSamplesAndThePlaceOfItsWindow) {
  GlobeSource whole;
  WindowedSource part(std::make_unique<GlobeSource>(), {16, 8, 20, 10});
  EXPECT_EQ(part.info().width, 20);
  EXPECT_EQ(part.info().height, 10);
  EXPECT_EQ(part.info().georeference.origin_x, -180.0 + 16 * 5.0);
  EXPECT_EQ(part.info().georeference.origin_y, 90.0 - 8 * 5.0);
  EXPECT_EQ(read(part, {0, 0, 20, 10}), read(whole, {16, 8, 20, 10}));
  EXPECT_EQ(read(part, {3, 4, 17, 2}), read(whole, {19, 12, 17, 2}));
  EXPECT_EQ(&part.as_stored(), &part);
}

TEST(ClosedSource, LeavesOutTheLastColumn) {
  GlobeSource whole;
  ClosedSource source(std::make_unique<GlobeSource>());
  EXPECT_EQ(source.info().width, 72);
  EXPECT_TRUE(source.info().warnings.empty()) << "nothing is lost";
  EXPECT_EQ(read(source, {0, 0, 72, 37}), read(whole, {0, 0, 72, 37}));
}

TEST(ClosedSource, SaysWhereTheLastColumnIsAnother) {
  auto globe = std::make_unique<GlobeSource>();
  globe->at(72, 36) = 7;
  const ClosedSource source(std::move(globe));
  ASSERT_EQ(source.info().warnings.size(), 1U);
  EXPECT_EQ(
      source.info().warnings[0],
      "memory: column 72 is the first one again, 360 degrees on, and is left out, although its samples are others: "
      "in row 36, for one");
  EXPECT_EQ(source.info().warnings[0].kind, Warning::Kind::kLoss);
}

TEST(Decorators, HaveTheSamplesAsStoredBehindEveryWindow) {
  GlobeSource whole;
  const Window part{16, 8, 57, 20};
  ClosedSource source(std::make_unique<WindowedSource>(filled(std::make_unique<GlobeSource>()), part));
  HeightSource& stored = source.as_stored();
  ASSERT_NE(&stored, &source);
  EXPECT_EQ(stored.info().width, 56);
  EXPECT_EQ(stored.info().height, 20);
  EXPECT_EQ(grid_of(stored.info().georeference), grid_of(source.info().georeference));
  const std::vector<std::int16_t> as_stored = read(stored, {0, 0, 56, 20});
  EXPECT_EQ(as_stored, read(whole, {16, 8, 56, 20}));
  const std::vector<std::int16_t> as_filled = read(source, {0, 0, 56, 20});
  int voids = 0;
  for (std::size_t i = 0; i < as_stored.size(); ++i) {
    const bool is_void = as_stored[i] == -32768;
    voids += is_void ? 1 : 0;
    EXPECT_EQ(is_void, as_stored[i] != as_filled[i]);
  }
  EXPECT_EQ(voids, 12);
}

TEST(Decorators, CountWhatIsKeptBeneathAndTheirOwn) {
  const TemporaryFolder folder;
  write_geoid(folder / "a.pgm", 720, 361, [](double, double) { return 20.0; });
  std::unique_ptr<HeightSource> source = filled(std::make_unique<GlobeSource>());
  const std::uint64_t beneath = GlobeSource::kKept + fill_memory_bytes(source->info(), false);
  EXPECT_EQ(source->buffer_bytes(), beneath);
  source = std::make_unique<ClosedSource>(std::move(source));
  EXPECT_EQ(source->buffer_bytes(), beneath);
  const GeoidSource moved(std::move(source), {folder / "a.pgm", GeoidShift::kToEllipsoidal});
  // The strip of the geoid: two degrees of two posts a degree, all the way round, of two bytes; int16 samples of the
  // largest window (all 37 rows of 72), a row of heights and one of shifts.
  EXPECT_GT(moved.buffer_bytes(), beneath + 720U * 5U * 2U + 37U * 72U * 2U + 72U * 16U);
  EXPECT_LT(moved.buffer_bytes(), beneath + 4U * (720U * 5U * 2U + 37U * 72U * 2U + 72U * 16U));
}

}  // namespace
}  // namespace isohf::test
