#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <random>

#include "formats/io/gzipped.h"
#include "formats/io/raw_file.h"
#include "formats/io/zip_archive.h"
#include "formats/reader_failure.h"
#include "formats/registry.h"
#include "isohf/raster.h"
#include "support/in_folder.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::HasSubstr;

std::string terrain(std::size_t bytes) {
  std::string contents(bytes, '\0');
  std::mt19937 random(4);
  for (std::size_t i = 0; i < bytes; ++i) contents[i] = static_cast<char>(i / 700 % 120 + random() % 3);
  return contents;
}

constexpr std::int64_t kSide = 1201;
constexpr std::uint64_t kTileBytes = std::uint64_t{kSide} * kSide * 2;
constexpr std::uint64_t kMiB = std::uint64_t{1} << 20U;

OpenOptions holding(std::uint64_t unpacked_bytes) {
  OpenOptions options;
  options.unpacked_bytes = unpacked_bytes;
  return options;
}

/// A tile, the same in gzip, and the same in a zip archive.
class PackedTile : public ::testing::Test {
 protected:
  PackedTile() {
    const std::string contents = terrain(kTileBytes);
    write_file(plain_, contents);
    write_file(plain_ + ".gz", gzipped(contents));
    const auto bytes = std::as_bytes(std::span(contents));
    const auto zip = zip_archive({{"N44E006.hgt", {bytes.begin(), bytes.end()}}}, true);
    write_file(plain_ + ".zip", zip);
  }

  const TemporaryFolder folder_;
  const std::string plain_ = folder_ / "N44E006.hgt";
};

TEST_F(PackedTile, IsHeldOnlyWhereThatIsAllowedAndThenCounted) {
  EXPECT_EQ(open_raster(plain_, {})->buffer_bytes(UINT64_MAX), 0U);
  for (const char* packing : {".gz", ".zip"}) {
    SCOPED_TRACE(packing);
    EXPECT_EQ(open_raster(plain_ + packing, {})->buffer_bytes(UINT64_MAX), kTileBytes);
    EXPECT_EQ(open_raster(plain_ + packing, holding(kTileBytes))->buffer_bytes(UINT64_MAX), kTileBytes);
    // Places of the decoder instead, one each MiB, and what it works with.
    const auto streamed = open_raster(plain_ + packing, holding(kTileBytes - 1))->buffer_bytes(UINT64_MAX);
    EXPECT_GT(streamed, kMiB / 4);
    EXPECT_LT(streamed, kMiB);
    const auto held = open_raster(plain_ + packing, {});
    EXPECT_EQ(held->buffer_bytes(kTileBytes), kTileBytes);
    EXPECT_EQ(held->buffer_bytes(4 * kMiB), kTileBytes);
    EXPECT_EQ(held->buffer_bytes(kMiB), streamed);
    held->limit_buffers(8 * kMiB);
    EXPECT_EQ(held->buffer_bytes(UINT64_MAX), kTileBytes);
    held->limit_buffers(kMiB);
    EXPECT_EQ(held->buffer_bytes(UINT64_MAX), streamed);
  }
}

TEST_F(PackedTile, HasTheSameSamplesHeldAndNotInAnyOrder) {
  const auto plain = open_raster(plain_, {});
  const auto all = read_whole(*plain);
  for (const char* packing : {".gz", ".zip"}) {
    SCOPED_TRACE(packing);
    const auto held = open_raster(plain_ + packing, {});
    EXPECT_EQ(held->info().format, "SRTM HGT");
    EXPECT_EQ(held->info().georeference.origin_y, 45.0);
    EXPECT_EQ(held->info().warnings.size(), 0U);
    const auto streamed = open_raster(plain_ + packing, holding(0));
    const auto dropped = open_raster(plain_ + packing, {});
    (void)read_window(*dropped, {0, 700, kSide, 1});
    dropped->limit_buffers(1);
    std::mt19937 random(9);
    for (int round = 0; round < 40; ++round) {
      const std::int64_t row = random() % 1190;
      const std::int64_t column = random() % 1000;
      const Window window{column, row, 1 + static_cast<std::int64_t>(random() % 200),
                          1 + static_cast<std::int64_t>(random() % 11)};
      const auto expected = read_window(*plain, window);
      ASSERT_EQ(read_window(*held, window), expected) << column << ", " << row;
      ASSERT_EQ(read_window(*streamed, window), expected) << column << ", " << row;
      ASSERT_EQ(read_window(*dropped, window), expected) << column << ", " << row;
    }
    EXPECT_EQ(read_whole(*held), all);
    EXPECT_EQ(read_whole(*streamed), all);
    EXPECT_EQ(read_whole(*dropped), all);
  }
}

TEST_F(PackedTile, SaysWhenItWasChangedWhileItWasRead) {
  const auto source = open_raster(plain_ + ".gz", {});
  source->limit_buffers(1);
  std::filesystem::resize_file(plain_ + ".gz", 1000);
  const Error error = error_of([&] { (void)read_window(*source, {0, 1100, kSide, 1}); });
  EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
  EXPECT_THAT(error.what(), HasSubstr("N44E006.hgt.gz: gzip data: ends early"));
}

using Gzip = InFolder;

