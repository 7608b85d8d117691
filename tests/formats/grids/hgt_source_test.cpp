#include "formats/readers.h"

#include <gtest/gtest.h>

#include <cstring>

#include <filesystem>
#include <fstream>

#include "formats/io/zip_archive.h"
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

std::vector<std::byte> zipped(const std::string& name, const std::vector<std::byte>& contents, bool deflated,
                              bool zip64 = false) {
  return test::zip_archive({{name, contents}}, deflated, zip64);
}

ErrorCode code_of(const std::string& path, const OpenOptions& options = {}) {
  const Error error = test::error_of([&] { (void)test::read_whole(*open_hgt(path, options)); });
  EXPECT_NE(std::string(error.what()).find(path), std::string::npos) << error.what();
  return error.code();
}

TEST_F(HgtSource, TakesTheCornerFromTheName) {
  const auto corner = [&](const std::string& name) {
    const auto source = open_hgt(write(name, tile(3, 3)), {});
    const Georeference& geo = source->info().georeference;
    EXPECT_TRUE(geo.has_origin);
    EXPECT_EQ(geo.spacing_x, 0.5);
    return std::pair(geo.origin_x, geo.origin_y);
  };
  EXPECT_EQ(corner("N44E006.hgt"), std::pair(6.0, 45.0));
  EXPECT_EQ(corner("s35e145.hgt"), std::pair(145.0, -34.0));
  EXPECT_EQ(corner("S01W180.HGT"), std::pair(-180.0, 0.0));
  EXPECT_EQ(corner("n00w001.SRTMGL1.hgt"), std::pair(-1.0, 1.0));
}

TEST_F(HgtSource, KeepsATileWithoutPlaceAndSaysSo) {
  for (const char* name : {"terrain.hgt", "N91E006.hgt", "N44E181.hgt", "N4.hgt", "NxxE006.hgt"}) {
    const auto source = open_hgt(write(name, tile(1201, 1201)), {});
    EXPECT_FALSE(source->info().georeference.has_origin) << name;
    EXPECT_EQ(source->info().warnings.size(), 1U) << name;
  }
}

