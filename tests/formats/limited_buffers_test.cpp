/// Readers that keep decoded rows keep as few as they are asked to, say how many bytes those are, and deliver the same.

#include <gtest/gtest.h>

#include "formats/registry.h"
#include "formats/write/raster_sink.h"
#include "isohf/raster.h"
#include "support/rasters/raster.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

constexpr std::int64_t kWidth = 700;
constexpr std::int64_t kHeight = 300;
constexpr std::size_t kRowBytes = kWidth * 2;

std::vector<std::byte> write_counting(const std::string& path, SampleType type) {
  std::vector<std::byte> samples(kRowBytes * kHeight);
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = static_cast<std::byte>(i * 37 % 61);
  write_raster(path, raster_spec(kWidth, kHeight, type), samples);
  return samples;
}

std::unique_ptr<HeightSource> open_within(const std::string& path, std::uint64_t bytes) {
  OpenOptions options;
  options.buffer_bytes = bytes;
  return open_raster(path, options);
}

TEST(LimitedBuffers, DeliverTheSameSamplesInAnyOrder) {
  const TemporaryFolder folder;
  for (const auto& [name, type] : {std::pair{"a.exr", SampleType::kFloat16}, {"a.png", SampleType::kUint16}}) {
    SCOPED_TRACE(name);
    const auto samples = write_counting(folder / name, type);
    for (const std::uint64_t limit : {std::uint64_t{1} << 30U, std::uint64_t{100000}, std::uint64_t{1}}) {
      SCOPED_TRACE(limit);
      const auto source = open_within(folder / name, limit);
      EXPECT_EQ(read_whole(*source), samples);
      for (const std::int64_t row : {290, 3, 150, 149, 0}) {
        const auto found = read_window(*source, {0, row, kWidth, 7});
        EXPECT_TRUE(std::equal(found.begin(), found.end(), samples.begin() + row * std::int64_t{kRowBytes})) << row;
      }
    }
  }
}

TEST(LimitedBuffers, AreCountedByTheRow) {
  const TemporaryFolder folder;
  (void)write_counting(folder / "a.png", SampleType::kUint16);
  const auto png = [&](std::uint64_t limit) { return open_within(folder / "a.png", limit)->buffer_bytes(); };
  // A kept row at least, one that is decoded and one of libpng's.
  EXPECT_EQ(png(1), 3 * kRowBytes);
  EXPECT_EQ(png(10 * kRowBytes), 12 * kRowBytes);
  EXPECT_EQ(png(UINT64_MAX), (kHeight + 2) * kRowBytes);
  (void)write_counting(folder / "a.exr", SampleType::kFloat16);
  const auto exr = [&](std::uint64_t limit) { return open_within(folder / "a.exr", limit)->buffer_bytes(); };
  // Bands are whole chunks of 16 rows; what OpenEXR holds besides does not depend on them.
  const std::uint64_t library = exr(1) - 16 * kRowBytes;
  EXPECT_GE(library, 16 * kRowBytes);
  EXPECT_EQ(exr(40 * kRowBytes), 32 * kRowBytes + library);
  EXPECT_EQ(exr(UINT64_MAX), kHeight * kRowBytes + library);
}

}  // namespace
}  // namespace isohf::test
