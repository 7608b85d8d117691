#include "isohf/fill/filled_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <random>

#include "isohf/error.h"
#include "support/error_of.h"
#include "support/rasters/memory_source.h"

namespace isohf::test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// A FilledSource over samples in memory.
template <typename T>
struct Filled {
  Filled(SampleType type, std::int64_t width, std::int64_t height, const VoidTreatment& treatment,
         const std::function<double(std::int64_t, std::int64_t)>& sample,
         const std::function<void(SourceInfo&)>& adapt = {}, const ScratchFolder& scratch = std::nullopt) {
    auto memory = std::make_unique<MemorySource<T>>(type, width, height, sample);
    if (adapt) adapt(memory->mutable_info());
    below = memory.get();
    source = std::make_unique<FilledSource>(std::move(memory), treatment, scratch);
  }

  std::vector<T> read(const Window& window) {
    std::vector<T> samples(static_cast<std::size_t>(window.columns * window.rows));
    source->read_window(window, std::as_writable_bytes(std::span(samples)));
    return samples;
  }
  std::vector<T> read_all() { return read({0, 0, source->info().width, source->info().height}); }

  MemorySource<T>* below = nullptr;
  std::unique_ptr<FilledSource> source;
};

VoidTreatment fill(std::int64_t distance) {
  VoidTreatment treatment;
  treatment.fill_distance = distance;
  return treatment;
}

/// Hills with holes of all sizes, some on the edge.
double hills(std::int64_t c, std::int64_t r) {
  const auto in_circle = [&](double x, double y, double radius) {
    return std::hypot(static_cast<double>(c) - x, static_cast<double>(r) - y) < radius;
  };
  const bool is_void = in_circle(40, 40, 12) || in_circle(0, 90, 9) || in_circle(100, 60, 30) || (c + r * 7) % 97 == 0;
  if (is_void) return std::numeric_limits<double>::quiet_NaN();
  return 500.0 + 80.0 * std::sin(static_cast<double>(c) / 9.0) * std::cos(static_cast<double>(r) / 13.0);
}

TEST(FilledSource, KeepsSamplesAndFillsWithinTheRangeOfWhatLiesAround) {
  Filled<float> filled(SampleType::kFloat32, 140, 120, fill(40), hills);
  const std::vector<float> samples = filled.read_all();
  for (std::int64_t r = 0; r < 120; ++r) {
    for (std::int64_t c = 0; c < 140; ++c) {
      const float height = samples[static_cast<std::size_t>(r * 140 + c)];
      const auto before = static_cast<float>(hills(c, r));
      ASSERT_TRUE(std::isnan(before) || height == before) << c << " " << r;
      ASSERT_TRUE(height >= 420.0F && height <= 580.0F) << height;
    }
  }
  const VoidCounts& counts = filled.source->counts();
  EXPECT_EQ(counts.rows, 120);
  EXPECT_GT(counts.found, 3000);
  EXPECT_EQ(counts.filled, counts.found);
  EXPECT_EQ(counts.left, 0);
}

TEST(FilledSource, FillsNoFurtherThanTheDistance) {
  // A hole of radius 30: what lies further than 10 from every sample stays void; what lies within 10 of one along a
  // row or a column, where rays run, is filled.
  const auto hole = [](std::int64_t c, std::int64_t r) {
    return std::hypot(static_cast<double>(c) - 50, static_cast<double>(r) - 50) < 30 ? double{kNan} : 7.0;
  };
  Filled<float> filled(SampleType::kFloat32, 101, 101, fill(10), hole);
  const std::vector<float> samples = filled.read_all();
  std::int64_t left = 0;
  for (std::int64_t r = 0; r < 101; ++r) {
    for (std::int64_t c = 0; c < 101; ++c) {
      const double from_middle = std::hypot(static_cast<double>(c) - 50, static_cast<double>(r) - 50);
      const bool is_void = std::isnan(samples[static_cast<std::size_t>(r * 101 + c)]);
      left += is_void ? 1 : 0;
      if (from_middle < 19) {
        EXPECT_TRUE(is_void) << c << " " << r;
      }
      if ((c == 50 || r == 50) && from_middle >= 20.5) {
        EXPECT_FALSE(is_void) << c << " " << r;
      }
      if (!is_void) {
        EXPECT_EQ(samples[static_cast<std::size_t>(r * 101 + c)], 7.0F);
      }
    }
  }
  EXPECT_EQ(filled.source->counts().left, left);
}

