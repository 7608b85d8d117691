#include "isohf/archive/attach.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "archive/codec/tiles.h"
#include "isohf/archive.h"
#include "isohf/error.h"
#include "isohf/verify.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

class Attach : public testing::Test {
 protected:
  Attach() : grid_(TileGrid::make(TileShape::make(12, 11, 3), 5, 4, 100.0, 100.0)) {
    test::make_archive(path(), grid_, CodeType::kU16);
    for (int i = 0; i < 5000; ++i) long_.push_back(static_cast<std::byte>(i % 7));
    test::write_file(folder_ / "long.txt", long_);
    test::write_file(folder_ / "short", short_);
  }
  [[nodiscard]] std::string path() const { return folder_ / "a.isohf"; }

  /// All tiles and what was attached, through the index.
  void expect_whole(const std::vector<std::string>& names) const {
    const ArchiveReader archive(path());
    EXPECT_FALSE(archive.reads_by_directory());
    EXPECT_THAT(archive.warnings(), IsEmpty());
    EXPECT_THAT(archive.check_structure(), IsEmpty());
    for (std::int64_t flat = 0; flat < grid_.tile_count(); ++flat)
      EXPECT_EQ(archive.read_tile(grid_.tile_at(flat)), test::tile_of_archive(grid_, CodeType::kU16, flat));
    EXPECT_EQ(archive.read_member("shadow/seeds.bin"), std::vector<std::byte>(1000, std::byte{7}));
    for (const std::string& name : names)
      EXPECT_EQ(archive.read_member(name), name.ends_with("short") ? short_ : long_) << name;
    EXPECT_EQ(archive.loose_members().size(), 5 + names.size());
    for (const Finding& finding : verify_archive(path()).findings) EXPECT_NE(finding.id, finding::kStructure);
  }

  test::TemporaryFolder folder_;
  TileGrid grid_;
  std::vector<std::byte> long_;
  std::vector<std::byte> short_ = {std::byte{1}};
};

TEST_F(Attach, LeavesAnArchiveAsAWriterMakesIt) {
  const std::uint64_t size =
      attach_members(path(), {{folder_ / "long.txt", "docs/long.txt"}, {folder_ / "short", "short"}});
  EXPECT_EQ(size, test::read_bytes(path()).size());
  expect_whole({"docs/long.txt", "short"});
  const std::uint64_t again = attach_members(path(), {{folder_ / "short", "again/short"}});
  EXPECT_EQ(again, test::read_bytes(path()).size());
  expect_whole({"docs/long.txt", "short", "again/short"});
  EXPECT_THAT(folder_.names(), testing::ElementsAre("a.isohf", "long.txt", "short"));
}

TEST_F(Attach, RefusesNamesThatAreTakenOrBad) {
  const std::vector<std::byte> before = test::read_bytes(path());
  for (const char* name : {"isohf.json", "index.bin", "mimetype", "preview.png", "tiles/0/0.tile", "tiles/x",
                           "planes/1", "../x", "", "a/"}) {
    EXPECT_THROW(static_cast<void>(attach_members(path(), {{folder_ / "short", name}})), Error) << name;
  }
  EXPECT_THROW(static_cast<void>(attach_members(path(), {{folder_ / "short", "x"}, {folder_ / "long.txt", "x"}})),
               Error);
  EXPECT_THROW(static_cast<void>(attach_members(path(), {{folder_ / "nothing", "x"}})), Error);
  EXPECT_EQ(test::read_bytes(path()), before);
}

TEST_F(Attach, ZipMayAddMembersToo) {
  if (std::system("command -v zip >/dev/null 2>&1") != 0) GTEST_SKIP() << "zip is not installed";
  for (const char* options : {"-q", "-q -g"}) {
    test::make_archive(folder_ / "b.isohf", grid_, CodeType::kU16);
    std::filesystem::rename(folder_ / "b.isohf", path());
    ASSERT_EQ(std::system(fmt::format("cd {} && zip {} a.isohf long.txt short", folder_ / ".", options).c_str()), 0);
    expect_whole({"long.txt", "short"});
    // And once more by our own tool, which puts all in order.
    static_cast<void>(attach_members(path(), {{folder_ / "short", "own/short"}}));
    expect_whole({"long.txt", "short", "own/short"});
  }
}

TEST_F(Attach, PythonMayAddMembersToo) {
  const std::string program =
      fmt::format("python3 -c \"import zipfile; z = zipfile.ZipFile('{}', 'a'); z.write('{}', 'long.txt'); z.close()\"",
                  path(), folder_ / "long.txt");
  if (std::system("command -v python3 >/dev/null 2>&1") != 0) GTEST_SKIP() << "python3 is not installed";
  ASSERT_EQ(std::system(program.c_str()), 0);
  expect_whole({"long.txt"});
}

}  // namespace
}  // namespace isohf
