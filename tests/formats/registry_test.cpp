#include "formats/registry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>

#include "formats/reader_failure.h"
#include "isohf/error.h"
#include "isohf/picture.h"
#include "isohf/raster.h"
#include "support/rasters/raster.h"
#include "support/rasters/samples.h"
#include "support/real_files.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;

Error refusal(const std::string& path) {
  return error_of([&] { (void)open_raster(path, {}); });
}

/// Whether this process has loaded one of these libraries.
bool is_loaded(std::initializer_list<const char*> libraries) {
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    for (const char* library : libraries) {
      if (line.find(library) != std::string::npos) return true;
    }
  }
  return false;
}

TEST(OpenSource, NamesWhatIsWrongWithAPath) {
  const TemporaryFolder folder;
  const std::string missing = folder / "missing.exr";
  EXPECT_EQ(refusal(missing).code(), ErrorCode::kIo);
  EXPECT_EQ(refusal(missing).what(), missing + ": no such file");

  EXPECT_EQ(refusal(folder / ".").code(), ErrorCode::kIo);
  EXPECT_THAT(refusal(folder / ".").what(), HasSubstr("is a folder"));

  const std::string empty = folder / "empty.tif";
  write_file(empty, "");
  EXPECT_EQ(refusal(empty).code(), ErrorCode::kCorrupt);
  EXPECT_EQ(refusal(empty).what(), empty + ": is empty (0 bytes)");

  const std::string fifo = folder / "fifo.exr";
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  EXPECT_EQ(refusal(fifo).code(), ErrorCode::kIo);
}

/// Part of the samples would be old and part new, zeros or not there yet.
TEST(OpenSource, NoticesAFileThatChangesWhileItIsRead) {
  namespace fs = std::filesystem;
  const TemporaryFolder folder;
  const std::vector<std::byte> rows(40 * 30 * 2);
  for (const std::string name : {"a.tif", "a.png", "a.r16", "a.npy", "a.asc"}) {
    SCOPED_TRACE(name);
    const std::string path = folder / name;
    write_raster(path, raster_spec(40, 30, SampleType::kUint16), rows);
    const std::string whole = read_file(path);
    const auto source = open_raster(path, {});
    const Window window = {0, 0, source->info().width, 1};
    (void)read_window(*source, window);
    const auto expect_refused = [&] {
      EXPECT_THAT(error_of([&] { (void)read_window(*source, window); }).what(),
                  HasSubstr(path + ": was changed or replaced while it was read"));
    };
    {  // in place, the same size
      std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
      file.write(whole.data(), static_cast<std::streamsize>(whole.size()));
    }
    fs::last_write_time(path, fs::last_write_time(path) + std::chrono::seconds(5));
    expect_refused();
    const auto again = open_raster(path, {});
    (void)read_window(*again, window);
    fs::copy_file(path, folder / "other");
    fs::last_write_time(folder / "other", fs::last_write_time(path));
    fs::rename(folder / "other", path);  // the same size and time
    EXPECT_THAT(error_of([&] { (void)read_window(*again, window); }).what(), HasSubstr("changed or replaced"));
  }
}

TEST(OpenSource, RefusesNumbersThatNoGroundHas) {
  const TemporaryFolder folder;
  const std::string path = folder / "a.asc";
  const auto grid = [&](const std::string& corner, const std::string& cell, const std::string& height) {
    write_file(path, "ncols 3\nnrows 2\nxllcorner " + corner + "\nyllcorner 0\ncellsize " + cell + "\n1 2 3\n4 5 " +
                         height + "\n");
  };
  grid("0", "1e-153", "6");
  EXPECT_EQ(refusal(path).what(), path + ": the spacing of columns: found 1e-153, must be from 1e-12 to 1000000000000");
  grid("1e300", "1", "6");
  EXPECT_THAT(refusal(path).what(), HasSubstr(path + ": the first sample's x: found 1e+300, must be from"));
  grid("0", "1", "3e38");
  const auto source = open_raster(path, {});
  EXPECT_EQ(error_of([&] {
              (void)read_window(*source, {0, 0, 3, 2});
            }).what(),
            path +
                ": found an elevation of 3e+38, must be 1e+30 at most either way; `void_values` 3e+38 takes it as "
                "nodata");
  OpenOptions options;
  options.void_values = {3e38};
  EXPECT_NO_THROW((void)read_window(*open_raster(path, options), {0, 0, 3, 2}));
}

TEST(OpenSource, SaysThatTextIsNoRaster) {
  const TemporaryFolder folder;
  for (const char* name : {"notes.txt", "no_extension", "wrong.exr"}) {
    const std::string path = folder / name;
    write_file(path, "this is no raster");
    const Error error = refusal(path);
    EXPECT_EQ(error.code(), ErrorCode::kUnsupported);
    EXPECT_THAT(error.what(), HasSubstr(": unknown format: this is text; isohf formats lists what is read"));
    // This program has no module beside it.
    EXPECT_THAT(error.what(), HasSubstr("need the OpenImageIO module isohf_oiio.so"));
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
  }
}