TEST(FilledSource, DoesNotDependOnWindows) {
  const std::int64_t width = 140;
  const std::int64_t height = 120;
  Filled<float> whole(SampleType::kFloat32, width, height, fill(15), hills);
  const std::vector<float> expected = whole.read_all();
  const auto expect_window = [&](Filled<float>& filled, const Window& window) {
    const std::vector<float> got = filled.read(window);
    for (std::int64_t r = 0; r < window.rows; ++r) {
      EXPECT_EQ(std::memcmp(got.data() + r * window.columns, expected.data() + (window.row + r) * width + window.column,
                            static_cast<std::size_t>(window.columns) * sizeof(float)),
                0)
          << "row " << window.row + r << " of a window of " << window.columns << "x" << window.rows;
    }
  };
  for (const std::int64_t rows : {1, 7, 64, 100}) {
    // Blocks of few rows make the chunks small: 8 MiB of them would hold everything at once.
    Filled<float> parts(SampleType::kFloat32, width, height, fill(15), hills);
    for (std::int64_t row = 0; row < height; row += rows) {
      expect_window(parts, {0, row, width, std::min(rows, height - row)});
    }
    EXPECT_EQ(parts.source->counts().found, whole.source->counts().found);
    EXPECT_EQ(parts.source->counts().filled, whole.source->counts().filled);
  }
  std::mt19937 random(5);
  Filled<float> anywhere(SampleType::kFloat32, width, height, fill(15), hills);
  for (int i = 0; i < 30; ++i) {
    const auto column = static_cast<std::int64_t>(random() % 140U);
    const auto row = static_cast<std::int64_t>(random() % 120U);
    expect_window(anywhere, {column, row, 1 + static_cast<std::int64_t>(random()) % (width - column),
                             1 + static_cast<std::int64_t>(random()) % (height - row)});
  }
}

TEST(FilledSource, DoesNotDependOnHowMuchIsReadAtOnce) {
  // Rows of 4 MiB: a chunk holds two, and a window needs many of them.
  const std::int64_t width = 1 << 20;
  const auto sample = [](std::int64_t c, std::int64_t r) {
    const bool is_void = c > 1000 && c < 1040 && r > 3 && r < 20;
    return is_void ? double{kNan} : static_cast<double>(c % 512 + 3 * r);
  };
  Filled<float> wide(SampleType::kFloat32, width, 24, fill(8), sample);
  Filled<float> narrow(SampleType::kFloat32, 1200, 24, fill(8), sample);
  const std::vector<float> expected = narrow.read_all();
  for (const std::int64_t row : {4, 5, 12, 19, 6, 0}) {  // backwards as well
    const std::vector<float> got = wide.read({900, row, 200, 3});
    for (std::int64_t r = 0; r < 3; ++r) {
      EXPECT_EQ(std::memcmp(got.data() + r * 200, expected.data() + (row + r) * 1200 + 900, 200 * sizeof(float)), 0)
          << row + r;
    }
  }
}

TEST(FilledSource, DependsOnNothingBeyondItsReach) {
  const std::int64_t distance = 12;
  const std::int64_t reach = distance + VoidFiller::smoothing_reach();
  Filled<float> before(SampleType::kFloat32, 140, 120, fill(distance), hills);
  // Another world beyond the reach of column 60.
  Filled<float> after(SampleType::kFloat32, 140, 120, fill(distance), [&](std::int64_t c, std::int64_t r) {
    return c > 60 + reach ? 12345.0 + static_cast<double>(c * r % 7) : hills(c, r);
  });
  const Window window{0, 0, 61, 120};
  EXPECT_EQ(std::memcmp(before.read(window).data(), after.read(window).data(), 61 * 120 * sizeof(float)), 0);
}

