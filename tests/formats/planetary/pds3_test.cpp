#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>

#include "formats/reader_failure.h"
#include "formats/readers.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "support/rasters/every_window.h"
#include "support/rasters/samples.h"
#include "support/real_files.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

using ::testing::HasSubstr;

class Pds3 : public test::ReaderTest {
 protected:
  /// What opening and reading the first samples of `bytes` says; empty where it works.
  std::string failure(const std::string& bytes, ErrorCode* code = nullptr) {
    return failure_at(write("a.img", bytes), code, open_pds3);
  }
};

const char* const kImage =
    "OBJECT = IMAGE\r\n LINES = 3\r\n LINE_SAMPLES = 4\r\n SAMPLE_TYPE = MSB_INTEGER\r\n SAMPLE_BITS = 16\r\n"
    "END_OBJECT = IMAGE\r\n";

/// An attached label of 1024 bytes, two records.
std::string attached(const std::string& image = kImage, const std::string& more = "") {
  std::string label =
      "PDS_VERSION_ID = PDS3\r\nRECORD_BYTES = 512\r\n^IMAGE = 3\r\nTARGET_NAME = MARS\r\n" + image + more;
  label += "END\r\n";
  label.resize(std::max<std::size_t>(label.size(), 1024), ' ');
  return label;
}

/// Samples of `size` bytes, 100, 101, 102, ...
std::string samples(int count, int size, bool big_endian, int first = 100) {
  std::string bytes;
  for (int i = 0; i < count; ++i) {
    for (int b = 0; b < size; ++b) {
      const int shift = 8 * (big_endian ? size - 1 - b : b);
      bytes.push_back(shift > 24 ? '\0' : static_cast<char>(((first + i) >> shift) & 0xFF));
    }
  }
  return bytes;
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  text.replace(text.find(what), what.size(), by);
  return text;
}

std::string map(const std::string& fields) {
  return "OBJECT = IMAGE_MAP_PROJECTION\r\n" + fields + "END_OBJECT = IMAGE_MAP_PROJECTION\r\n";
}

TEST_F(Pds3, ReadsTheRealMoonBehindItsLabelNotInside) {
  const auto file = test::real_data() / "ldem_4_cropped.img";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << test::kNoRealFiles;
  const auto source = open_raster(file.string(), {});
  const SourceInfo& info = source->info();
  EXPECT_EQ(info.width, 1440);
  EXPECT_EQ(info.height, 1);
  EXPECT_EQ(info.z_scale, 0.5);
  EXPECT_EQ(info.z_offset, 1737400.0);
  EXPECT_EQ(info.georeference.spacing_x, 0.25);
  EXPECT_EQ(info.georeference.origin_x, 0.125);
  EXPECT_EQ(info.georeference.origin_y, 89.875);
  EXPECT_EQ(info.georeference.system.body, "Moon");
  EXPECT_EQ(info.georeference.system.semi_major_axis_m, 1737400.0);
  // Its text was edited after the pointer was written. The reference's samples are the text itself ("PD" = 17488), so
  // they are not compared: the row nearest to the pole is smooth and within 1 km.
  ASSERT_EQ(info.warnings.size(), 1U);
  EXPECT_THAT(info.warnings.front(),
              HasSubstr("^IMAGE points at byte 2904, inside the label, which ends at byte 2924"));
  const std::vector<double> values = test::values_of(*source);
  EXPECT_EQ(values[0], -10);
  for (const double value : values) EXPECT_LT(std::abs(value), 2000);
}

