#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "formats/reader_failure.h"
#include "formats/readers.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "support/rasters/every_window.h"
#include "support/rasters/place_at.h"
#include "support/rasters/samples.h"
#include "support/real_files.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

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

std::string of_type(const std::string& name, int bits, const std::string& more = "") {
  return replaced(replaced(kImage, "MSB_INTEGER", name), "SAMPLE_BITS = 16",
                  fmt::format("SAMPLE_BITS = {}", bits) + more);
}

std::string map(const std::string& fields) {
  return "OBJECT = IMAGE_MAP_PROJECTION\r\n" + fields + "END_OBJECT = IMAGE_MAP_PROJECTION\r\n";
}

class Pds3 : public test::ReaderTest {
 protected:
  /// What opening and reading the first samples of `bytes` says; empty where it works.
  std::string failure(const std::string& bytes) { return failure_at(write("a.img", bytes), nullptr, kPds3Format.open); }

  std::unique_ptr<HeightSource> open(const std::string& bytes, const std::string& channel = "") {
    return open_raster(write("a.img", bytes), test::of_channel(channel));
  }
  /// With 4 x 3 samples on a map.
  SourceInfo on_map(const std::string& fields) {
    return open(attached(kImage, map(fields)) + samples(12, 2, true))->info();
  }
};

TEST_F(Pds3, ReadsTheRealMoonBehindItsLabelNotInside) {
  const auto file = test::real_data() / "ldem_4_cropped.img";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << test::kNoRealFiles;
  const auto source = open_raster(file.string(), {});
  const SourceInfo& info = source->info();
  EXPECT_EQ(info.z_scale, 0.5);
  EXPECT_EQ(info.z_offset, 1737400.0);
  EXPECT_THAT(test::grid_of(info.georeference), ElementsAre(0.125, 89.875, 0.25, 0.25));
  EXPECT_EQ(info.georeference.system.body, "Moon");
  EXPECT_EQ(info.georeference.system.semi_major_axis_m, 1737400.0);
  // Its text was edited after the pointer was written. The reference's samples are the text itself ("PD" = 17488), so
  // they are not compared: the row nearest to the pole is smooth and within 1 km.
  EXPECT_THAT(info.warnings,
              ElementsAre(HasSubstr("^IMAGE points at byte 2904, inside the label, which ends at byte 2924")));
  const std::vector<double> values = test::values_of(*source);
  EXPECT_EQ(values[0], -10);
  for (const double value : values) EXPECT_LT(std::abs(value), 2000);
}

TEST_F(Pds3, ReadsEverySampleType) {
  for (const auto& [name, bits, type, big_endian] : {std::tuple("MSB_INTEGER", 8, SampleType::kInt8, true),
                                                     {"MSB_INTEGER", 16, SampleType::kInt16, true},
                                                     {"MAC_INTEGER", 32, SampleType::kInt32, true},
                                                     {"VAX_INTEGER", 16, SampleType::kInt16, false},
                                                     {"\"LSB_INTEGER\"", 32, SampleType::kInt32, false},
                                                     {"PC_INTEGER", 16, SampleType::kInt16, false},
                                                     {"MSB_UNSIGNED_INTEGER", 8, SampleType::kUint8, true},
                                                     {"LSB_UNSIGNED_INTEGER", 16, SampleType::kUint16, false},
                                                     {"\"UNSIGNED INTEGER\"", 32, SampleType::kUint32, true}}) {
    const auto source = open(attached(of_type(name, bits)) + samples(12, bits / 8, big_endian));
    EXPECT_EQ(source->info().sample_type, type) << name;
    const std::vector<double> values = test::values_of(*source);
    for (std::size_t i = 0; i < 12; ++i) EXPECT_EQ(values[i], 100.0 + static_cast<double>(i)) << name << bits;
  }
  // VAX Architecture Reference Manual, F_floating: 1.5 is 000040C0 hexadecimal.
  const std::string special = "\r\n MISSING_CONSTANT = 16#FF7FFFFB#";
  for (const auto& [name, bytes] : {std::pair("IEEE_REAL", "\x3F\xC0\0\0\xFF\x7F\xFF\xFB\xF0\xA0\0\0"),
                                    {"PC_REAL", "\0\0\xC0\x3F\xFB\xFF\x7F\xFF\0\0\xA0\xF0"},
                                    {"VAX_REAL", "\xC0\x40\0\0\x80\x40\0\0\xC0\xC0\0\0"}}) {
    const bool is_vax = name[0] == 'V';
    const auto source = open(attached(of_type(name, 32, is_vax ? "\r\n MISSING_CONSTANT = 16#00004080#" : special)) +
                             std::string(bytes, 12) + std::string(36, '\0'));
    const std::vector<double> values = test::values_of(*source);
    EXPECT_EQ(source->info().sample_type, SampleType::kFloat32) << name;
    EXPECT_EQ(values[0], 1.5) << name;
    EXPECT_TRUE(test::is_void(source->info(), values[1])) << name << values[1];
    EXPECT_FALSE(test::is_void(source->info(), values[2])) << name << values[2];
    EXPECT_EQ(source->info().void_values.size(), 1U) << name;
  }
}

