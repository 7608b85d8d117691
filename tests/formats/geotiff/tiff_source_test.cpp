#include "formats/readers.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>

#include "formats/geotiff/tiff_bytes.h"
#include "isohf/base/sample.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "support/error_of.h"
#include "support/rasters/place_at.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

using test::TiffBytes;

template <typename T>
std::string bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

/// 2 columns, 3 rows of int16: 0, 1 / 2, 3 / 4, 5.
TiffBytes small() {
  TiffBytes tiff;
  tiff.image(2, 3, 16, 2, 3).block(bytes_of<std::int16_t>({0, 1, 2, 3, 4, 5}));
  return tiff;
}

class TiffSource : public testing::Test {
 protected:
  std::unique_ptr<HeightSource> open(const TiffBytes& tiff, const OpenOptions& options = {}) const {
    return kTiffFormat.open(tiff.write(folder_ / "a.tif"), options);
  }

  SourceInfo info_of(const TiffBytes& tiff, const OpenOptions& options = {}) const {
    return open(tiff, options)->info();
  }

  std::vector<double> values(const TiffBytes& tiff, const OpenOptions& options = {}) const {
    return test::values_of(*open(tiff, options));
  }

  ErrorCode code_of(const TiffBytes& tiff, const OpenOptions& options = {}) const {
    return test::error_of([&] { (void)values(tiff, options); }).code();
  }

  const test::TemporaryFolder folder_;
};

using Values = std::vector<double>;

TEST_F(TiffSource, RecognisesBothByteOrdersAndBigTiff) {
  for (const bool big_endian : {false, true}) {
    for (const bool big_tiff : {false, true}) {
      const std::string file = TiffBytes(big_endian, big_tiff).build();
      EXPECT_TRUE(kTiffFormat.recognises(std::as_bytes(std::span(file))));
      EXPECT_FALSE(kTiffFormat.recognises(std::as_bytes(std::span(file)).first(3)));
    }
  }
  const std::string other = "II*x";
  EXPECT_FALSE(kTiffFormat.recognises(std::as_bytes(std::span(other))));
}

TEST_F(TiffSource, KnowsNothingOfAPlainTiff) {
  const SourceInfo info = info_of(small());
  EXPECT_EQ(info.format, "TIFF");
  EXPECT_EQ(info.georeference.registration, Registration::kUnknown);
  EXPECT_EQ(info.georeference.unit, HorizontalUnit::kUnknown);
  EXPECT_FALSE(info.georeference.has_origin);
  EXPECT_TRUE(info.void_values.empty());
  EXPECT_TRUE(info.channel.empty());
  EXPECT_TRUE(info.warnings.empty());
}

