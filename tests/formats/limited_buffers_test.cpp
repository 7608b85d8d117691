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

TEST(LimitedBuffers, DeliverTheSameSamplesInAnyOrder) {
  const TemporaryFolder folder;
  for (const auto& [name, type] : {std::pair{"a.exr", SampleType::kFloat16}, {"a.png", SampleType::kUint16}}) {
    SCOPED_TRACE(name);
    const auto samples = write_counting(folder / name, type);
    const auto source = open_raster(folder / name, {});
    const std::uint64_t all = source->buffer_bytes(UINT64_MAX);
    EXPECT_GE(all, samples.size());
    for (const std::uint64_t limit : {std::uint64_t{1} << 30U, std::uint64_t{100000}, std::uint64_t{1}}) {
      SCOPED_TRACE(limit);
      source->limit_buffers(limit);  // also of a reader that is somewhere in the file
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
  const auto png = open_raster(folder / "a.png", {});
  // A kept row at least, one that is decoded and one of libpng's.
  EXPECT_EQ(png->buffer_bytes(1), 3 * kRowBytes);
  EXPECT_EQ(png->buffer_bytes(10 * kRowBytes), 12 * kRowBytes);
  EXPECT_EQ(png->buffer_bytes(UINT64_MAX), (kHeight + 2) * kRowBytes);
  (void)write_counting(folder / "a.exr", SampleType::kFloat16);
  const auto exr = open_raster(folder / "a.exr", {});
  // Bands are whole chunks of 16 rows; what OpenEXR holds besides does not depend on them.
  const std::uint64_t library = exr->buffer_bytes(1) - 16 * kRowBytes;
  EXPECT_GE(library, 16 * kRowBytes);
  EXPECT_EQ(exr->buffer_bytes(40 * kRowBytes), 32 * kRowBytes + library);
  EXPECT_EQ(exr->buffer_bytes(UINT64_MAX), kHeight * kRowBytes + library);
}

}  // namespace
}  // namespace isohf::test
