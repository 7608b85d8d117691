/// GDAL's virtual rasters: lists of files. What gdalbuildvrt itself writes is tests/cli/gdal/gdal_variants_test.cpp.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "formats/io/packed_bytes.h"
#include "formats/mosaic/mosaic_pieces.h"
#include "formats/reader_failure.h"
#include "formats/registry.h"
#include "isohf/raster.h"
#include "support/rasters/samples.h"

namespace isohf::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr const char* kWgs84 =
    R"(<SRS>GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],)"
    R"(UNIT["degree",0.0174532925199433],AUTHORITY["EPSG","4326"]]</SRS>)";

/// A source; `more` after the number of its band.
std::string source(const std::string& file, const std::string& more = {}, const char* kind = "SimpleSource",
                   int band = 1) {
  return fmt::format(
      R"(<{0}><SourceFilename relativeToVRT="1">{1}</SourceFilename><SourceBand>{2}</SourceBand>{3}</{0}>)", kind, file,
      band, more);
}

std::string rectangles(const Window& at) {
  return fmt::format(R"(<SrcRect xOff="0" yOff="0" xSize="{2}" ySize="{3}"/><DstRect xOff="{0}" yOff="{1}" )"
                     R"(xSize="{2}" ySize="{3}"/>)",
                     at.column, at.row, at.columns, at.rows);
}

class Vrt : public ReaderTest {
 protected:
  /// Writes a.vrt: what its one band holds, and what precedes it.
  void write_vrt(std::int64_t width, std::int64_t height, const std::string& type, const std::string& band,
                 const std::string& before = {}) const {
    write("a.vrt", fmt::format(R"(<VRTDataset rasterXSize="{}" rasterYSize="{}">{}<VRTRasterBand dataType="{}" )"
                               R"(band="1">{}</VRTRasterBand></VRTDataset>)",
                               width, height, before, type, band));
  }
  [[nodiscard]] std::unique_ptr<HeightSource> open() const { return open_raster(folder / "a.vrt", {}); }
  [[nodiscard]] std::string failure() const {
    return failure_of(folder.path(), nullptr, [&] { read_corner(*open()); });
  }
  /// Unplaced samples in a format of plain numbers.
  template <typename T>
  void write_envi(const std::string& name, std::int64_t width, int type, const std::vector<T>& samples) const {
    write(name + ".dat", std::string(reinterpret_cast<const char*>(samples.data()), samples.size() * sizeof(T)));
    write(name + ".hdr", fmt::format("ENVI\nsamples = {}\nlines = {}\ndata type = {}\n", width,
                                     samples.size() / static_cast<std::size_t>(width), type));
  }
};

TEST_F(Vrt, IsTheMosaicOfItsFilesLaterOnesOnTop) {
  const CutRaster raster = noise_raster(placed_spec(97, 61, SampleType::kInt16, Registration::kArea));
  const Georeference place = *raster.spec.georeference;
  // More than may be open, each under a strip of the next one, and one of other samples beneath all.
  const std::vector<Window> cut = regular_cut(97, 61, 7, 2);
  ASSERT_GT(cut.size(), most_open_rasters());
  std::string sources = source("below.tif", rectangles({0, 0, 50, 40}));
  raster_of<std::int16_t>(raster.spec, [](auto, auto) { return 1; }).cut(folder / "below.tif", {0, 0, 50, 40});
  for (std::size_t i = 0; i < cut.size(); ++i) sources += source(fmt::format("piece{}.tif", i), rectangles(cut[i]));
  write_pieces(raster, folder / "", cut);
  const auto vrt = [&](double west) {
    write_vrt(97, 61, "Int16", sources,
              fmt::format("<SRS>EPSG:32632</SRS><GeoTransform>{}, 30, 0, {}, 0, -30</GeoTransform>", west,
                          place.origin_y + 15.0));
  };
  vrt(place.origin_x - 15.0);
  const auto mosaic = open();
  EXPECT_EQ(mosaic->info().format, "VRT");
  EXPECT_EQ(grid_of(mosaic->info().georeference), grid_of(place));
  EXPECT_EQ(mosaic->info().georeference.system.epsg, 32632);
  EXPECT_THAT(mosaic->info().warnings, IsEmpty());
  for (const Window& window : {Window{0, 0, 97, 61}, Window{3, 7, 80, 1}, Window{0, 60, 97, 1}})
    EXPECT_TRUE(read_window(*mosaic, window) == raster.part(window));
  vrt(place.origin_x + 15.0);
  EXPECT_THAT(failure(), HasSubstr("below.tif: begins at 500015, 5200000 by itself, and is put at 500045, 5200000; "
                                   "gdal_translate " +
                                   (folder / "a.vrt")));
}

