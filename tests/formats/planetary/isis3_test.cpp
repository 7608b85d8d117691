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
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

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

  std::string failure(const std::string& bytes, ErrorCode* code = nullptr) const {
    return failure_at(write(bytes), code, open_isis3);
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
  ErrorCode code = ErrorCode::kCancelled;
  EXPECT_THAT(test::failure_of(path, &code, [&] { (void)open_raster(path, {}); }),
              HasSubstr("^Core names DATA.cub, which must be a file beside the label"));
  EXPECT_EQ(code, ErrorCode::kIo);
}

TEST_F(Isis3, PlacesPixelsAndScalesThem) {
  const auto source = open_raster(write(label(kTiles, 1, kWord) + tiles(3, 2, 1, false)), {});
  const SourceInfo& info = source->info();
  EXPECT_EQ(info.georeference.registration, Registration::kArea);
  EXPECT_EQ(info.georeference.origin_x, -95.0);
  EXPECT_EQ(info.georeference.origin_y, 195.0);
  EXPECT_EQ(info.georeference.spacing_x, 10.0);
  EXPECT_EQ(info.georeference.system.name, "SimpleCylindrical Moon");
  EXPECT_EQ(info.georeference.system.inverse_flattening, 0.0);
  EXPECT_EQ(info.z_scale, 0.5);
  EXPECT_EQ(info.z_offset, 1737400.0);
  const auto bare = open_raster(write(label(kTiles, 1, kWord, "") + tiles(3, 2, 1, false)), {});
  EXPECT_FALSE(bare->info().georeference.has_origin);
  EXPECT_TRUE(bare->info().warnings.empty());
}

/// What they mean reference_systems.py holds against GDAL.
TEST_F(Isis3, MapsAreUnderstoodOrMissedAloud) {
  const auto warnings_of = [&](const std::string& kind, const std::string& more = "") {
    std::string mapping = kMapping;
    mapping.replace(mapping.find("SimpleCylindrical"), 17, kind + "\n" + more);
    const auto source = open_raster(write(label(kTiles, 1, kWord, mapping) + tiles(3, 2, 1, false)), {});
    EXPECT_EQ(source->info().warnings.empty(), !source->info().georeference.system.wkt.empty());
    return source->info().warnings;
  };
  EXPECT_THAT(warnings_of("ObliqueCylindrical", "PoleLatitude = 30\nPoleRotation = 10\n"), IsEmpty());
  EXPECT_THAT(warnings_of("PointPerspective", "Distance = 30000\n"), IsEmpty());
  for (const std::vector<Warning>& lost :
       {warnings_of("Planar"), warnings_of("PointPerspective"), warnings_of("PointPerspective", "Distance = 1000\n")}) {
    ASSERT_EQ(lost.size(), 1U);
    EXPECT_EQ(lost.front().kind, Warning::Kind::kLoss);
    EXPECT_THAT(lost.front(), HasSubstr("is not known: coordinates are metres of a map without a name"));
  }
  EXPECT_THAT(warnings_of("Planar").front(), HasSubstr("Planar"));
}

TEST_F(Isis3, TakesSpecialPixelsForVoids) {
  struct Kind {
    const char* name;
    SampleType type;
    std::vector<double> special;
    std::vector<double> plain;
  };
  const auto real = [](std::uint32_t bits) { return static_cast<double>(std::bit_cast<float>(bits)); };
  const Kind kinds[] = {
      {"UnsignedByte", SampleType::kUint8, {0, 255}, {1, 254}},
      {"SignedWord", SampleType::kInt16, {-32768, -32767, -32766, -32765, -32764}, {-32752, 32767}},
      {"UnsignedWord", SampleType::kUint16, {0, 1, 2, 65534, 65535}, {3, 65522}},
      {"UnsignedInteger", SampleType::kUint32, {0, 1, 2, 4294967294.0, 4294967295.0}, {3, 4294967282.0}},
      {"Real",
       SampleType::kFloat32,
       {real(0xFF7FFFFB), real(0xFF7FFFFC), real(0xFF7FFFFD), real(0xFF7FFFFE), real(0xFF7FFFFF)},
       {real(0xFF7FFFFA), 0.0, real(0x7F7FFFFF)}}};
  for (const Kind& kind : kinds) {
    SCOPED_TRACE(kind.name);
    const auto source =
        open_raster(write(label(kTiles, 1, fmt::format("Type = {}", kind.name)) + std::string(2000, '\1')), {});
    EXPECT_EQ(source->info().sample_type, kind.type);
    for (const double value : kind.special) EXPECT_TRUE(test::is_void(source->info(), value)) << value;
    for (const double value : kind.plain) EXPECT_FALSE(test::is_void(source->info(), value)) << value;
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
