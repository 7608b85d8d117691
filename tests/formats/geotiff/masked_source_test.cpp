#include "formats/adapters/masked_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include "formats/geotiff/tiff_bytes.h"
#include "formats/readers.h"
#include "isohf/base/sample.h"
#include "isohf/error.h"
#include "support/rasters/memory_source.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using testing::HasSubstr;

template <typename T>
std::unique_ptr<MemorySource<T>> ramp(SampleType type, std::int64_t width, std::int64_t height) {
  return std::make_unique<MemorySource<T>>(
      type, width, height, [&](std::int64_t c, std::int64_t r) { return static_cast<double>(10 * r + c); });
}

/// Transparent where column and row are equal.
std::unique_ptr<HeightSource> diagonal(std::int64_t width, std::int64_t height) {
  return std::make_unique<MemorySource<std::uint8_t>>(
      SampleType::kUint8, width, height, [](std::int64_t c, std::int64_t r) { return c == r ? 0.0 : 255.0; });
}

std::vector<float> heights(HeightSource& source, const Window& window) {
  const auto count = static_cast<std::size_t>(window.columns * window.rows);
  std::vector<std::byte> raw(count * size_bytes(source.info().sample_type));
  source.read_window(window, raw);
  std::vector<float> out(count);
  heights_from_samples(source.info(), 0.0, raw, out);
  return out;
}

TEST(MaskedSource, TransparentSamplesAreVoidInATypeThatHasAVoid) {
  auto declared = ramp<std::int16_t>(SampleType::kInt16, 4, 3);
  declared->mutable_info().void_values = {-5.0};
  const auto integers = mask_transparent(std::move(declared), diagonal(4, 3));
  const auto floats = mask_transparent(ramp<float>(SampleType::kFloat32, 4, 3), diagonal(4, 3));
  const auto widened = mask_transparent(ramp<std::int16_t>(SampleType::kInt16, 4, 3), diagonal(4, 3));
  EXPECT_EQ(integers->info().sample_type, SampleType::kInt16);
  EXPECT_EQ(floats->info().sample_type, SampleType::kFloat32);
  EXPECT_EQ(widened->info().sample_type, SampleType::kInt32);
  ASSERT_EQ(widened->info().warnings.size(), 1U);
  EXPECT_THAT(widened->info().warnings[0], HasSubstr("int16 has no number to spare for transparent samples"));
  for (HeightSource* source : {integers.get(), floats.get(), widened.get()}) {
    EXPECT_TRUE(source == widened.get() || source->info().warnings.empty());
    for (const std::int64_t left : {0, 1}) {
      const std::int64_t columns = 3;
      const std::vector<float> found = heights(*source, {left, 0, columns, 3});
      for (std::int64_t i = 0; i < 3 * columns; ++i) {
        const std::int64_t row = i / columns;
        const std::int64_t column = left + i % columns;
        const float height = found[static_cast<std::size_t>(i)];
        EXPECT_TRUE(column == row ? std::isnan(height) : height == static_cast<float>(10 * row + column)) << i;
      }
    }
  }
}

TEST(MaskedSource, LargeWindowsAreReadInParts) {
  constexpr std::int64_t kSide = 700;  // more samples than are read at once
  const auto source = mask_transparent(ramp<std::uint16_t>(SampleType::kUint16, kSide, kSide), diagonal(kSide, kSide));
  const std::vector<float> found = heights(*source, {0, 0, kSide, kSide});
  for (std::int64_t i = 0; i < kSide * kSide; ++i) {
    const float height = found[static_cast<std::size_t>(i)];
    const bool is_void = i / kSide == i % kSide;
    ASSERT_TRUE(is_void ? std::isnan(height) : height == static_cast<float>(10 * (i / kSide) + i % kSide)) << i;
  }
}

TEST(MaskedSource, SizesMustBeEqual) {
  EXPECT_THROW((void)mask_transparent(ramp<float>(SampleType::kFloat32, 4, 3), diagonal(3, 4)), Error);
}

TEST(MaskedSource, TiffMasksOfBitsAndBytesAreTurnedWithTheirImage) {
  const TemporaryFolder folder;
  for (const bool from_south : {false, true}) {
    for (const int bits : {1, 8}) {
      // 11 x 3 bytes; void: (0, 0), (10, 0), (9, 1) as stored.
      std::string samples;
      for (int i = 0; i < 33; ++i) samples += static_cast<char>(i + 1);
      TiffBytes mask;
      mask.image(11, 3, bits, 1, 3).longs(254, {4}).shorts(262, {4});
      std::string opaque(33, '\x01');
      opaque[0] = opaque[10] = opaque[11 + 9] = '\0';
      mask.block(bits == 8 ? opaque : std::string("\x7f\xdf\xff\xbf\xff\xff"));
      TiffBytes tiff;
      tiff.image(11, 3, 8, 1, 3).block(samples).next(mask);
      if (from_south) tiff.shorts(274, {4});
      const auto source = kTiffFormat.open(tiff.write(folder / "a.tif"), {});
      EXPECT_EQ(source->info().sample_type, SampleType::kInt32);
      // From a column that is not the first of its byte.
      const std::vector<float> found = heights(*source, {3, 0, 8, 3});
      for (int r = 0; r < 3; ++r) {
        for (int c = 3; c < 11; ++c) {
          const int stored = from_south ? 2 - r : r;
          const bool is_void = (stored == 0 && c == 10) || (stored == 1 && c == 9);
          const float height = found[static_cast<std::size_t>(r * 8 + c - 3)];
          EXPECT_TRUE(is_void ? std::isnan(height) : height == static_cast<float>(11 * stored + c + 1))
              << bits << " bits, " << c << " " << r;
        }
      }
      EXPECT_TRUE(std::isnan(heights(*source, {0, from_south ? 2 : 0, 1, 1})[0]));
    }
  }
}

TEST(MaskedSource, ADirectoryThatIsDamagedIsWarnedOf) {
  const TemporaryFolder folder;
  TiffBytes mask;
  mask.image(4, 2, 8, 1, 2).longs(254, {4}).shorts(262, {4}).block(std::string(8, '\0'));
  TiffBytes tiff;
  tiff.image(4, 2, 8, 1, 2).block("abcdefgh");
  const std::size_t alone = tiff.build().size();
  write_file(folder / "a.tif", tiff.next(mask).build().substr(0, alone + 10));
  const auto source = kTiffFormat.open(folder / "a.tif", {});
  ASSERT_EQ(source->info().warnings.size(), 1U);
  EXPECT_THAT(source->info().warnings[0], HasSubstr("a directory behind the image is damaged"));
}

}  // namespace
}  // namespace isohf::test