TEST_F(Pds3, WindowsEqualTheWholeInEveryLayout) {
  for (const std::string order : {"BAND_SEQUENTIAL", "LINE_INTERLEAVED", "SAMPLE_INTERLEAVED"}) {
    for (const int margin : {0, 3}) {
      const std::string image = replaced(
          kImage, " LINES",
          fmt::format(
              " BANDS = 2\r\n BAND_STORAGE_TYPE = {}\r\n LINE_PREFIX_BYTES = {}\r\n LINE_SUFFIX_BYTES = {}\r\n LINES",
              order, margin, margin));
      const bool by_sample = order[0] == 'S';
      const std::string pad(static_cast<std::size_t>(margin), '\x77');
      std::string data;
      const auto value = [](int b, int r, int c) { return 1000 * (b + 1) + 10 * r + c; };
      for (int outer = 0; outer < (by_sample ? 3 : 6); ++outer) {
        data += pad;
        for (int i = 0; i < (by_sample ? 8 : 4); ++i) {
          const int v = by_sample         ? value(i % 2, outer, i / 2)
                        : order[0] == 'B' ? value(outer / 3, outer % 3, i)
                                          : value(outer % 2, outer / 2, i);
          data += samples(1, 2, true, v);
        }
        data += pad;
      }
      for (int band = 0; band < 2; ++band) {
        const auto source = open(attached(image) + data, std::to_string(band));
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
  write("DATA.DAT", data + data);
  for (const auto& [pointer, name, first] : {std::tuple("129", "p.img", 100),
                                             {"1036 <BYTES>", "p.img", 101},
                                             {"\"data.dat\"", "p.lbl", 100},
                                             {"(\"DATA.DAT\", 2)", "p.lbl", 104},
                                             {"(\"DATA.DAT\", 3 <BYTES>)", "p.lbl", 101}}) {
    const std::string text = replaced(label, "^IMAGE = 3", std::string("^IMAGE = ") + pointer);
    const auto source = open_raster(write(name, text + data + data), {});
    EXPECT_EQ(test::values_of(*source)[0], first) << pointer;
  }
  for (const char* wrong :
       {"0", "-1", "1.5", "\"none.dat\"", "\"../DATA.DAT\"", "(1, 2, 3)", "(\"DATA.DAT\", x)", "9e18"}) {
    EXPECT_NE(failure(replaced(label, "^IMAGE = 3", std::string("^IMAGE = ") + wrong) + data), "") << wrong;
  }
}

TEST_F(Pds3, TellsTheDataFileOfALabelFromOthers) {
  const std::string label = replaced(attached(), "^IMAGE = 3", "^IMAGE = \"X.IMG\"");
  write("x.lbl", label);
  write("y.lbl", label);
  EXPECT_EQ(open_raster(write("x.img", samples(12, 2, true)), {})->info().format, "PDS3");
  EXPECT_THAT(failure_at(write("y.img", samples(12, 2, true)), nullptr, kPds3Format.open), HasSubstr("describes"));
  EXPECT_FALSE(kPds3Format.described(write("z.img", "no label")));
}

TEST_F(Pds3, SamplesInJpeg2000AreRefusedWithTheCommandThatUnpacksThem) {
  const std::string label =
      write("x_jp2.lbl",
            "PDS_VERSION_ID = PDS3\r\nOBJECT = COMPRESSED_FILE\r\n FILE_NAME = \"X.JP2\"\r\nEND_OBJECT\r\nOBJECT = "
            "UNCOMPRESSED_FILE\r\n ^IMAGE = \"X.IMG\"\r\n" +
                replaced(of_type("LSB_INTEGER", 16), "LINES", "SCALING_FACTOR = 0.5\r\n OFFSET = 1737400\r\n LINES") +
                "END_OBJECT\r\nEND\r\n");
  const std::string picture = write("x.jp2", std::string("\0\0\0\x0CjP  \r\n\x87\n", 12));
  const std::string unpacked = folder / "X.IMG";
  const auto command = HasSubstr("gdal_translate -of ENVI " + picture + " " + unpacked + " unpacks the samples for");
  for (const std::string& path : {label, picture}) {
    EXPECT_THAT(failure_at(path, nullptr, open_raster),
                AllOf(HasSubstr("JPEG 2000"), command, HasSubstr("`z_scale` 0.5 and `z_offset` 1737400")));
  }
  test::write_file(unpacked, samples(12, 2, false));
  const auto source = open_raster(label, {});
  EXPECT_EQ(test::values_of(*source)[0], 100.0);
  EXPECT_EQ(source->info().z_offset, 1737400.0);
  EXPECT_THAT(failure_at(picture, nullptr, open_raster), HasSubstr("open " + label));
  test::write_file(label, replaced(test::read_file(label), "LSB", "MSB"));
  std::filesystem::remove(unpacked);
  EXPECT_THAT(failure_at(label, nullptr, open_raster), HasSubstr("gdal_translate " + picture + " OUT.tif"));
}

TEST_F(Pds3, PlacesByWhicheverMeaningTheBoundsConfirm) {
  // 4 x 3 samples of half a degree, West edge 10 E, North edge 20 N, counted from 180 E on the equator.
  const std::string bounds =
      "MAXIMUM_LATITUDE = 20\r\nMINIMUM_LATITUDE = 18.5\r\nWESTERNMOST_LONGITUDE = 10\r\n"
      "EASTERNMOST_LONGITUDE = 12\r\n";
  const std::string scale =
      "MAP_PROJECTION_TYPE = SIMPLE_CYLINDRICAL\r\nMAP_RESOLUTION = 2 <PIX/DEG>\r\n"
      "CENTER_LATITUDE = 0\r\nCENTER_LONGITUDE = 180\r\nA_AXIS_RADIUS = 3396000 <M>\r\n";
  // The bounds span one step less than there are samples.
  const std::string posts =
      "MAXIMUM_LATITUDE = 20\r\nMINIMUM_LATITUDE = 19\r\nWESTERNMOST_LONGITUDE = 10\r\n"
      "EASTERNMOST_LONGITUDE = 11.5\r\n";
  const auto offsets = [](double sample, double line) {
    return fmt::format("SAMPLE_PROJECTION_OFFSET = {}\r\nLINE_PROJECTION_OFFSET = {}\r\n", sample, line);
  };
  // Middle of the first sample: 10.25 E, 19.75 N; 339.5 columns West of 180 E, 39.5 rows North of the equator.
  for (const auto& [fields, x, y, warnings] :
       {std::tuple(bounds + offsets(339.5, 39.5), 10.25, 19.75, 0U),
        {bounds + offsets(340.5, 40.5), 10.25, 19.75, 0U},
        {bounds + offsets(-339.5, -39.5), 10.25, 19.75, 0U},
        {bounds, 10.25, 19.75, 0U},
        {posts, 10.0, 20.0, 0U},
        // Half a pixel off either way is no agreement: the standard's meaning, with a warning.
        {bounds + offsets(340.0, 40.0), 10.0, 20.0, 1U},
        {offsets(339.5, 39.5), 10.25, 19.75, 1U}}) {
    const SourceInfo info = on_map(scale + fields);
    EXPECT_DOUBLE_EQ(test::origin_of(info.georeference)[0], x) << fields;
    EXPECT_DOUBLE_EQ(test::origin_of(info.georeference)[1], y) << fields;
    EXPECT_EQ(info.warnings.size(), warnings) << fields;
    EXPECT_EQ(info.georeference.registration, fields == posts ? Registration::kPoint : Registration::kArea);
    EXPECT_EQ(info.georeference.system.semi_major_axis_m, 3396000.0);
  }
  EXPECT_FALSE(on_map(scale).georeference.has_origin);
  EXPECT_FALSE(on_map(scale + bounds + "MAP_PROJECTION_ROTATION = 90\r\n").georeference.has_origin);
}

TEST_F(Pds3, PlacesTheGlobeInEitherLongitudes) {
  const std::string image = replaced(kImage, "LINES = 3", "LINES = 2");
  for (const auto& [direction, centre, west, edge] : {std::tuple("EAST", 180, 0, 0),
                                                      {"EAST", 0, -180, -180},
                                                      {"EAST", 0, 180, 180},
                                                      {"WEST", 180, 360, 0},
                                                      {"WEST", 0, 180, -180}}) {
    const std::string fields = fmt::format(
        "MAP_PROJECTION_TYPE = \"EQUIRECTANGULAR\"\r\nMAP_RESOLUTION = {} "
        "<PIXEL/DEGREE>\r\nPOSITIVE_LONGITUDE_DIRECTION = "
        "{}\r\nCENTER_LONGITUDE = {}\r\nWESTERNMOST_LONGITUDE = {}\r\nMAXIMUM_LATITUDE = 90\r\n"
        "SAMPLE_PROJECTION_OFFSET = 1.5\r\nLINE_PROJECTION_OFFSET = 0.5\r\n",
        1.0 / 90.0, direction, centre, west);
    const auto source = open(attached(image, map(fields)) + samples(8, 2, true));
    EXPECT_THAT(source->info().warnings, IsEmpty());
    EXPECT_EQ(source->info().georeference.system.body, "Mars");
    EXPECT_NEAR(source->info().georeference.origin_x, edge + 45.0, 1e-9) << direction << ' ' << centre;
  }
}

TEST_F(Pds3, OtherMapsAreInMetresOrMissedAloud) {
  const std::string radii = "A_AXIS_RADIUS = 3396.19 <KM>\r\nC_AXIS_RADIUS = 3376.2 <KM>\r\n";
  const std::string place =
      "MAP_SCALE = 0.24 <KM/PIXEL>\r\nLINE_PROJECTION_OFFSET = 1\r\nSAMPLE_PROJECTION_OFFSET = 1.5\r\n";
  for (const auto& [kind, ellipsoid, lost] :
       {std::tuple("POLAR STEREOGRAPHIC", radii, ""),
        {"OBLIQUE CYLINDRICAL", radii, ""},
        {"PERSPECTIVE", radii, "the map projection PERSPECTIVE is not known"},
        {"LAMBERT CONFORMAL", radii, "PROJ does not take the map projection LAMBERT CONFORMAL"},  // no parallels
        {"SINUSOIDAL", "", "the label gives no radius of Mars"}}) {
    const SourceInfo info = on_map(fmt::format("MAP_PROJECTION_TYPE = \"{}\"\r\n{}{}", kind, ellipsoid, place));
    const Georeference& geo = info.georeference;
    EXPECT_EQ(geo.unit, HorizontalUnit::kMetre) << kind;
    EXPECT_THAT(test::grid_of(geo), ElementsAre(-360.0, 240.0, 240.0, 240.0)) << kind;
    EXPECT_EQ(geo.system.name, std::string(kind) + " MARS");
    EXPECT_EQ(geo.system.wkt.empty(), *lost != '\0') << kind;
    ASSERT_EQ(info.warnings.size(), *lost != '\0' ? 1U : 0U) << kind;
    if (*lost == '\0') continue;
    EXPECT_EQ(info.warnings[0].kind, Warning::Kind::kLoss);
    EXPECT_THAT(info.warnings[0], HasSubstr(lost));
  }
}

TEST_F(Pds3, ScalesAndMarksVoids) {
  const SourceInfo info =
      open(attached(
               replaced(kImage, " LINES",
                        " SCALING_FACTOR = 0.5\r\n OFFSET = 1.7374E6 /* radius */\r\n UNIT = KM\r\n NULL = -32768\r\n"
                        " MISSING_CONSTANT = (-32767, 70000, 16#8000#)\r\n LINES")) +
           samples(12, 2, true))
          ->info();
  EXPECT_EQ(info.z_scale, 0.5);
  EXPECT_EQ(info.z_offset, 1737400.0);
  EXPECT_EQ(info.metres_per_vertical_unit, 1000.0);
  EXPECT_THAT(info.void_values, ElementsAre(-32767.0, -32768.0));
}

TEST_F(Pds3, NamesTheLineOfWhatItRefuses) {
  for (const auto& [what, by, said] :
       {std::tuple("LINES = 3", "LINES = many", "label line 6: LINES is \"many\", must be a whole number"),
        {"SAMPLE_BITS = 16", "SAMPLE_BITS = 12", "line 9: SAMPLE_BITS is \"12\", must be 8, 16 or 32"},
        {"MSB_INTEGER", "VAXG_REAL", "SAMPLE_TYPE is \"VAXG_REAL\""},
        {"MSB_INTEGER", "VAX_REAL", "must be 32 for VAX floats"},
        {"END_OBJECT = IMAGE", "END_OBJECT = TABLE", "line 10: END_OBJECT = TABLE ends block IMAGE"},
        {"END_OBJECT = IMAGE", "COLOUR = GREY     ", "block IMAGE has no end"},
        {"LINES = 3", "LINES = 2000000000", "says end at 16000001024"},
        {"^IMAGE = 3", "^TABLE = 3", "no ^IMAGE"},
        {"^IMAGE = 3", "^IMAGE = 1", "^IMAGE points at byte 1, inside the label"},
        {"LINES", "ENCODING_TYPE = JP2\r\n LINES", "ENCODING_TYPE is JP2"}}) {
    EXPECT_THAT(failure(replaced(attached(), what, by) + samples(12, 2, true)), HasSubstr(said));
  }
}

}  // namespace
}  // namespace isohf
