/// What GDAL keeps beside a raster, in whatever format.

#include "formats/georeference/sidecars.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "formats/reader_cases.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

constexpr const char* kAuxiliary =
    "<PAMDataset><PAMRasterBand band=\"1\"><NoDataValue>77</NoDataValue><UnitType>km</UnitType><Offset>100</Offset>"
    "<Scale>0.5</Scale></PAMRasterBand></PAMDataset>";

TEST(FilesBeside, GdalsSaysWhatTheSamplesOfEveryGridMeanBesideAPrjToo) {
  set_module_folder(ISOHF_BIN_DIR);
  constexpr std::array kGrids = {
      "EsriAsciiGrid", "EhdrHeader", "EhdrProjection", "GridFloatSamples", "Dted",      "Hgt",         "EnviHeader",
      "XyzText",       "Npy",        "TiffTagsFirst",  "TiffTiles",        "PngGray16", "ExrScanLines"};
  std::size_t tried = 0;
  for (const ReaderCase& each : reader_cases()) {
    if (std::ranges::count(kGrids, each.name) == 0) continue;
    SCOPED_TRACE(each.name);
    ++tried;
    const TemporaryFolder folder;
    for (const auto& [name, bytes] : each.beside) write_file(folder / name, bytes);
    write_file(folder / each.file_name, each.bytes);
    const std::string path = folder / (each.opened.empty() ? each.file_name : each.opened);
    const SourceInfo own = each.open(path, each.options)->info();
    write_file(own.path + ".aux.xml", kAuxiliary);
    if (!std::ifstream(folder / "a.prj")) {
      write_file(folder / "a.prj",
                 "GEOGCS[\"GCS_WGS_1984\",DATUM[\"D_WGS_1984\",SPHEROID[\"WGS_1984\",6378137.0,298.257223563]],"
                 "PRIMEM[\"Greenwich\",0.0],UNIT[\"Degree\",0.0174532925199433]]");
    }
    const SourceInfo info = each.open(path, each.options)->info();
    // GDAL takes ENVI's header for less.
    const bool goes_first = each.name == "EnviHeader";
    const bool is_scaled = !goes_first && (own.z_scale != 1.0 || own.z_offset != 0.0);
    EXPECT_EQ(info.z_scale, is_scaled ? own.z_scale : 0.5);
    EXPECT_EQ(info.z_offset, is_scaled ? own.z_offset : 100.0);
    EXPECT_EQ(info.vertical_unit, own.vertical_unit.empty() ? "kilometre" : own.vertical_unit);
    const bool has_own_void = !own.void_values.empty() && !goes_first;
    EXPECT_EQ(info.void_values, has_own_void ? own.void_values : std::vector<double>{77.0});
  }
  EXPECT_EQ(tried, kGrids.size());
}

}  // namespace
}  // namespace isohf::test
