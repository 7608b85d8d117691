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

using testing::ElementsAre;
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

TEST(MaskedSource, IntegersWithoutAVoidWidenAndSaySo) {
  const auto source = mask_transparent(ramp<std::int16_t>(SampleType::kInt16, 4, 3), diagonal(4, 3));
  EXPECT_EQ(source->info().sample_type, SampleType::kInt32);
  ASSERT_EQ(source->info().warnings.size(), 1U);
  EXPECT_THAT(source->info().warnings[0], HasSubstr("int16 has no number to spare for transparent samples"));
  const std::vector<float> found = heights(*source, {1, 0, 2, 3});
  EXPECT_THAT(std::vector(found.begin(), found.begin() + 2), ElementsAre(1.0F, 2.0F));
  EXPECT_TRUE(std::isnan(found[2]));
  EXPECT_EQ(found[3], 12.0F);
  EXPECT_EQ(found[4], 21.0F);
  EXPECT_TRUE(std::isnan(found[5]));
}

TEST(MaskedSource, TypesWithAVoidStay) {
  auto declared = ramp<std::int16_t>(SampleType::kInt16, 4, 3);
  declared->mutable_info().void_values = {-5.0};
  const auto integers = mask_transparent(std::move(declared), diagonal(4, 3));
  EXPECT_EQ(integers->info().sample_type, SampleType::kInt16);
  const auto floats = mask_transparent(ramp<float>(SampleType::kFloat32, 4, 3), diagonal(4, 3));
  EXPECT_EQ(floats->info().sample_type, SampleType::kFloat32);
  for (HeightSource* source : {integers.get(), floats.get()}) {
    EXPECT_TRUE(source->info().warnings.empty());
    const std::vector<float> found = heights(*source, {0, 0, 4, 3});
    for (std::size_t i = 0; i < found.size(); ++i) {
      const auto height = static_cast<float>(10 * (i / 4) + i % 4);
      EXPECT_TRUE(i % 4 == i / 4 ? std::isnan(found[i]) : found[i] == height) << i;
    }
  }
}

TEST(MaskedSource, LargeWindowsAreReadInParts) {
  constexpr std::int64_t kSide = 700;  // more samples than are read at once
  const auto source = mask_transparent(ramp<std::uint16_t>(SampleType::kUint16, kSide, kSide), diagonal(kSide, kSide));
  const std::vector<float> found = heights(*source, {0, 0, kSide, kSide});
  for (std::int64_t r = 0; r < kSide; ++r) {
    for (std::int64_t c = 0; c < kSide; ++c) {
      const float height = found[static_cast<std::size_t>(r * kSide + c)];
      ASSERT_TRUE(c == r ? std::isnan(height) : height == static_cast<float>(10 * r + c)) << c << " " << r;
    }
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
      const auto source = open_tiff(tiff.write(folder / "a.tif"), {});
      EXPECT_EQ(source->info().sample_type, SampleType::kInt16);
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
  const auto source = open_tiff(folder / "a.tif", {});
  ASSERT_EQ(source->info().warnings.size(), 1U);
  EXPECT_THAT(source->info().warnings[0], HasSubstr("a directory behind the image is damaged"));
}

}  // namespace
}  // namespace isohf::test
