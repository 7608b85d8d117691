/// Rasters in ZIP and tar archives, and in .gz. Damaged ones are in mutation_test.cpp.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>

#include "formats/geotiff/tiff_bytes.h"
#include "formats/io/gzipped.h"
#include "formats/io/tar_archive.h"
#include "formats/io/zip_archive.h"
#include "formats/reader_failure.h"
#include "formats/readers.h"
#include "formats/registry.h"
#include "isohf/raster.h"
#include "support/rasters/raster.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Files = std::vector<std::pair<std::string, std::string>>;

const std::string kFloats("\0\0\x80\x3f\0\0\0\x40\0\0\x40\x40\0\0\x80\x40", 16);  // 1, 2, 3, 4
constexpr const char* kHeader = "ncols 2\nnrows 2\ncellsize 5\nxllcorner 10\nyllcorner 20\nbyteorder LSBFIRST\n";

std::string grid(const std::string& numbers = "1 2\n3 4\n") {
  return "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n" + numbers;
}

class Packed : public ::testing::Test {
 protected:
  /// Temporary files go where they can be counted.
  void SetUp() override { ::setenv("TMPDIR", temporary_.path().c_str(), 1); }
  void TearDown() override {
    ::unsetenv("TMPDIR");
    EXPECT_THAT(temporary_.names(), IsEmpty());
  }
  [[nodiscard]] std::string zip(const Files& files, bool deflated = true, bool zip64 = false) const {
    std::vector<ZipEntry> members;
    for (const auto& [file, contents] : files) {
      const auto bytes = std::as_bytes(std::span(contents));
      members.push_back({file, {bytes.begin(), bytes.end()}});
    }
    const std::vector<std::byte> all = zip_archive(members, deflated, zip64);
    return {reinterpret_cast<const char*>(all.data()), all.size()};
  }
  [[nodiscard]] std::unique_ptr<HeightSource> open(const std::string& name, const std::string& part = {}) const {
    OpenOptions options;
    options.part = part;
    return open_raster(folder_ / name, options);
  }
  [[nodiscard]] std::vector<double> values(const std::string& name, const std::string& part = {}) const {
    const auto source = open(name, part);
    EXPECT_EQ(source->info().path, folder_ / name);
    return values_of(*source);
  }
  [[nodiscard]] std::string failure(const std::string& name, const std::string& part = {}) const {
    return failure_of(folder_ / name, nullptr, [&] { read_corner(*open(name, part)); });
  }

  TemporaryFolder folder_;
  TemporaryFolder temporary_;
};

