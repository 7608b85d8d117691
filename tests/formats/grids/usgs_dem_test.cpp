#include "formats/readers.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "formats/raster_reference.h"
#include "formats/reader_failure.h"
#include "isohf/raster.h"
#include "support/rasters/samples.h"
#include "support/real_files.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Profile {
  double x = 0.0;
  double y = 0.0;
  std::vector<int> posts;  // from the South
};

struct Dem {
  int system = 1;
  int zone = 12;
  int unit = 2;
  int z_unit = 2;
  double angle = 0.0;
  double dx = 30.0;
  double dy = 30.0;
  double dz = 1.0;
  double local_datum = 0.0;
  int vertical_datum = 2;
  int horizontal_datum = 1;
  std::vector<Profile> profiles;
};

std::string fortran(double value) {
  std::string text = fmt::format("{:24.15E}", value);
  std::replace(text.begin(), text.end(), 'E', 'D');
  return text;
}

std::string padded(std::string text) {
  text.resize((text.size() + 1023) / 1024 * 1024, ' ');
  return text;
}

std::string header(const Dem& dem) {
  std::string text(144, ' ');
  text.replace(0, 8, "A QUAD  ");
  text += fmt::format("{:6}{:6}{:6}{:6}", 1, 1, dem.system, dem.zone);
  for (int i = 0; i < 15; ++i) text += fortran(0.0);
  text += fmt::format("{:6}{:6}{:6}", dem.unit, dem.z_unit, 4);
  for (int i = 0; i < 8; ++i) text += fortran(0.0);
  text += fortran(-50.0) + fortran(3000.0) + fortran(dem.angle) + "     0";
  for (const double d : {dem.dx, dem.dy, dem.dz}) text += fmt::format("{:12.6E}", d);
  text += fmt::format("{:6}{:6}", 1, dem.profiles.size());
  EXPECT_EQ(text.size(), 864U);
  text += std::string(24, ' ') + fmt::format("{:2}{:2}", dem.vertical_datum, dem.horizontal_datum);
  return padded(text);
}

std::string body(const Dem& dem) {
  std::string all;
  int column = 0;
  for (const Profile& profile : dem.profiles) {
    std::string text = fmt::format("{:6}{:6}{:6}{:6}", 1, ++column, profile.posts.size(), 1);
    text += fortran(profile.x) + fortran(profile.y) + fortran(dem.local_datum) + fortran(0.0) + fortran(0.0);
    for (std::size_t i = 0; i < profile.posts.size(); ++i) {
      text += fmt::format("{:6}", profile.posts[i]);
      if (i == 145 || (i > 145 && (i - 145) % 170 == 0)) text = padded(text);
    }
    all += padded(text);
  }
  return all;
}

/// The records as lines, with their blanks or without.
std::string as_lines(const std::string& records, const std::string& end, bool with_blanks) {
  std::string lines;
  for (std::size_t at = 0; at < records.size(); at += 1024) {
    std::string line = records.substr(at, 1024);
    if (!with_blanks) line.resize(line.find_last_not_of(' ') + 1);
    lines += line + end;
  }
  return lines;
}

/// 3 x 4 posts 30 m apart, the first profile two posts shorter.
Dem small_dem() {
  Dem dem;
  dem.profiles = {{300000.0, 4200030.0, {10, 11}},
                  {300030.0, 4200000.0, {20, -32767, 22, 23}},
                  {300060.0, 4200000.0, {30, 31, 32, -33}}};
  return dem;
}

const std::vector<double> kSmall = {-32767, 23, -33, 11, 22, 32, 10, -32767, 31, -32767, 20, 30};

Dem long_dem(int columns, int rows) {
  Dem dem;
  for (int c = 0; c < columns; ++c) {
    Profile profile{30.0 * c, 0.0, {}};
    for (int r = 0; r < rows; ++r) profile.posts.push_back(1000 * c + r - 40);
    dem.profiles.push_back(profile);
  }
  return dem;
}

class UsgsDem : public testing::Test {
 protected:
  std::string write(const std::string& bytes, const std::string& name = "a.dem") const {
    const std::string path = folder_ / name;
    test::write_file(path, bytes);
    return path;
  }
  std::string failure(const std::string& bytes, ErrorCode* code = nullptr) const {
    const std::string path = write(bytes);
    return test::failure_of(path, code, [&] { test::read_corner(*open_usgs_dem(path, {})); });
  }
  std::string failure(const Dem& dem) const { return failure(header(dem) + body(dem)); }

  const test::TemporaryFolder folder_;
};

