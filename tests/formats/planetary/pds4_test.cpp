#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "formats/netcdf/netcdf_bytes.h"
#include "formats/planetary/pds4_label.h"
#include "formats/reader_failure.h"
#include "formats/registry.h"
#include "isohf/raster.h"
#include "support/rasters/place_at.h"
#include "support/rasters/samples.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  return text.replace(text.find(what), what.size(), by);
}

class Pds4 : public ReaderTest {
 protected:
  [[nodiscard]] std::unique_ptr<HeightSource> open(const std::string& name, const std::string& channel = {}) const {
    return open_raster(folder / name, of_channel(channel));
  }
  /// Under a label, with two bytes before the samples.
  [[nodiscard]] std::unique_ptr<HeightSource> open_with(const Pds4Options& options, const std::string& samples,
                                                        const std::string& channel = {}) const {
    write("a.dat", "xy" + samples);
    write("a.xml", pds4_label("a.dat", options));
    return open("a.xml", channel);
  }
  [[nodiscard]] std::string failure(const std::string& name) const {
    return failure_of(folder.path(), nullptr, [&] { read_corner(*open(name)); });
  }
};

TEST_F(Pds4, ReadsTheArrayThatTheLabelDescribes) {
  (void)open_with({}, big_endian<std::int16_t>({1, 2, 3, -32768, 5, 6}));
  for (const char* name : {"a.xml", "a.dat"}) {
    const auto source = open(name);
    const SourceInfo& info = source->info();
    EXPECT_EQ(info.format, "PDS4");
    EXPECT_THAT(values_of(*source), ElementsAre(1, 2, 3, -32768, 5, 6));
    EXPECT_THAT(info.void_values, ElementsAre(-32768));
    EXPECT_EQ(info.z_scale, 0.5);
    EXPECT_EQ(info.z_offset, 1000.0);
    EXPECT_EQ(info.vertical_unit, "metre");
    EXPECT_EQ(info.georeference.registration, Registration::kArea);
    EXPECT_EQ(info.georeference.unit, HorizontalUnit::kMetre);
    EXPECT_THAT(grid_of(info.georeference), ElementsAre(5050.0, 8950.0, 100.0, 100.0));
    const ReferenceSystem& system = info.georeference.system;
    EXPECT_EQ(system.name, "Equirectangular Mars");
    EXPECT_EQ(system.body, "Mars");
    EXPECT_THAT(system.wkt, AllOf(HasSubstr(R"("Equirectangular Mars")"), HasSubstr(R"("D_Mars")"),
                                  HasSubstr(R"(PARAMETER["Latitude of 1st standard parallel",30,)"),
                                  HasSubstr(R"(PARAMETER["Longitude of natural origin",-20,)")));
  }
}

TEST_F(Pds4, AxesComeInAnyOrderAndRowsFromTheBottom) {
  const std::string samples = big_endian<std::int16_t>({1, 10, 2, 20, 3, 30, 4, 40, 5, 50, 6, 60});
  const std::pair<std::string, int> line = {"Line", 2};
  const std::pair<std::string, int> sample = {"Sample", 3};
  const std::pair<std::string, int> band = {"Band", 2};
  const auto read = [&](std::vector<std::pair<std::string, int>> axes, const char* channel,
                        const std::string& direction = "Top to Bottom") {
    Pds4Options options;
    options.axes = std::move(axes);
    options.direction = direction;
    return values_of(*open_with(options, samples, channel));
  };
  EXPECT_THAT(read({line, sample, band}, "1"), ElementsAre(10, 20, 30, 40, 50, 60));
  EXPECT_THAT(read({line, band, sample}, ""), ElementsAre(1, 10, 2, 4, 40, 5));
  EXPECT_THAT(read({sample, line, band}, ""), ElementsAre(1, 3, 5, 2, 4, 6));
  EXPECT_THAT(read({band, line, sample}, "1", "Bottom to Top"), ElementsAre(50, 6, 60, 4, 40, 5));
}

TEST_F(Pds4, ConstantsMayBeBits) {
  Pds4Options options;
  options.type = "IEEE754LSBSingle";
  for (const char* bits : {"16#FF7FFFFB#", "0xFF7FFFFB", "-3.4028226550889045e+38"}) {
    options.constants = fmt::format("<missing_constant>{}</missing_constant><valid_maximum>5</valid_maximum>", bits);
    const auto source =
        open_with(options, stored_bytes<float>({1.0F, -3.4028226550889045e38F, 3.0F, 4.0F, 5.0F, 6.0F}));
    const std::vector<double> values = values_of(*source);
    EXPECT_TRUE(is_void(source->info(), values[1])) << bits;
    EXPECT_FALSE(is_void(source->info(), values[4])) << bits;
    EXPECT_TRUE(is_void(source->info(), values[5])) << bits;
  }
}

TEST_F(Pds4, LabelsOfOtherThingsAreRefused) {
  write("a.dat", "xy");
  write("b.dat", std::string(20, 'x'));
  Pds4Options complex;
  complex.type = "ComplexLSB8";
  const std::string label = pds4_label("b.dat");
  for (const auto& [text, said] :
       {std::pair(pds4_label("a.dat"), "has 2 bytes, 3 x 2 samples"),
        {pds4_label("c.dat"), "its samples, c.dat, are not beside it"},
        {"<?xml version=\"1.0\"?>\n<Product_Observational></Product_Observational>", "describes no array"},
        {replaced(label, "<scaling_factor>0.5", "<scaling_factor>abc"), "scaling_factor is \"abc\", must be a number"},
        {replaced(label, "<Axis_Array>", "<axis_index_order>First Index Fastest</axis_index_order><Axis_Array>"),
         "must be \"Last Index Fastest\""},
        {pds4_label("b.dat", complex), "data_type is \"ComplexLSB8\""}}) {
    write("a.xml", text);
    EXPECT_THAT(failure("a.xml"), HasSubstr(said));
  }
  write("a.xml", label);
  EXPECT_THAT(failure("a.dat"), HasSubstr("describes"));
}

}  // namespace
}  // namespace isohf::test
