// Files cut short, damaged or made to mislead: an Error that names the file, or the samples as stored; never a crash, a
// huge allocation or samples made up.

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <zlib.h>

#include "formats/geotiff/tiff_bytes.h"
#include "formats/readers.h"
#include "isohf/error.h"
#include "support/error_of.h"
#include "support/temporary_folder.h"

namespace isohf {
namespace {

using test::TiffBytes;

std::string ramp(std::size_t samples, int first = 0) {
  std::string bytes;
  for (std::size_t i = 0; i < samples; ++i) {
    const auto value = static_cast<std::uint16_t>(first + static_cast<int>(i) * 259);
    bytes.push_back(static_cast<char>(value & 0xFF));
    bytes.push_back(static_cast<char>(value >> 8));
  }
  return bytes;
}

std::string deflated(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string packed(size, '\0');
  compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(),
            9);
  packed.resize(size);
  return packed;
}

/// 6 x 5 samples in three strips of 2 rows.
TiffBytes small(int compression, bool big_endian = false, bool big_tiff = false) {
  TiffBytes tiff(big_endian, big_tiff);
  tiff.image(6, 5, 16, 1, 2, compression);
  for (const auto& [count, first] : {std::pair(12U, 0), std::pair(12U, 12), std::pair(6U, 24)}) {
    const std::string samples = tiff.ordered(ramp(count, first * 259), 2);
    tiff.block(compression == 8 ? deflated(samples) : samples);
  }
  return tiff;
}

class TiffHostile : public testing::Test {
 protected:
  std::string write(const std::string& bytes) const {
    const std::string path = folder_ / "a.tif";
    test::write_file(path, bytes);
    return path;
  }

  /// What went wrong, or nullopt where the file was read.
  std::optional<ErrorCode> failure(const std::string& bytes, std::vector<std::byte>* samples = nullptr) {
    const std::string path = write(bytes);
    try {
      const auto source = kTiffFormat.open(path, {});
      // A window of what a damaged header may claim, as far as memory goes.
      const SourceInfo& info = source->info();
      const Window window = {0, 0, std::min<std::int64_t>(info.width, 4096), std::min<std::int64_t>(info.height, 256)};
      std::vector<std::byte> raw(static_cast<std::size_t>(window.columns * window.rows) * size_bytes(info.sample_type));
      source->read_window(window, raw);
      if (samples != nullptr) *samples = raw;
      return std::nullopt;
    } catch (const Error& error) {
      message_ = error.what();
      EXPECT_EQ(message_.rfind(path, 0), 0U) << message_;
      return error.code();
    }
  }

