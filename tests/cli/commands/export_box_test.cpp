/// isohf export --bbox in degrees: turns round the body, the 180th meridian, the seam of a globe.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "support/rasters/degree_grid.h"
#include "support/rasters/raster.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

/// Without a seam anywhere.
double land(double longitude, double latitude) {
  return 500.0 + 300.0 * std::sin(longitude * M_PI / 180.0 * 40.0) + 20.0 * latitude;
}

class ExportBox : public testing::Test {
 protected:
  void convert(const std::string& name, const std::vector<std::string>& more) {
    const RunResult made =
        run_isohf(with_more({"convert", folder / name, folder / "a.isohf", "--overwrite", "--type", "f32"}, more));
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }

  Raster exported(const std::string& box) {
    const RunResult result =
        run_isohf({"export", folder / "a.isohf", folder / "a.tif", "--overwrite", "--bbox", box, "-q"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.err, "");
    return result.exit_code == 0 ? read_raster(folder / "a.tif") : Raster{};
  }

  [[nodiscard]] std::string refused(const std::string& box) const {
    const RunResult result = run_isohf({"export", folder / "a.isohf", folder / "none.tif", "--bbox", box});
    EXPECT_EQ(result.exit_code, 2) << result.out;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    return result.err;
  }

  TemporaryFolder folder;
};

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

TEST_F(ExportBox, TakesTheSamplesThatConvertTakesAcrossThe180thMeridian) {
  // The same ground, counted on from 179 and from -181.
  for (const double west : {179.0, -181.0}) {
    write_degrees(folder / "across", 200, 150, west, 60.0, 0.01, land);
    for (const std::string box : {"179.5,60.2,-179.7,60.9", "179.5,60.2,180.3,60.9", "-180.5,60.2,-179.7,60.9"}) {
      SCOPED_TRACE(box + " of " + std::to_string(west));
      convert("across.flt", {"--to-crs", "equirectangular", "--bbox", box});
      const json cropped = json::parse(run_isohf({"info", folder / "a.isohf", "--json"}).out).at("metadata");
      convert("across.flt", {"--to-crs", "equirectangular"});
      const Raster part = exported(box);
      EXPECT_EQ(part.info.width, 80);
      EXPECT_EQ(part.info.height, 70);
      EXPECT_EQ(part.info.width, cropped.at("source").at("width"));
      EXPECT_EQ(part.info.height, cropped.at("source").at("height"));
      const Georeference& place = part.info.georeference;
      EXPECT_NEAR(std::remainder(place.origin_x - 179.505, 360.0), 0.0, 1e-9);
      for (std::int64_t i = 0; i < part.info.width * part.info.height; ++i) {
        const double longitude = 179.505 + 0.01 * static_cast<double>(i % part.info.width);
        const double latitude = 60.895 - 0.01 * static_cast<double>(i / part.info.width);
        // Waves of 210 m a degree, 0.01 degrees apart.
        ASSERT_NEAR(part.elevations[static_cast<std::size_t>(i)], land(longitude, latitude), 0.1) << i;
      }
    }
  }
}

TEST_F(ExportBox, IsTheSameOnAMapFromWhicheverSideItIsCounted) {
  for (const std::string kind : {"transverse-mercator", "lambert-conformal", "local"}) {
    SCOPED_TRACE(kind);
    write_degrees(folder / "across", 200, 150, 179.0, 60.0, 0.01, land);
    convert("across.flt", {"--to-crs", kind});
    const Raster first = exported("179.5,60.2,-179.7,60.9");
    EXPECT_GT(first.info.width, 40);
    EXPECT_LT(first.info.width, 120);
    EXPECT_EQ(std::count_if(first.elevations.begin(), first.elevations.end(), [](float z) { return std::isnan(z); }),
              0);
    EXPECT_TRUE(same_bits(first.elevations, exported("179.5,60.2,180.3,60.9").elevations));
    EXPECT_TRUE(same_bits(first.elevations, exported("-180.5,60.2,-179.7,60.9").elevations));
  }
}

TEST_F(ExportBox, GoesOnAcrossTheEndsOfAGlobe) {
  write_degrees(folder / "globe", 720, 360, -180.0, -90.0, 0.5, land);
  for (const std::vector<std::string>& more : {std::vector<std::string>{}, {"--no-wrap"}}) {
    SCOPED_TRACE(more.size());
    convert("globe.flt", more);
    const Raster west = exported("170,-10,180,10");
    const Raster east = exported("-180,-10,-175,10");
    EXPECT_EQ(west.info.width, 20);
    EXPECT_EQ(east.info.width, 10);
    for (const std::string box : {"170,-10,-175,10", "170,-10,185,10", "-190,-10,-175,10"}) {
      SCOPED_TRACE(box);
      const Raster both = exported(box);
      ASSERT_EQ(both.info.width, 30);
      EXPECT_NEAR(both.info.georeference.origin_x, 170.25, 1e-9);
      for (std::int64_t row = 0; row < 40; ++row) {
        for (std::int64_t c = 0; c < 30; ++c)
          ASSERT_EQ(both.at(c, row), c < 20 ? west.at(c, row) : east.at(c - 20, row)) << c;
      }
    }
    // A whole turn, or a little more: all of it.
    EXPECT_EQ(exported("-180,-90,180,90").info.width, 720);
    EXPECT_EQ(exported("-180.0001,-90,180.0001,90").info.width, 720);
    // Tiles of a part are a rectangle of tiles.
    const RunResult part =
        run_isohf({"extract", folder / "a.isohf", "-o", folder / "p.isohf", "--bbox", "170,-10,-175,10"});
    EXPECT_EQ(part.exit_code, 2);
    EXPECT_THAT(part.err,
                HasSubstr("which is no rectangle of it; give 170 to 180 and -180 to -175 one after the other"));
  }
}

TEST_F(ExportBox, RefusesGroundAtBothEndsOfWhatGoesNotRound) {
  write_degrees(folder / "most", 700, 360, -180.0, -90.0, 0.5, land);
  convert("most.flt", {});
  EXPECT_THAT(
      refused("160,-10,-175,10"),
      HasSubstr("--bbox 160,-10,-175,10: lies at the East end and at the West end of the archive's ground, -180 "
                "to 170, which is no rectangle of it; give 160 to 170 and -180 to -175 one after the other"));
}

TEST_F(ExportBox, CountsLongitudesRoundTheBody) {
  write_degrees(folder / "globe", 720, 360, 0.0, -90.0, 0.5, land);
  convert("globe.flt", {});
  const Raster west = exported("-20,10,-10,20");
  EXPECT_EQ(west.info.width, 20);
  EXPECT_NEAR(west.info.georeference.origin_x, 340.25, 1e-9);
  EXPECT_TRUE(same_bits(west.elevations, exported("340,10,350,20").elevations));
}

TEST_F(ExportBox, IsReadInTheSourcesOwnUnit) {
  const RunResult made =
      run_isohf({"convert", ISOHF_SOURCE_DIR "/testdata/coast_512x384_int16.tif", folder / "a.isohf"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(refused("500100,4100000,500000,4200000"), HasSubstr("West must be less than East"));
}

}  // namespace
}  // namespace isohf::test