TEST_F(Packed, RemovesWhatKilledRunsLeft) {
  write_file(folder_ / "dem.zip", zip({{"dem.asc", grid()}}));
  // A child that is killed while it has the archive open.
  int opened[2] = {};
  ASSERT_EQ(::pipe(opened), 0);
  const ::pid_t child = ::fork();
  if (child == 0) {
    const auto source = open("dem.zip");
    (void)!::write(opened[1], "x", 1);
    ::pause();
  }
  char byte = 0;
  ASSERT_EQ(::read(opened[0], &byte, 1), 1);
  const std::vector<std::string> in_use = temporary_.names();
  ASSERT_EQ(in_use.size(), 1U);
  const auto age = [&] {
    const auto now = std::filesystem::file_time_type::clock::now();
    std::filesystem::last_write_time(temporary_ / in_use.front(), now - std::chrono::hours(1));
  };
  age();
  EXPECT_THAT(values("dem.zip"), ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(temporary_.names(), in_use) << "of a run that goes on";
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  age();
  EXPECT_THAT(values("dem.zip"), ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(temporary_.names(), IsEmpty());
  ::close(opened[0]);
  ::close(opened[1]);
}

TEST_F(Packed, WhatLiesBesideTheRasterInAnArchiveBelongsToIt) {
  const Files files = {{"readme.txt", "x"}, {"other/a.hdr", "x"}, {"d/e/a.flt", kFloats}, {"d/e/a.hdr", kHeader}};
  write_file(folder_ / "deflated.zip", zip(files));
  write_file(folder_ / "stored.zip", zip(files, false));
  write_file(folder_ / "large.zip", zip(files, true, true));
  write_file(folder_ / "a.tar", tar_archive(files));
  write_file(folder_ / "a.tar.gz", gzipped(tar_archive(files)));
  write_file(folder_ / "a.tgz", gzipped(tar_archive(files)));
  for (const char* name : {"deflated.zip", "stored.zip", "large.zip", "a.tar", "a.tar.gz", "a.tgz"}) {
    EXPECT_THAT(values(name), ElementsAre(1, 2, 3, 4)) << name;
    EXPECT_EQ(open(name)->info().format, "GridFloat");
    EXPECT_EQ(open(name)->info().georeference.origin_x, 12.5);
    EXPECT_TRUE(is_archive_of_rasters(folder_ / name));
  }
}

TEST_F(Packed, ArchivesWithoutARasterAreToldFromOthers) {
  const Files files = {{"readme.txt", "x"}, {"a.hdr", "x"}};
  write_file(folder_ / "a.zip", zip(files));
  write_file(folder_ / "a.tar", tar_archive(files));
  write_file(folder_ / "a.tgz", gzipped(tar_archive(files)));
  for (const char* name : {"a.zip", "a.tar", "a.tgz"}) EXPECT_FALSE(is_archive_of_rasters(folder_ / name)) << name;
  write_file(folder_ / "b.tgz", std::string("cut"));
  EXPECT_TRUE(is_archive_of_rasters(folder_ / "b.tgz"));  // whoever opens it says what is wrong
}

TEST_F(Packed, OfSeveralRastersPartTakesOne) {
  write_file(folder_ / "a.zip",
             zip({{"a.asc", grid()}, {"b/a.asc", grid("5 6\n7 8\n")}, {"browse.png", "no picture"}}));
  EXPECT_THAT(failure("a.zip"), HasSubstr("holds 2 rasters, a.asc, b/a.asc; `part` NAME takes one"));
  EXPECT_THAT(values("a.zip", "b/a.asc"), ElementsAre(5, 6, 7, 8));
  EXPECT_THAT(failure("a.zip", "c.asc"), HasSubstr("holds no \"c.asc\"; there are a.asc, b/a.asc, browse.png"));
}

TEST_F(Packed, TilesOfHgtAreOneRaster) {
  const std::string tile(2 * 2 * 2, '\1');
  write_file(folder_ / "a.zip", zip({{"N44E006.hgt", tile}, {"N44E007.hgt", tile}}));
  const auto source = open("a.zip");
  EXPECT_EQ(source->info().width, 3);
  EXPECT_THAT(source->info().warnings.back(), HasSubstr("2 tiles are inside"));
}

TEST_F(Packed, NoNameLeadsOutOfTheFolder) {
  for (const char* name : {"../../a.asc", "/tmp/a.asc", "a/../../../a.asc"}) {
    write_file(folder_ / "a.zip", zip({{name, grid()}}));
    EXPECT_THAT(values("a.zip"), ElementsAre(1, 2, 3, 4)) << name;
  }
  write_file(folder_ / "a.zip", zip({{"..", "x"}, {"x/..", "x"}, {".asc", grid()}, {"__MACOSX/._a.asc", "x"}}));
  EXPECT_THAT(failure("a.zip"), HasSubstr("holds no raster that isohf reads"));
  write_file(folder_ / "a.zip", zip({{std::string(300, 'n') + ".asc", grid()}}));
  EXPECT_NE(failure("a.zip"), "");
  EXPECT_THAT(folder_.names(), ElementsAre("a.zip"));
}

TEST_F(Packed, WhatCannotBeReadIsRefusedByTheArchivesName) {
  write_file(folder_ / "a.zip", zip({{"readme.txt", "x"}, {"b.zip", "x"}}));
  EXPECT_THAT(failure("a.zip"), HasSubstr("holds no raster that isohf reads; there are readme.txt, b.zip"));
  write_file(folder_ / "a.zip", zip({{"a.asc", grid("1 2\n3 x\n")}}));
  EXPECT_EQ(failure("a.zip").rfind(folder_ / "a.zip" + "/a.asc: line 7", 0), 0U) << failure("a.zip");
  write_file(folder_ / "a.zip", zip({{"a.asc", grid()}, {"a.asc", grid()}}));
  EXPECT_THAT(failure("a.zip"), HasSubstr("holds 2 rasters"));
  EXPECT_THAT(failure("a.zip", "a.asc"), HasSubstr("holds 2 rasters"));
  ::setenv("TMPDIR", "/nowhere", 1);
  EXPECT_THAT(failure("a.zip", "a.asc"), HasSubstr("TMPDIR"));
}

TEST_F(Packed, LongNamesAndSizesOfTarAreTaken) {
  const std::string deep = std::string(90, 'd') + '/' + std::string(90, 'e') + "/a.asc";
  const std::string end(512, '\0');
  write_file(folder_ / "gnu.tar", tar_member("././@LongLink", deep + '\0', 'L') + tar_member("short", grid()) + end);
  const std::string record = fmt::format("{} path={}\n", deep.size() + 10, deep);
  ASSERT_EQ(record.size(), deep.size() + 10);
  write_file(folder_ / "pax.tar", tar_member("pax", record, 'x') + tar_member("short", grid()) + end);
  for (const char* name : {"gnu.tar", "pax.tar"}) {
    EXPECT_THAT(values(name), ElementsAre(1, 2, 3, 4)) << name;
    EXPECT_THAT(values(name, deep), ElementsAre(1, 2, 3, 4)) << name;
  }
}

TEST_F(Packed, FilesWithHolesOfATarAreRefused) {
  const std::string end(512, '\0');
  write_file(folder_ / "gnu.tar", tar_member("a.asc", grid(), 'S') + end);
  write_file(folder_ / "pax.tar",
             tar_member("pax", "22 GNU.sparse.major=1\n", 'x') + tar_member("a.asc", grid()) + end);
  for (const char* name : {"gnu.tar", "pax.tar"}) {
    EXPECT_THAT(failure(name), HasSubstr("a.asc is stored with holes")) << name;
  }
}

TEST_F(Packed, TiffsAndHeadersAreReadInAGzip) {
  TiffBytes tiff(false);
  tiff.image(8, 6, 16, 2, 6);
  tiff.block(std::string(96, '\1'));
  write_file(folder_ / "a.tif.gz", gzipped(tiff.build()));
  EXPECT_EQ(values("a.tif.gz").size(), 48U);
  write_file(folder_ / "a.flt.gz", gzipped(kFloats));
  write_file(folder_ / "a.hdr", kHeader);
  EXPECT_THAT(values("a.flt.gz"), ElementsAre(1, 2, 3, 4));
}

}  // namespace
}  // namespace isohf::test
