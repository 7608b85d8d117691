#include "isohf/archive/writer.h"
#include "isohf/archive/tile/tile_encoder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <tuple>

#include "archive/tile/tiles.h"
#include "isohf/archive.h"
#include "isohf/archive/tile/tile_codes.h"
#include "isohf/error.h"
#include "support/error_of.h"
#include "support/in_folder.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

using test::small_grid;
using test::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;

WriterOptions plain() {
  return {false, false, "", {4, 2}};
}

EncodedTile tile_at(const TileGrid& grid, std::int64_t flat) {
  EncodedTile tile = encode_tile(grid.shape(), test::tile_of_archive(grid, CodeType::kU16, flat));
  tile.statistics.vertices = flat + 1;
  tile.statistics.sum = 0.1 * static_cast<double>(flat);
  tile.statistics.min = -static_cast<double>(flat);
  return tile;
}

constexpr PlaneInfo kPlanes{4, 2};

/// The coarse tiles that follow a fine one: what they hold means nothing to the container.
void add_plane_tiles(ArchiveWriter& writer, const TileGrid& grid, std::int64_t done) {
  if (done == 12) writer.add_plane_tile(1, {0, 0}, tile_at(grid, 2), {3, 4000});
  if (done == 18) writer.add_plane_tile(1, {1, 0}, tile_at(grid, 1), {1, 2});
  if (done == 20) writer.add_plane_tile(2, {0, 0}, tile_at(grid, 0), {0, 5000});
}

/// Adds tiles up to `end`, a member before every third one.
void add_tiles(ArchiveWriter& writer, const TileGrid& grid, std::int64_t end) {
  while (writer.next_tile() < end) {
    const std::int64_t flat = writer.next_tile();
    if (flat % 3 == 0)
      writer.add_member("extra/" + std::to_string(flat), std::vector<std::byte>(50, std::byte{3}), true);
    add_plane_tiles(writer, grid, flat);
    writer.add_tile(tile_at(grid, flat));
  }
}

void complete(ArchiveWriter& writer, const TileGrid& grid) {
  add_tiles(writer, grid, grid.tile_count());
  add_plane_tiles(writer, grid, grid.tile_count());
  EXPECT_EQ(writer.statistics().vertices, 210);
  EXPECT_EQ(writer.statistics().min, -19.0);
  EXPECT_EQ(writer.tiles_stored(), 18);
  Metadata metadata = test::make_metadata(grid, CodeType::kU16);
  metadata.statistics.mean = writer.statistics().sum;
  static_cast<void>(writer.finish(metadata));
}

/// Opens a writer that must not be opened.
std::function<void()> opening(const std::string& path, const TileGrid& grid, const WriterOptions& options) {
  return [=] { ArchiveWriter(path, grid, options); };
}

ErrorCode code_of(const std::function<void()>& deed, const std::string& part_of_message) {
  const Error error = test::error_of(deed);
  EXPECT_THAT(error.what(), HasSubstr(part_of_message));
  return error.code();
}

class ArchiveWriting : public test::InFolder {
 protected:
  const TileGrid grid = small_grid();
};

TEST_F(ArchiveWriting, RefusesTargetsThatItMustNotWrite) {
  const auto open = [&](const std::string& path) { return opening(path, grid, {}); };
  test::write_file(folder / "there", "x");
  EXPECT_EQ(code_of(open(folder / "there"), "is no isohf archive"), ErrorCode::kInvalidArgument);
  EXPECT_EQ(code_of(open(folder / "."), "folder"), ErrorCode::kInvalidArgument);
  EXPECT_EQ(code_of(open(folder / "no/such"), "no/such"), ErrorCode::kIo);
  EXPECT_EQ(code_of(open("/dev/null"), "/dev/null"), ErrorCode::kInvalidArgument);
  EXPECT_THAT(folder.names(), ElementsAre("there"));
  EXPECT_EQ(test::read_bytes(folder / "there").size(), 1U);
}