TEST_F(Pds3, ReadsEverySampleType) {
  struct Kind {
    const char* name;
    int bits;
    SampleType type;
    bool big_endian;
  };
  const Kind kinds[] = {{"MSB_INTEGER", 8, SampleType::kInt8, true},
                        {"MSB_INTEGER", 16, SampleType::kInt16, true},
                        {"MSB_INTEGER", 32, SampleType::kInt32, true},
                        {"LSB_INTEGER", 16, SampleType::kInt16, false},
                        {"\"LSB_INTEGER\"", 32, SampleType::kInt32, false},
                        {"PC_INTEGER", 16, SampleType::kInt16, false},
                        {"MSB_UNSIGNED_INTEGER", 8, SampleType::kUint8, true},
                        {"MSB_UNSIGNED_INTEGER", 16, SampleType::kUint16, true},
                        {"LSB_UNSIGNED_INTEGER", 16, SampleType::kUint16, false},
                        {"LSB_UNSIGNED_INTEGER", 32, SampleType::kUint32, false},
                        {"\"UNSIGNED INTEGER\"", 32, SampleType::kUint32, true}};
  for (const Kind& kind : kinds) {
    SCOPED_TRACE(kind.name + std::to_string(kind.bits));
    std::string image = replaced(kImage, "MSB_INTEGER", kind.name);
    image = replaced(image, "SAMPLE_BITS = 16", "SAMPLE_BITS = " + std::to_string(kind.bits));
    const auto source = open_raster(write("t.img", attached(image) + samples(12, kind.bits / 8, kind.big_endian)), {});
    EXPECT_EQ(source->info().sample_type, kind.type);
    const auto raw = test::read_whole(*source);
    for (std::size_t i = 0; i < 12; ++i) EXPECT_EQ(test::value_at(kind.type, raw, i), 100.0 + static_cast<double>(i));
  }
  for (const bool big_endian : {false, true}) {
    const std::string image = replaced(replaced(kImage, "MSB_INTEGER", big_endian ? "IEEE_REAL" : "PC_REAL"),
                                       "SAMPLE_BITS = 16", "SAMPLE_BITS = 32\r\n MISSING_CONSTANT = 16#FF7FFFFB#");
    std::string data;
    for (const float value : {1.5F, std::bit_cast<float>(0xFF7FFFFBU), -1e29F}) {
      const auto bits = std::bit_cast<std::uint32_t>(value);
      for (int b = 0; b < 4; ++b) data.push_back(static_cast<char>(bits >> (8 * (big_endian ? 3 - b : b))));
    }
    const auto source = open_raster(write("f.img", attached(image) + data + std::string(36, '\0')), {});
    const std::vector<double> values = test::values_of(*source);
    ASSERT_EQ(source->info().sample_type, SampleType::kFloat32);
    EXPECT_EQ(values[0], 1.5);
    EXPECT_TRUE(test::is_void(source->info(), values[1]));
    EXPECT_FALSE(test::is_void(source->info(), values[2]));
    ASSERT_EQ(source->info().void_values.size(), 1U);
  }
}

TEST_F(Pds3, ReadsVaxFloats) {
  // VAX Architecture Reference Manual, F_floating: 1.0 is 00004080 hexadecimal, -1.5 0000C0C0.
  const std::vector<std::pair<std::uint32_t, double>> numbers = {
      {0x00004080, 1.0},   {0x0000C0C0, -1.5},   {0x00000000, 0.0},
      {0x00004020, 0.625}, {0x0000458A, 1104.0}, {0xFFFF7FFF, 1.7014117331926443e38}};
  std::string data;
  std::vector<double> wanted;
  for (int i = 0; i < 12; ++i) {
    const auto& [bits, value] = numbers[static_cast<std::size_t>(i) % numbers.size()];
    for (unsigned b = 0; b < 32; b += 8) data.push_back(static_cast<char>(bits >> b & 0xFFU));
    wanted.push_back(value);
  }
  const std::string image =
      replaced(replaced(kImage, "MSB_INTEGER", "VAX_REAL"), "SAMPLE_BITS = 16", "SAMPLE_BITS = 32");
  const auto source = open_pds3(write("vax.img", attached(image) + data), {});
  ASSERT_EQ(source->info().sample_type, SampleType::kFloat32);
  EXPECT_EQ(test::values_of(*source), wanted);
}

TEST_F(Pds3, WindowsEqualTheWholeInEveryLayout) {
  for (const char* order : {"BAND_SEQUENTIAL", "LINE_INTERLEAVED", "SAMPLE_INTERLEAVED"}) {
    for (const int margin : {0, 3}) {
      std::string image = replaced(kImage, " LINES",
                                   std::string(" BANDS = 2\r\n BAND_STORAGE_TYPE = ") + order +
                                       "\r\n LINE_PREFIX_BYTES = " + std::to_string(margin) +
                                       "\r\n LINE_SUFFIX_BYTES = " + std::to_string(margin) + "\r\n LINES");
      const bool by_sample = order[0] == 'S';
      const std::string pad(static_cast<std::size_t>(margin), '\x77');
      std::string data;
      const auto value = [](int b, int r, int c) { return 1000 * (b + 1) + 10 * r + c; };
      for (int outer = 0; outer < (by_sample ? 3 : 6); ++outer) {
        data += pad;
        for (int i = 0; i < (by_sample ? 8 : 4); ++i) {
          int v = 0;
          if (order[0] == 'B') v = value(outer / 3, outer % 3, i);
          if (order[0] == 'L') v = value(outer % 2, outer / 2, i);
          if (by_sample) v = value(i % 2, outer, i / 2);
          data += samples(1, 2, true, v);
        }
        data += pad;
      }
      for (int band = 0; band < 2; ++band) {
        const auto source = open_raster(write("b.img", attached(image) + data), test::of_channel(std::to_string(band)));
        test::expect_every_window(*source, test::stored<std::int16_t>(4, 3, [&](std::int64_t c, std::int64_t r) {
          return value(band, static_cast<int>(r), static_cast<int>(c));
        }));
      }
    }
  }
}

