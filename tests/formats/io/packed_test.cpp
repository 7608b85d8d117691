/// Rasters in archives, and in gzip, bzip2, xz and Zstandard. Damaged ones are in mutation_test.cpp too.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>

#include "formats/io/packed_bytes.h"
#include "formats/io/packed_files.h"
#include "formats/io/unpacked_folder.h"
#include "formats/mosaic/mosaic_source.h"
#include "formats/reader_failure.h"
#include "formats/readers.h"
#include "formats/registry.h"
#include "isohf/raster.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::StartsWith;

const std::string kFloats("\0\0\x80\x3f\0\0\0\x40\0\0\x40\x40\0\0\x80\x40", 16);  // 1, 2, 3, 4
constexpr const char* kHeader = "ncols 2\nnrows 2\ncellsize 5\nxllcorner 10\nyllcorner 20\nbyteorder LSBFIRST\n";

std::string grid(const std::string& numbers = "1 2\n3 4\n") {
  return "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n" + numbers;
}

/// A tar whose first header was changed.
std::string with_sum(std::string tar) {
  tar.replace(148, 8, std::string(8, ' '));
  unsigned sum = 0;
  for (const char c : tar.substr(0, 512)) sum += static_cast<unsigned char>(c);
  return tar.replace(148, 7, fmt::format("{:06o}", sum) + '\0');
}

class Packed : public ::testing::Test {
 protected:
  /// Temporary files go where they can be counted.
  void SetUp() override { ::setenv("TMPDIR", temporary_.path().c_str(), 1); }
  void TearDown() override {
    ::unsetenv("TMPDIR");
    EXPECT_THAT(temporary_.names(), IsEmpty());
  }
  void write(const std::string& name, const std::string& bytes) const { write_file(folder_ / name, bytes); }
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
  /// "CODE what is said"; empty where it is read.
  [[nodiscard]] std::string failure(const std::string& name, const std::string& part = {}) const {
    ErrorCode code = ErrorCode::kCancelled;
    const std::string text = failure_of(folder_ / name, &code, [&] { read_corner(*open(name, part)); });
    return text.empty() ? text : fmt::format("{} {}", static_cast<int>(code), text.substr(folder_.path().size() + 1));
  }
  static std::string corrupt(const std::string& text) {
    return fmt::format("{} {}", static_cast<int>(ErrorCode::kCorrupt), text);
  }

  TemporaryFolder folder_;
  TemporaryFolder temporary_;
};

TEST_F(Packed, ArchivesOfEveryKindAreReadWithWhatLiesBesideTheRaster) {
  const std::vector<PackedEntry> files = {{"readme.txt", "x"},
                                          {"other/a.hdr", "x"},
                                          {"d/e/a.tif.txt", "x"},
                                          {"d/e/a.flt", kFloats},
                                          {"d/e/a.hdr", kHeader}};
  const std::tuple<const char*, const char*, const char*, const char*> kinds[] = {
      {"deflated.zip", "zip", nullptr, nullptr},
      {"stored.zip", "zip", nullptr, "zip:compression=store"},
      {"large.zip", "zip", nullptr, "zip:zip64"},
      {"a.7z", "7zip", nullptr, nullptr},
      {"a.tar", "pax", nullptr, nullptr},
      {"b.tar", "gnutar", nullptr, nullptr},
      {"a.tar.gz", "ustar", "gzip", nullptr},
      {"a.tgz", "ustar", "gzip", nullptr},
      {"a.tar.bz2", "ustar", "bzip2", nullptr},
      {"a.txz", "ustar", "xz", nullptr},
      {"a.tar.zst", "ustar", "zstd", nullptr},
      {"zip.of.any.name", "zip", nullptr, nullptr},
      {"tar_of_any_name", "ustar", nullptr, nullptr},
  };
  for (const auto& [name, format, filter, options] : kinds) {
    SCOPED_TRACE(name);
    write(name, packed(files, format, filter, options));
    EXPECT_THAT(values(name), ElementsAre(1, 2, 3, 4));
    EXPECT_EQ(open(name)->info().format, "GridFloat");
    EXPECT_EQ(open(name)->info().georeference.origin_x, 12.5);
    EXPECT_TRUE(is_archive_of_rasters(folder_ / name));
    EXPECT_THAT(values(std::string(name) + "/d/e/a.flt"), ElementsAre(1, 2, 3, 4));
  }
}

