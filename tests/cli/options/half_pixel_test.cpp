/// The half-pixel test of what is written: a ramp of areas or of points, converted, then restored and exported to every
/// format, lies where it lay when our readers, a second conversion, or GDAL read the file.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "formats/write/raster_sink.h"
#include "support/rasters/place_at.h"
#include "support/rasters/raster.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;

/// A share of a sample: places are doubles, good to 1e-11 of a spacing here.
constexpr double kShift = 1e-9;
/// Elevations of the surface are floats of up to 1000 m, and go through a few steps.
constexpr double kRounding = 3e-4;

/// z = base + along_x (x - west) + along_y (north - y), whole numbers at the samples: every type holds them. What a
/// place that is wrong by half a sample would add is a multiple of half a metre.
struct Ramp {
  std::int64_t width = 0;
  std::int64_t height = 0;
  HorizontalUnit unit = HorizontalUnit::kMetre;
  double west = 0.0;  ///< of the middle of sample (0, 0), or its post
  double north = 0.0;
  double spacing_x = 1.0;
  double spacing_y = 1.0;
  int step_x = 1;  ///< metres for a sample
  int step_y = 1;
  int base = 0;

  [[nodiscard]] double at(double x, double y) const {
    return base + step_x * ((x - west) / spacing_x) + step_y * ((north - y) / spacing_y);
  }
};

constexpr Ramp kSquare = {40, 32, HorizontalUnit::kMetre, 500000.0, 4000000.0, 10.0, 10.0, 2, 5, 100};
constexpr Ramp kOblong = {40, 32, HorizontalUnit::kMetre, 500000.0, 4000000.0, 10.0, 12.5, 2, 5, 100};
constexpr Ramp kTile = {1201, 1201, HorizontalUnit::kDegree, 20.0, 11.0, 1.0 / 1200, 1.0 / 1200, 2, 3, -500};

void write_ramp(const std::string& path, const Ramp& ramp, Registration registration, SampleType type) {
  RasterSpec spec;
  spec.width = ramp.width;
  spec.height = ramp.height;
  spec.sample_type = type;
  spec.vertical_unit = "metre";
  spec.overwrite = true;
  spec.georeference = place_at(registration, ramp.unit, ramp.west, ramp.north, ramp.spacing_x,
                               ramp.unit == HorizontalUnit::kDegree ? 4326 : 32632);
  spec.georeference->spacing_y = ramp.spacing_y;
  std::vector<std::int16_t> whole;
  std::vector<float> floats;
  for (std::int64_t row = 0; row < ramp.height; ++row) {
    for (std::int64_t column = 0; column < ramp.width; ++column) {
      whole.push_back(static_cast<std::int16_t>(ramp.base + ramp.step_x * column + ramp.step_y * row));
      floats.push_back(whole.back());
    }
  }
  write_raster(path, spec,
               type == SampleType::kInt16 ? std::as_bytes(std::span(whole)) : std::as_bytes(std::span(floats)));
}

struct Written {
  const char* extension;
  bool has_place;
  bool only_area;    ///< whose readers take every cell for an area
  bool whole_codes;  ///< integers over the range of elevations
};
constexpr Written kFormats[] = {
    {".tif", true, false, false}, {".exr", true, false, false}, {".png", true, false, true},
    {".r16", true, false, true},  {".raw", true, false, true},  {".r32", true, false, false},
    {".asc", true, true, false},  {".flt", true, true, false},  {".npy", false, false, false},
};

class HalfPixel : public testing::Test {
 protected:
  [[nodiscard]] std::string run(const std::vector<std::string>& arguments, const std::string& input = {}) const {
    RunOptions options;
    options.input = input;
    const RunResult result = run_isohf(arguments, options);
    EXPECT_EQ(result.exit_code, 0) << arguments.front() << ": " << result.err;
    EXPECT_EQ(result.err, "") << arguments.front();
    return result.out;
  }

  void convert(const std::string& source, const std::string& archive, std::vector<std::string> options = {}) const {
    options.insert(options.begin(),
                   {"convert", source, folder_ / archive, "--overwrite", "--type", "f32", "-q", "-j", "1"});
    (void)run(options);
  }

