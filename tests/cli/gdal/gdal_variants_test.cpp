/// One raster in the ways in which GDAL stores rasters, against what GDAL says of each.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "formats/registry.h"
#include "isohf/base/sample.h"
#include "isohf/raster.h"
#include "support/gdal_answers.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

struct Variant {
  const char* name;
  std::vector<std::string> options;  ///< of gdal_translate
};

class GdalVariants : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!has_gdal()) GTEST_SKIP() << "gdalinfo and gdallocationinfo are not installed (Debian: gdal-bin)";
    set_module_folder(ISOHF_BIN_DIR);
    const std::string coast = std::string(ISOHF_SOURCE_DIR) + "/testdata/coast_512x384_int16.tif";
    // A coast: sea at 0, and land.
    translate(coast, "whole.tif", {"-srcwin", "264", "100", "160", "140"});
    translate(coast, "real.tif",
              {"-srcwin", "264", "100", "160", "140", "-ot", "Float32", "-scale", "0", "3000", "0", "1000"});
  }

  void translate(const std::string& from, const std::string& to, std::vector<std::string> options) {
    options.insert(options.begin(), {"gdal_translate", "-q", from, folder_ / to});
    const RunResult result = run_gdal(options, {}, true);
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }

  /// Expects of the variant what GDAL says: size, type, place, void value and samples.
  void expect_same(const std::string& from, const Variant& variant) {
    SCOPED_TRACE(variant.name);
    ASSERT_NO_FATAL_FAILURE(translate(folder_ / from, variant.name, variant.options));
    const std::string file = folder_ / variant.name;
    const json gdal = json::parse(run_gdal({"gdalinfo", "-json", file}, {}, true).out);
    const RunResult result = run_isohf({"info", file, "--json", "--quiet"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const json ours = json::parse(result.out);
    EXPECT_EQ(ours.at("width"), gdal.at("size")[0]);
    EXPECT_EQ(ours.at("height"), gdal.at("size")[1]);
    const json& band = gdal.at("bands")[0];
    if (band.contains("noDataValue") && band.at("noDataValue").is_number()) {
      ASSERT_EQ(ours.at("void_values").size(), 1U);
      const double theirs = band.at("noDataValue");  // of floats eight digits are printed
      EXPECT_NEAR(ours.at("void_values")[0].get<double>(), theirs, 1e-7 * std::abs(theirs));
    }
    EXPECT_EQ(ours.at("z_scale"), band.value("scale", 1.0));
    EXPECT_EQ(ours.at("z_offset"), band.value("offset", 0.0));
    ASSERT_TRUE(gdal.contains("geoTransform"));
    expect_same_place(ours, gdal);
    expect_same_samples(file, gdal.at("geoTransform")[5] > 0.0);
  }

  /// Expects one line of error, with `why` in it.
  void expect_refused(const Variant& variant, const char* why) {
    SCOPED_TRACE(variant.name);
    ASSERT_NO_FATAL_FAILURE(translate(folder_ / "whole.tif", variant.name, variant.options));
    const RunResult result = run_isohf({"info", folder_ / variant.name});
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_THAT(result.err, HasSubstr(why));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1);
  }

  TemporaryFolder folder_;
};