TEST_F(HgtSource, ReadsSquaresAndHalvedColumns) {
  const auto size = [&](int columns, int rows) {
    const auto source = open_hgt(write("N60E010.hgt", tile(columns, rows)), {});
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
  for (const std::string& path :
       {write("N01E001.hgt", tile(7, 7)), write("N01E001.hgt.zip", zipped("N01E001.hgt", tile(7, 7), true))}) {
    const auto source = open_hgt(path, {});
    test::expect_every_window(*source, test::stored<std::int16_t>(7, 7, [](std::int64_t c, std::int64_t r) {
      return sample(static_cast<int>(7 * r + c));
    }));
  }
}

TEST_F(HgtSource, ReadsStoredAndDeflatedMembers) {
  for (const int kind : {0, 1, 2, 3}) {
    const auto zip = zipped("folder/S10W070.hgt", tile(11, 11), kind % 2 == 1, kind >= 2);
    const auto source = open_hgt(write("any.hgt.zip", zip), {});
    EXPECT_EQ(source->info().georeference.origin_y, -9.0);
    EXPECT_EQ(source->info().georeference.origin_x, -70.0);
    EXPECT_EQ(test::value_at(SampleType::kInt16, test::read_whole(*source), 120), 20);
  }
}

TEST_F(HgtSource, SaysWhenAnArchiveHoldsAnotherTileThanItsNameSays) {
  const auto source = open_hgt(write("N46E007.hgt.zip", zipped("N45E006.hgt", tile(1201, 1201), true)), {});
  EXPECT_EQ(source->info().georeference.origin_x, 6.0);
  ASSERT_EQ(source->info().warnings.size(), 1U);
  EXPECT_NE(source->info().warnings[0].find("is called N46E007.hgt.zip and holds N45E006.hgt"), std::string::npos);
}

TEST_F(HgtSource, RefusesAZip64ArchiveWhoseRecordsAreElsewhere) {
  const auto zip = zipped("N01E001.hgt", tile(5, 5), true, true);
  constexpr std::size_t kEnd = 22;
  constexpr std::size_t kLocator = 20;
  constexpr std::size_t kEnd64 = 56;
  const auto changed = [&](std::size_t from_end, std::uint64_t value) {
    auto damaged = zip;
    std::memcpy(damaged.data() + damaged.size() - from_end, &value, sizeof value);
    return code_of(write("N01E001.hgt.zip", damaged));
  };
  for (const std::uint64_t far : {std::uint64_t{1} << 40U, ~std::uint64_t{0}, std::uint64_t{zip.size()}}) {
    EXPECT_EQ(changed(kEnd + kLocator - 8, far), ErrorCode::kCorrupt);           // of the end record
    EXPECT_EQ(changed(kEnd + kLocator + 8, far), ErrorCode::kCorrupt);           // of the directory
    EXPECT_EQ(changed(kEnd + kLocator + 16, far), ErrorCode::kCorrupt);          // its size
    EXPECT_EQ(changed(kEnd + kLocator + 24, far), ErrorCode::kCorrupt);          // the number of members
    EXPECT_EQ(changed(kEnd + kLocator + kEnd64 + 8, far), ErrorCode::kCorrupt);  // the member's header
    EXPECT_EQ(changed(kEnd + kLocator, far), ErrorCode::kCorrupt);               // the locator's signature
  }
}

TEST_F(HgtSource, NeverCrashesOnADamagedArchive) {
  const auto zip = zipped("N01E001.hgt", tile(5, 5), true);
  const auto intact = tile(5, 5);
  for (std::size_t at = 0; at < zip.size(); ++at) {
    for (const int bits : {0x01, 0x80, 0xFF}) {
      auto damaged = zip;
      damaged[at] ^= static_cast<std::byte>(bits);
      const std::string path = write("N01E001.hgt.zip", damaged);
      std::string found;
      for (const std::uint64_t held : {std::uint64_t{1} << 20U, std::uint64_t{0}}) {
        OpenOptions options;
        options.unpacked_bytes = held;
        std::string failure;
        try {
          const auto source = open_hgt(path, options);
          auto raw = test::read_whole(*source);
          for (std::size_t i = 0; i + 1 < raw.size(); i += 2) std::swap(raw[i], raw[i + 1]);
          EXPECT_EQ(raw, intact) << at;
        } catch (const Error& error) {
          failure = error.what();
        }
        if (held == 0) {
          EXPECT_EQ(failure, found) << at;
        }
        found = failure;
      }
    }
  }
}

TEST_F(HgtSource, IsFoundInAnArchiveOfAnotherName) {
  const std::string path = write("NASADEM_HGT_n44e006.zip", zipped("n44e006.hgt", tile(7, 7), true));
  EXPECT_TRUE(is_zip_of_hgt(path));
  const auto source = open_raster(path, {});
  EXPECT_EQ(source->info().format, "SRTM HGT");
  EXPECT_EQ(source->info().georeference.origin_y, 45.0);
  EXPECT_FALSE(is_zip_of_hgt(write("other.zip", zipped("readme.txt", tile(3, 3), true))));
  EXPECT_FALSE(is_zip_of_hgt(write("none.zip", tile(3, 3))));
  EXPECT_FALSE(is_zip_of_hgt(folder / "absent.zip"));
}

TEST_F(HgtSource, RefusesWhatIsNoTile) {
  EXPECT_EQ(code_of(write("N01E001.hgt", "")), ErrorCode::kCorrupt);
  EXPECT_EQ(code_of(write("N01E001.hgt", std::vector<std::byte>(2))), ErrorCode::kCorrupt);
  EXPECT_EQ(code_of(write("N01E001.hgt", std::vector<std::byte>(17))), ErrorCode::kCorrupt);
  EXPECT_EQ(code_of(write("N01E001.hgt", std::vector<std::byte>(2884800))), ErrorCode::kCorrupt);
  EXPECT_EQ(code_of(folder / "N02E002.hgt"), ErrorCode::kIo);
  EXPECT_EQ(code_of(folder.path()), ErrorCode::kIo);
  EXPECT_EQ(code_of(write("N01E001.hgt.zip", zipped("readme.txt", tile(3, 3), true))), ErrorCode::kUnsupported);
  EXPECT_EQ(code_of(write("N01E001.hgt", tile(3, 3)), test::of_channel("R")), ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace isohf