  std::string message_;
  const test::TemporaryFolder folder_;
};

TEST_F(TiffHostile, EveryTruncationIsReported) {
  for (const int compression : {1, 8}) {
    for (const bool big_endian : {false, true}) {
      for (const bool big_tiff : {false, true}) {
        const std::string whole = small(compression, big_endian, big_tiff).build();
        std::vector<std::byte> samples;
        ASSERT_EQ(failure(whole, &samples), std::nullopt) << message_;
        const std::string wanted = ramp(30);
        ASSERT_EQ(samples.size(), wanted.size());
        ASSERT_EQ(std::memcmp(samples.data(), wanted.data(), wanted.size()), 0);
        for (std::size_t length = 0; length < whole.size(); ++length) {
          EXPECT_EQ(failure(whole.substr(0, length)), ErrorCode::kCorrupt)
              << length << " of " << whole.size() << " compression " << compression << ": " << message_;
        }
      }
    }
  }
}

TEST_F(TiffHostile, DamagedDataIsReportedWithItsPlace) {
  TiffBytes tiff;
  tiff.image(6, 4, 16, 1, 2, 8);
  tiff.block(deflated(ramp(12)));
  std::string second = deflated(ramp(12));
  second[5] = static_cast<char>(second[5] ^ 0x55);
  tiff.block(second);
  EXPECT_EQ(failure(tiff.build()), ErrorCode::kCorrupt);
  EXPECT_NE(message_.find("strip 1"), std::string::npos) << message_;
}

TEST_F(TiffHostile, TooFewSamplesInAStripAreReported) {
  TiffBytes packed;
  packed.image(6, 2, 16, 1, 2, 8).block(deflated(ramp(11)));
  EXPECT_EQ(failure(packed.build()), ErrorCode::kCorrupt);
  TiffBytes plain;
  plain.image(6, 4, 16, 1, 2).block(ramp(11)).block(ramp(12));
  EXPECT_EQ(failure(plain.build()), ErrorCode::kCorrupt);
  EXPECT_NE(message_.find("22 bytes"), std::string::npos) << message_;
}

TEST_F(TiffHostile, AbsurdSizesAreRefusedWithoutAllocating) {
  const auto with = [](std::uint64_t width, std::uint64_t height, std::uint64_t rows_per_strip, int compression) {
    TiffBytes tiff;
    tiff.image(width, height, 32, 3, rows_per_strip, compression);
    return tiff.block(deflated(ramp(64)));
  };
  for (const int compression : {1, 5, 8, 32773}) {
    for (const std::uint64_t huge : {0xFFFFFFFFULL, 0x7FFFFFFFULL, 1000000000ULL}) {
      EXPECT_EQ(failure(with(huge, 1, 1, compression).build()), ErrorCode::kCorrupt) << message_;
      EXPECT_EQ(failure(with(1, huge, 1, compression).build()), ErrorCode::kCorrupt) << message_;
      EXPECT_EQ(failure(with(huge, huge, huge, compression).build()), ErrorCode::kCorrupt) << message_;
      EXPECT_EQ(failure(with(100, huge, huge, compression).build()), ErrorCode::kCorrupt) << message_;
      TiffBytes tiled = with(huge, huge, 1, compression);
      EXPECT_EQ(failure(tiled.tiles(16, 16).build()), ErrorCode::kCorrupt) << message_;
      EXPECT_EQ(failure(tiled.tiles(huge & ~15ULL, huge & ~15ULL).build()), ErrorCode::kCorrupt) << message_;
    }
    TiffBytes tile = with(100, 100, 1, compression);
    EXPECT_EQ(failure(tile.tiles(1000000000, 1000000000).build()), ErrorCode::kCorrupt) << message_;
    EXPECT_EQ(failure(tile.tiles(16384, 16384).build()), ErrorCode::kCorrupt) << message_;
  }
  EXPECT_EQ(failure(with(0, 10, 1, 1).build()), ErrorCode::kCorrupt);
  EXPECT_EQ(failure(with(10, 0, 1, 1).build()), ErrorCode::kCorrupt);
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
#if !defined(__SANITIZE_ADDRESS__)
  EXPECT_LT(usage.ru_maxrss, 256 * 1024) << "KiB";
#endif
}

TEST_F(TiffHostile, SampleTypesThatAreNotReadAreNamed) {
  const auto refused = [&](TiffBytes& tiff, const std::string& words) {
    EXPECT_EQ(failure(tiff.build()), ErrorCode::kUnsupported);
    EXPECT_NE(message_.find(words), std::string::npos) << message_;
  };
  const std::pair<int, int> formats[] = {{1, 1}, {4, 1}, {20, 1}, {12, 2}, {24, 3}, {32, 5}, {64, 6}};
  for (const auto& [bits, format] : formats) {
    TiffBytes tiff;
    tiff.image(8, 1, bits, format, 1).block(std::string(64, '\1'));
    refused(tiff, std::to_string(bits) + " bit");
  }
  TiffBytes cmyk;
  cmyk.image(2, 1, 8, 1, 1).shorts(262, {5}).shorts(277, {4}).shorts(258, {8, 8, 8, 8}).shorts(339, {1, 1, 1, 1});
  refused(cmyk.block(std::string(8, '\1')), "CMYK");
  TiffBytes jpeg2000;
  jpeg2000.image(8, 1, 16, 1, 1, 34712).block(std::string(64, '\1'));
  refused(jpeg2000, "34712");
  TiffBytes turned;
  turned.image(8, 1, 16, 1, 1).shorts(274, {6}).block(ramp(8));
  refused(turned, "orientation is 6");
}

TEST_F(TiffHostile, BlocksOutsideTheFileAreReported) {
  for (const std::uint64_t offset : {0xFFFFFFFFULL, 0x7FFFFFFFULL, 100000ULL}) {
    for (const int compression : {1, 8}) {
      TiffBytes tiff;
      tiff.image(6, 2, 16, 1, 2, compression).block(ramp(12)).longs(273, {offset});
      EXPECT_EQ(failure(tiff.build()), ErrorCode::kCorrupt);
      EXPECT_NE(message_.find("truncated"), std::string::npos) << message_;
    }
  }
  TiffBytes big(false, true);
  big.image(6, 2, 16, 1, 2).block(ramp(12)).integers(273, TiffBytes::kLong8, {0xFFFFFFFFFFFFFFF0ULL});
  EXPECT_EQ(failure(big.build()), ErrorCode::kCorrupt);
  TiffBytes fewer;
  fewer.image(6, 6, 16, 1, 2).block(ramp(12)).block(ramp(12));
  EXPECT_EQ(failure(fewer.build()), ErrorCode::kCorrupt) << message_;
}

TEST_F(TiffHostile, WhatIsNoTiffIsRefused) {
  EXPECT_EQ(failure(""), ErrorCode::kCorrupt);
  EXPECT_EQ(failure("II"), ErrorCode::kCorrupt);
  EXPECT_EQ(failure(std::string(1000, 'x')), ErrorCode::kCorrupt);
  EXPECT_THROW((void)kTiffFormat.open(folder_ / "absent.tif", {}), Error);
  EXPECT_THROW((void)kTiffFormat.open(folder_.path(), {}), Error);
}

TEST_F(TiffHostile, NothingIsPrinted) {
  ::testing::internal::CaptureStderr();
  ::testing::internal::CaptureStdout();
  const std::string whole = small(8).build();
  for (std::size_t length = 0; length < whole.size(); length += 7) (void)failure(whole.substr(0, length));
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
}

TEST_F(TiffHostile, FileThatIsCutWhileItIsReadIsAnError) {
  constexpr std::int64_t kSide = 1024;
  TiffBytes tiff;
  tiff.image(kSide, kSide, 8, 1, 16);
  for (int i = 0; i < 64; ++i) tiff.block(std::string(16 * kSide, '\7'));
  const std::string path = tiff.write(folder_ / "a.tif");
  const std::unique_ptr<HeightSource> source = kTiffFormat.open(path, {});
  std::vector<std::byte> row(kSide);
  source->read_window({0, 0, kSide, 1}, row);
  EXPECT_EQ(row, std::vector<std::byte>(kSide, std::byte{7}));
  std::filesystem::resize_file(path, 4096);
  EXPECT_EQ(test::error_of([&] { source->read_window({0, kSide - 1, kSide, 1}, row); }).code(), ErrorCode::kCorrupt);
}

/// libtiff makes small strips of it, the last of which would be empty as in a sparse file.
TEST_F(TiffHostile, OnePlainStripThatIsTooShortIsReported) {
  for (const std::size_t missing : {std::size_t{1}, std::size_t{4096}, std::size_t{40960}}) {
    TiffBytes tiff;
    tiff.image(4096, 40, 8, 1, 40).block(std::string(4096 * 40 - missing, '\7'));
    EXPECT_EQ(failure(tiff.build()), ErrorCode::kCorrupt) << missing;
  }
}

TEST_F(TiffHostile, StripsTooLargeToDecodeAreRefusedWithARemedy) {
  TiffBytes tiff;
  tiff.image(20000, 20000, 8, 1, 20000, 8).block(deflated(std::string(400'000'000, '\0')));
  EXPECT_EQ(failure(tiff.build()), ErrorCode::kUnsupported);
  EXPECT_NE(message_.find("gdal_translate -co TILED=YES"), std::string::npos) << message_;
}

}  // namespace
}  // namespace isohf