TEST_F(GdalVariants, TiffCompressionsAndLayouts) {
  for (const Variant& variant : std::vector<Variant>{
           {"lzw.tif", {"-co", "COMPRESS=LZW", "-co", "PREDICTOR=2"}},
           {"lerc.tif", {"-co", "COMPRESS=LERC"}},
           {"lerc_deflate.tif", {"-co", "COMPRESS=LERC_DEFLATE"}},
           {"lerc_zstd.tif", {"-co", "COMPRESS=LERC_ZSTD", "-co", "TILED=YES"}},
           {"lzma.tif", {"-co", "COMPRESS=LZMA"}},
           {"zstd.tif", {"-co", "COMPRESS=ZSTD", "-co", "PREDICTOR=2", "-co", "TILED=YES"}},
           {"packbits.tif", {"-co", "COMPRESS=PACKBITS"}},
           {"big_endian.tif", {"-co", "ENDIANNESS=BIG", "-co", "COMPRESS=DEFLATE", "-co", "PREDICTOR=2"}},
           {"bigtiff.tif", {"-co", "BIGTIFF=YES", "-co", "TILED=YES", "-co", "BLOCKXSIZE=16", "-co", "BLOCKYSIZE=32"}},
           {"sparse.tif", {"-co", "SPARSE_OK=YES", "-a_nodata", "0"}},
           {"cog.tif", {"-of", "COG", "-co", "BLOCKSIZE=64"}},
           {"planes.tif", {"-b", "1", "-co", "INTERLEAVE=BAND"}},
           {"geotiff11.tif", {"-co", "GEOTIFF_VERSION=1.1"}},
           {"esri.tif", {"-co", "GEOTIFF_KEYS_FLAVOR=ESRI_PE"}},
           {"world.tif", {"-co", "PROFILE=BASELINE", "-co", "TFW=YES"}},
           {"aux.tif", {"-co", "PROFILE=BASELINE", "-a_nodata", "-32768", "-a_scale", "0.5", "-a_offset", "10"}},
           {"scaled.tif", {"-a_scale", "0.1", "-a_offset", "100"}}}) {
    expect_same("whole.tif", variant);
  }
  for (const Variant& variant :
       std::vector<Variant>{{"float_deflate.tif", {"-co", "COMPRESS=DEFLATE", "-co", "PREDICTOR=3"}},
                            {"float_lerc.tif", {"-co", "COMPRESS=LERC", "-co", "MAX_Z_ERROR=0"}},
                            {"float_zstd.tif", {"-co", "COMPRESS=ZSTD", "-co", "PREDICTOR=3", "-co", "TILED=YES"}},
                            {"half.tif", {"-co", "NBITS=16"}},
                            {"float24.tif", {"-co", "NBITS=24"}}}) {
    expect_same("real.tif", variant);
  }
}

TEST_F(GdalVariants, TransparentSamplesAreVoids) {
  // The sea, at 0, becomes transparent.
  translate(folder_ / "whole.tif", "sea.tif", {"-a_nodata", "0"});
  const auto elevations = [](const std::string& path) {
    const std::unique_ptr<HeightSource> source = open_raster(path, {});
    const SourceInfo& info = source->info();
    const auto count = static_cast<std::size_t>(info.width * info.height);
    std::vector<std::byte> raw(count * size_bytes(info.sample_type));
    source->read_window({0, 0, info.width, info.height}, raw);
    std::vector<float> out(count);
    heights_from_samples(info, 0.0, raw, out);
    for (float& height : out) height = std::isnan(height) ? -1e9F : height;
    return out;
  };
  const std::vector<float> expected = elevations(folder_ / "sea.tif");
  const auto voids = std::count(expected.begin(), expected.end(), -1e9F);
  ASSERT_GT(voids, 1000);
  ASSERT_LT(voids, static_cast<std::ptrdiff_t>(expected.size()) - 1000);
  const std::vector<std::string> inside = {
      "-mask", "mask,1", "-a_nodata", "none", "--config", "GDAL_TIFF_INTERNAL_MASK", "YES"};
  for (const Variant& variant : std::vector<Variant>{
           {"inside.tif", inside},
           {"tiles.tif", with_more(inside, {"-co", "TILED=YES", "-co", "BLOCKXSIZE=32", "-co", "BLOCKYSIZE=16"})},
           {"deflated.tif", with_more(inside, {"-co", "COMPRESS=DEFLATE", "-co", "PREDICTOR=2"})},
           {"cog.tif", {"-of", "COG", "-mask", "mask,1", "-a_nodata", "none"}},
           {"beside.tif", {"-mask", "mask,1", "-a_nodata", "none", "--config", "GDAL_TIFF_INTERNAL_MASK", "NO"}},
           {"both.tif", with_more(inside, {"-a_nodata", "-9999"})}}) {
    SCOPED_TRACE(variant.name);
    ASSERT_NO_FATAL_FAILURE(translate(folder_ / "sea.tif", variant.name, variant.options));
    EXPECT_TRUE(elevations(folder_ / variant.name) == expected);
  }
  ASSERT_EQ(run_gdal({"gdalwarp", "-q", "-dstalpha", folder_ / "sea.tif", folder_ / "alpha.tif"}).exit_code, 0);
  EXPECT_TRUE(elevations(folder_ / "alpha.tif") == expected);
  ASSERT_NO_FATAL_FAILURE(translate(folder_ / "alpha.tif", "alpha.png", {"-of", "PNG", "-ot", "UInt16"}));
  std::vector<float> unsigned_land = expected;
  for (float& height : unsigned_land) height = height > -1e9F ? std::max(height, 0.0F) : height;
  EXPECT_TRUE(elevations(folder_ / "alpha.png") == unsigned_land);
}

