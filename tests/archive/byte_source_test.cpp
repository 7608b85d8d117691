#include "isohf/byte_source.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <thread>

#include "archive/tile/tiles.h"
#include "isohf/archive.h"
#include "isohf/base/source_bytes.h"
#include "isohf/error.h"
#include "support/error_of.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

using test::error_of;
using test::small_grid;
using testing::HasSubstr;

std::vector<std::byte> archive_bytes(const TileGrid& grid) {
  const test::TemporaryFolder folder;
  test::make_archive(folder / "a.isohf", grid, CodeType::kU16);
  return test::read_bytes(folder / "a.isohf");
}

/// More tiles than opening sees of the file's end.
TileGrid large_grid() {
  return TileGrid::make(TileShape::make(5, 5, 1), 160, 60, 100.0, 100.0);
}

void expect_all_tiles(const ArchiveReader& reader) {
  const TileGrid& grid = reader.grid();
  for (std::int64_t flat = 0; flat < grid.tile_count(); ++flat) {
    EXPECT_EQ(reader.read_tile(grid.tile_at(flat)), test::tile_of_archive(grid, CodeType::kU16, flat)) << flat;
  }
  EXPECT_EQ(reader.read_member("shadow/seeds.bin"), std::vector<std::byte>(1000, std::byte{7}));
  EXPECT_EQ(reader.check_structure(), std::vector<std::string>{});
}

/// A source of the tests' own, without a view, that counts what is asked of it and may misbehave.
class TestSource : public ByteSource {
 public:
  explicit TestSource(std::vector<std::byte> bytes) : bytes_(std::move(bytes)) {}

  [[nodiscard]] std::uint64_t size_bytes() const override { return bytes_.size(); }
  [[nodiscard]] std::size_t read(std::uint64_t offset_bytes, std::span<std::byte> out) const override {
    EXPECT_FALSE(out.empty());
    EXPECT_LE(offset_bytes + out.size(), bytes_.size());
    if (fails) throw Error(ErrorCode::kIo, "the line is dead");
    const std::uint64_t there = std::min<std::uint64_t>(ends_at, bytes_.size());
    const std::uint64_t left = offset_bytes < there ? there - offset_bytes : 0;
    const std::size_t count = std::min({out.size(), static_cast<std::size_t>(left), most_at_once});
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(offset_bytes), count, out.begin());
    ++ranges;
    bytes_read += count;
    return count + surplus;
  }

  std::size_t most_at_once = SIZE_MAX;
  std::uint64_t ends_at = UINT64_MAX;
  std::size_t surplus = 0;
  std::atomic<bool> fails = false;
  mutable std::atomic<std::size_t> ranges = 0;
  mutable std::atomic<std::size_t> bytes_read = 0;

 private:
  std::vector<std::byte> bytes_;
};

TEST(ByteSource, ReadsASmallArchiveInOneRange) {
  const auto source = std::make_shared<TestSource>(archive_bytes(small_grid()));
  expect_all_tiles(ArchiveReader(source, "small"));
  EXPECT_EQ(source->ranges, 1U);
  EXPECT_EQ(source->bytes_read, source->size_bytes());
}

TEST(ByteSource, OpensALargeArchiveInTwoRangesAndReadsATileInTwoOrOne) {
  const std::vector<std::byte> bytes = archive_bytes(large_grid());
  ASSERT_GT(bytes.size(), 1U << 20U);
  const auto source = std::make_shared<TestSource>(bytes);
  const ArchiveReader reader(source, "large");
  EXPECT_EQ(source->ranges, 2U);
  EXPECT_EQ(source->bytes_read, 512U << 10U);
  source->ranges = 0;
  const TileEntry entry = reader.tile_entry({0, 2});
  EXPECT_EQ(source->ranges, 1U);  // a page
  source->bytes_read = 0;
  static_cast<void>(reader.read_tile({0, 2}));
  EXPECT_EQ(source->ranges, 2U);
  EXPECT_EQ(source->bytes_read, 30 + std::string("tiles/2/0.tile").size() + entry.compressed_bytes);
  static_cast<void>(reader.read_tile({1, 2}));
  EXPECT_EQ(source->ranges, 3U);
  EXPECT_EQ(reader.loose_members().size(), 5U);
}