  /// Every sample of the file is the ramp's at the place that the file gives it, to kShift of a sample where
  /// `tolerance` is 0; and the place is the source's.
  static void expect_placed(const Raster& raster, const Ramp& ramp, const std::string& registration, double tolerance) {
    const Georeference& place = raster.info.georeference;
    ASSERT_EQ(raster.info.width, ramp.width);
    ASSERT_EQ(raster.info.height, ramp.height);
    ASSERT_TRUE(place.has_origin);
    EXPECT_EQ(to_string(place.registration), registration);
    EXPECT_EQ(place.unit, ramp.unit);
    EXPECT_TRUE(raster.info.warnings.empty()) << raster.info.warnings.front();
    EXPECT_NEAR(place.origin_x, ramp.west, kShift * ramp.spacing_x);
    EXPECT_NEAR(place.origin_y, ramp.north, kShift * ramp.spacing_y);
    std::size_t i = 0;
    for (std::int64_t row = 0; row < ramp.height; ++row) {
      const double y = place.origin_y - static_cast<double>(row) * place.spacing_y;
      for (std::int64_t column = 0; column < ramp.width; ++column, ++i) {
        const double x = place.origin_x + static_cast<double>(column) * place.spacing_x;
        const double elevation = ramp.at(x, y);
        ASSERT_NEAR(static_cast<double>(raster.elevations[i]), elevation, tolerance + kShift * ramp.step_x)
            << column << ", " << row;
      }
    }
  }

  /// What a format without a place holds: the ramp's samples, row by row.
  static void expect_in_order(const Raster& raster, const Ramp& ramp, double tolerance) {
    ASSERT_EQ(raster.info.width, ramp.width);
    ASSERT_EQ(raster.info.height, ramp.height);
    EXPECT_FALSE(raster.info.georeference.has_origin);
    std::size_t i = 0;
    for (std::int64_t row = 0; row < ramp.height; ++row) {
      for (std::int64_t column = 0; column < ramp.width; ++column, ++i) {
        const auto elevation = static_cast<double>(ramp.base + ramp.step_x * column + ramp.step_y * row);
        ASSERT_NEAR(static_cast<double>(raster.elevations[i]), elevation, tolerance) << column << ", " << row;
      }
    }
  }

  /// The surface of an archive made of the written file: world (0, 0) is the corner of the first area or the first
  /// post, and between the samples the ramp goes on.
  void expect_surface(const std::string& archive, const Ramp& ramp, bool area, double tolerance) const {
    const json source = json::parse(run({"info", folder_ / archive, "--json"})).at("metadata").at("source");
    EXPECT_EQ(source.at("registration"), area ? "area" : "point");
    const double first_x = area ? ramp.spacing_x / 2 : 0.0;
    const double first_z = area ? ramp.spacing_y / 2 : 0.0;
    EXPECT_NEAR(source.at("first_sample").at("x").get<double>(), first_x, kShift * ramp.spacing_x);
    EXPECT_NEAR(source.at("first_sample").at("z").get<double>(), first_z, kShift * ramp.spacing_y);
    std::ostringstream places;
    places.precision(17);
    std::vector<double> expected;
    // Triangles of a plane are the plane, but at the rim, where the surface is level over the outermost half areas.
    for (double row = 2.0; row < static_cast<double>(ramp.height) - 3.0; row += 1.37) {
      for (double column = 2.0; column < static_cast<double>(ramp.width) - 3.0; column += 1.73) {
        places << first_x + column * ramp.spacing_x << " " << first_z + row * ramp.spacing_y << "\n";
        expected.push_back(ramp.base + ramp.step_x * column + ramp.step_y * row);
      }
    }
    std::istringstream lines(run({"sample", folder_ / archive, "--json"}, places.str()));
    for (const double elevation : expected) {
      std::string line;
      ASSERT_TRUE(std::getline(lines, line));
      ASSERT_NEAR(json::parse(line).at("elevation").get<double>(), elevation, tolerance + kRounding);
    }
  }

  TemporaryFolder folder_;
};

TEST_F(HalfPixel, RestoredSamplesLieWhereTheyLayInEveryFormat) {
  for (const auto registration : {Registration::kArea, Registration::kPoint}) {
    const std::string kind = to_string(registration);
    write_ramp(folder_ / (kind + ".tif"), kOblong, registration, SampleType::kFloat32);
    convert(folder_ / (kind + ".tif"), "a.isohf", {"--lossless"});
    for (const Written& format : kFormats) {
      SCOPED_TRACE(kind + " " + format.extension);
      const std::string path = folder_ / ("back" + std::string(format.extension));
      (void)run({"export", folder_ / "a.isohf", path, "--overwrite", "-q", "-j", "1"});
      const Raster raster = read_raster(path);
      if (format.has_place) {
        expect_placed(raster, kOblong, format.only_area ? "area" : kind, 0.0);
      } else {
        expect_in_order(raster, kOblong, 0.0);
      }
    }
  }
}

