#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "isohf/raster.h"
#include "support/rasters/samples.h"

namespace isohf::test {
namespace {

std::string data_file(const std::string& name) {
  return std::string(ISOHF_SOURCE_DIR) + "/tests/formats/data/" + name;
}

/// opj_compress of every number of 8 bits, sixteen times each. Those of other bits are in tests/cli/gdal/placement.py.
TEST(Jpeg2000, SignedSamplesAreThoseStored) {
  const auto source = open_raster(data_file("signed8.j2k"), {});
  ASSERT_EQ(source->info().sample_type, SampleType::kInt8);
  const std::vector<double> values = values_of(*source);
  ASSERT_EQ(values.size(), 4096U);
  for (std::size_t i = 0; i < values.size(); ++i) ASSERT_EQ(values[i], static_cast<double>(i / 16) - 128.0) << i;
  EXPECT_EQ(values_of(SampleType::kInt8, read_window(*source, {30, 31, 3, 2}))[4],
            static_cast<double>((32 * 64 + 31) / 16) - 128.0);
}

/// opj_compress -t 16,16 -d 3,5 -T 1,2: neither the picture nor its tiles begin at the codestream's corner.
TEST(Jpeg2000, TilesLieWhereThePictureBegins) {
  const auto source = open_raster(data_file("tiled.jp2"), {});
  ASSERT_EQ(source->info().sample_type, SampleType::kInt16);
  for (std::int64_t row = 29; row >= 0; --row) {  // backwards through the rows of tiles
    const std::vector<double> found = values_of(SampleType::kInt16, read_window(*source, {2, row, 37, 1}));
    for (std::size_t i = 0; i < 37; ++i) {
      ASSERT_EQ(found[i], static_cast<double>(9 * row + 7 * static_cast<std::int64_t>(i + 2) - 200)) << i << ',' << row;
    }
  }
}

}  // namespace
}  // namespace isohf::test