TEST(FilledSource, WideVoidsAreTheSameWhereverTheyAreCutInMemoryAndInAScratchFile) {
  const auto field = [](std::int64_t c, std::int64_t r) {
    return r >= 20 && r < 90 && c % 1000 > 3
               ? std::nan("")
               : 300.0 + std::sin(static_cast<double>(c) / 31.0) * 50.0 + static_cast<double>(r);
  };
  constexpr std::int64_t kWidth = 9500;
  constexpr std::int64_t kMoved = 1500;
  Filled<float> all(SampleType::kFloat32, kWidth, 110, fill(60), field);
  Filled<float> kept(SampleType::kFloat32, kWidth, 110, fill(60), field, {}, ScratchFolder(testing::TempDir()));
  Filled<float> east(SampleType::kFloat32, kWidth - kMoved, 110, fill(60),
                     [&](std::int64_t c, std::int64_t r) { return field(c + kMoved, r); });
  const std::int64_t reach = VoidFiller(all.source->info(), 60).reach();
  const std::vector<float> whole = all.read_all();
  const auto bits = [](float value) { return std::isnan(value) ? 0U : std::bit_cast<std::uint32_t>(value); };
  const std::vector<float> in_scratch = kept.read_all();
  for (std::size_t i = 0; i < whole.size(); ++i) ASSERT_EQ(bits(in_scratch[i]), bits(whole[i])) << i;
  EXPECT_EQ(kept.source->counts().filled, all.source->counts().filled);
  const Window there{reach, 0, kWidth - kMoved - reach, 110};
  const std::vector<float> moved = east.read(there);
  for (std::int64_t r = 0; r < there.rows; ++r) {
    for (std::int64_t c = 0; c < there.columns; ++c) {
      ASSERT_EQ(bits(moved[static_cast<std::size_t>(r * there.columns + c)]),
                bits(whole[static_cast<std::size_t>(r * kWidth + kMoved + reach + c)]))
          << c << " " << r;
    }
  }
  // Read again from the North: what was dropped is there anew.
  const std::vector<float> again = kept.read({0, 0, kWidth, 30});
  for (std::size_t i = 0; i < again.size(); ++i) ASSERT_EQ(bits(again[i]), bits(whole[i])) << i;
}

TEST(FilledSource, GivesAPlaneBackNearly) {
  // Weights of distance^-1.5 are not exact on slopes; the passes on circles pull them there.
  const auto plane = [](std::int64_t c, std::int64_t r) {
    return 2.0 * static_cast<double>(c) + static_cast<double>(r);
  };
  Filled<float> filled(SampleType::kFloat32, 90, 90, fill(40), [&](std::int64_t c, std::int64_t r) {
    return std::hypot(static_cast<double>(c) - 40, static_cast<double>(r) - 45) < 15 ? double{kNan} : plane(c, r);
  });
  const std::vector<float> samples = filled.read_all();
  double worst = 0.0;
  for (std::int64_t r = 0; r < 90; ++r) {
    for (std::int64_t c = 0; c < 90; ++c) {
      worst = std::max(worst, std::abs(double{samples[static_cast<std::size_t>(r * 90 + c)]} - plane(c, r)));
    }
  }
  // The hole spans 67 elevations.
  EXPECT_LT(worst, 1.5);
}

/// What a hole of 5x5 becomes in samples of one type, as numbers.
template <typename T>
std::vector<T> fill_hole(SampleType type, double void_value,
                         const std::function<double(std::int64_t, std::int64_t)>& land) {
  Filled<T> filled(
      type, 21, 21, fill(9),
      [&](std::int64_t c, std::int64_t r) {
        return std::abs(c - 10) < 3 && std::abs(r - 10) < 3 ? void_value : land(c, r);
      },
      [&](SourceInfo& info) { info.void_values = {void_value}; });
  return filled.read_all();
}