TEST_F(ArchiveWriting, LeavesNothingWhereItIsNotFinished) {
  {
    ArchiveWriter writer(folder / "a", grid, plain());
    add_tiles(writer, grid, 7);
    EXPECT_THAT(folder.names(), ElementsAre("a.part", "a.part.journal"));
  }
  EXPECT_THAT(folder.names(), ElementsAre());
}

TEST_F(ArchiveWriting, LetsOneProcessWriteATarget) {
  ArchiveWriter writer(folder / "a", grid, plain());
  for (const bool resume : {false, true}) {
    EXPECT_EQ(code_of(opening(folder / "a", grid, {true, resume, "", kPlanes}), "another process"), ErrorCode::kIo);
  }
  complete(writer, grid);  // unharmed
  EXPECT_EQ(ArchiveReader(folder / "a").check_structure(), std::vector<std::string>{});
}

TEST_F(ArchiveWriting, KeepsWhatSomebodyElseMadeMeanwhile) {
  {
    ArchiveWriter writer(folder / "a", grid, plain());
    test::write_file(folder / "a", "x");
    EXPECT_EQ(code_of([&] { complete(writer, grid); }, "meanwhile"), ErrorCode::kIo);
  }
  EXPECT_EQ(test::read_bytes(folder / "a").size(), 1U);
  EXPECT_EQ(ArchiveReader(folder / "a.part").check_structure(), std::vector<std::string>{});
}

TEST_F(ArchiveWriting, ReplacesWhereItMay) {
  test::write_file(folder / "a", "");
  for (int time = 0; time < 2; ++time) {  // an empty file, then an archive
    ArchiveWriter writer(folder / "a", grid, {true, false, "", kPlanes});
    complete(writer, grid);
  }
  EXPECT_THAT(folder.names(), ElementsAre("a"));
  EXPECT_EQ(ArchiveReader(folder / "a").metadata().tiles_stored, 18);
  EXPECT_EQ(code_of(opening(folder / "a", grid, plain()), "exists; `overwrite`"), ErrorCode::kInvalidArgument);
  for (const char* other : {"text", "PK\x03\x04 a ZIP archive of something else, longer than a header"}) {
    test::write_file(folder / "b", other);
    EXPECT_EQ(code_of(opening(folder / "b", grid, {true, false, "", kPlanes}), "b: is no isohf archive"),
              ErrorCode::kInvalidArgument);
    EXPECT_EQ(test::read_file(folder / "b"), other);
  }
}

TEST_F(ArchiveWriting, RefusesMembersWithBadOrTakenNames) {
  ArchiveWriter writer(folder / "a", grid, {});
  writer.add_member("good", {}, false);
  for (const char* name : {"", "/a", "a/", "..", "a/../b", "./a", "a//b", "a\\b", "c:a", "a\nb", "good", "isohf.json",
                           "index.bin", "tiles/0/0.tile"}) {
    EXPECT_EQ(code_of([&] { writer.add_member(name, {}, false); }, "member"), ErrorCode::kInvalidArgument) << name;
  }
}

/// Archives that a run wrote whole, and one that stopped at `stop` tiles, was damaged, and went on.
class Resume : public testing::Test {
 protected:
  Resume() : grid_(small_grid()) {
    ArchiveWriter writer(folder_ / "whole", grid_, {false, false, "job", kPlanes});
    complete(writer, grid_);
    whole_ = test::read_bytes(folder_ / "whole");
  }
  void stop_at(std::int64_t tiles) {
    ArchiveWriter writer(folder_ / "a", grid_, {true, false, "job", kPlanes});
    add_tiles(writer, grid_, tiles);
    writer.keep_part();
  }
  /// Goes on and checks the result; returns the tile that it went on with.
  std::int64_t go_on() {
    std::int64_t first = 0;
    {
      ArchiveWriter writer(folder_ / "a", grid_, {true, true, "job", kPlanes});
      first = writer.next_tile();
      complete(writer, grid_);
    }
    EXPECT_EQ(test::read_bytes(folder_ / "a"), whole_);
    EXPECT_THAT(folder_.names(), ElementsAre("a", "whole"));
    return first;
  }
  [[nodiscard]] std::string part() const { return folder_ / "a.part"; }
  [[nodiscard]] std::string journal() const { return folder_ / "a.part.journal"; }