TEST_F(UsgsDem, DeliversTheRealFileAsTheReferenceDoes) {
  const auto file = test::real_data() / "derived" / "besseggen_utm.dem";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << test::kNoRealFiles;
  const auto source = open_raster(file.string(), {});
  const auto ref = test::reference_of(file);
  const SourceInfo& info = source->info();
  // The profiles begin at y = 6818005 and have 200 posts. GDAL moves the grid to multiples of its spacing, half a post
  // off, and adds a row of voids in the South.
  EXPECT_EQ(info.width, 200);
  EXPECT_EQ(info.height, 200);
  EXPECT_EQ(ref.at("height").get<int>(), 201);
  EXPECT_EQ(ref.at("nodata_count").get<int>(), 200);
  EXPECT_EQ(info.georeference.origin_x, 484505.0);
  EXPECT_EQ(info.georeference.origin_y, 6819995.0);
  EXPECT_EQ(info.georeference.spacing_y, 10.0);
  EXPECT_EQ(info.georeference.system.epsg, ref.at("crs").at("epsg").get<int>());
  EXPECT_EQ(info.sample_type, SampleType::kInt16);
  const std::vector<double> all = test::values_of(*source);
  double sum = 0.0;
  for (const double value : all) sum += value;
  EXPECT_EQ(*std::min_element(all.begin(), all.end()), ref.at("raw_min").get<double>());
  EXPECT_EQ(*std::max_element(all.begin(), all.end()), ref.at("raw_max").get<double>());
  EXPECT_NEAR(sum / 40000.0, ref.at("raw_mean").get<double>(), 1e-9);
  int compared = 0;
  for (const auto& pixel : ref.at("pixels")) {
    if (!pixel.at("raw").is_number() || pixel.at("row").get<int>() == 200) continue;
    const auto at = static_cast<std::size_t>(pixel.at("row").get<int>() * 200 + pixel.at("col").get<int>());
    EXPECT_EQ(all[at], pixel.at("raw").get<double>());
    ++compared;
  }
  EXPECT_GT(compared, 5);
}

TEST_F(UsgsDem, TurnsProfilesOfDifferentLengthsIntoRows) {
  const Dem dem = small_dem();
  const std::string records = header(dem) + body(dem);
  for (const std::string& bytes :
       {records, as_lines(records, "\n", true), as_lines(records, "\r\n", true), as_lines(records, "\n", false),
        as_lines(records, "\r\n", false), records.substr(0, records.find_last_not_of(' ') + 1)}) {
    const auto source = open_raster(write(bytes), {});
    const SourceInfo& info = source->info();
    EXPECT_EQ(info.format, "USGS DEM");
    ASSERT_EQ(info.width, 3);
    ASSERT_EQ(info.height, 4);
    EXPECT_EQ(test::values_of(*source), kSmall);
    EXPECT_EQ(info.georeference.registration, Registration::kPoint);
    EXPECT_EQ(info.georeference.origin_x, 300000.0);
    EXPECT_EQ(info.georeference.origin_y, 4200090.0);
    EXPECT_EQ(info.georeference.system.epsg, 26712);
    EXPECT_EQ(info.georeference.system.vertical_datum, "NGVD29");
    EXPECT_EQ(info.vertical_unit, "metre");
    EXPECT_THAT(info.warnings, IsEmpty());
  }
}

TEST_F(UsgsDem, WindowsEqualTheWholeAcrossRecords) {
  const Dem dem = long_dem(4, 700);
  const std::string records = header(dem) + body(dem);
  for (const std::string& bytes : {records, as_lines(records, "\n", false)}) {
    const auto source = open_raster(write(bytes), {});
    ASSERT_EQ(source->info().height, 700);
    const auto whole = test::read_whole(*source);
    for (int r = 0; r < 700; ++r) {
      for (int c = 0; c < 4; ++c) {
        const auto at = static_cast<std::size_t>(4 * r + c);
        ASSERT_EQ(test::value_at(SampleType::kInt16, whole, at), 1000 * c + 699 - r - 40);
      }
    }
    std::mt19937 random(6);
    for (int round = 0; round < 200; ++round) {
      const Window window{static_cast<std::int64_t>(random() % 3), static_cast<std::int64_t>(random() % 600), 2,
                          1 + static_cast<std::int64_t>(random() % 100)};
      std::vector<std::byte> part(static_cast<std::size_t>(window.columns * window.rows) * 2);
      source->read_window(window, part);
      for (std::int64_t r = 0; r < window.rows; ++r) {
        const auto from = whole.begin() + ((window.row + r) * 4 + window.column) * 2;
        ASSERT_TRUE(std::equal(from, from + 4, part.begin() + r * 4));
      }
    }
  }
}