TEST_F(HalfPixel, ExportedSurfacesLieWhereTheirSourceLayInEveryFormat) {
  for (const auto registration : {Registration::kArea, Registration::kPoint}) {
    const std::string kind = to_string(registration);
    write_ramp(folder_ / (kind + ".tif"), kSquare, registration, SampleType::kFloat32);
    convert(folder_ / (kind + ".tif"), "a.isohf");
    for (const Written& format : kFormats) {
      SCOPED_TRACE(kind + " " + format.extension);
      const std::string path = folder_ / ("out" + std::string(format.extension));
      const json summary = json::parse(
          run({"export", folder_ / "a.isohf", path, "--overwrite", "--method", "barycentric", "--json", "-j", "1"}));
      const double step = format.whole_codes ? summary.at("z_scale").get<double>() : 0.0;
      const Raster raster = read_raster(path);
      std::vector<std::string> options;
      if (format.has_place) {
        expect_placed(raster, kSquare, format.only_area ? "area" : kind, step / 2 + kRounding);
      } else {
        expect_in_order(raster, kSquare, step / 2 + kRounding);
        options = {"--sample-spacing", "10", "--registration", kind};
      }
      convert(path, "again.isohf", options);
      expect_surface("again.isohf", kSquare, format.only_area || registration == Registration::kArea, step / 2);
    }
  }
}

TEST_F(HalfPixel, AnOverruledRegistrationMovesNoSample) {
  write_ramp(folder_ / "area.tif", kSquare, Registration::kArea, SampleType::kInt16);
  convert(folder_ / "area.tif", "a.isohf", {"--registration", "point"});
  expect_surface("a.isohf", kSquare, false, 0.0);
  // What its samples stand for changes, where they lie does not.
  const json found = json::parse(run({"info", folder_ / "a.isohf", "--json"}));
  EXPECT_EQ(found.at("metadata").at("source").at("crs").at("origin_x"), kSquare.west);
  EXPECT_EQ(found.at("bounds").at("west"), kSquare.west);
}

TEST_F(HalfPixel, RastersWithoutAPlaceKeepTheirRegistration) {
  RasterSpec spec;
  spec.width = spec.height = 8;
  spec.sample_type = SampleType::kFloat32;
  const std::vector<float> level(64, 1.0F);
  write_raster(folder_ / "r.exr", spec, std::as_bytes(std::span(level)));
  for (const std::string registration : {"area", "point"}) {
    convert(folder_ / "r.exr", "a.isohf", {"--registration", registration});
    for (const char* name : {"back.tif", "back.r32"}) {
      (void)run({"export", folder_ / "a.isohf", folder_ / name, "--overwrite", "-q"});
      const SourceInfo info = read_raster(folder_ / name).info;
      // Without a place, samples are on posts unless the file says otherwise.
      EXPECT_EQ(info.georeference.registration == Registration::kArea, registration == "area") << name;
      EXPECT_FALSE(info.georeference.has_origin) << name;
      EXPECT_EQ(info.georeference.spacing_x, 1.0) << name;
      EXPECT_TRUE(info.warnings.empty()) << name;
    }
  }
}

TEST_F(HalfPixel, AsciiGridsByCornerAndByCentreAreTheSamePlace) {
  for (const std::string kind : {"corner 495", "center 500"}) {
    write_file(folder_ / "a.asc", "ncols 3\nnrows 2\nxll" + kind + "\nyll" + kind + "\ncellsize 10\n1 2 3 4 5 6\n");
    const Georeference place = read_raster(folder_ / "a.asc").info.georeference;
    EXPECT_EQ(place.registration, Registration::kArea) << kind;
    EXPECT_EQ(place.origin_x, 500.0) << kind;
    EXPECT_EQ(place.origin_y, 510.0) << kind;
  }
}

TEST_F(HalfPixel, HgtTilesLieWhereTheirNameSays) {
  const std::string tile = folder_ / "N10E020.hgt";
  for (const auto registration : {Registration::kArea, Registration::kPoint}) {
    write_ramp(folder_ / "tile.tif", kTile, registration, SampleType::kInt16);
    convert(folder_ / "tile.tif", "a.isohf", {"--lossless", "--to-crs", "equirectangular"});
    for (const std::string method : {"kept samples", "barycentric"}) {
      SCOPED_TRACE(to_string(registration) + " " + method);
      std::vector<std::string> arguments = {"export", folder_ / "a.isohf", tile, "--overwrite", "-q"};
      if (method == "barycentric") arguments.insert(arguments.end(), {"--method", method});
      (void)run(arguments);
      // Whole numbers, of the surface as well: it is off by less than they are rounded by.
      expect_placed(read_raster(tile), kTile, "point", 0.0);
    }
  }
  convert(tile, "again.isohf", {"--to-crs", "equirectangular"});
  std::ostringstream places;
  places.precision(17);
  std::vector<double> expected;
  for (double lat = 10.003; lat < 10.998; lat += 0.0217) {
    for (double lon = 20.003; lon < 20.998; lon += 0.0219) {
      places << lon << " " << lat << "\n";
      expected.push_back(kTile.at(lon, lat));
    }
  }
  std::istringstream lines(run({"sample", folder_ / "again.isohf", "--in", "lonlat", "--json"}, places.str()));
  for (const double elevation : expected) {
    std::string line;
    ASSERT_TRUE(std::getline(lines, line));
    // Floats of up to 5500 m.
    ASSERT_NEAR(json::parse(line).at("elevation").get<double>(), elevation, 10 * kRounding);
  }
}