TEST(FilledSource, FillsInTheSourcesOwnType) {
  const auto slope = [](std::int64_t c, std::int64_t r) { return static_cast<double>(100 + 3 * c + r); };
  const auto expect_slope = [&](const auto& samples) {
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const auto c = static_cast<std::int64_t>(i % 21);
      const auto r = static_cast<std::int64_t>(i / 21);
      EXPECT_NEAR(static_cast<double>(samples[i]), slope(c, r), 1.0);
    }
  };
  expect_slope(fill_hole<std::uint8_t>(SampleType::kUint8, 0, slope));
  expect_slope(fill_hole<std::int16_t>(SampleType::kInt16, -32768, slope));
  expect_slope(fill_hole<std::uint16_t>(SampleType::kUint16, 65535, slope));
  expect_slope(fill_hole<std::int32_t>(SampleType::kInt32, -9999, slope));
  expect_slope(fill_hole<std::uint32_t>(SampleType::kUint32, 4294967295.0, slope));
  expect_slope(fill_hole<float>(SampleType::kFloat32, -9999, slope));
  expect_slope(fill_hole<double>(SampleType::kFloat64, -9999, slope));
}

TEST(FilledSource, NeverFillsWithAVoidValue) {
  // Land on both sides of the void value 0: what should become 0 becomes its neighbour.
  const auto land = [](std::int64_t c, std::int64_t) { return c < 10 ? -1.0 : 1.0; };
  for (const std::int16_t sample : fill_hole<std::int16_t>(SampleType::kInt16, 0, land)) {
    EXPECT_TRUE(sample == 1 || sample == -1) << sample;
  }
  for (const float sample : fill_hole<float>(SampleType::kFloat32, 0, land)) EXPECT_NE(sample, 0.0F);
}

TEST(FilledSource, CountsWhatIsOutsideTheValidRange) {
  VoidTreatment treatment;
  treatment.valid_range = {0.0, 100.0};
  // raw * 0.5 - 10: raw 20 is 0, raw 220 is 100.
  Filled<std::int16_t> filled(
      SampleType::kInt16, 50, 10, treatment,
      [](std::int64_t c, std::int64_t r) {
        return r == 0 ? std::array{-32768, 19, 20, 220, 221}[static_cast<std::size_t>(c % 5)] : 60;
      },
      [](SourceInfo& info) {
        info.void_values = {-32768.0};
        info.z_scale = 0.5;
        info.z_offset = -10.0;
      });
  EXPECT_EQ(filled.source->info().valid_min, 20.0);
  EXPECT_EQ(filled.source->info().valid_max, 220.0);
  (void)filled.read_all();
  const VoidCounts& counts = filled.source->counts();
  EXPECT_EQ(counts.found, 30);
  EXPECT_EQ(counts.by_valid_range, 20);
  EXPECT_EQ(counts.filled, 0);
  EXPECT_EQ(counts.left, 30);
  // With a falling scale the ends change places.
  Filled<std::int16_t> falling(
      SampleType::kInt16, 5, 2, treatment, [](std::int64_t, std::int64_t) { return 0.0; },
      [](SourceInfo& info) { info.z_scale = -2.0; });
  EXPECT_EQ(falling.source->info().valid_min, -50.0);
  EXPECT_EQ(falling.source->info().valid_max, 0.0);
}

TEST(FilledSource, ReadsASourceWithoutVoidsOnce) {
  Filled<float> filled(SampleType::kFloat32, 64, 200, fill(100),
                       [](std::int64_t c, std::int64_t r) { return static_cast<double>(c * r); });
  for (std::int64_t row = 0; row < 200; row += 20) (void)filled.read({0, row, 64, 20});
  EXPECT_EQ(filled.below->rows_read, 200);
  EXPECT_EQ(filled.source->counts().found, 0);
}

TEST(FilledSource, GivesTheStoredSamplesWhenAsked) {
  Filled<float> filled(SampleType::kFloat32, 140, 120, fill(20), hills);
  EXPECT_EQ(&filled.source->as_stored(), filled.below);
  EXPECT_EQ(filled.source->as_stored().info().fill_distance, 0);
}

TEST(FilledSource, RefusesAnEmptyRange) {
  VoidTreatment empty;
  empty.valid_range = {5.0, 5.0};
  auto source = std::make_unique<MemorySource<float>>(SampleType::kFloat32, 4, 4, [](auto, auto) { return 0.0; });
  EXPECT_EQ(error_of([&] { (void)with_voids_treated(std::move(source), empty); }).code(), ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace isohf::test
