#include "formats/georeference/sidecars.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "formats/reader_failure.h"
#include "formats/registry.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "support/rasters/place_at.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::HasSubstr;

constexpr const char* kDegrees =
    R"(GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["Degree",0.0174532925199433]])";

/// Pictures that say nothing of their place, and what lies beside them.
class PlaceBeside : public ReaderTest {
 protected:
  std::string picture() {
    const std::string path = folder / "a.png";
    std::filesystem::copy_file(std::string(ISOHF_SOURCE_DIR) + "/testdata/peaks_256x256_uint16.png", path);
    return path;
  }
};

TEST_F(PlaceBeside, WorldFileAndPrjPlaceAPicture) {
  write("a.prj", kDegrees);
  write("a.pgw", "0.5\n0\n0\n-0.25\n10.25\n50\n");
  const Georeference place = open_raster(picture(), {})->info().georeference;
  EXPECT_THAT(grid_of(place), ::testing::ElementsAre(10.25, 50.0, 0.5, 0.25));
  EXPECT_EQ(place.unit, HorizontalUnit::kDegree);
  EXPECT_EQ(place.system.epsg, 4326) << "by its parameters";
  EXPECT_EQ(place.system.semi_major_axis_m, 6378137.0);
}

TEST_F(PlaceBeside, PictureWithoutAWorldFileHasNoPlace) {
  write("a.prj", kDegrees);
  const Georeference place = open_raster(picture(), {})->info().georeference;
  EXPECT_FALSE(place.has_origin);
  EXPECT_EQ(place.unit, HorizontalUnit::kUnknown);
}

TEST_F(PlaceBeside, RefusesPicturesWithNorthAtTheBottom) {
  write("a.wld", "0.5\n0\n0\n0.25\n10.25\n50\n");
  const std::string path = picture();
  const Error error = error_of([&] { (void)open_raster(path, {}); });
  EXPECT_EQ(error.code(), ErrorCode::kUnsupported);
  EXPECT_THAT(error.what(), HasSubstr("a.wld: dy is positive; rows must run from North to South"));
}

TEST_F(PlaceBeside, SaysWhichWorldFileIsNone) {
  write("a.wld", "half a metre");
  const std::string path = picture();
  EXPECT_THAT(error_of([&] { (void)open_raster(path, {}); }).what(), HasSubstr("a.wld: is not a world file"));
}

TEST_F(PlaceBeside, WarnsOfDegreesThatNothingNames) {
  write("a.wld", "0.001\n0\n0\n-0.001\n10.25\n50\n");
  const auto source = open_raster(picture(), {});
  ASSERT_EQ(source->info().warnings.size(), 1U);
  EXPECT_THAT(source->info().warnings[0], HasSubstr("look like degrees"));
}

}  // namespace
}  // namespace isohf::test
