#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>

#include "formats/reader_failure.h"
#include "formats/readers.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "support/rasters/every_window.h"
#include "support/rasters/place_at.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr std::size_t kLabelBytes = 1536;

const char* const kMapping =
    "  Group = Mapping\n    ProjectionName = SimpleCylindrical\n    TargetName = Moon\n    EquatorialRadius = "
    "1737400.0 "
    "<meters>\n    PolarRadius = 1737400.0 <meters>\n    UpperLeftCornerX = -100.0 <meters>\n    UpperLeftCornerY = "
    "200.0 "
    "<meters>\n    PixelResolution = 10.0 <meters/pixel>\n  End_Group\n";

std::string label(const std::string& layout, int bands, const std::string& pixels, const std::string& more = kMapping) {
  std::string text = fmt::format(
      "Object = IsisCube\n  Object = Core\n    StartByte = {}\n    {}\n    Group = Dimensions\n      Samples = 5\n"
      "      Lines = 4\n      Bands = {}\n    End_Group\n    Group = Pixels\n      {}\n    End_Group\n  End_Object\n{}"
      "End_Object\nObject = Label\n  Bytes = {}\nEnd_Object\nEnd\n",
      kLabelBytes + 1, layout, bands, pixels, more, kLabelBytes);
  text.resize(kLabelBytes, '\0');
  return text;
}

const char* const kWord = "Type = SignedWord\n ByteOrder = Lsb\n Base = 1737400.0\n Multiplier = 0.5";
const char* const kTiles = "Format = Tile\n TileSamples = 3\n TileLines = 2";

int height_at(int band, int column, int row) {
  return 1000 * band + 100 * row + column - 150;
}

void put_word(std::string& bytes, int value, bool big_endian) {
  const char low = static_cast<char>(value & 0xFF);
  const char high = static_cast<char>((value >> 8) & 0xFF);
  bytes += big_endian ? high : low;
  bytes += big_endian ? low : high;
}

/// The samples of a cube of 5 x 4 in tiles of that size, the last ones filled up with NULL.
std::string tiles(int tile_columns, int tile_rows, int bands, bool big_endian) {
  std::string bytes;
  for (int b = 0; b < bands; ++b) {
    for (int top = 0; top < 4; top += tile_rows) {
      for (int left = 0; left < 5; left += tile_columns) {
        for (int r = top; r < top + tile_rows; ++r) {
          for (int c = left; c < left + tile_columns; ++c) {
            put_word(bytes, r < 4 && c < 5 ? height_at(b, c, r) : -32768, big_endian);
          }
        }
      }
    }
  }
  return bytes;
}

class Isis3 : public test::ReaderTest {
 protected:
  std::string write(const std::string& bytes) const { return ReaderTest::write("a.cub", bytes); }

  std::string failure(const std::string& bytes) const { return failure_at(write(bytes), nullptr, kIsis3Format.open); }

  /// With a word of its map replaced.
  SourceInfo on_map(const std::string& word, const std::string& by) const {
    std::string mapping = kMapping;
    mapping.replace(mapping.find(word), word.size(), by);
    return open_raster(write(label(kTiles, 1, kWord, mapping) + tiles(3, 2, 1, false)), {})->info();
  }
};

TEST_F(Isis3, WindowsEqualTheWholeInEveryLayout) {
  for (const auto& [layout, tile_columns, tile_rows] : {std::tuple(kTiles, 3, 2),
                                                        {"Format = BandSequential", 5, 4},
                                                        {"Format = Tile\nTileSamples=8\nTileLines=8", 8, 8},
                                                        {"Format = Tile\nTileSamples=1\nTileLines=3", 1, 3}}) {
    for (const bool big_endian : {false, true}) {
      std::string pixels = kWord;
      if (big_endian) pixels.replace(pixels.find("Lsb"), 3, "Msb");
      for (int band = 0; band < 2; ++band) {
        const auto source = open_raster(write(label(layout, 2, pixels) + tiles(tile_columns, tile_rows, 2, big_endian)),
                                        test::of_channel(std::to_string(band)));
        test::expect_every_window(*source, test::stored<std::int16_t>(5, 4, [&](std::int64_t c, std::int64_t r) {
          return height_at(band, static_cast<int>(c), static_cast<int>(r));
        }));
      }
    }
  }
}

TEST_F(Isis3, FollowsADetachedLabelToItsCore) {
  const std::string whole = label(kTiles, 1, kWord) + tiles(3, 2, 1, false);
  std::string text = label(std::string("^Core = DATA.cub\n") + kTiles, 1, kWord);
  test::write_file(folder / "whole.cub", whole);
  test::write_file(folder / "data.CUB", std::string(kLabelBytes, 'x') + tiles(3, 2, 1, false));
  const std::string path = folder / "outside.lbl";
  test::write_file(path, text);
  const auto expected = open_raster(folder / "whole.cub", {});
  const auto source = open_raster(path, {});
  EXPECT_EQ(test::read_whole(*source), test::read_whole(*expected));
  EXPECT_EQ(source->info().georeference.origin_x, expected->info().georeference.origin_x);
  std::filesystem::remove(folder / "data.CUB");
  EXPECT_THAT(failure_at(path, nullptr, kIsis3Format.open),
              HasSubstr("^Core names DATA.cub, which must be a file beside the label"));
}