TEST_F(Gzip, HoldsTextGridsWithTheirPrj) {
  write_file(folder / "a.asc.gz", gzipped("ncols 2\nnrows 2\nxllcorner 5\nyllcorner 6\ncellsize 1\n1 2\n3 4\n"));
  write_file(folder / "a.prj", R"(PROJCS["Here",GEOGCS["G",DATUM["D",SPHEROID["S",6378137,298]]],UNIT["metre",1]])");
  const auto source = open_raster(folder / "a.asc.gz", {});
  EXPECT_EQ(source->info().format, "ESRI ASCII grid");
  EXPECT_EQ(source->info().georeference.system.name, "Here");
  const auto all = read_whole(*source);
  EXPECT_EQ(value_at(SampleType::kInt32, all, 3), 4.0);
  EXPECT_EQ(read_window(*source, {0, 0, 1, 1}), std::vector<std::byte>(all.begin(), all.begin() + 4));
}

TEST_F(Gzip, JoinsMembersAndPassesPaddingOver) {
  write_file(folder / "a.gz", gzipped("first ") + gzipped("") + gzipped("second") + std::string(600, '\0'));
  for (const std::uint64_t held : {kMiB, std::uint64_t{0}}) {
    SCOPED_TRACE(held);
    const RawFile file(folder / "a.gz", held);
    ASSERT_EQ(file.size_bytes(), 12U);
    std::string text(12, '?');
    file.read(0, std::as_writable_bytes(std::span(text)));
    EXPECT_EQ(text, "first second");
    EXPECT_EQ(error_of([&] { file.read(7, std::as_writable_bytes(std::span(text))); }).code(), ErrorCode::kCorrupt);
  }
}

TEST_F(Gzip, HoldsManyMembersWhoseSizeTogetherNoFieldSays) {
  const std::string block = terrain(65280);  // as bgzip cuts them
  std::string packed;
  std::string contents;
  for (int i = 0; i < 40; ++i) {
    packed += gzipped(block + std::to_string(i));
    contents += block + std::to_string(i);
  }
  write_file(folder / "a.gz", packed + gzipped(""));
  for (const std::uint64_t most : {std::uint64_t{contents.size()}, std::uint64_t{contents.size() - 1}}) {
    SCOPED_TRACE(most);
    const RawFile file(folder / "a.gz", most);
    ASSERT_EQ(file.size_bytes(), contents.size());
    EXPECT_EQ(file.buffer_bytes(UINT64_MAX) == contents.size(), most == contents.size());
    std::string text(contents.size(), '?');
    file.read(0, std::as_writable_bytes(std::span(text)));
    EXPECT_TRUE(text == contents);
  }
}

TEST_F(Gzip, NeverHoldsMoreThanItsMost) {
  constexpr std::uint64_t kMost = RawFile::kMostHeldBytes;
  for (const std::uint64_t bytes : {kMost, kMost + 1}) {
    write_file(folder / "a.gz", gzipped(std::string(bytes, '\0')));
    const RawFile file(folder / "a.gz", UINT64_MAX);
    ASSERT_EQ(file.size_bytes(), bytes);
    const std::uint64_t kept = file.buffer_bytes(UINT64_MAX);
    EXPECT_EQ(kept == kMost, bytes == kMost);
    EXPECT_TRUE(kept == kMost || kept < 8 * kMiB) << kept;
  }
}

TEST_F(Gzip, RefusesEveryTruncationAndEveryFlippedByteInTheSameWordsHeldAndNot) {
  const std::string whole = gzipped(terrain(800));
  const std::string path = folder / "4.raw.gz";
  ErrorCode code = ErrorCode::kCancelled;
  const auto failure = [&](const std::string& bytes) {
    write_file(path, bytes);
    OpenOptions options;
    options.raw = RawLayout{20, 20, SampleType::kUint16, false};
    const std::string held = failure_of(path, &code, [&] { read_corner(*open_raster(path, options)); });
    options.unpacked_bytes = 0;
    EXPECT_EQ(failure_of(path, &code, [&] { read_corner(*open_raster(path, options)); }), held);
    return held;
  };
  EXPECT_EQ(failure(whole), "");
  for (std::size_t length = 3; length < whole.size(); ++length) {
    EXPECT_THAT(failure(whole.substr(0, length)), HasSubstr("gzip data: ends early")) << length;
    EXPECT_EQ(code, ErrorCode::kCorrupt);
  }
  EXPECT_THAT(failure(whole + "garbage"), HasSubstr("incorrect header check"));
  for (std::size_t at = 10; at < whole.size(); ++at) {  // behind the header, whose time and system mean nothing
    if (at == whole.size() - 9) continue;               // the last bits before the checksum are filling
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x40);
    EXPECT_NE(failure(damaged), "") << at;
    EXPECT_EQ(code, ErrorCode::kCorrupt) << at;
  }
}

TEST_F(Gzip, SaysWhichFormatsItDoesNotReadInside) {
  const auto says = [&](const std::string& name, const std::string& contents) {
    write_file(folder / name, gzipped(contents));
    return std::string(error_of([&] { (void)open_raster(folder / name, {}); }).what());
  };
  EXPECT_THAT(says("a.tif.gz", std::string("II*\0\x08\0\0\0", 8) + std::string(90, ' ')),
              HasSubstr("a.tif.gz/a.tif: is not a readable TIFF file"));
  EXPECT_THAT(says("a.txt.gz", "nothing that is known"), HasSubstr("is something unknown in gzip"));
  // A browser may have unpacked it already: the content decides.
  write_file(folder / "b.asc.gz", "ncols 2\nnrows 1\n1 2\n");
  EXPECT_EQ(open_raster(folder / "b.asc.gz", {})->info().width, 2);
}

}  // namespace
}  // namespace isohf::test