TEST_F(UsgsDem, ReadsSecondsFeetAndTenthsAboveALocalDatum) {
  Dem dem = small_dem();
  dem.system = 0;
  dem.unit = 3;
  dem.z_unit = 1;
  dem.dx = dem.dy = 3.0;
  dem.dz = 0.1;
  dem.local_datum = 100.0;
  dem.horizontal_datum = 3;
  dem.vertical_datum = 1;
  for (std::size_t i = 0; i < 3; ++i) dem.profiles[i].x = -108.0 * 3600.0 + 3.0 * static_cast<double>(i);
  for (std::size_t i = 0; i < 3; ++i) dem.profiles[i].y = 37.0 * 3600.0 + (i == 0 ? 3.0 : 0.0);
  const auto source = open_raster(write(header(dem) + body(dem)), {});
  const SourceInfo& info = source->info();
  EXPECT_EQ(info.georeference.unit, HorizontalUnit::kDegree);
  EXPECT_EQ(info.georeference.origin_x, -108.0);
  EXPECT_DOUBLE_EQ(info.georeference.origin_y, 37.0 + 9.0 / 3600.0);
  EXPECT_DOUBLE_EQ(info.georeference.spacing_x, 3.0 / 3600.0);
  EXPECT_EQ(info.georeference.system.epsg, 4326);
  EXPECT_EQ(info.vertical_unit, "foot");
  EXPECT_EQ(info.metres_per_vertical_unit, 0.3048);
  EXPECT_EQ(info.z_scale, 0.1);
  EXPECT_EQ(info.z_offset, 100.0);
  EXPECT_EQ(info.sample_type, SampleType::kInt16);
  EXPECT_EQ(test::values_of(*source), kSmall);
}

TEST_F(UsgsDem, NamesWhatItRefuses) {
  const auto with = [](auto change) {
    Dem dem = small_dem();
    change(dem);
    return dem;
  };
  EXPECT_THAT(failure(with([](Dem& d) { d.unit = 0; })), HasSubstr("are radians"));
  EXPECT_THAT(failure(with([](Dem& d) { d.angle = 0.1; })), HasSubstr("is turned by 0.1 radians"));
  EXPECT_THAT(failure(with([](Dem& d) { d.profiles[1].y += 7.0; })),
              HasSubstr("profile 2 begins at (300030, 4200007), which is no post"));
  EXPECT_THAT(failure(with([](Dem& d) { d.profiles[2].x += 30.0; })), HasSubstr("profile 3 begins at"));
  EXPECT_THAT(failure(with([](Dem& d) { d.profiles[0].posts[1] = 40000; })),
              HasSubstr("profile 1: elevation 2 is 40000, outside of the range"));
  std::string records = header(small_dem()) + body(small_dem());
  EXPECT_THAT(failure(std::string(records).replace(1024 + 144, 6, "    x1")),
              HasSubstr("profile 1 at byte 1024: elevation 1 of 2 is not a whole number"));
  EXPECT_THAT(failure(std::string(records).replace(2048 + 6, 6, "     3")), HasSubstr("row 1 and column 2"));
  EXPECT_THAT(failure(std::string(records).replace(858, 6, "999999")), HasSubstr("says 999999 profiles"));
}

TEST_F(UsgsDem, ReadsHeadersOfOtherLengthsAndWithoutAPattern) {
  const std::string records = header(small_dem()) + body(small_dem());
  for (const std::size_t length : {864, 893, 1021}) {
    EXPECT_EQ(test::values_of(*open_raster(write(records.substr(0, length) + records.substr(1024)), {})), kSmall)
        << length;
  }
  for (const char* pattern : {"     4", "      "}) {
    EXPECT_EQ(test::values_of(*open_raster(write(std::string(records).replace(150, 6, pattern)), {})), kSmall)
        << pattern;
  }
  EXPECT_THAT(failure(std::string(records).replace(150, 6, "     2")),
              HasSubstr("the elevation pattern is not regular"));
}

TEST_F(UsgsDem, RefusesEveryTruncation) {
  const std::string records = header(small_dem()) + body(small_dem());
  const std::size_t used = records.find_last_not_of(' ') + 1;
  for (const bool lines : {false, true}) {
    const std::string whole = lines ? as_lines(records, "\n", false) : records.substr(0, used);
    EXPECT_EQ(failure(whole), "");
    for (std::size_t length = 1; length + (lines ? 1 : 0) < whole.size(); ++length) {
      ErrorCode code = ErrorCode::kCancelled;
      EXPECT_NE(failure(whole.substr(0, length), &code), "") << length;
      EXPECT_EQ(code, ErrorCode::kCorrupt) << length;
    }
  }
}

}  // namespace
}  // namespace isohf