TEST_F(GdalVariants, TiffSampleTypes) {
  for (const char* type : {"Byte", "UInt16", "UInt32", "Int32", "Int64", "Float32", "Float64"}) {
    const std::string name = std::string(type) + ".tif";
    expect_same("whole.tif", {name.c_str(), {"-ot", type, "-a_nodata", "none"}});
  }
  for (const auto& [bits, type, wider] : {std::tuple("NBITS=10", "UInt16", "-co NBITS=16"),
                                          {"NBITS=12", "UInt16", "-co NBITS=16"},
                                          {"NBITS=24", "UInt32", "-co NBITS=32"}}) {
    expect_refused({"bits.tif", {"-ot", type, "-co", bits, "-a_nodata", "none"}}, wider);
  }
  expect_refused({"eleven.tif", {"-ot", "UInt16", "-co", "NBITS=11", "-a_nodata", "none"}}, "11 bit unsigned numbers");
  expect_refused({"complex.tif", {"-ot", "CInt16", "-a_nodata", "none"}}, "32 bit complex numbers");
}

TEST_F(GdalVariants, OtherFormats) {
  for (const Variant& variant :
       std::vector<Variant>{{"a.asc", {"-of", "AAIGrid"}},
                            {"b.bil", {"-of", "EHdr"}},
                            {"c.cub", {"-of", "ISIS3"}},
                            {"sphere.cub", {"-of", "ISIS3", "-a_srs", "ESRI:104971"}},
                            {"d.lbl", {"-of", "ISIS3", "-co", "DATA_LOCATION=EXTERNAL"}},
                            {"e.lbl", {"-of", "ISIS3", "-co", "DATA_LOCATION=GEOTIFF"}},
                            {"f.png", {"-of", "PNG", "-ot", "UInt16", "-a_nodata", "none"}},
                            {"g.png", {"-of", "PNG", "-ot", "UInt16", "-a_nodata", "7", "-co", "WORLDFILE=YES"}}}) {
    expect_same("whole.tif", variant);
  }
  for (const Variant& variant : std::vector<Variant>{
           {"r.flt", {"-of", "EHdr"}},
           {"s.asc", {"-of", "AAIGrid", "-co", "DECIMAL_PRECISION=9"}},
           {"t.cub", {"-of", "ISIS3", "-co", "TILED=YES", "-co", "BLOCKXSIZE=64", "-co", "BLOCKYSIZE=64"}}}) {
    expect_same("real.tif", variant);
  }
}

