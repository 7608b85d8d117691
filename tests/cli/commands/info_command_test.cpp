#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <span>

#include "formats/write/raster_sink.h"
#include "isohf/archive.h"
#include "support/rasters/plain_tiff.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

std::int64_t line_count(const std::string& text) {
  return std::count(text.begin(), text.end(), '\n');
}

class InfoCommand : public testing::Test {
 protected:
  InfoCommand() {
    // The East half is void.
    write_float_tiff(folder / "a.tif", 200, 100, [](std::int64_t c, std::int64_t r) {
      return c < 100 ? static_cast<float>(c + 2 * r) : std::numeric_limits<float>::quiet_NaN();
    });
    const RunResult result = run_isohf({"convert", folder / "a.tif", folder / "a.isohf", "--shape", "28x35", "--fit",
                                        "--levels", "2", "--type", "f32"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
  }

  TemporaryFolder folder;
};

TEST_F(InfoCommand, ADozenLinesAreEnoughAndVerboseHasMore) {
  const std::string archive = run_isohf({"info", folder / "a.isohf"}).out;
  EXPECT_LE(line_count(archive), 12) << archive;
  EXPECT_GE(line_count(run_isohf({"info", folder / "a.isohf", "-v"}).out), line_count(archive) + 3);
  const std::string raster = run_isohf({"info", folder / "a.tif"}).out;
  EXPECT_LE(line_count(raster), 10) << raster;
  EXPECT_GT(line_count(run_isohf({"info", folder / "a.tif", "-v"}).out), line_count(raster));
}

TEST_F(InfoCommand, SaysThatTransparentSamplesAreVoids) {
  RasterSpec spec;
  spec.width = 2;
  spec.height = 2;
  spec.sample_type = SampleType::kUint8;
  spec.channels = 4;
  const auto sink = create_raster(folder / "clear.png", spec);
  const std::array<std::uint8_t, 16> pixels = {1, 134, 170, 255, 1, 134, 180, 255, 1, 134, 190, 255, 0, 0, 0, 0};
  sink->write_rows(std::as_bytes(std::span(pixels)));
  sink->finish();
  const RunResult result = run_isohf({"info", folder / "clear.png", "--encoding", "mapbox"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("transparent samples, read as 0\n"));
}

TEST_F(InfoCommand, SaysThatTheSourcesSamplesAreKept) {
  EXPECT_THAT(run_isohf({"info", folder / "a.isohf"}).out, testing::Not(HasSubstr("lossless")));
  ASSERT_EQ(run_isohf({"convert", folder / "a.tif", folder / "b.isohf", "--lossless", "-q"}).exit_code, 0);
  const std::string text = run_isohf({"info", folder / "b.isohf"}).out;
  EXPECT_THAT(text, HasSubstr("export gives the float32 samples bit for bit; residuals of "));
}

TEST_F(InfoCommand, ComparesAnExtractWithTheSamplesOnItsGround) {
  const auto bits = [&](const char* name) {
    return json::parse(run_isohf({"info", folder / name, "--json"}).out).at("bits_per_source_sample").get<double>();
  };
  const std::int64_t columns = ArchiveReader(folder / "a.isohf").grid().tile_columns();
  std::uint64_t samples = 0;
  for (std::int64_t column = 0; column < columns; ++column) {
    const std::string part = std::to_string(column) + ":" + std::to_string(column + 1);
    const std::string rows = std::to_string(ArchiveReader(folder / "a.isohf").grid().tile_rows());
    ASSERT_EQ(run_isohf({"extract", folder / "a.isohf", "-o", folder / "p.isohf", "--tiles", part + ",0:" + rows, "-q",
                         "--overwrite"})
                  .exit_code,
              0);
    samples +=
        json::parse(run_isohf({"info", folder / "p.isohf", "--json"}).out).at("source_samples").get<std::uint64_t>();
    if (column == 0) {
      EXPECT_GT(bits("p.isohf"), bits("a.isohf")) << "where all the elevations are";
    }
  }
  EXPECT_NEAR(static_cast<double>(samples), 20000.0, static_cast<double>(columns));
}

TEST_F(InfoCommand, TilesAreListedOneALine) {
  const json info = json::parse(run_isohf({"info", folder / "a.isohf", "--json", "--tiles"}).out);
  const std::size_t count = info.at("grid").at("tiles").get<std::size_t>();
  EXPECT_EQ(info.at("tiles").size(), count);
  // Samples are column + 2 row; the padding of tiles that end on the edge goes on with that slope by one lattice step.
  const json& lattice = info.at("metadata").at("lattice");
  const double beyond = lattice.at("column_step").get<double>() + 2.0 * lattice.at("row_step").get<double>();
  std::size_t stored = 0;
  std::uint64_t bytes = 0;
  for (const json& tile : info.at("tiles")) {
    if (!tile.at("stored").get<bool>()) continue;
    ++stored;
    bytes += tile.at("compressed_bytes").get<std::uint64_t>();
    EXPECT_GE(tile.at("min").get<double>(), -beyond - 1e-3);
    EXPECT_LE(tile.at("max").get<double>(), 99.0 + 2 * 99.0 + beyond + 1e-3);
    EXPECT_LE(tile.at("min").get<double>(), tile.at("max").get<double>());
  }
  EXPECT_GT(stored, 0U);
  EXPECT_LT(stored, count);  // the void half stores nothing
  EXPECT_EQ(info.at("tile_bytes"), bytes);

  // The same on one line, where it is one of many documents.
  const std::string lines = run_isohf({"info", folder / "a.isohf", folder / "a.isohf", "--json", "--tiles"}).out;
  EXPECT_EQ(std::count(lines.begin(), lines.end(), '\n'), 2);
  EXPECT_EQ(json::parse(lines.substr(0, lines.find('\n'))), info);

  const RunResult text = run_isohf({"info", folder / "a.isohf", "--tiles"});
  EXPECT_EQ(static_cast<std::size_t>(std::count(text.out.begin(), text.out.end(), '\n')), count + 1);
  EXPECT_THAT(text.out, HasSubstr(" 0 void void all\n"));
}

TEST_F(InfoCommand, StatisticsOfARasterAreReadWhenAskedFor) {
  const RunResult stats = run_isohf({"info", folder / "a.tif", "--stats"});
  EXPECT_EQ(stats.err, "");
  EXPECT_THAT(stats.out, HasSubstr("0 .. 297, mean 148.5\n"));
  EXPECT_THAT(stats.out, HasSubstr("20 000, 10 000 of them nodata\n"));

  const json info = json::parse(run_isohf({"info", folder / "a.tif", "--json", "--stats"}).out);
  EXPECT_EQ(info.at("width"), 200);
  EXPECT_EQ(info.at("statistics").at("voids"), 10000);
  EXPECT_EQ(info.at("statistics").at("mean"), 148.5);
  EXPECT_EQ(info.at("registration_from"), "default");
  EXPECT_TRUE(info.at("origin").is_null());
  EXPECT_TRUE(json::parse(run_isohf({"info", folder / "a.tif", "--json"}).out).at("statistics").is_null());
}

TEST_F(InfoCommand, RastersAndArchivesTakeTheirOwnOptions) {
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"info", folder / "a.tif", "--tiles"},
                                                    {"info", folder / "a.isohf", "--stats"},
                                                    {"info", folder / "a.isohf", "--channel", "3"}}) {
    const RunResult result = run_isohf(arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments.back();
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  }
}

/// What says that a raster of these samples holds voids that it does not declare.
std::string spike_warning(const TemporaryFolder& folder,
                          const std::function<std::int16_t(std::int64_t, std::int64_t)>& height_at) {
  write_int16_tiff(folder / "s.tif", 64, 48, height_at);
  return run_isohf({"info", folder / "s.tif", "--stats"}).err;
}

TEST_F(InfoCommand, WarnsOfVoidsThatAreNotDeclared) {
  const auto land = [](std::int64_t c, std::int64_t r) { return static_cast<std::int16_t>(100 + 3 * c + r); };
  for (const int mark : {-32768, -9999, 9999, 32767}) {
    const std::string warning = spike_warning(folder, [&](std::int64_t c, std::int64_t r) {
      return c == 7 && r < 3 ? static_cast<std::int16_t>(mark) : land(c, r);
    });
    EXPECT_EQ(warning,
              fmt::format("isohf info: warning: {}: 3 samples hold {}, far from all others (100 to 336): if that "
                          "means no elevation, give --nodata {}\n",
                          folder / "s.tif", mark, mark));
  }
  // Convert says the same; with --nodata nobody does.
  EXPECT_THAT(run_isohf({"convert", folder / "s.tif", folder / "s.isohf"}).err, HasSubstr("3 samples hold 32767"));
  EXPECT_EQ(run_isohf({"convert", folder / "s.tif", folder / "t.isohf", "--nodata", "32767"}).err, "");
}

TEST_F(InfoCommand, TakesNoOrdinaryElevationForAVoid) {
  // All codes, a range that happens to end on a mark, and a step of -32768 under its neighbours.
  EXPECT_EQ(spike_warning(folder, [](std::int64_t c,
                                     std::int64_t r) { return static_cast<std::int16_t>(-32768 + 21 * (c + 64 * r)); }),
            "");
  EXPECT_EQ(spike_warning(folder,
                          [](std::int64_t c, std::int64_t r) { return static_cast<std::int16_t>(-9999 + c * c + r); }),
            "");
  EXPECT_EQ(spike_warning(folder, [](std::int64_t c,
                                     std::int64_t) { return static_cast<std::int16_t>(c == 0 ? -9999 : c * 200); }),
            "");
}

}  // namespace
}  // namespace isohf::test