TEST_F(Isis3, PlacesPixelsAndScalesThem) {
  const auto source = open_raster(write(label(kTiles, 1, kWord) + tiles(3, 2, 1, false)), {});
  const SourceInfo& info = source->info();
  EXPECT_EQ(info.georeference.registration, Registration::kArea);
  EXPECT_THAT(test::grid_of(info.georeference), ElementsAre(-95.0, 195.0, 10.0, 10.0));
  EXPECT_EQ(info.georeference.system.name, "SimpleCylindrical Moon");
  EXPECT_EQ(info.georeference.system.inverse_flattening, 0.0);
  EXPECT_EQ(info.z_scale, 0.5);
  EXPECT_EQ(info.z_offset, 1737400.0);
  const auto bare = open_raster(write(label(kTiles, 1, kWord, "") + tiles(3, 2, 1, false)), {});
  EXPECT_FALSE(bare->info().georeference.has_origin);
  EXPECT_TRUE(bare->info().warnings.empty());
}

/// What they mean reference_systems.py compares with GDAL.
TEST_F(Isis3, MapsAreUnderstoodOrMissedAloud) {
  for (const auto& [kind, more, lost] :
       {std::tuple("ObliqueCylindrical", "PoleLatitude = 30\nPoleRotation = 10\n", ""),
        {"PointPerspective", "Distance = 30000\n", ""},
        {"PointPerspective", "Distance = 1000\n", "the map projection PointPerspective is not known"},
        {"PointPerspective", "", "the map projection PointPerspective is not known"},
        {"Planar", "", "the map projection Planar is not known: coordinates are those of a map without a name"}}) {
    const SourceInfo info = on_map("SimpleCylindrical", std::string(kind) + "\n" + more);
    EXPECT_EQ(info.georeference.unit, HorizontalUnit::kMetre);
    EXPECT_EQ(info.georeference.system.wkt.empty(), *lost != '\0') << kind << more;
    ASSERT_EQ(info.warnings.size(), *lost != '\0' ? 1U : 0U) << kind << more;
    if (*lost == '\0') continue;
    EXPECT_EQ(info.warnings[0].kind, Warning::Kind::kLoss);
    EXPECT_THAT(info.warnings[0], HasSubstr(lost));
  }
  // ISIS draws both to scale on the parallel of the centre.
  for (const char* kind : {"Mercator", "PolarStereographic"}) {
    const std::string wkt =
        on_map("SimpleCylindrical", std::string(kind) + "\nCenterLatitude = -70\n").georeference.system.wkt;
    EXPECT_THAT(wkt, AllOf(HasSubstr("standard parallel\",-70"), HasSubstr("D_Moon"), HasSubstr(kind))) << kind;
  }
  EXPECT_THAT(on_map("UpperLeftCornerX", "x").warnings, ElementsAre(HasSubstr("the origin is unknown")));
  for (const char* without : {"PixelResolution", "Rotation = 5\nTargetName"}) {
    const SourceInfo info = on_map(without[0] == 'P' ? without : "TargetName", without[0] == 'P' ? "x" : without);
    EXPECT_EQ(info.georeference.unit, HorizontalUnit::kUnknown);
    EXPECT_THAT(info.warnings, ElementsAre(HasSubstr("its place is left out")));
  }
}

TEST_F(Isis3, TakesSpecialPixelsForVoids) {
  const auto real = [](std::uint32_t bits) { return static_cast<double>(std::bit_cast<float>(bits)); };
  for (const auto& [name, type, special, plain] :
       {std::tuple("UnsignedByte", SampleType::kUint8, std::vector{0.0, 255.0}, std::vector{1.0, 254.0}),
        {"SignedWord", SampleType::kInt16, {-32768, -32767, -32766, -32765, -32764}, {-32752, 32767}},
        {"UnsignedWord", SampleType::kUint16, {0, 1, 2, 65534, 65535}, {3, 65522}},
        {"UnsignedInteger", SampleType::kUint32, {0, 1, 2, 4294967294.0, 4294967295.0}, {3, 4294967282.0}},
        {"Real",
         SampleType::kFloat32,
         {real(0xFF7FFFFB), real(0xFF7FFFFF)},
         {real(0xFF7FFFFA), 0.0, real(0x7F7FFFFF)}}}) {
    const auto source =
        open_raster(write(label(kTiles, 1, fmt::format("Type = {}", name)) + std::string(2000, '\1')), {});
    EXPECT_EQ(source->info().sample_type, type);
    for (const double value : special) EXPECT_TRUE(test::is_void(source->info(), value)) << name << value;
    for (const double value : plain) EXPECT_FALSE(test::is_void(source->info(), value)) << name << value;
  }
}

TEST_F(Isis3, NamesWhatItRefuses) {
  const std::string data = tiles(3, 2, 1, false);
  EXPECT_THAT(failure(label("Format = Spiral", 1, kWord) + data), HasSubstr("FORMAT is \"Spiral\", must be Tile"));
  EXPECT_THAT(failure(label(kTiles, 1, "Type = Double") + data), HasSubstr("TYPE is \"Double\", must be UnsignedByte"));
  EXPECT_THAT(failure(label(kTiles, 3, kWord) + data), HasSubstr("ends early"));
  EXPECT_THAT(failure(label(std::string("^Core = \"other.cub\"\n") + kTiles, 1, kWord) + data),
              HasSubstr("^Core names other.cub, which must be a file beside the label"));
  std::string early = label(kTiles, 1, kWord) + data;
  early.replace(early.find("1537"), 4, "0099");
  EXPECT_THAT(failure(early), HasSubstr("STARTBYTE is \"0099\", must be behind the label"));
}

}  // namespace
}  // namespace isohf