TEST_F(GdalVariants, SamplesThatAHeaderDescribes) {
  for (const Variant& variant :
       std::vector<Variant>{{"a.bsq", {"-of", "ENVI"}},
                            {"b.dat", {"-of", "ENVI", "-co", "INTERLEAVE=BIP", "-a_nodata", "0"}},
                            {"c.bil", {"-of", "ENVI", "-co", "SUFFIX=ADD", "-ot", "UInt16"}},
                            {"south.bin", {"-of", "ENVI", "-a_ullr", "10", "49", "11", "50", "-a_srs", "EPSG:4326"}},
                            {"e.nc", {"-of", "netCDF"}},
                            {"i.xyz", {"-of", "XYZ"}},
                            {"j.xyz", {"-of", "XYZ", "-co", "COLUMN_SEPARATOR=,", "-co", "ADD_HEADER_LINE=YES"}},
                            {"g.xml", {"-of", "PDS4"}},
                            {"h.xml", {"-of", "PDS4", "-a_nodata", "0", "-co", "INTERLEAVE=BIP"}},
                            {"f.nc", {"-of", "netCDF", "-co", "FORMAT=NC2", "-a_nodata", "0"}}}) {
    expect_same("whole.tif", variant);
  }
  for (const Variant& variant : std::vector<Variant>{{"r.img", {"-of", "ENVI", "-ot", "Float64"}},
                                                     {"u.xml", {"-of", "PDS4", "-ot", "Float64"}},
                                                     {"t.nc", {"-of", "netCDF", "-co", "WRITE_BOTTOMUP=NO"}}}) {
    expect_same("real.tif", variant);
  }
  // Bands in each order.
  for (const std::string order : {"BSQ", "BIL", "BIP"}) {
    const std::string name = order + ".dat";
    translate(folder_ / "whole.tif", name, {"-of", "ENVI", "-b", "1", "-b", "1", "-co", "INTERLEAVE=" + order});
    const RunResult second = run_isohf({"info", folder_ / name, "--channel", "1", "--stats", "--json", "--quiet"});
    const RunResult whole = run_isohf({"info", folder_ / "whole.tif", "--stats", "--json", "--quiet"});
    ASSERT_EQ(second.exit_code, 0) << second.err;
    EXPECT_EQ(json::parse(second.out).at("statistics"), json::parse(whole.out).at("statistics")) << order;
  }
}

TEST_F(GdalVariants, MapsOfPds4LabelsAreThoseThatGdalFinds) {
  for (const char* map : {"+proj=eqc +lat_ts=30 +lon_0=40 +R=3396190", "+proj=sinu +lon_0=10 +R=1737400",
                          "+proj=laea +lat_0=20 +lon_0=10 +R=1737400", "+proj=merc +lon_0=10 +k=1 +R=1737400",
                          "+proj=stere +lat_0=90 +lon_0=0 +k=1 +a=3396190 +b=3376200",
                          "+proj=lcc +lat_0=40 +lat_1=30 +lat_2=50 +lon_0=10 +R=1737400"}) {
    SCOPED_TRACE(map);
    expect_same("whole.tif", {"map.xml", {"-of", "PDS4", "-a_srs", map, "-a_ullr", "1000", "90000", "49000", "48000"}});
    const std::string wkt = open_raster(folder_ / "map.xml", {})->info().georeference.system.wkt;
    const auto proj = [](const std::string& system) {
      std::string text = run_gdal({"gdalsrsinfo", "-o", "proj4", system}, {}, true).out;
      for (const std::string same : {" +k=1", " +lat_ts=90"}) {  // two spellings of one map, at a pole
        if (const std::size_t at = text.find(same + ' '); at != std::string::npos) text.erase(at, same.size());
      }
      return text;
    };
    EXPECT_EQ(proj(wkt), proj(folder_ / "map.xml"));
    EXPECT_THAT(proj(wkt), HasSubstr("+proj="));
  }
}