TEST_F(Pds3, FollowsEveryPointer) {
  const std::string data = samples(12, 2, true);
  const std::string label = replaced(attached(), "RECORD_BYTES = 512\r\n", "RECORD_BYTES = 8\r\n");
  const auto first = [&](const std::string& path) {
    return test::value_at(SampleType::kInt16, test::read_whole(*open_raster(path, {})), 0);
  };
  EXPECT_EQ(first(write("p.img", replaced(label, "^IMAGE = 3", "^IMAGE = 129") + data)), 100);
  EXPECT_EQ(first(write("p.img", replaced(label, "^IMAGE = 3", "^IMAGE = 1036 <BYTES>") + data + data)), 101);
  write("DATA.DAT", data + data);
  EXPECT_EQ(first(write("p.lbl", replaced(label, "^IMAGE = 3", "^IMAGE = \"data.dat\""))), 100);
  EXPECT_EQ(first(write("p.lbl", replaced(label, "^IMAGE = 3", "^IMAGE = (\"DATA.DAT\", 2)"))), 104);
  EXPECT_EQ(first(write("p.lbl", replaced(label, "^IMAGE = 3", "^IMAGE = (\"DATA.DAT\", 3 <BYTES>)"))), 101);
  for (const char* wrong :
       {"0", "-1", "1.5", "\"none.dat\"", "\"../DATA.DAT\"", "(1, 2, 3)", "(\"DATA.DAT\", x)", "9e18"}) {
    EXPECT_NE(failure(replaced(label, "^IMAGE = 3", std::string("^IMAGE = ") + wrong) + data), "") << wrong;
  }
}

TEST_F(Pds3, TellsTheDataFileOfALabelFromOthers) {
  write("x.lbl", replaced(attached(), "^IMAGE = 3", "^IMAGE = \"X.IMG\""));
  const std::string data = write("x.img", samples(12, 2, true));
  EXPECT_EQ(open_raster(data, {})->info().format, "PDS3");
  write("y.lbl", replaced(attached(), "^IMAGE = 3", "^IMAGE = \"X.IMG\""));
  const std::string other = write("y.img", samples(12, 2, true));
  EXPECT_THROW((void)open_raster(other, {}), Error);
  EXPECT_FALSE(has_pds3_label(write("z.img", "no label")));
}