  TemporaryFolder folder_;
  TileGrid grid_;
  std::vector<std::byte> whole_;
};

TEST_F(Resume, GivesTheSameBytesFromWhereverItStopped) {
  for (std::int64_t tiles = 0; tiles <= 20; ++tiles) {
    stop_at(tiles);
    EXPECT_EQ(go_on(), tiles);
  }
}

TEST_F(Resume, HasCoarsePlanesThatComeBackTileByTile) {
  stop_at(13);
  EXPECT_EQ(go_on(), 13);
  const ArchiveReader archive(folder_ / "a");
  EXPECT_FALSE(archive.reads_by_directory());
  EXPECT_THAT(archive.check_structure(), ElementsAre());
  EXPECT_EQ(archive.metadata().planes, kPlanes);
  EXPECT_EQ(archive.metadata().plane_grid(1), TileGrid::make(grid_.shape(), 2, 1, 400.0, 400.0));
  EXPECT_EQ(archive.metadata().plane_grid(2), TileGrid::make(grid_.shape(), 1, 1, 1600.0, 1600.0));
  for (const auto& [plane, tile, flat] : {std::tuple(1, TileIndex{0, 0}, 2), {1, {1, 0}, 1}, {2, {0, 0}, 0}}) {
    const TileCodes expected = test::tile_of_archive(grid_, CodeType::kU16, flat);
    EXPECT_EQ(archive.read_tile(tile, plane), expected);
    const auto digest = archive.tile_digest(tile, plane);
    ASSERT_TRUE(digest.has_value());
    EXPECT_EQ(*digest, tile_at(grid_, flat).content_digest);
  }
  EXPECT_EQ(archive.tile_entry({0, 0}, 1).code_max, 4000U);
  EXPECT_THROW(static_cast<void>(archive.read_tile({2, 0}, 1)), Error);
  EXPECT_THROW(static_cast<void>(archive.read_tile({0, 0}, 3)), Error);
  std::vector<std::pair<std::string, std::int64_t>> tables;
  for (const MemberTable& table : archive.tables()) tables.emplace_back(table.name, table.stored);
  EXPECT_THAT(tables, ElementsAre(testing::Pair("tiles/{row}/{column}.tile", 18),
                                  testing::Pair("planes/1/{row}/{column}.tile", 2),
                                  testing::Pair("planes/2/{row}/{column}.tile", 1)));
}

TEST_F(Resume, StartsOverWhereThereIsNothing) {
  EXPECT_EQ(go_on(), 0);
}

TEST_F(Resume, SurvivesEveryLengthOfAJournal) {
  stop_at(9);
  const std::vector<std::byte> part_bytes = test::read_bytes(part());
  const std::vector<std::byte> journal_bytes = test::read_bytes(journal());
  std::int64_t before = 0;
  for (std::size_t size = 0; size <= journal_bytes.size(); size += 7) {
    test::write_file(part(), part_bytes);
    test::write_file(journal(), {journal_bytes.begin(), journal_bytes.begin() + static_cast<std::ptrdiff_t>(size)});
    const std::int64_t first = go_on();
    EXPECT_GE(first, before);
    before = first;
  }
}

TEST_F(Resume, GoesBackToTheLastTileThatIsWhole) {
  stop_at(9);
  const std::vector<std::byte> part_bytes = test::read_bytes(part());
  const std::vector<std::byte> journal_bytes = test::read_bytes(journal());
  for (std::size_t at = 0; at < part_bytes.size(); at += 61) {
    for (const bool cut : {false, true}) {
      std::vector<std::byte> damaged = part_bytes;
      if (cut) {
        damaged.resize(at);
      } else {
        damaged[at] ^= std::byte{16};
      }
      test::write_file(part(), damaged);
      test::write_file(journal(), journal_bytes);
      EXPECT_LE(go_on(), 9);
    }
  }
}