TEST(ByteSource, GivesWhatTheFileGivesFromABufferAndInPieces) {
  for (const TileGrid& grid : {small_grid(), large_grid()}) {
    const std::vector<std::byte> bytes = archive_bytes(grid);
    expect_all_tiles(ArchiveReader(memory_source(bytes), "buffer"));
    const auto pieces = std::make_shared<TestSource>(bytes);
    pieces->most_at_once = 777;
    expect_all_tiles(ArchiveReader(pieces, "pieces"));
  }
}

TEST(ByteSource, CountsAShorterSourceAsAnErrorThatNamesIt) {
  const std::vector<std::byte> bytes = archive_bytes(large_grid());
  const auto cut = std::make_shared<TestSource>(bytes);
  cut->ends_at = bytes.size() / 2;
  EXPECT_THAT(error_of([&] { const ArchiveReader reader(cut, "cut"); }).what(), HasSubstr("cut: 0 of "));
  const auto later = std::make_shared<TestSource>(bytes);
  const ArchiveReader reader(later, "later");
  static_cast<void>(reader.tile_entry({79, 48}));
  later->ends_at = bytes.size() / 8;
  EXPECT_THAT(error_of([&] {
                static_cast<void>(reader.read_tile({79, 48}));
              }).what(),
              HasSubstr("later: tile (79,48) at byte"));
  EXPECT_THAT(error_of([&] { static_cast<void>(reader.members()); }).what(), HasSubstr("later: 0 of "));
  EXPECT_THAT(reader.check_structure(), testing::Contains(HasSubstr("0 of ")));
}

TEST(ByteSource, RefusesASourceThatReadsMoreThanItWasAsked) {
  const auto source = std::make_shared<TestSource>(archive_bytes(small_grid()));
  source->surplus = 1;
  EXPECT_THAT(error_of([&] { const ArchiveReader reader(source, "liar"); }).what(), HasSubstr("liar: "));
}

TEST(ByteSource, PassesErrorsOnWithTheName) {
  const auto source = std::make_shared<TestSource>(archive_bytes(large_grid()));
  const ArchiveReader reader(source, "https://example.org/a.isohf");
  source->fails = true;
  EXPECT_THAT(error_of([&] {
                static_cast<void>(reader.read_tile({2, 1}));
              }).what(),
              testing::AllOf(testing::StartsWith("https://example.org/a.isohf: "), HasSubstr("the line is dead")));
  EXPECT_THAT(error_of([&] { const ArchiveReader again(source, "again"); }).what(),
              testing::StrEq("again: the line is dead"));
}

TEST(ByteSource, RefusesEveryTruncationInMemory) {
  const std::vector<std::byte> bytes = archive_bytes(small_grid());
  for (std::size_t size = 0; size < bytes.size(); size += size < 16000 ? 197 : 3) {
    EXPECT_THROW(
        ArchiveReader(memory_source({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)}), "cut"), Error);
  }
}

TEST(ByteSource, IsReadByManyThreadsAtOnce) {
  const auto source = std::make_shared<TestSource>(archive_bytes(small_grid()));
  const ArchiveReader reader(source, "threads");
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) threads.emplace_back([&] { expect_all_tiles(reader); });
  for (std::thread& thread : threads) thread.join();
}

TEST(SourceBytes, CopiesOnlyWhereThereIsNoView) {
  const std::vector<std::byte> bytes = {std::byte{1}, std::byte{2}, std::byte{3}};
  const auto buffer = memory_source(bytes);
  EXPECT_EQ(SourceBytes(*buffer, 1, 2).bytes().data(), buffer->view(1, 2).data());
  const TestSource source(bytes);
  EXPECT_EQ(SourceBytes(source, 1, 2).take(), std::vector<std::byte>(bytes.begin() + 1, bytes.end()));
  EXPECT_EQ(SourceBytes(*buffer, 1, 2).take(), SourceBytes(source, 1, 2).take());
  EXPECT_TRUE(SourceBytes(source, 3, 0).bytes().empty());
  for (const auto& [offset, size] : {std::pair<std::uint64_t, std::uint64_t>{1, 3}, {4, 1}, {UINT64_MAX, 2}}) {
    EXPECT_THROW(SourceBytes(source, offset, size), Error);
    EXPECT_THROW(SourceBytes(*buffer, offset, size), Error);
  }
}

}  // namespace
}  // namespace isohf