TEST_F(Packed, OneFileIsReadWithItsNeighbours) {
  write("a.hdr", kHeader);
  for (const auto& [ending, filter] : {std::pair(".gz", "gzip"), {".bz2", "bzip2"}, {".xz", "xz"}, {".zst", "zstd"}}) {
    SCOPED_TRACE(ending);
    write(std::string("a.flt") + ending, packed({{"", kFloats}}, "raw", filter));
    EXPECT_THAT(values(std::string("a.flt") + ending), ElementsAre(1, 2, 3, 4));
    write(std::string("a.asc") + ending, grid());  // a browser has unpacked it
    EXPECT_THAT(values(std::string("a.asc") + ending), ElementsAre(1, 2, 3, 4));
  }
  const std::string tile(2 * 2 * 2, '\1');
  write("N44E006.hgt.gz", gzipped(tile));
  EXPECT_EQ(open("N44E006.hgt.gz")->info().georeference.origin_y, 45.0);
  OpenOptions raw;
  raw.raw = RawLayout{2, 2, SampleType::kUint16, false};
  EXPECT_THAT(values_of(*open_raster(folder_ / "N44E006.hgt.gz", raw)), ElementsAre(257, 257, 257, 257));
  // As bgzip writes it; padding follows.
  const std::string text = grid();
  write("b.asc.gz", gzipped(text.substr(0, 9)) + gzipped("") + gzipped(text.substr(9)) + std::string(600, '\0'));
  EXPECT_THAT(values("b.asc.gz"), ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(failure("b.asc.gz", "b.asc"), HasSubstr("is one packed file; `part` is for archives"));
  write("c.txt.gz", gzipped("nothing that is known"));
  EXPECT_THAT(failure("c.txt.gz"), HasSubstr("unknown format: this is text"));
}

TEST_F(Packed, OfSeveralRastersPartOrThePathTakesOne) {
  write("a.zip", packed({{"a.asc", grid()}, {"b/a.asc", grid("5 6\n7 8\n")}, {"browse.png", "no picture"}}, "zip"));
  EXPECT_THAT(failure("a.zip"), HasSubstr("holds 2 rasters, a.asc, b/a.asc; `part` NAME takes one"));
  EXPECT_THAT(values("a.zip", "b/a.asc"), ElementsAre(5, 6, 7, 8));
  EXPECT_THAT(values("a.zip/b/a.asc"), ElementsAre(5, 6, 7, 8));
  EXPECT_THAT(failure("a.zip", "c.asc"), HasSubstr("holds no \"c.asc\"; there are a.asc, b/a.asc, browse.png"));
  EXPECT_THAT(error_of([&] { (void)open("a.zip/c.asc"); }).what(), HasSubstr("a.zip: holds no \"c.asc\""));
  // A tile of SRTM hides nothing; several are one raster.
  const std::string tile(2 * 2 * 2, '\1');
  write("b.zip", packed({{"N44E006.hgt", tile}, {"x.asc", grid()}}, "zip"));
  EXPECT_THAT(failure("b.zip"), HasSubstr("holds 2 rasters, N44E006.hgt, x.asc"));
  EXPECT_THAT(values("b.zip", "x.asc"), ElementsAre(1, 2, 3, 4));
  write("c.zip", packed({{"N44E006.hgt", tile}, {"N44E007.hgt", tile}}, "zip"));
  const auto tiles = open("c.zip");
  EXPECT_EQ(tiles->info().width, 3);
  EXPECT_THAT(tiles->info().warnings.back(), HasSubstr("2 tiles are inside"));
  write("d.zip", packed({{"h\xC3\xB6he.asc", grid()}, {"x.asc", grid()}}, "zip"));
  EXPECT_THAT(values("d.zip/h\xC3\xB6he.asc"), ElementsAre(1, 2, 3, 4));
}

TEST(PackedFiles, NamesOfGdalArePathsIntoArchives) {
  EXPECT_EQ(without_vsi("/vsizip/d/tiles.zip/e/a.tif"), "d/tiles.zip/e/a.tif");
  EXPECT_EQ(without_vsi("/vsizip//d/tiles.zip/a.tif"), "/d/tiles.zip/a.tif");
  EXPECT_EQ(without_vsi("/vsitar/{d/tiles.any}/a.tif"), "d/tiles.any/a.tif");
  EXPECT_EQ(without_vsi("/vsigzip/a.tif.gz"), "a.tif.gz");
  EXPECT_EQ(without_vsi("/vsicurl/a.tif"), "/vsicurl/a.tif");
}

TEST_F(Packed, NoNameAndNoLinkLeadsOutOfTheFolder) {
  for (const char* name : {"../../a.asc", "/tmp/a.asc", "a/../../../a.asc"}) {
    write("a.zip", packed({{name, grid()}}, "zip"));
    EXPECT_THAT(values("a.zip"), ElementsAre(1, 2, 3, 4)) << name;
  }
  write("secret.asc", grid());
  write("a.tar", packed({{"..", "x"},
                         {"x/..", "x"},
                         {".asc", grid()},
                         {"__MACOSX/._a.asc", "x"},
                         {"link.asc", "", AE_IFLNK, folder_ / "secret.asc"},
                         {"hard.asc", "", AE_IFREG, "", "link.asc"},
                         {"fifo.asc", "", AE_IFIFO},
                         {"device.asc", "", AE_IFBLK}},
                        "pax"));
  EXPECT_THAT(failure("a.tar"), HasSubstr("holds no raster that isohf reads; there are .., x/.., .asc"));
  EXPECT_THAT(failure("a.tar", "link.asc"), HasSubstr("holds no \"link.asc\""));
  write("long.zip", packed({{std::string(300, 'n') + ".asc", grid()}}, "zip"));
  EXPECT_THAT(failure("long.zip"), HasSubstr("long.zip"));
  EXPECT_THAT(folder_.names(), ElementsAre("a.tar", "a.zip", "long.zip", "secret.asc"));
}

TEST_F(Packed, WhatCannotBeReadIsRefusedByTheArchivesName) {
  const std::string end(1024, '\0');
  std::string damaged =
      packed({{"a.asc", grid(std::string(900, '5') + " 2\n3 4\n")}}, "zip", nullptr, "zip:compression=store");
  damaged[200] = '6';
  std::string bad_header = packed({{"a.asc", grid()}}, "ustar");
  bad_header[3] = 'x';
  const std::string zip = packed({{"a.asc", grid()}}, "zip");
  // One that says it has 2 GiB, and one that has a little more than 1 GiB.
  const std::string claim = with_sum(packed({{"a.asc", grid()}}, "ustar").replace(124, 11, "20000000000"));
  const std::string part = packed({{"", std::string(std::size_t{1} << 26U, '1')}}, "raw", "zstd");
  std::string bomb;
  for (int i = 0; i < 17; ++i) bomb += part;
  const std::tuple<const char*, std::string, ErrorCode, const char*> kCases[] = {
      {"none.zip", packed({{"readme.txt", "x"}, {"b.zip", "x"}, {"c.tif.gz", "x"}}, "zip"), ErrorCode::kUnsupported,
       "holds no raster that isohf reads; there are readme.txt, b.zip, c.tif.gz"},
      {"empty.zip", packed({}, "zip"), ErrorCode::kUnsupported, "there are no files"},
      {"empty.tar.gz", gzipped(end), ErrorCode::kUnsupported, "there are no files"},
      {"nothing.gz", gzipped(""), ErrorCode::kUnsupported, "there are no files"},
      {"wrong.zip", packed({{"a.asc", grid("1 2\n3 x\n")}}, "zip"), ErrorCode::kCorrupt, "wrong.zip/a.asc: line 7"},
      {"twice.zip", packed({{"a.asc", grid()}, {"a.asc", grid()}}, "zip"), ErrorCode::kInvalidArgument,
       "holds 2 rasters, a.asc, a.asc"},
      {"twins.zip", packed({{"a.asc", grid()}, {"a.prj", ""}, {"a.prj", ""}}, "zip"), ErrorCode::kUnsupported,
       "holds two files called a.prj"},
      {"locked.zip", packed({{"a.asc", grid()}}, "zip", nullptr, "zip:encryption=aes256"), ErrorCode::kUnsupported,
       "is encrypted"},
      {"damaged.zip", damaged, ErrorCode::kCorrupt, "is damaged or cut off: ZIP bad CRC"},
      {"cut.zip", zip.substr(0, zip.size() - 30), ErrorCode::kCorrupt, "is damaged or cut off"},
      {"damaged.tar", bad_header, ErrorCode::kCorrupt, "is damaged or cut off"},
      {"not.tar.gz", gzipped("text"), ErrorCode::kCorrupt, "is not a whole archive"},
      {"numpy.npz", packed({{"z.npy", "x"}}, "zip"), ErrorCode::kUnsupported, "this is a NumPy archive; np.save("},
      {"claim.tar", claim, ErrorCode::kUnsupported, "unpacks to more than 1073741824 bytes"},
      {"bomb.asc.zst", bomb, ErrorCode::kUnsupported, "unpacks to more than 1073741824 bytes"},
  };
  for (const auto& [name, bytes, code, text] : kCases) {
    SCOPED_TRACE(name);
    write(name, bytes);
    EXPECT_THAT(failure(name), AllOf(StartsWith(fmt::format("{} {}", static_cast<int>(code), name)), HasSubstr(text)));
  }
  EXPECT_THAT(error_of([&] { UnpackedFolder("a.zip").require_room(UINT64_MAX / 2); }).what(),
              AllOf(HasSubstr("a.zip: takes 9223372036854775807 bytes more to unpack"), HasSubstr("has room for")));
  ::setenv("TMPDIR", "/nowhere", 1);
  EXPECT_THAT(failure("twice.zip", "a.asc"), HasSubstr("TMPDIR"));
}

/// libarchive alone verifies no checksum of gzip, and takes a damaged member for the end.
TEST_F(Packed, EveryTruncationAndEveryFlippedByteOfAGzipIsFound) {
  std::string text = grid("");
  for (int i = 0; i < 400; ++i) text += std::to_string(i * i % 97) + ' ';
  for (const auto& [name, whole] : {std::pair{"a.asc.gz", gzipped(grid("1 2\n3")) + gzipped(" 4\n")},
                                    {"a.tgz", packed({{"a.asc", grid()}}, "ustar", "gzip")}}) {
    SCOPED_TRACE(name);
    write(name, whole);
    ASSERT_EQ(failure(name), "");
    for (std::size_t length = 3; length < whole.size(); ++length) {
      write(name, whole.substr(0, length));
      if (const std::string what = failure(name); !what.empty()) {
        EXPECT_THAT(what, StartsWith(corrupt(name))) << length;
      } else {
        EXPECT_EQ(values(name), (std::vector<double>{1, 2, 3, 4})) << length;
      }
    }
    for (std::size_t at = 10; at < whole.size(); ++at) {  // behind the header, whose time and system mean nothing
      std::string damaged = whole;
      damaged[at] = static_cast<char>(damaged[at] ^ 0x40);
      write(name, damaged);
      if (const std::string what = failure(name); !what.empty()) {
        EXPECT_THAT(what, StartsWith(corrupt(name))) << at;
      } else {
        EXPECT_EQ(values(name), (std::vector<double>{1, 2, 3, 4})) << at;
      }
    }
    write(name, whole + "garbage");
    EXPECT_THAT(failure(name), HasSubstr("gzip data: incorrect header check"));
  }
}

TEST_F(Packed, LongNamesAndHolesOfTarAreTaken) {
  const std::string deep = std::string(90, 'd') + '/' + std::string(90, 'e') + "/a.asc";
  for (const char* format : {"gnutar", "pax"}) {
    write("a.tar", packed({{deep, grid()}}, format));
    EXPECT_THAT(values("a.tar", deep), ElementsAre(1, 2, 3, 4)) << format;
  }
  write("a.tar", packed({{"N44E006.hgt", std::string(2, '\1'), AE_IFREG, "", "", 1201 * 1201 * 2 - 2}}, "pax"));
  EXPECT_EQ(values("a.tar").back(), 257.0);
  EXPECT_LT(std::filesystem::file_size(folder_ / "a.tar"), 20000U);
  // A size that is no number, of a file before the raster.
  std::string bad = packed({{"x.txt", std::string(1000, 'x')}, {"a.asc", grid()}}, "ustar");
  const std::string record = "12 size=xyz\n";
  std::string block = packed({{"pax", record}}, "ustar").substr(0, 1024);
  block[156] = 'x';
  bad.insert(0, with_sum(block));
  write("bad.tar", bad);
  EXPECT_THAT(failure("bad.tar"), StartsWith(corrupt("bad.tar")));
}

TEST_F(Packed, WhatIsUnpackedIsSharedWhileSomebodyKeepsIt) {
  write("a.zip", packed({{"a.asc", grid()}}, "zip"));
  auto first = open("a.zip");
  const auto kept = keep_unpacked(folder_ / "a.zip", {});
  ASSERT_NE(kept, nullptr);
  first.reset();
  EXPECT_THAT(temporary_.names(), SizeIs(1));
  EXPECT_THAT(values("a.zip"), ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(temporary_.names(), SizeIs(1));
  write("a.zip", packed({{"a.asc", grid("9 2\n3 4\n")}}, "zip"));
  EXPECT_THAT(values("a.zip"), ElementsAre(9, 2, 3, 4));
  write("b.asc", grid());
  EXPECT_EQ(keep_unpacked(folder_ / "b.asc", {}), nullptr);
}

TEST_F(Packed, AMosaicUnpacksItsFilesOnce) {
  constexpr std::size_t kSide = 401;
  std::vector<std::string> plain;
  std::vector<std::string> packed_paths;
  for (const char* name : {"N45E000.hgt", "N45E001.hgt", "N46E000.hgt"}) {
    std::string samples(kSide * kSide * 2, '\0');
    for (std::size_t i = 1; i < samples.size(); i += 2) samples[i] = static_cast<char>(i % 97 + plain.size());
    write(name, samples);
    write(name + std::string(".gz"), gzipped(samples));
    plain.push_back(folder_ / name);
    packed_paths.push_back(plain.back() + ".gz");
  }
  const auto unpacked = [&] {
    std::set<std::string> folders;
    for (const std::string& process : temporary_.names()) {
      for (const auto& each : std::filesystem::directory_iterator(temporary_ / process)) folders.insert(each.path());
    }
    return folders;
  };
  MosaicSource mosaic("mosaic", plan_mosaic(packed_paths, {}), {}, OverlapRule::kLast);
  MosaicSource expected("mosaic", plan_mosaic(plain, {}), {}, OverlapRule::kLast);
  const auto before = unpacked();
  EXPECT_THAT(before, SizeIs(packed_paths.size()));
  EXPECT_EQ(mosaic.buffer_bytes(), expected.buffer_bytes());
  EXPECT_TRUE(read_whole(mosaic) == read_whole(expected));
  EXPECT_EQ(unpacked(), before);
}

TEST_F(Packed, OnlyFoldersOfThisHostsKilledProcessesAreRemoved) {
  write("dem.zip", packed({{"dem.asc", grid()}}, "zip"));
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
  ASSERT_THAT(temporary_.names(), SizeIs(1));
  const std::string name = temporary_.names().front();
  EXPECT_THAT(values("dem.zip"), ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(temporary_.names(), ElementsAre(name)) << "of a process that runs";
  // The same on another node: its processes are not seen here.
  const std::string elsewhere = "isohf-unpacked_another" + name.substr(name.find('_'));
  std::filesystem::create_directory(temporary_ / elsewhere);
  std::filesystem::create_directory(temporary_ / "isohf-unpacked");
  // Its number is another process's by now.
  std::string older = name;
  const std::string process = '_' + std::to_string(child) + '_';
  older.replace(name.find(process), process.size(), process + '1');
  std::filesystem::create_directory(temporary_ / older);
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  EXPECT_THAT(values("dem.zip"), ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(temporary_.names(), ElementsAre("isohf-unpacked", elsewhere));
  std::filesystem::remove(temporary_ / elsewhere);
  std::filesystem::remove(temporary_ / "isohf-unpacked");
  ::close(opened[0]);
  ::close(opened[1]);
}

}  // namespace
}  // namespace isohf::test
