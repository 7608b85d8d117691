#include "formats/readers.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <tuple>

#include "formats/reader_failure.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "support/error_of.h"
#include "support/rasters/every_window.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

class HgtSource : public test::ReaderTest {};

/// A void in front, then rising.
int sample(int i) {
  return i == 0 ? -32768 : i % 9000 - 100;
}

/// The same big-endian.
std::vector<std::byte> tile(int columns, int rows) {
  std::vector<std::byte> bytes;
  for (int i = 0; i < columns * rows; ++i) {
    const int value = sample(i);
    bytes.push_back(static_cast<std::byte>((value >> 8) & 0xFF));
    bytes.push_back(static_cast<std::byte>(value & 0xFF));
  }
  return bytes;
}

ErrorCode code_of(const std::string& path, const OpenOptions& options = {}) {
  const Error error = test::error_of([&] { (void)test::read_whole(*kHgtFormat.open(path, options)); });
  EXPECT_NE(std::string(error.what()).find(path), std::string::npos) << error.what();
  return error.code();
}

TEST_F(HgtSource, TakesTheCornerFromTheName) {
  const std::tuple<const char*, double, double> rows[] = {
      {"N44E006.hgt", 6, 45},         {"s35e145.hgt", 145, -34},     {"S01W180.HGT", -180, 0},
      {"n00w001.SRTMGL1.hgt", -1, 1}, {"N44E006v2.hgt", 6, 45},      {"srtm_n44e006_v3.hgt", 6, 45},
      {"N91E006-n44e006.hgt", 6, 45}, {"N44E006_N45E007.hgt", 6, 45}};
  for (const auto& [name, x, y] : rows) {
    const Georeference place = kHgtFormat.open(write(name, tile(3, 3)), {})->info().georeference;
    EXPECT_TRUE(place.has_origin) << name;
    EXPECT_EQ(place.spacing_x, 0.5);
    EXPECT_EQ(std::pair(place.origin_x, place.origin_y), std::pair(x, y)) << name;
  }
  for (const char* name : {"terrain.hgt", "N91E006.hgt", "N44E181.hgt", "N4.hgt", "NxxE006.hgt", "srtmN44E006.hgt",
                           "srtm_N44E006v3.hgt", "a_N44E006_N45E007.hgt"}) {
    const auto source = kHgtFormat.open(write(name, tile(1201, 1201)), {});
    EXPECT_FALSE(source->info().georeference.has_origin) << name;
    EXPECT_EQ(source->info().warnings.size(), 1U) << name;
  }
}

TEST_F(HgtSource, ReadsSquaresAndHalvedColumns) {
  const auto size = [&](int columns, int rows) {
    const auto source = kHgtFormat.open(write("N60E010.hgt", tile(columns, rows)), {});
    EXPECT_EQ(source->info().width, columns);
    EXPECT_EQ(source->info().height, rows);
    return source->info().warnings.size();
  };
  EXPECT_EQ(size(1201, 1201), 0U);
  EXPECT_EQ(size(3601, 3601), 0U);
  EXPECT_EQ(size(1801, 3601), 0U);
  EXPECT_EQ(size(2, 2), 1U);
  EXPECT_EQ(size(601, 601), 1U);
}

TEST_F(HgtSource, WindowsEqualTheWhole) {
  const auto source = kHgtFormat.open(write("N01E001.hgt", tile(7, 7)), {});
  test::expect_every_window(*source, test::stored<std::int16_t>(7, 7, [](std::int64_t c, std::int64_t r) {
    return sample(static_cast<int>(7 * r + c));
  }));
}

TEST_F(HgtSource, RefusesWhatIsNoTile) {
  EXPECT_EQ(code_of(write("N01E001.hgt", "")), ErrorCode::kCorrupt);
  EXPECT_EQ(code_of(write("N01E001.hgt", std::vector<std::byte>(2))), ErrorCode::kCorrupt);
  EXPECT_EQ(code_of(write("N01E001.hgt", std::vector<std::byte>(17))), ErrorCode::kCorrupt);
  EXPECT_EQ(code_of(write("N01E001.hgt", std::vector<std::byte>(2884800))), ErrorCode::kCorrupt);
  EXPECT_EQ(code_of(folder / "N02E002.hgt"), ErrorCode::kIo);
  EXPECT_EQ(code_of(folder.path()), ErrorCode::kIo);
  EXPECT_EQ(code_of(write("N01E001.hgt", tile(3, 3)), test::of_channel("R")), ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace isohf