TEST(OpenSource, NamesForeignFilesAndTheCommandThatHelps) {
  const TemporaryFolder folder;
  const std::string path = folder / "file.tif";
  const std::pair<std::string, std::string> cases[] = {
      {"%PDF-1.4\n", "this is a PDF document; isohf formats lists what is read"},
      {"LASF\x01\x02", "this is a LAS point cloud; PDAL grids it: pdal translate " + path},
      {"ASTM-E57", "this is an E57 point cloud; PDAL grids it: pdal translate " + path},
      {"\x0e\x03\x13\x01", "this is an HDF4 file; gdal_translate " + path},
      {"NITF02.10", "this is a NITF raster; gdal_translate " + path},
      {"SQLite format 3", "this is an SQLite database, as a GeoPackage is one; gdal_translate " + path},
      {std::string("\0\0\x27\x0a", 4), "this is a shapefile, which holds points or outlines; gdal_grid makes"},
      {"BZh", "this is a bzip2 file; a name that ends in .bz2 has it unpacked"},
      {"Rar!", "this is a RAR file; unpack it first"},
      {std::string("\xff\xfeX\0Y\0", 6), "this is text in UTF-16; iconv -f UTF-16 -t UTF-8 " + path},
      {std::string("PK\x03\x04") + std::string(26, '\0') + "isohf.json", "an isohf archive; isohf export " + path},
      {"GRIB\x01\x02", "this is a GRIB file; gdal_translate " + path + " OUT.tif makes a GeoTIFF of it"},
      {std::string("\x01\x02\x03", 3), "unknown format; isohf formats lists what is read"}};
  for (const auto& [content, message] : cases) {
    write_file(path, content);
    const Error error = refusal(path);
    EXPECT_EQ(error.code(), ErrorCode::kUnsupported);
    EXPECT_THAT(error.what(), HasSubstr(message));
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    EXPECT_LT(std::string(error.what()).size(), path.size() * 2 + 400);
  }
}

/// Rasters of other programs: the plug-in is not loaded for them.
TEST(OpenSource, NamesTheCommandThatConvertsARasterOfAnotherProgram) {
  set_module_folder(ISOHF_BIN_DIR);
  struct Row {
    std::string name;  ///< of the file
    std::string bytes;
    std::string says;  ///< after the path, up to the command
    std::string command = "gdal_translate";
    std::string beside = {};     ///< another file that is there
    std::string converted = {};  ///< the file that the command names, if another
  };
  const Row rows[] = {
      {"grass.asc", "north: 200\nsouth: 180\n", "a GRASS ASCII raster"},
      {"a.dem", std::string(144, ' ') + "     1     1     1    12", "a USGS DEM"},
      {"a.sdat", "12", "a SAGA grid"},
      {"a.sgrd", "NAME = a\n", "a SAGA grid", "gdal_translate", "", "a.sdat"},
      {"a.rst", "12", "an IDRISI raster", "gdal_translate", "a.rdc"},
      {"a.rdc", "columns : 1\n", "an IDRISI raster", "gdal_translate", "", "a.rst"},
      {"a.dem", "12", "a ROI_PAC raster", "gdal_translate", "a.dem.rsc"},
      {"a.dem.rsc", "WIDTH 1\n", "a ROI_PAC raster", "gdal_translate", "", "a.dem"},
      {"a.vic", "LBLSIZE=256 ", "a VICAR raster"},
      {"a.ter", "TERRAGENTERRAIN SIZE", "a Terragen terrain"},
      {"a.pgm", "P5 1 1 255 1", "a portable graymap"},
      {"text.grd", "DSAA\n4 3\n", "a Surfer grid"},
      {"six.grd", "DSBB", "a Surfer grid"},
      {"seven.grd", "DSRB", "a Surfer grid"},
      {"a.jp2", std::string("\0\0\0\x0CjP  \r\n\x87\n", 12), "a JPEG 2000 picture"},
      {"a.j2k", "\xFF\x4F\xFF\x51", "a JPEG 2000 picture"},
      {"a.mbtiles", "SQLite format 3", "an MBTiles file", "pmtiles convert"},
      {"tiles.db", "SQLite format 3" + std::string(53, '\0') + "MPBX", "an MBTiles file", "pmtiles convert"},
      {"a.img", "EHFA_HEADER_TAG", "an ERDAS Imagine raster"},
      {"a.map", "RUU CROSS SYSTEM MAP FORMAT", "a PCRaster map"},
      {"a.ers", "DatasetHeader Begin\n", "an ER Mapper raster"},
      {"w001001.adf", std::string("\0\0\x27\x0a", 4), "an Arc/Info grid"},
      {"a.bag", "\x89HDF\r\n\x1a\n", "a BAG bathymetry grid"},
      {"a.gpkg", "SQLite format 3", "a GeoPackage"},
      {"a.npz", "PK\x03\x04", "a NumPy archive", "np.save(\"a.npy\", np.load(\""},
  };
  for (const Row& row : rows) {
    SCOPED_TRACE(row.name);
    const TemporaryFolder folder;
    const std::string path = folder / row.name;
    write_file(path, row.bytes);
    if (!row.beside.empty()) write_file(folder / row.beside, "");
    EXPECT_EQ(native_format_of(path, {}), nullptr);
    const Error error = refusal(path);
    EXPECT_EQ(error.code(), ErrorCode::kUnsupported);
    const std::string says = path + ": this is " + row.says + "; " + row.command +
                             (row.command.ends_with('"') ? "" : " ") +
                             (folder / (row.converted.empty() ? row.name : row.converted));
    EXPECT_THAT(error.what(), HasSubstr(says));
    EXPECT_THAT(error_of([&] { (void)open_photo(path); }).what(), HasSubstr(says));
  }
  EXPECT_FALSE(is_loaded({"libgdal", "OpenImageIO", "isohf_oiio"}));
  set_module_folder("");
}