TEST_F(Pds3, PlacesByWhicheverMeaningTheBoundsConfirm) {
  // 4 x 3 samples of half a degree, West edge 10 E, North edge 20 N, counted from 180 E on the equator.
  const std::string bounds =
      "MAXIMUM_LATITUDE = 20\r\nMINIMUM_LATITUDE = 18.5\r\nWESTERNMOST_LONGITUDE = 10\r\n"
      "EASTERNMOST_LONGITUDE = 12\r\n";
  const std::string scale =
      "MAP_PROJECTION_TYPE = SIMPLE_CYLINDRICAL\r\nMAP_RESOLUTION = 2 <PIX/DEG>\r\n"
      "CENTER_LATITUDE = 0\r\nCENTER_LONGITUDE = 180\r\nA_AXIS_RADIUS = 3396000 <M>\r\n";
  const auto place = [&](const std::string& fields) {
    const auto source = open_raster(write("m.img", attached(kImage, map(scale + fields)) + samples(12, 2, true)), {});
    return source->info();
  };
  const auto expect = [](const SourceInfo& info, double x, double y, std::size_t warnings) {
    EXPECT_TRUE(info.georeference.has_origin);
    EXPECT_DOUBLE_EQ(info.georeference.origin_x, x);
    EXPECT_DOUBLE_EQ(info.georeference.origin_y, y);
    EXPECT_EQ(info.warnings.size(), warnings);
    EXPECT_EQ(info.georeference.system.semi_major_axis_m, 3396000.0);
  };
  const auto offsets = [](double sample, double line) {
    return "SAMPLE_PROJECTION_OFFSET = " + std::to_string(sample) +
           "\r\nLINE_PROJECTION_OFFSET = " + std::to_string(line) + "\r\n";
  };
  // Middle of the first sample: 10.25 E, 19.75 N; 339.5 columns West of 180 E, 39.5 rows North of the equator.
  expect(place(bounds + offsets(339.5, 39.5)), 10.25, 19.75, 0);
  expect(place(bounds + offsets(340.5, 40.5)), 10.25, 19.75, 0);
  expect(place(bounds + offsets(-339.5, -39.5)), 10.25, 19.75, 0);
  expect(place(bounds), 10.25, 19.75, 0);
  // Half a pixel off either way is no agreement: the standard's meaning, with a warning.
  expect(place(bounds + offsets(340.0, 40.0)), 10.0, 20.0, 1);
  expect(place(offsets(339.5, 39.5)), 10.25, 19.75, 1);
  // Posts: the bounds span one step less than there are samples.
  const std::string posts =
      "MAXIMUM_LATITUDE = 20\r\nMINIMUM_LATITUDE = 19\r\nWESTERNMOST_LONGITUDE = 10\r\n"
      "EASTERNMOST_LONGITUDE = 11.5\r\n";
  expect(place(posts), 10.0, 20.0, 0);
  EXPECT_EQ(place(posts).georeference.registration, Registration::kPoint);
  EXPECT_FALSE(place("").georeference.has_origin);
  EXPECT_FALSE(place(bounds + "MAP_PROJECTION_ROTATION = 90\r\n").georeference.has_origin);
}

TEST_F(Pds3, PlacesTheGlobeInEitherLongitudes) {
  const std::string image = replaced(replaced(kImage, "LINES = 3", "LINES = 2"), "MSB_INTEGER", "LSB_INTEGER");
  const auto west_edge = [&](const std::string& direction, double centre, double west) {
    const auto source = open_raster(
        write("g.img",
              attached(image, map("MAP_PROJECTION_TYPE = \"EQUIRECTANGULAR\"\r\nMAP_RESOLUTION = 0.0111111111111"
                                  "1111 <PIXEL/DEGREE>\r\nPOSITIVE_LONGITUDE_DIRECTION = " +
                                  direction + "\r\nCENTER_LONGITUDE = " + std::to_string(centre) +
                                  "\r\nWESTERNMOST_LONGITUDE = " + std::to_string(west) +
                                  "\r\nMAXIMUM_LATITUDE = 90\r\nSAMPLE_PROJECTION_OFFSET = 1.5\r\n"
                                  "LINE_PROJECTION_OFFSET = 0.5\r\n")) +
                  samples(8, 2, false)),
        {});
    EXPECT_TRUE(source->info().warnings.empty()) << source->info().warnings.front();
    EXPECT_EQ(source->info().georeference.system.body, "Mars");
    return source->info().georeference.origin_x - 45.0;
  };
  EXPECT_NEAR(west_edge("EAST", 180, 0), 0, 1e-9);
  EXPECT_NEAR(west_edge("EAST", 0, -180), -180, 1e-9);
  EXPECT_NEAR(west_edge("EAST", 0, 180), 180, 1e-9);
  EXPECT_NEAR(west_edge("WEST", 180, 360), 0, 1e-9);
  EXPECT_NEAR(west_edge("WEST", 0, 180), -180, 1e-9);
}

TEST_F(Pds3, CarriesOtherProjectionsInMetres) {
  const auto source = open_raster(
      write("s.img",
            attached(kImage, map("MAP_PROJECTION_TYPE = \"POLAR STEREOGRAPHIC\"\r\nMAP_SCALE = 0.24 <KM/PIXEL>\r\n"
                                 "A_AXIS_RADIUS = 3396.19 <KM>\r\nC_AXIS_RADIUS = 3376.2 <KM>\r\n"
                                 "LINE_PROJECTION_OFFSET = 1\r\nSAMPLE_PROJECTION_OFFSET = 1.5\r\n")) +
                samples(12, 2, true)),
      {});
  const Georeference& geo = source->info().georeference;
  EXPECT_EQ(geo.unit, HorizontalUnit::kMetre);
  EXPECT_DOUBLE_EQ(geo.spacing_x, 240.0);
  EXPECT_DOUBLE_EQ(geo.origin_x, -360.0);
  EXPECT_DOUBLE_EQ(geo.origin_y, 240.0);
  EXPECT_EQ(geo.system.name, "POLAR STEREOGRAPHIC MARS");
  EXPECT_NEAR(*geo.system.inverse_flattening, 169.894, 1e-3);
  EXPECT_TRUE(source->info().warnings.empty());
}

