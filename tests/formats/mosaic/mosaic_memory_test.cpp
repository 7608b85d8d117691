/// Packed members of a mosaic: what their readers keep is counted, bounded, and without effect on the samples.

#include <gtest/gtest.h>

#include <random>

#include "formats/io/gzipped.h"
#include "formats/mosaic/mosaic_source.h"
#include "isohf/raster.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

constexpr std::int64_t kSide = 401;
constexpr std::int64_t kTiles = 4;
constexpr std::uint64_t kTileBytes = std::uint64_t{kSide} * kSide * 2;

/// A row of tiles of one degree, in gzip.
class PackedMosaic : public ::testing::Test {
 protected:
  PackedMosaic() {
    std::mt19937 random(3);
    for (std::int64_t tile = 0; tile < kTiles; ++tile) {
      std::string samples(kTileBytes, '\0');
      for (char& byte : samples) byte = static_cast<char>(random() % 13);
      paths_.push_back(folder_ / ("N45E00" + std::to_string(tile) + ".hgt"));
      write_file(paths_.back(), samples);
      packed_paths_.push_back(paths_.back() + ".gz");
      write_file(packed_paths_.back(), gzipped(samples));
    }
  }

  [[nodiscard]] static std::unique_ptr<MosaicSource> open(const std::vector<std::string>& paths,
                                                          std::uint64_t unpacked_bytes) {
    OpenOptions options;
    options.unpacked_bytes = unpacked_bytes;
    return std::make_unique<MosaicSource>("mosaic", plan_mosaic(paths, options), options, OverlapRule::kLast);
  }

  const TemporaryFolder folder_;
  std::vector<std::string> paths_;
  std::vector<std::string> packed_paths_;
};

TEST_F(PackedMosaic, CountsWhatItsReadersKeep) {
  const auto plain = open(paths_, UINT64_MAX);
  const std::uint64_t strip = plain->buffer_bytes(UINT64_MAX);  // plain readers keep nothing
  // The strip, and its parts as they come from the members.
  EXPECT_EQ(strip, 2 * static_cast<std::uint64_t>(plain->info().block_height * plain->info().width * 2));
  EXPECT_EQ(open(packed_paths_, UINT64_MAX)->buffer_bytes(UINT64_MAX), strip + kTiles * kTileBytes);
  const auto threads = static_cast<std::uint64_t>(plain->plan().readers_at_once);
  const auto open_at_least = std::min<std::uint64_t>(threads, kTiles);
  EXPECT_EQ(open(packed_paths_, UINT64_MAX)->buffer_bytes(0), strip + open_at_least * kTileBytes);
}

TEST_F(PackedMosaic, HasTheSameSamplesWhateverIsHeld) {
  const auto expected = read_whole(*open(paths_, UINT64_MAX));
  for (const std::uint64_t unpacked : {UINT64_MAX, kTiles * kTileBytes, kTileBytes, std::uint64_t{0}}) {
    for (const std::uint64_t limit : {UINT64_MAX, kTileBytes / 16, std::uint64_t{0}}) {
      SCOPED_TRACE(std::to_string(unpacked) + " " + std::to_string(limit));
      const auto mosaic = open(packed_paths_, unpacked);
      EXPECT_TRUE(read_window(*mosaic, {0, 0, mosaic->info().width, 100}).size() > 0);  // some are open
      mosaic->limit_buffers(limit);
      EXPECT_TRUE(read_whole(*mosaic) == expected);
    }
  }
}

TEST_F(PackedMosaic, OpensMembersOnceWhereTheyFitAndAnewWhereTheyDoNot) {
  // Narrow windows: every one is read from the members, not from a strip.
  const auto times = [&](std::uint64_t limit) {
    const auto mosaic = open(packed_paths_, UINT64_MAX);
    mosaic->limit_buffers(limit);
    for (std::int64_t column = 0; column < mosaic->info().width; column += 200) {
      for (std::int64_t row = 0; row < kSide; row += 200) (void)read_window(*mosaic, {column, row, 1, 1});
    }
    for (std::int64_t column = 0; column < mosaic->info().width; column += 200) {
      (void)read_window(*mosaic, {column, 7, 1, 1});
    }
    return mosaic->times_opened();
  };
  EXPECT_EQ(times(UINT64_MAX), kTiles);
  EXPECT_GT(times(0), kTiles);
}

}  // namespace
}  // namespace isohf::test