TEST_F(Resume, RefusesThePartOfAnotherJob) {
  stop_at(5);
  const std::vector<std::byte> before = test::read_bytes(part());
  EXPECT_EQ(code_of(opening(folder_ / "a", grid_, {true, true, "other", kPlanes}), "other"),
            ErrorCode::kInvalidArgument);
  EXPECT_EQ(test::read_bytes(part()), before);
  EXPECT_EQ(go_on(), 5);
}

TEST_F(Resume, ARunThatStartsOverKeepsAnInterruptedOneUntilItIsComplete) {
  stop_at(15);
  stop_at(3);
  EXPECT_THAT(folder_.names(), ElementsAre("a.part", "a.part.journal", "a.part.old", "a.part.old.journal", "whole"));
  stop_at(4);  // the larger of the two stays
  EXPECT_EQ(go_on(), 15);
  // A larger one of this run, and one of another job.
  stop_at(5);
  stop_at(12);
  EXPECT_EQ(go_on(), 12);
  stop_at(5);
  {
    ArchiveWriter writer(folder_ / "a", grid_, {true, false, "other", kPlanes});
    add_tiles(writer, grid_, 3);
    writer.keep_part();
  }
  EXPECT_EQ(go_on(), 5);
}

TEST_F(Resume, ARunThatFailsLeavesAnInterruptedOne) {
  stop_at(9);
  {
    ArchiveWriter writer(folder_ / "a", grid_, {true, false, "job", kPlanes});
    add_tiles(writer, grid_, 2);
  }
  EXPECT_THAT(folder_.names(), ElementsAre("a.part.old", "a.part.old.journal", "whole"));
  EXPECT_EQ(go_on(), 9);
}

TEST_F(Resume, FindsTheJournalOfARunThatWasBeingPutAside) {
  for (const bool back : {false, true}) {
    stop_at(9);
    std::filesystem::rename(journal(), part() + ".old.journal");
    if (back) {
      std::filesystem::rename(part(), part() + ".old");
      std::filesystem::rename(part() + ".old.journal", journal());
    }
    EXPECT_EQ(go_on(), 9);
  }
}

TEST_F(Resume, DropsAnOldPartWithoutBeingAsked) {
  stop_at(5);
  {
    ArchiveWriter writer(folder_ / "a", grid_, {true, false, "job", kPlanes});
    EXPECT_EQ(writer.next_tile(), 0);
    complete(writer, grid_);
  }
  EXPECT_EQ(test::read_bytes(folder_ / "a"), whole_);
}

TEST_F(Resume, GoesOnAfterAKill) {
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    ArchiveWriter writer(folder_ / "a", grid_, {true, false, "job", kPlanes});
    add_tiles(writer, grid_, 13);
    ::kill(::getpid(), SIGKILL);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_THAT(folder_.names(), ElementsAre("a.part", "a.part.journal", "whole"));
  static_cast<void>(go_on());
}

TEST_F(ArchiveWriting, SaysThatTheDiskIsFullAndLeavesNothing) {
  // A limit on file sizes fails writes as a full disk does, without needing one.
  const TileGrid large = TileGrid::make(TileShape::make(212, 243, 4), 40, 4, 1.0, 1.0);
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{5 << 20, 5 << 20};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    int result = 1;
    try {
      ArchiveWriter writer(folder / "a", large, plain());
      const EncodedTile tile =
          encode_tile(large.shape(), test::make_tile(large.shape(), CodeType::kU16, test::Kind::kNoise, 1));
      while (writer.next_tile() < large.tile_count()) writer.add_tile(tile);
    } catch (const Error& error) {
      const std::string message = error.what();
      const bool is_clear = message.find("/a: cannot write") != std::string::npos &&
                            message.find("File too large") != std::string::npos &&
                            message.find("of 160 tiles are done") != std::string::npos;
      result = error.code() == ErrorCode::kIo && is_clear ? 0 : 2;
    }
    ::_exit(result);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
  EXPECT_THAT(folder.names(), ElementsAre());
}

}  // namespace
}  // namespace isohf