TEST_F(Vrt, PlacesFilesThatDoNotAndLeavesGapsVoid) {
  write_envi<std::int16_t>("a", 2, 2, {1, 2, 3, 4});
  write_vrt(4, 3, "Int16", source("a.dat", rectangles({1, 1, 2, 2})),
            std::string(kWgs84) + "<GeoTransform>10, 0.5, 0, 50, 0, -0.5</GeoTransform>");
  const SourceInfo info = open()->info();
  EXPECT_EQ(info.georeference.origin_x, 10.25);
  EXPECT_EQ(info.georeference.system.epsg, 4326);
  EXPECT_EQ(info.georeference.unit, HorizontalUnit::kDegree);
  EXPECT_EQ(info.georeference.registration, Registration::kArea);
  EXPECT_EQ(info.sample_type, SampleType::kInt32) << "int16 has no void to spare";
  const double v = info.void_values.at(0);
  EXPECT_THAT(values_of(*open()), ElementsAre(v, v, v, v, v, 1, 2, v, v, 3, 4, v));
  // The VRT's own scale and unit, and no position.
  write_vrt(2, 2, "Int16", "<UnitType>ft</UnitType><Offset>7</Offset><Scale>2</Scale>" + source("a.dat"));
  EXPECT_FALSE(open()->info().georeference.has_origin);
  EXPECT_EQ(open()->info().z_scale, 2.0);
  EXPECT_EQ(open()->info().z_offset, 7.0);
  EXPECT_EQ(open()->info().vertical_unit, "foot");
}

TEST_F(Vrt, NodataOfSourcesAndOfTheWholeAreVoid) {
  const auto voids = [&](const std::string& whole, const std::string& of_source) {
    write_vrt(2, 2, "Float32",
              (whole.empty() ? "" : "<NoDataValue>" + whole + "</NoDataValue>") +
                  source("a.dat", "<NODATA>" + of_source + "</NODATA>", "ComplexSource"));
    return open()->info().void_values;
  };
  write_envi<float>("a", 2, 4, {1.0F, -3.4028234663852886e38F, 0.1F, 4.0F});
  // As GDAL writes floats in 15 digits.
  EXPECT_THAT(voids("-9", "-3.40282346638529e+38"), ElementsAre(-3.4028234663852886e38F, -9.0));
  EXPECT_THAT(voids("", "0.100000001490116"), ElementsAre(0.1F));
  EXPECT_THAT(voids("4", "4"), ElementsAre(4.0));
  EXPECT_THAT(voids("", "nan"), IsEmpty());
}

TEST_F(Vrt, ReadsTheBandThatItNames) {
  write("a.dat", std::string("\1\2\3\4\5\6\7\x8", 8));
  write("a.hdr", "ENVI\nsamples = 2\nlines = 2\nbands = 2\ndata type = 1\nband names = {mask, elevation}\n");
  for (const auto& [band, first] : {std::pair{1, 1.0}, {2, 5.0}}) {
    write_vrt(2, 2, "Byte", source("a.dat", {}, "SimpleSource", band));
    EXPECT_EQ(values_of(*open())[0], first);
  }
}

TEST_F(Vrt, FindsFilesInArchives) {
  const std::string head = "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n";
  write("tiles.zip", packed({{"d/a.asc", head + "1 2 3 4\n"}, {"b.asc", head + "5 6 7 8\n"}}, "zip"));
  for (const char* name : {"/vsizip/tiles.zip/d/a.asc", "/vsizip/{tiles.zip}/d/a.asc", "tiles.zip/d/a.asc"}) {
    write_vrt(2, 2, "Int16", source(name));
    EXPECT_THAT(values_of(*open()), ElementsAre(1, 2, 3, 4)) << name;
  }
  write_vrt(2, 2, "Int16", source("/vsizip/tiles.zip/none.asc"));
  EXPECT_THAT(failure(), HasSubstr("none.asc"));
}

TEST_F(Vrt, OtherThanListsOfFilesIsRefusedWithACommand) {
  write_envi<float>("a", 2, 4, {1.0F, 2.5F, 300.0F, 4.0F});
  const std::string command = "; gdal_translate " + folder / "a.vrt" + " OUT.tif makes a GeoTIFF of it";
  struct Case {
    std::string band;
    std::string message;
    std::string type = "Float32";
  };
  for (const Case& one : {
           Case{source("a.dat", R"(<SourceProperties DataType="Float32"/>)"), "those of " + (folder / "a.dat"),
                "Int16"},
           Case{source("a.dat", "<ScaleRatio>2</ScaleRatio>", "ComplexSource"), "has a ComplexSource with ScaleRatio"},
           Case{source("a.dat", {}, "KernelFilteredSource"), "has a KernelFilteredSource"},
           Case{source("a.dat", R"(<SrcRect xOff="1" yOff="0" xSize="2" ySize="2"/>)"), "takes a part of"},
           Case{source("a.dat", R"(<SrcRect xOff="0" yOff="0" xSize="1" ySize="2"/>)"), "resamples"},
           Case{source("a.dat", R"(<DstRect xOff="0.5" yOff="0" xSize="2" ySize="2"/>)"), "between samples"},
           Case{source("a.dat", rectangles({1, 1, 2, 2})), "cuts off"},
           Case{source("a.dat", rectangles({0, 0, 1, 2})), "has 2 x 2 samples, of which 1 x 2 are taken"},
           Case{source("a.dat") + source("a.dat", {}, "SimpleSource", 2), "takes different bands"},
           Case{source("a.vrt"), "is a virtual raster itself"},
           Case{"", "has no sources"},
           Case{source("/vsicurl/http://a.dat"), "names a file that is not on a disk"},
       }) {
    write_vrt(2, 2, one.type, one.band);
    EXPECT_THAT(failure(), HasSubstr(one.message)) << one.band;
    EXPECT_THAT(failure(), HasSubstr(command)) << one.band;
  }
  write_vrt(2, 2, "Byte", "", "<GeoTransform>490000, 30, 0.0, 5.0e+06, 0.0, 3.0e+01</GeoTransform>");
  EXPECT_THAT(failure(), HasSubstr("a dy of 30 and"));
}

}  // namespace
}  // namespace isohf::test
