#include "formats/registry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "formats/raster_reference.h"
#include "isohf/base/error.h"

namespace isohf::testing {
namespace {

using ::testing::HasSubstr;

Error refusal(const std::string& path) {
  return error_of([&] { (void)open_source(path, {}); });
}

TEST(OpenSource, NamesWhatIsWrongWithAPath) {
  const ScratchFolder folder;
  const std::string missing = folder / "missing.exr";
  EXPECT_EQ(refusal(missing).code(), ErrorCode::kIo);
  EXPECT_EQ(refusal(missing).what(), missing + ": no such file");

  EXPECT_EQ(refusal(folder / ".").code(), ErrorCode::kIo);
  EXPECT_THAT(refusal(folder / ".").what(), HasSubstr("is a folder"));

  const std::string empty = folder / "empty.tif";
  write_bytes(empty, "", 0);
  EXPECT_EQ(refusal(empty).code(), ErrorCode::kCorrupt);
  EXPECT_EQ(refusal(empty).what(), empty + ": is empty (0 bytes)");

  const std::string fifo = folder / "fifo.exr";
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  EXPECT_EQ(refusal(fifo).code(), ErrorCode::kIo);
}

TEST(OpenSource, ReportsAFileThatMayNotBeRead) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may read everything";
  const ScratchFolder folder;
  const std::string path = folder / "secret.exr";
  write_bytes(path, "abcdefgh", 8);
  ASSERT_EQ(::chmod(path.c_str(), 0), 0);
  EXPECT_EQ(refusal(path).code(), ErrorCode::kIo);
  EXPECT_THAT(refusal(path).what(), HasSubstr("cannot be opened: Permission denied"));
}

TEST(OpenSource, ListsWhatIsReadWhenTheFormatIsUnknown) {
  const ScratchFolder folder;
  for (const char* name : {"notes.txt", "no_extension", "wrong.exr"}) {
    const std::string path = folder / name;
    write_bytes(path, "this is no raster", 17);
    const Error error = refusal(path);
    EXPECT_EQ(error.code(), ErrorCode::kUnsupported);
    EXPECT_THAT(error.what(), HasSubstr("unknown format"));
    EXPECT_THAT(error.what(), HasSubstr("OpenEXR (.exr)"));
    // This program has no module beside it.
    EXPECT_THAT(error.what(), HasSubstr("need the OpenImageIO module isohf_oiio.so"));
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
  }
}

TEST(OpenSource, GoesByContentNotByName) {
  const auto data = shared_data();
  if (!data) GTEST_SKIP() << "no shared terrain beside this checkout";
  const ScratchFolder folder;
  for (const auto& [name, format] : {std::pair{"t3d_peak1.exr", "OpenEXR"},
                                     {"earth_0_0_0.png", "PNG"},
                                     {"float_nan.tif", "GeoTIFF"},
                                     {"N44E006.hgt", "SRTM HGT"}}) {
    EXPECT_EQ(open_source((*data / name).string(), {})->info().format, format);
    const bool has_signature = std::string(format) != "SRTM HGT";
    const std::string renamed = folder / (has_signature ? "N44E006.hgt" : "UPPER_N44E006.HGT");
    std::filesystem::copy_file(*data / name, renamed, std::filesystem::copy_options::overwrite_existing);
    EXPECT_EQ(open_source(renamed, {})->info().format, format);
  }
}

/// The native readers must not pull in the libraries of others: they cost start-up time.
TEST(OpenSource, LoadsNoOtherImageLibraryForNativeFormats) {
  const auto data = shared_data();
  if (!data) GTEST_SKIP() << "no shared terrain beside this checkout";
  for (const char* name : {"t3d_peak1.exr", "earth_0_0_0.png", "mt_fuji_90m.tif", "N44E006.hgt"}) {
    const auto source = open_source((*data / name).string(), {});
    (void)read_window(*source, {0, 0, source->info().width, 2});
  }
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    for (const char* library : {"libgdal", "OpenImageIO", "isohf_oiio"}) {
      EXPECT_EQ(line.find(library), std::string::npos) << line;
    }
  }
}

}  // namespace
}  // namespace isohf::testing