TEST_F(HalfPixel, HgtTilesAreNotWrittenUnderTheNameOfAnotherPlace) {
  write_ramp(folder_ / "tile.tif", kTile, Registration::kPoint, SampleType::kInt16);
  convert(folder_ / "tile.tif", "a.isohf", {"--lossless", "--to-crs", "equirectangular"});
  const std::vector<std::string> before = folder_.names();
  for (const char* name : {"N44E006.hgt", "n10e021.hgt", "S10E020.hgt"}) {
    const RunResult refused = run_isohf({"export", folder_ / "a.isohf", folder_ / name, "-q"});
    EXPECT_EQ(refused.exit_code, 2) << name;
    EXPECT_THAT(refused.err, ::testing::HasSubstr(
                                 "these samples lie at 20 to 21 and 10 to 11; give the file the name of its place"));
  }
  EXPECT_EQ(folder_.names(), before);
}

TEST_F(HalfPixel, GdalFindsEverySampleWhereWeDo) {
  if (run_program({"/bin/sh", "-c", "command -v gdalinfo gdallocationinfo"}).exit_code != 0) {
    GTEST_SKIP() << "gdal-bin is not installed";
  }
  write_ramp(folder_ / "tile.tif", kTile, Registration::kPoint, SampleType::kInt16);
  convert(folder_ / "tile.tif", "tile.isohf", {"--lossless", "--to-crs", "equirectangular"});
  const std::string no_pam = "GDAL_PAM_ENABLED=NO";
  for (const auto registration : {Registration::kArea, Registration::kPoint}) {
    write_ramp(folder_ / "ramp.tif", kOblong, registration, SampleType::kFloat32);
    convert(folder_ / "ramp.tif", "ramp.isohf", {"--lossless"});
    for (const std::string name : {"ramp.tif", "ramp.asc", "ramp.flt", "N10E020.hgt"}) {
      // What the other formats hold is the same for both, as the tests above find.
      if (registration == Registration::kArea && name != "ramp.tif") continue;
      SCOPED_TRACE(to_string(registration) + " " + name);
      const Ramp& ramp = name == "N10E020.hgt" ? kTile : kOblong;
      const std::string archive = name == "N10E020.hgt" ? "tile.isohf" : "ramp.isohf";
      (void)run({"export", folder_ / archive, folder_ / name, "--overwrite", "-q"});
      const RunResult told = run_program({"/usr/bin/env", no_pam, "gdalinfo", "-json", folder_ / name});
      ASSERT_EQ(told.exit_code, 0) << told.err;
      // GDAL's place is the corner of the first area, whatever the samples stand for.
      const json transform = json::parse(told.out).at("geoTransform");
      EXPECT_NEAR(transform.at(0).get<double>() + ramp.spacing_x / 2, ramp.west, kShift * ramp.spacing_x);
      EXPECT_NEAR(transform.at(3).get<double>() - ramp.spacing_y / 2, ramp.north, kShift * ramp.spacing_y);
      EXPECT_NEAR(transform.at(1).get<double>(), ramp.spacing_x,
                  kShift * ramp.spacing_x / static_cast<double>(ramp.width));
      EXPECT_NEAR(-transform.at(5).get<double>(), ramp.spacing_y,
                  kShift * ramp.spacing_y / static_cast<double>(ramp.height));
      // Just inside the corners of a pixel it is still that sample which GDAL names.
      std::ostringstream places;
      places.precision(17);
      std::vector<double> expected;
      for (std::int64_t row = 0; row < ramp.height; row += 7) {
        const std::int64_t column = (11 * row) % ramp.width;
        for (const double inside : {-0.4999, 0.0, 0.4999}) {
          places << ramp.west + (static_cast<double>(column) + inside) * ramp.spacing_x << " "
                 << ramp.north - (static_cast<double>(row) + inside) * ramp.spacing_y << "\n";
          expected.push_back(static_cast<double>(ramp.base + ramp.step_x * column + ramp.step_y * row));
        }
      }
      RunOptions options;
      options.input = places.str();
      const RunResult found =
          run_program({"/usr/bin/env", no_pam, "gdallocationinfo", "-valonly", "-geoloc", folder_ / name}, options);
      ASSERT_EQ(found.exit_code, 0) << found.err;
      std::istringstream values(found.out);
      for (const double elevation : expected) {
        double value = std::numeric_limits<double>::quiet_NaN();
        ASSERT_TRUE(values >> value);
        ASSERT_EQ(value, elevation);
      }
    }
  }
}

}  // namespace
}  // namespace isohf::test