TEST_F(Pds3, MapsThatAreNotKnownAreMissedAloud) {
  const std::string radii = "A_AXIS_RADIUS = 3396.19 <KM>\r\nC_AXIS_RADIUS = 3396.19 <KM>\r\n";
  const auto warnings_of = [&](const std::string& lines) {
    const std::string more =
        "MAP_SCALE = 0.24 <KM/PIXEL>\r\nLINE_PROJECTION_OFFSET = 1\r\nSAMPLE_PROJECTION_OFFSET = 1.5\r\n";
    return open_raster(write("u.img", attached(kImage, map(lines + more)) + samples(12, 2, true)), {})->info().warnings;
  };
  EXPECT_TRUE(warnings_of("MAP_PROJECTION_TYPE = \"OBLIQUE CYLINDRICAL\"\r\n" + radii).empty());
  const std::vector<Warning> lost = warnings_of("MAP_PROJECTION_TYPE = \"PERSPECTIVE\"\r\n" + radii);
  ASSERT_EQ(lost.size(), 1U);
  EXPECT_EQ(lost.front().kind, Warning::Kind::kLoss);
  EXPECT_THAT(lost.front(), HasSubstr("the map projection PERSPECTIVE is not known"));
  const std::vector<Warning> unsized = warnings_of("MAP_PROJECTION_TYPE = SINUSOIDAL\r\n");
  ASSERT_EQ(unsized.size(), 1U);
  EXPECT_THAT(unsized.front(), HasSubstr("gives no radius of Mars"));
}

TEST_F(Pds3, ScalesAndMarksVoids) {
  const auto source =
      open_raster(write("v.img", attached(replaced(kImage, " LINES",
                                                   " SCALING_FACTOR = 0.5\r\n OFFSET = 1.7374E6 /* radius */\r\n"
                                                   " UNIT = KM\r\n NULL = -32768\r\n"
                                                   " MISSING_CONSTANT = (-32767, 70000)\r\n LINES")) +
                                     samples(12, 2, true)),
                  {});
  const SourceInfo& info = source->info();
  EXPECT_EQ(info.z_scale, 0.5);
  EXPECT_EQ(info.z_offset, 1737400.0);
  EXPECT_EQ(info.metres_per_vertical_unit, 1000.0);
  EXPECT_EQ(info.void_values, (std::vector<double>{-32767.0, -32768.0}));
  EXPECT_EQ(info.warnings.size(), 1U);
}

TEST_F(Pds3, NamesTheLineOfWhatItRefuses) {
  const std::string data = samples(12, 2, true);
  const auto says = [&](const std::string& what, const std::string& by) {
    return failure(replaced(attached(), what, by) + data);
  };
  EXPECT_THAT(says("LINES = 3", "LINES = many"), HasSubstr("label line 6: LINES is \"many\", must be a whole number"));
  EXPECT_THAT(says("SAMPLE_BITS = 16", "SAMPLE_BITS = 12"),
              HasSubstr("line 9: SAMPLE_BITS is \"12\", must be 8, 16 or 32"));
  EXPECT_THAT(says("MSB_INTEGER", "VAXG_REAL"), HasSubstr("SAMPLE_TYPE is \"VAXG_REAL\""));
  EXPECT_THAT(says("MSB_INTEGER", "VAX_REAL"), HasSubstr("must be 32 for VAX floats"));
  EXPECT_THAT(says("END_OBJECT = IMAGE", "END_OBJECT = TABLE"),
              HasSubstr("line 10: END_OBJECT = TABLE ends block IMAGE"));
  EXPECT_THAT(says("END_OBJECT = IMAGE", "COLOUR = GREY     "), HasSubstr("block IMAGE has no end"));
  EXPECT_THAT(says("LINES = 3", "LINES = 2000000000"), HasSubstr("need 16000001024"));
  EXPECT_THAT(says("^IMAGE = 3", "^TABLE = 3"), HasSubstr("no ^IMAGE"));
  EXPECT_THAT(says("LINES", "ENCODING_TYPE = JP2\r\n LINES"), HasSubstr("ENCODING_TYPE is JP2"));
}

}  // namespace
}  // namespace isohf