TEST(OpenSource, GoesByContentNotByName) {
  if (real_files().empty()) GTEST_SKIP() << kNoRealFiles;
  const TemporaryFolder folder;
  for (const auto& [name, format] : {std::pair{"t3d_peak1.exr", "OpenEXR"},
                                     {"earth_0_0_0.png", "PNG"},
                                     {"float_nan.tif", "GeoTIFF"},
                                     {"N44E006.hgt", "SRTM HGT"}}) {
    EXPECT_EQ(open_raster(real_data() / name, {})->info().format, format);
    const bool has_signature = std::string(format) != "SRTM HGT";
    const std::string renamed = folder / (has_signature ? "N44E006.hgt" : "UPPER_N44E006.HGT");
    std::filesystem::copy_file(real_data() / name, renamed, std::filesystem::copy_options::overwrite_existing);
    EXPECT_EQ(open_raster(renamed, {})->info().format, format);
  }
}

/// The native readers must not pull in the libraries of others: they cost start-up time.
TEST(OpenSource, LoadsNoOtherImageLibraryForNativeFormats) {
  for (const char* name : {"ridges_161x161_float.exr", "peaks_256x256_uint16.png", "coast_512x384_int16.tif"}) {
    const auto source = open_raster(std::string(ISOHF_SOURCE_DIR "/testdata/") + name, {});
    (void)read_window(*source, {0, 0, source->info().width, 2});
  }
  EXPECT_FALSE(is_loaded({"libgdal", "OpenImageIO", "isohf_oiio"}));
}

TEST(Formats, AreListedWithTheLibraryThatReadsThem) {
  std::set<std::string> extensions;
  for (const Format& format : native_formats()) {
    EXPECT_FALSE(format.extensions.empty()) << format.name;
    EXPECT_FALSE(library_of(format).empty()) << format.name;
    for (const std::string extension : format.extensions) {
      const bool first = extensions.insert(extension).second;
      // Of these the content tells which format it is.
      EXPECT_TRUE(first || extension == ".img" || extension == ".lbl" || extension == ".dem" || extension == ".hdr")
          << extension << " is listed twice";
    }
  }
  const auto library = [](const std::vector<Format>& formats, const std::string& name) {
    const auto found = std::find_if(formats.begin(), formats.end(), [&](const Format& f) { return f.name == name; });
    return found == formats.end() ? std::string("no such format") : library_of(*found);
  };
  EXPECT_THAT(library(native_formats(), "TIFF"), MatchesRegex("libtiff [0-9]+\\.[0-9]+\\.[0-9]+"));
  EXPECT_THAT(library(native_formats(), "PNG"), MatchesRegex("libpng [0-9]+\\.[0-9]+\\.[0-9]+"));
  EXPECT_THAT(library(writable_formats(), "OpenEXR"), MatchesRegex("OpenEXR [0-9]+\\.[0-9]+\\.[0-9]+"));
  EXPECT_EQ(library(native_formats(), "SRTM HGT"), "isohf");
}

TEST(Formats, ListEveryExtensionThatIsWritten) {
  for (const Format& format : writable_formats()) {
    EXPECT_NE(format.note, "") << format.name;
    for (const std::string extension : format.extensions) {
      EXPECT_THAT(writable_extensions(), ::testing::Contains(extension));
    }
  }
}

TEST(Formats, TheOneOfAFileIsFoundWithoutOpeningIt) {
  const TemporaryFolder folder;
  const std::string path = folder / "a.raw";
  write_file(path, "0123456789abcdef");
  ASSERT_NE(native_format_of(path, {}), nullptr);
  EXPECT_EQ(std::string(native_format_of(path, {})->name), "raw samples");
  const std::string tiff = folder / "b.raw";  // the content decides
  write_file(tiff, std::string_view("II*\0\10\0\0\0", 8));
  EXPECT_EQ(std::string(native_format_of(tiff, {})->name), "TIFF");
  OpenOptions raw;
  raw.raw = RawLayout{4, 4, SampleType::kUint8, false};
  EXPECT_EQ(std::string(native_format_of(tiff, raw)->name), "raw samples");
  const std::string other = folder / "c.txt";
  write_file(other, "what is this");
  EXPECT_EQ(native_format_of(other, {}), nullptr);
}

}  // namespace
}  // namespace isohf::test