TEST_F(GdalVariants, Netcdf4) {
  const std::vector<std::string> netcdf = {"-of", "netCDF", "-co", "FORMAT=NC4"};
  const auto of = [&](const char* name, std::vector<std::string> more) {
    more.insert(more.begin(), netcdf.begin(), netcdf.end());
    return Variant{name, more};
  };
  expect_same("whole.tif", of("plain.nc", {}));
  expect_same("whole.tif", of("deflated.nc", {"-co", "COMPRESS=DEFLATE", "-a_nodata", "0"}));
  expect_same("whole.tif", of("degrees.nc", {"-a_srs", "EPSG:4326", "-a_ullr", "10", "50", "11", "49.5"}));
  expect_same("real.tif", of("down.nc", {"-co", "WRITE_BOTTOMUP=NO", "-co", "COMPRESS=DEFLATE"}));
  expect_same("real.tif", of("double.nc", {"-ot", "Float64", "-a_scale", "2", "-a_offset", "100"}));
}

TEST_F(GdalVariants, VirtualRasters) {
  expect_same("whole.tif", {"whole.vrt", {"-of", "VRT"}});
  expect_refused({"part.vrt", {"-of", "VRT", "-srcwin", "20", "30", "70", "60"}}, "gdal_translate");
  expect_refused({"real.vrt", {"-of", "VRT", "-ot", "Float32", "-scale", "0", "4096", "0", "1024"}}, "gdal_translate");
  // Four pieces with voids, one over the other.
  for (const auto& [name, column, row] :
       {std::tuple("nw.tif", "0", "0"), {"ne.tif", "70", "0"}, {"sw.tif", "0", "60"}, {"se.tif", "90", "80"}}) {
    translate(folder_ / "whole.tif", name, {"-srcwin", column, row, "70", "60", "-a_nodata", "0"});
  }
  const RunResult built =
      run_gdal({"gdalbuildvrt", "-q", folder_ / "west.vrt", folder_ / "nw.tif", folder_ / "sw.tif"});
  ASSERT_EQ(built.exit_code, 0) << built.err;
  ASSERT_EQ(run_gdal({"gdalbuildvrt", "-q", folder_ / "all.vrt", folder_ / "nw.tif", folder_ / "sw.tif",
                      folder_ / "ne.tif", folder_ / "se.tif"})
                .exit_code,
            0);
  for (const char* name : {"west.vrt", "all.vrt"}) {
    const json gdal = json::parse(run_gdal({"gdalinfo", "-json", folder_ / name}).out);
    const json ours = json::parse(run_isohf({"info", folder_ / name, "--json", "--quiet"}).out);
    expect_same_place(ours, gdal);
    expect_same_samples(folder_ / name, false);
  }
  // Names as they are: long, and not of ASCII alone.
  const std::string far = "a folder whose name is long enough for forty-one letters/für Höhen.tif";
  std::filesystem::create_directory(std::filesystem::path(folder_ / far).parent_path());
  std::filesystem::copy(folder_ / "whole.tif", folder_ / far);
  ASSERT_EQ(run_gdal({"gdalbuildvrt", "-q", folder_ / "far.vrt", folder_ / far}).exit_code, 0);
  expect_same_samples(folder_ / "far.vrt", false);
  expect_refused({"small.vrt", {"-of", "VRT", "-outsize", "50%", "50%"}}, "resamples");
  ASSERT_EQ(
      run_gdal({"gdalwarp", "-q", "-of", "VRT", "-t_srs", "EPSG:3857", folder_ / "whole.tif", folder_ / "warped.vrt"})
          .exit_code,
      0);
  EXPECT_THAT(run_isohf({"info", folder_ / "warped.vrt"}).err, HasSubstr("VRTWarpedDataset"));
}

TEST_F(GdalVariants, OtherPictures) {
  if (!std::filesystem::exists(std::string(ISOHF_BIN_DIR) + "/isohf_oiio.so")) GTEST_SKIP() << "no OpenImageIO module";
  ASSERT_NO_FATAL_FAILURE(translate(folder_ / "whole.tif", "grey.bmp", {"-of", "BMP", "-ot", "Byte", "-scale"}));
  expect_same_samples(folder_ / "grey.bmp", false);
  expect_refused({"a.fits", {"-of", "FITS"}}, "OpenImageIO displaces the rows of FITS images");
}

}  // namespace
}  // namespace isohf::test
