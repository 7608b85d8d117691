#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "archive/tile/tiles.h"
#include "isohf/archive.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/tile/tile_codes.h"
#include "isohf/archive/tile/tile_encoder.h"
#include "isohf/archive/writer.h"
#include "isohf/error.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

using test::small_grid;
using test::TemporaryFolder;

TEST(Archive, BringsBackTilesMembersAndMetadata) {
  for (const CodeType type : {CodeType::kU16, CodeType::kU8, CodeType::kF32}) {
    const TemporaryFolder folder;
    const TileGrid grid = small_grid();
    const std::string path = folder / "a.isohf";
    test::make_archive(path, grid, type);
    EXPECT_EQ(folder.names(), std::vector<std::string>{"a.isohf"});
    const ArchiveReader reader(path);
    EXPECT_FALSE(reader.reads_by_directory());
    EXPECT_TRUE(reader.warnings().empty());
    EXPECT_TRUE(reader.check_structure().empty());
    EXPECT_EQ(reader.metadata().tiles_stored, 18);
    for (std::int64_t flat = 0; flat < grid.tile_count(); ++flat) {
      EXPECT_TRUE(test::same_samples(reader.read_tile(grid.tile_at(flat)), test::tile_of_archive(grid, type, flat)));
    }
    ASSERT_EQ(reader.members().size(), 5U);
    EXPECT_EQ(reader.read_member("shadow/seeds.bin"), std::vector<std::byte>(1000, std::byte{7}));
    EXPECT_EQ(reader.read_member("preview.png"), std::vector<std::byte>(33, std::byte{9}));
    EXPECT_EQ(reader.read_member("nothing"), std::nullopt);
  }
}

/// docs/reader.py was written from docs/archive_format.md; it compares content hashes.
int read_by_page(const std::string& path) {
  return std::system((R"(python3 ")" ISOHF_SOURCE_DIR R"(/docs/reader.py" )" + path).c_str());
}

TEST(Archive, IsReadByThePageAboutItsFormat) {
  if (std::system("command -v python3 >/dev/null 2>&1") != 0) GTEST_SKIP() << "python3 is not installed";
  const TemporaryFolder folder;
  const std::string path = folder / "a.isohf";
  for (const TileShape& shape : {TileShape::make(5, 5, 1), TileShape::make(12, 11, 3), TileShape::make(24, 29, 1)}) {
    for (const CodeType type : {CodeType::kU16, CodeType::kU8, CodeType::kF32}) {
      std::filesystem::remove(path);
      test::make_archive(path, TileGrid::make(shape, 5, 4, 100.0, 1.0 / 3.0), type);
      EXPECT_EQ(read_by_page(path), 0) << to_string(type) << " " << shape.columns();
    }
  }
}

TEST(Archive, IsReadByThePageWithPayloadsOfEveryKind) {
  if (std::system("command -v python3 >/dev/null 2>&1") != 0) GTEST_SKIP() << "python3 is not installed";
  const TemporaryFolder folder;
  const std::string path = folder / "a.isohf";
  const TileGrid grid = TileGrid::make(TileShape::make(68, 67, 1), 1, 1, 100.0, 1.0 / 3.0);
  for (const CodeType type : {CodeType::kU16, CodeType::kU8, CodeType::kF32}) {
    const TileCodes codes = test::make_tile(grid.shape(), type, test::Kind::kTerrain, 1);
    for (const Effort effort : {Effort::kFast, Effort::kDefault}) {
      for (const PayloadVersion version : {PayloadVersion::kFirst, PayloadVersion::kAdaptive}) {
        std::filesystem::remove(path);
        ArchiveWriter writer(path, grid, WriterOptions{});
        writer.add_tile(encode_tile(grid.shape(), codes, effort, version));
        static_cast<void>(writer.finish(test::make_metadata(grid, type)));
        EXPECT_EQ(read_by_page(path), 0) << to_string(type) << ", level " << level_of(effort);
      }
    }
  }
}

}  // namespace
}  // namespace isohf