TEST_F(TiffSource, TurnsAnImageStoredFromTheBottom) {
  EXPECT_EQ(values(small()), (Values{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(values(small().shorts(274, {4})), (Values{4, 5, 2, 3, 0, 1}));
  const auto source = open(small().shorts(274, {4}));
  EXPECT_EQ(test::values_of(SampleType::kInt16, test::read_window(*source, {1, 0, 1, 2})), (Values{5, 3}));
}

TEST_F(TiffSource, TurnsAGeoreferenceThatRunsFromTheSouth) {
  TiffBytes tiff = small().doubles(34264, {10, 0, 0, 500, 0, 20, 0, 7000, 0, 0, 0, 0, 0, 0, 0, 1});
  EXPECT_EQ(values(tiff), (Values{4, 5, 2, 3, 0, 1}));
  const Georeference geo = info_of(tiff).georeference;
  EXPECT_THAT(test::grid_of(geo), ::testing::ElementsAre(505, 7050, 10, 20));
}

TEST_F(TiffSource, IgnoresTheOrientationOfAGeoreferencedImage) {
  const TiffBytes tiff = small().shorts(274, {4}).doubles(33550, {1, 1, 0}).doubles(33922, {0, 0, 0, 5, 6, 0});
  EXPECT_EQ(values(tiff), (Values{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(info_of(tiff).warnings.size(), 1U);
}

TEST_F(TiffSource, RefusesRotationAndMirrorImages) {
  EXPECT_EQ(code_of(small().doubles(34264, {10, 1, 0, 0, 1, -10, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1})),
            ErrorCode::kUnsupported);
  EXPECT_EQ(code_of(small().doubles(34264, {-10, 0, 0, 0, 0, -10, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1})),
            ErrorCode::kUnsupported);
  EXPECT_EQ(code_of(small().doubles(34264, {10, 0, 0, 0})), ErrorCode::kCorrupt);
  EXPECT_EQ(code_of(small().doubles(33550, {0, 0, 0})), ErrorCode::kCorrupt);
  EXPECT_EQ(code_of(small().doubles(33550, {1, NAN, 0})), ErrorCode::kCorrupt);
}

TEST_F(TiffSource, PlacesBySidecarFilesWhereTheTagsDoNot) {
  test::write_file(folder_ / "a.tfw", "30\n0\n0\n-20\n1000.5\n2000.5\n");
  test::write_file(folder_ / "a.prj",
                   "PROJCS[\"somewhere\",GEOGCS[\"S\",DATUM[\"S\",SPHEROID[\"S\",6378137,298]],"
                   "PRIMEM[\"Greenwich\",0],UNIT[\"Degree\",0.0174532925199433]],PROJECTION[\"Mercator_1SP\"],"
                   "PARAMETER[\"central_meridian\",0],PARAMETER[\"scale_factor\",1],UNIT[\"Foot\",0.3048]]\n");
  SourceInfo info = info_of(small());
  EXPECT_THAT(test::grid_of(info.georeference), ::testing::ElementsAre(1000.5, 2000.5, 30, 20));
  EXPECT_EQ(info.georeference.system.name, "somewhere");
  EXPECT_EQ(info.georeference.system.wkt.rfind("PROJCS[\"somewhere\"", 0), 0U);
  EXPECT_EQ(info.georeference.unit, HorizontalUnit::kMetre);
  EXPECT_EQ(info.georeference.metres_per_unit, 0.3048);
  info = info_of(small().doubles(33550, {1, 1, 0}).doubles(33922, {0, 0, 0, 5, 6, 0}));
  EXPECT_EQ(info.georeference.spacing_x, 1);
  test::write_file(folder_ / "a.tfw", "30\n0\n0\n20\n1000.5\n2000.5\n");
  EXPECT_EQ(info_of(small()).georeference.origin_y, 2040.5);
  EXPECT_EQ(values(small()), (Values{4, 5, 2, 3, 0, 1}));
  test::write_file(folder_ / "a.tfw", "30\n1\n0\n20\n1000.5\n2000.5\n");
  EXPECT_EQ(code_of(small()), ErrorCode::kUnsupported);
  test::write_file(folder_ / "a.tfw", "thirty");
  EXPECT_EQ(code_of(small()), ErrorCode::kCorrupt);
}

TEST_F(TiffSource, TakesVoidsAndScaleFromGdalTags) {
  TiffBytes tiff = small()
                       .ascii(42113, "-32768 ")
                       .ascii(42112,
                              "<GDALMetadata>\n"
                              "  <Item name=\"SCALE\" sample=\"1\" role=\"scale\">9</Item>\n"
                              "  <Item name=\"SCALE\" sample=\"0\" role=\"scale\">0.5</Item>\n"
                              "  <Item name=\"OFFSET\" sample=\"0\" role=\"offset\">1737400</Item>\n"
                              "  <Item name=\"UNITTYPE\" sample=\"0\" role=\"unittype\">ft</Item>\n"
                              "  <Item name=\"note\">12</Item>\n</GDALMetadata>\n");
  const SourceInfo info = info_of(tiff);
  EXPECT_EQ(info.void_values, Values{-32768});
  EXPECT_EQ(info.z_scale, 0.5);
  EXPECT_EQ(info.z_offset, 1737400);
  EXPECT_EQ(info.vertical_unit, "foot");
  EXPECT_EQ(info.metres_per_vertical_unit, 0.3048);
  EXPECT_TRUE(info.warnings.empty());
  OpenOptions options;
  options.z_scale = 3.0;
  options.void_values = {5.0};
  EXPECT_EQ(info_of(tiff, options).z_scale, 1.5);
  EXPECT_EQ(info_of(tiff, options).z_offset, 5212200);
  EXPECT_EQ(info_of(tiff, options).void_values, Values{5});
}

TEST_F(TiffSource, KnowsUnitsThatAreLengths) {
  const auto with = [&](const std::string& unit) {
    return info_of(small().ascii(42112, "<GDALMetadata><Item name=\"UNITTYPE\" sample=\"0\" role=\"unittype\">" + unit +
                                            "</Item></GDALMetadata>"));
  };
  EXPECT_EQ(with("dm").metres_per_vertical_unit, 0.1);
  EXPECT_EQ(with("1/10 m").metres_per_vertical_unit, 0.1);
  EXPECT_EQ(with("Clarke&apos;s foot").vertical_unit, "Clarke's foot");
  // GDAL escapes twice.
  for (const char* unknown : {"mGal", "a &amp;lt; b", "a &lt; b"}) {
    const SourceInfo info = with(unknown);
    EXPECT_TRUE(info.vertical_unit.empty());
    ASSERT_EQ(info.warnings.size(), 1U);
    EXPECT_EQ(info.warnings[0].kind, Warning::Kind::kLoss);
    EXPECT_THAT(info.warnings[0], testing::HasSubstr(std::string(unknown) == "mGal" ? "\"mGal\"" : "\"a < b\""));
  }
}

TEST_F(TiffSource, TakesTheVoidValueBesideBeforeItsOwn) {
  test::write_file(folder_ / "a.tif.aux.xml",
                   "<PAMDataset><PAMRasterBand band=\"1\"><NoDataValue>4</NoDataValue></PAMRasterBand></PAMDataset>");
  const SourceInfo info = info_of(small().ascii(42113, "-32768"));
  EXPECT_EQ(info.void_values, Values{4});
  EXPECT_TRUE(info.warnings.empty());
}

TEST_F(TiffSource, WarnsOfVoidsThatCannotBe) {
  for (const char* text : {"-99999", "nan", "none", "1.5", "1e999"}) {
    const SourceInfo info = info_of(small().ascii(42113, text));
    EXPECT_TRUE(info.void_values.empty()) << text;
    EXPECT_EQ(info.warnings.size(), 1U) << text;
  }
}

TEST_F(TiffSource, FindsFloatVoidsByTheirDecimalTexts) {
  constexpr double kLowest = std::numeric_limits<float>::lowest();
  struct Row {
    const char* text;
    int bits;
    double stored;
  };
  for (const Row& row :
       {Row{"-3.4028234663852886e+38", 32, kLowest}, Row{"-3.40282346638529e+38", 32, kLowest},
        Row{"-3.402823e+38", 32, kLowest}, Row{"-3.4028235e+38", 32, kLowest}, Row{"-3.40282e+38", 32, kLowest},
        Row{"1.701412e+38", 32, 0x1p127}, Row{"-2.147484e+09", 32, -0x1p31}, Row{"-9999", 32, -9999.0},
        Row{"1e20", 32, float{1e20F}}, Row{"-32767.99", 32, float{-32767.99F}},
        Row{"-1.79769313486232e+308", 64, std::numeric_limits<double>::lowest()},
        Row{"-3.4028234663852886e+38", 64, kLowest}}) {
    TiffBytes tiff;
    tiff.image(2, 1, row.bits, 3, 1);
    if (row.bits == 32) {
      tiff.block(bytes_of<float>({static_cast<float>(row.stored), 1.0F}));
    } else {
      tiff.block(bytes_of<double>({row.stored, 1.0}));
    }
    const auto source = open(tiff.ascii(42113, row.text));
    EXPECT_TRUE(source->info().warnings.empty());
    std::vector<float> heights(2);
    heights_from_samples(source->info(), 0.0, test::read_whole(*source), heights);
    EXPECT_TRUE(std::isnan(heights[0])) << row.text;
    EXPECT_EQ(heights[1], 1.0F);
  }
  TiffBytes tiff;
  tiff.image(2, 1, 32, 3, 1).block(bytes_of<float>({1.0F, 2.0F}));
  EXPECT_TRUE(std::isnan(info_of(tiff.ascii(42113, "nan")).void_values.at(0)));
}

TEST_F(TiffSource, TakesFloatsBeyondAnyHeightForVoidsWhereNoneAreDeclared) {
  TiffBytes tiff;
  tiff.image(3, 1, 32, 3, 1).block(bytes_of<float>({std::numeric_limits<float>::lowest(), 1.0F, 1e31F}));
  const auto source = open(tiff);
  std::vector<float> heights(3);
  heights_from_samples(source->info(), 0.0, test::read_whole(*source), heights);
  EXPECT_TRUE(std::isnan(heights[0]));
  EXPECT_EQ(heights[1], 1.0F);
  EXPECT_TRUE(std::isnan(heights[2]));
  EXPECT_TRUE(std::isinf(info_of(tiff.ascii(42113, "-9999")).valid_min));
  EXPECT_TRUE(std::isinf(info_of(small()).valid_min));
}

TEST_F(TiffSource, PicksTheChannel) {
  TiffBytes tiff;
  tiff.image(2, 1, 16, 1, 1).shorts(262, {2}).shorts(277, {4}).shorts(258, {16, 16, 16, 16}).shorts(338, {2});
  tiff.shorts(339, {1, 1, 1, 1}).block(bytes_of<std::uint16_t>({10, 20, 30, 40, 11, 21, 31, 41}));
  const auto with = [&](const std::string& channel) {
    const OpenOptions options = test::of_channel(channel);
    EXPECT_EQ(info_of(tiff, options).warnings.size(), channel.empty() ? 1U : 0U);
    return values(tiff, options);
  };
  EXPECT_EQ(with(""), (Values{10, 11}));
  EXPECT_EQ(with("0"), (Values{10, 11}));
  EXPECT_EQ(with("g"), (Values{20, 21}));
  EXPECT_EQ(with("B"), (Values{30, 31}));
  EXPECT_EQ(with("A"), (Values{40, 41}));
  EXPECT_EQ(with("3"), (Values{40, 41}));
  OpenOptions options = test::of_channel("2");
  EXPECT_EQ(info_of(tiff, options).channel, "B");
  for (const char* wrong : {"4", "Y", "-1", "R ", "00x"}) {
    options.channel = wrong;
    EXPECT_EQ(code_of(tiff, options), ErrorCode::kInvalidArgument) << wrong;
  }
}

TEST_F(TiffSource, PicksTheChannelThatIsDescribedAsElevations) {
  const auto described = [](const std::string& first, const std::string& second) {
    TiffBytes tiff;
    tiff.image(2, 1, 16, 1, 1).shorts(277, {3}).shorts(258, {16, 16, 16}).shorts(338, {0, 0}).shorts(339, {1, 1, 1});
    tiff.block(bytes_of<std::uint16_t>({10, 20, 30, 11, 21, 31}));
    const std::string item = "<Item name=\"DESCRIPTION\" sample=\"{}\" role=\"description\">{}</Item>";
    return tiff.ascii(42112, "<GDALMetadata>" + fmt::format(fmt::runtime(item), 0, first) +
                                 fmt::format(fmt::runtime(item), 1, second) + "</GDALMetadata>");
  };
  EXPECT_EQ(values(described("slope", "elevation")), (Values{20, 21}));
  EXPECT_EQ(info_of(described("slope", "elevation")).warnings,
            std::vector<Warning>{"there are 3 bands; channel elevation is read"});
  EXPECT_EQ(values(described("Z", "DEM [m]")), (Values{20, 21}));
  EXPECT_EQ(values(described("slope", "z")), (Values{20, 21}));
  EXPECT_EQ(values(described("Height", "elevation")), (Values{10, 11}));
  EXPECT_EQ(values(described("slope", "elevation error")), (Values{10, 11}));
  EXPECT_EQ(values(described("slope", "elevation"), test::of_channel("0")), (Values{10, 11}));
  for (const char* stored : {"Rock &amp; Ice &lt;m&gt;", "Rock &amp;amp; Ice &amp;lt;m&amp;gt;"}) {
    EXPECT_EQ(values(described("slope", stored), test::of_channel("Rock & Ice <m>")), (Values{20, 21}));
  }
}

/// Pixels of `channels` samples; of four the last one is of kind `extra` (TIFF's ExtraSamples).
template <typename T>
TiffBytes colours(std::size_t channels, const std::vector<T>& samples, std::uint64_t extra = 2) {
  TiffBytes tiff;
  const auto all = [&](std::uint64_t value) { return std::vector<std::uint64_t>(channels, value); };
  tiff.image(samples.size() / channels, 1, 8 * sizeof(T), 1, 1).shorts(262, {2}).shorts(277, {channels});
  tiff.shorts(258, all(8 * sizeof(T))).shorts(339, all(1)).block(bytes_of<T>(samples));
  if (channels == 4) tiff.shorts(338, {extra});
  return tiff;
}

TEST_F(TiffSource, RefusesAColourPictureUnlessAChannelIsNamed) {
  const TiffBytes tiff = colours<std::uint8_t>(3, {'a', 'b', 'c'});
  EXPECT_EQ(code_of(tiff), ErrorCode::kUnsupported);
  EXPECT_EQ(values(tiff, test::of_channel("G")), (Values{'b'}));
}

TEST_F(TiffSource, ReadsEqualColoursAsGreyWithoutWhatIsTransparent) {
  EXPECT_EQ(values(colours<std::uint8_t>(3, {7, 7, 7, 9, 9, 9})), (Values{7, 9}));
  for (const std::uint64_t extra : {1U, 2U, 0U}) {  // associated and unassociated opacity, and no statement
    const TiffBytes tiff =
        colours<std::uint16_t>(4, {300, 300, 300, 65535, 0, 0, 0, 0, 1800, 1800, 1800, 65535}, extra);
    const auto source = open(tiff);
    std::vector<float> heights(3);
    heights_from_samples(source->info(), 0.0, test::read_whole(*source), heights);
    EXPECT_EQ(heights[0], 300.0F);
    EXPECT_EQ(std::isnan(heights[1]), extra != 0) << extra;
    EXPECT_EQ(heights[2], 1800.0F);
    EXPECT_EQ(values(tiff, test::of_channel("R")), (Values{300, 0, 1800}));
  }
}

TEST_F(TiffSource, ReadsElevationsThatArePackedIntoColours) {
  const std::vector<std::uint8_t> bytes = {1, 134, 160, 1, 134, 170};  // 100000 and 100010: 0 and 1 m
  OpenOptions options;
  options.encoding = "mapbox";
  TiffBytes tiff = colours<std::uint8_t>(3, bytes);
  EXPECT_EQ(values(tiff, options), (Values{100000, 100010}));
  EXPECT_EQ(info_of(tiff, options).z_offset, -10000.0);
  // Each colour in a plane of its own.
  TiffBytes planes;
  planes.image(2, 1, 8, 1, 1).shorts(262, {2}).shorts(277, {3}).shorts(258, {8, 8, 8}).shorts(339, {1, 1, 1});
  planes.shorts(284, {2}).block(std::string("\x01\x01")).block(std::string("\x86\x86")).block(std::string("\xa0\xaa"));
  EXPECT_EQ(values(planes, options), (Values{100000, 100010}));
  EXPECT_EQ(code_of(colours<std::uint16_t>(3, {1, 2, 3}), options), ErrorCode::kInvalidArgument);
}

TEST_F(TiffSource, ReadsElevationsWithAPaletteIfAChannelIsNamed) {
  for (const int bits : {8, 16}) {
    TiffBytes tiff;
    tiff.image(2, 1, bits, 1, 1).shorts(262, {3}).shorts(320, std::vector<std::uint64_t>(std::size_t{3} << bits, 1));
    tiff.block(bits == 8 ? bytes_of<std::uint8_t>({0, 250}) : bytes_of<std::uint16_t>({0, 250}));
    EXPECT_EQ(test::error_of([&] { (void)info_of(tiff); }).code(), ErrorCode::kUnsupported);
    EXPECT_THAT(test::error_of([&] { (void)info_of(tiff); }).what(), testing::HasSubstr("`channel` 0"));
    EXPECT_EQ(values(tiff, test::of_channel("0")), (Values{0, 250}));
  }
}

TEST_F(TiffSource, ReadsMinIsWhiteAsHeights) {
  EXPECT_EQ(values(small().shorts(262, {0})), (Values{0, 1, 2, 3, 4, 5}));
}

TEST_F(TiffSource, FillsBlocksThatAreNotStored) {
  for (const int compression : {1, 8}) {
    TiffBytes tiff;
    tiff.image(2, 2, 16, 2, 1, compression).block("");
    std::string row = bytes_of<std::int16_t>({7, 8});
    if (compression == 8) {
      std::string packed(64, '\0');
      uLongf size = packed.size();
      compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(row.data()), row.size());
      row = packed.substr(0, size);
    }
    tiff.block(row);
    EXPECT_EQ(values(tiff), (Values{0, 0, 7, 8}));
    ASSERT_EQ(info_of(tiff).warnings.size(), 1U);
    EXPECT_EQ(info_of(tiff).warnings[0], "1 of 2 strips are not stored in the file; they read as 0");
    EXPECT_EQ(values(tiff.ascii(42113, "-9999")), (Values{-9999, -9999, 7, 8}));
  }
}

/// libtiff writes big-endian files with the floating-point predictor the wrong way round; this one is right: Adobe's
/// Technical Note 3 puts the most significant bytes first whatever the byte order of the file.
TEST_F(TiffSource, ReadsTheFloatPredictorOfABigEndianFile) {
  const std::vector<float> row = {981.8F, 1742.4F, -3.25F, 0.5F};
  std::string planes;
  for (int byte = 3; byte >= 0; --byte) {
    for (const float value : row)
      planes.push_back(static_cast<char>(std::bit_cast<std::uint32_t>(value) >> (8 * byte)));
  }
  for (std::size_t i = planes.size() - 1; i > 0; --i) planes[i] = static_cast<char>(planes[i] - planes[i - 1]);
  std::string packed(128, '\0');
  uLongf size = packed.size();
  compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(planes.data()),
           planes.size());
  TiffBytes tiff(true);
  tiff.image(4, 1, 32, 3, 1, 8).shorts(317, {3}).block(packed.substr(0, size));
  EXPECT_EQ(values(tiff), Values(row.begin(), row.end()));
}

TEST_F(TiffSource, WidensNothingOfHalfFloats) {
  TiffBytes tiff(true);
  tiff.image(3, 1, 16, 3, 1).block(tiff.ordered(bytes_of<std::uint16_t>({0x3C00, 0xFC00, 0x0001}), 2));
  EXPECT_EQ(info_of(tiff).sample_type, SampleType::kFloat16);
  EXPECT_EQ(values(tiff), (Values{1.0, -INFINITY, 0x1p-24}));
}

}  // namespace
}  // namespace isohf
