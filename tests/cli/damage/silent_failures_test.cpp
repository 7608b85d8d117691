/// What once passed in silence: exit code 0 and a wrong result, or a plan for what the run refuses.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "formats/io/packed_bytes.h"
#include "formats/netcdf/netcdf_bytes.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

const std::string kVoids = ISOHF_SOURCE_DIR "/testdata/voids_200x150_int16.tif";

class SilentFailures : public ::testing::Test {
 protected:
  RunResult run(const std::vector<std::string>& arguments, int exit_code = 0) {
    RunOptions options;
    options.folder = folder.path();
    RunResult result = run_isohf(arguments, options);
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    return result;
  }
  TemporaryFolder folder;
};

TEST_F(SilentFailures, AGeoTiffThatIsCutIsRefusedByName) {
  const std::string whole = read_file(kVoids);
  for (const std::size_t cut : {1U, 8U, 50U, 100U, 200U}) {
    write_file(folder / "cut.tif", whole.substr(0, whole.size() - cut));
    for (const std::string command : {"convert", "info"}) {
      std::vector<std::string> arguments = {command, "cut.tif", "-q"};
      if (command == "convert") arguments.emplace_back("x.isohf");
      EXPECT_THAT(run(arguments, 1).err, HasSubstr(": cut.tif: ")) << cut;
    }
  }
  EXPECT_EQ(folder.names(), std::vector<std::string>{"cut.tif"});
}

TEST_F(SilentFailures, APlanRefusesTheMemoryThatTheRunRefuses) {
  const std::string memory = "1M";
  const RunResult run_of_it = run({"convert", kVoids, "x.isohf", "--memory", memory, "-j", "2"}, 1);
  const RunResult plan = run({"plan", kVoids, "x.isohf", "--memory", memory, "-j", "2"}, 1);
  EXPECT_EQ(plan.err.substr(plan.err.find(": ")), run_of_it.err.substr(run_of_it.err.find(": ")));
  EXPECT_EQ(plan.out, "");
}

TEST_F(SilentFailures, ASingleTileIsNamedLikeItsLikes) {
  run({"convert", kVoids, "a.isohf", "-q"});
  run({"export", "a.isohf", "one.npy", "--tile-size", "200x150", "-q"});
  run({"export", "a.isohf", "whole.npy", "--method", "hex", "-q"});
  EXPECT_EQ(folder.names(), (std::vector<std::string>{"a.isohf", "one_x0_y0.npy", "whole.npy"}));
  EXPECT_EQ(read_file(folder / "one_x0_y0.npy"), read_file(folder / "whole.npy"));
  EXPECT_THAT(run({"export", "a.isohf", "two.npy", "--tile-size", "200x150"}).out, HasSubstr("two_x0_y0.npy: "));
}

TEST_F(SilentFailures, NamesThatAreNoUtf8AreKeptAsLatin1AndVerify) {
  write_file(folder / "a.asc",
             "ncols 3\nnrows 3\nxllcorner 500000\nyllcorner 4000000\ncellsize 10\n10 11 12\n11 13 15\n12 15 20\n");
  write_file(folder / "a.prj",
             "PROJCS[\"M\xe9tropole\",GEOGCS[\"GCS_WGS_1984\",DATUM[\"D_WGS_1984\",SPHEROID[\"WGS_1984\",6378137,"
             "298.257223563]],PRIMEM[\"Greenwich\",0],UNIT[\"Degree\",0.0174532925199433]],PROJECTION["
             "\"Lambert_Conformal_Conic\"],PARAMETER[\"False_Easting\",700000],PARAMETER[\"False_Northing\",6600000],"
             "PARAMETER[\"Central_Meridian\",3],PARAMETER[\"Standard_Parallel_1\",44],PARAMETER["
             "\"Standard_Parallel_2\",49],PARAMETER[\"Latitude_Of_Origin\",46.5],UNIT[\"Meter\",1]]");
  run({"convert", "a.asc", "a.isohf", "-q"});
  run({"verify", "a.isohf"});
  EXPECT_THAT(run({"info", "a.isohf"}).out, HasSubstr("M\xc3\xa9tropole"));
}

TEST_F(SilentFailures, DiffNamesAMemberThatOneArchiveAloneHas) {
  run({"convert", kVoids, "a.isohf", "-q"});
  run({"convert", kVoids, "b.isohf", "-q"});
  write_file(folder / "note.txt", "hello");
  if (std::system("command -v zip >/dev/null 2>&1") != 0) GTEST_SKIP() << "zip is not installed";
  ASSERT_EQ(std::system(("cd " + (folder / ".") + " && zip -q b.isohf note.txt").c_str()), 0);
  EXPECT_THAT(run({"diff", "a.isohf", "b.isohf", "-v"}, 3).out,
              HasSubstr("member \"note.txt\": nothing, then {\"bytes\":5,"));
  EXPECT_THAT(run({"diff", "b.isohf", "b.isohf"}).out, Not(HasSubstr("note.txt")));
}

TEST_F(SilentFailures, VoidsBeyondTheValidRangeAreVoidInWhatRestoreWrites) {
  std::string samples;
  for (const int value : {1, 2, 3, 4, 32767, 6, 7, 8, 9})
    samples += {static_cast<char>(value >> 8), static_cast<char>(value)};
  NetcdfBytes file;
  file.dimension("y", 3).dimension("x", 3);
  file.variable("z", {0, 1}, 3, samples, {}, {{"_FillValue", {32767.0}}, {"valid_max", {9000.0}}});
  write_file(folder / "a.nc", file.bytes());
  run({"convert", "a.nc", "a.isohf", "--lossless", "-q"});
  const RunResult restored = run({"export", "a.isohf", "a.tif"});
  EXPECT_EQ(restored.err, "");
  EXPECT_THAT(run({"info", "a.tif", "--stats"}).out, HasSubstr("1 of them nodata"));
}

TEST_F(SilentFailures, TheValidRangeCountsWhatItRemovesAndWarnsOfNothing) {
  std::ostringstream grid;
  grid << "ncols 40\nnrows 40\nxllcorner 0\nyllcorner 0\ncellsize 10\n";
  for (int row = 0; row < 40; ++row) {
    for (int column = 0; column < 40; ++column) grid << (row == column ? -9999 : 100 + row * 3 + column) << ' ';
    grid << '\n';
  }
  write_file(folder / "a.asc", grid.str());
  const RunResult result = run({"convert", "a.asc", "a.isohf", "--valid-range", "0:5000"});
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(result.out, HasSubstr("nodata in 40 samples, 40 by --valid-range"));
  // Where the range lets it pass, it is as suspicious as ever.
  EXPECT_THAT(run({"convert", "a.asc", "b.isohf", "--valid-range", "-10000:5000"}).err, HasSubstr("--nodata -9999"));
}

TEST_F(SilentFailures, AFolderHoldsRastersInZipFilesOfAnyName) {
  std::filesystem::create_directory(folder / "tiles");
  for (const std::string name : {"n44e006", "n44e007"}) {
    std::string samples(2 * 1201 * 1201, '\0');
    for (std::size_t i = 1; i < samples.size(); i += 2) samples[i] = static_cast<char>(i / 9000);
    write_file(folder / ("tiles/NASADEM_HGT_" + name + ".zip"),
               packed({{name + ".num", "x"}, {name + ".hgt", samples}}, "zip"));
  }
  write_file(folder / "tiles/other.zip", packed({{"readme.txt", "x"}}, "zip"));
  EXPECT_THAT(run({"plan", "tiles"}).out, HasSubstr("mosaic of 2 files"));
}

TEST_F(SilentFailures, LikeAGridWithoutAReferenceSystemKeepsItsPlace) {
  run({"convert", kVoids, "a.isohf", "-q"});
  run({"export", "a.isohf", "part.asc", "--bbox", "301500,5297000,304500,5299000", "-q"});
  run({"export", "a.isohf", "with.npy", "--like", "part.asc", "-q"});
  std::filesystem::remove(folder / "part.prj");
  const RunResult result = run({"export", "a.isohf", "without.npy", "--like", "part.asc"});
  EXPECT_THAT(result.err,
              HasSubstr("part.asc: does not say what its coordinates count (a .prj would); they are taken"));
  EXPECT_EQ(read_file(folder / "without.npy"), read_file(folder / "with.npy"));
  write_file(folder / "far.asc", "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 30\n1 2 3\n4 5 6\n");
  EXPECT_THAT(run({"export", "a.isohf", "far.npy", "--like", "far.asc"}).err, HasSubstr("North-West corner"));
}

/// What a message says to type makes voids of what it names, and of what was void before.
TEST_F(SilentFailures, TheNodataThatIsAskedForIsTakenAsItIsPrinted) {
  const auto nodata_of = [](const std::string& text) {
    const std::size_t at = text.find("--nodata ") + 9;
    return text.substr(at, text.find_first_of(" \n", at) - at);
  };
  const auto voids_after = [&](const std::vector<std::string>& inputs, int exit_code) {
    std::vector<std::string> arguments = {"convert", "-o", "x.isohf", "--overwrite", "--json"};
    arguments.insert(arguments.end(), inputs.begin(), inputs.end());
    const std::string said = run(arguments, exit_code).err;
    EXPECT_THAT(said, HasSubstr("--nodata "));
    arguments.insert(arguments.end(), {"--nodata", nodata_of(said)});
    const RunResult mended = run(arguments);
    EXPECT_THAT(mended.err, Not(HasSubstr("--nodata"))) << nodata_of(said);
    const std::size_t at = mended.out.find("\"source_voids\"");
    return at == std::string::npos ? std::string() : mended.out.substr(at, 60);
  };
  std::string points;
  for (int i = 0; i < 600; ++i) {
    if (i % 11 == 0 && i > 0) continue;  // 54 points are missing
    points += std::to_string(i % 30) + " " + std::to_string(i / 30) + " " +
              (i % 11 == 1 ? "-32768" : std::to_string(i)) + "\n";
  }
  write_file(folder / "miss.xyz", points);
  EXPECT_THAT(voids_after({"miss.xyz"}, 0), HasSubstr("\"found\": 109,"));

  std::ostringstream float_grid;
  float_grid << "ncols 20\nnrows 20\nxllcorner 0\nyllcorner 0\ncellsize 10\nNODATA_value -9999\n";
  for (int i = 0; i < 400; ++i)
    float_grid << (i == 7 ? "-9999" : i == 99 ? "-3.4028235e38" : std::to_string(i) + ".5") << ' ';
  write_file(folder / "stray.asc", float_grid.str());
  EXPECT_THAT(voids_after({"stray.asc"}, 1), HasSubstr("\"found\": 2,"));
}

TEST_F(SilentFailures, GroundThatNoSourceOfAVrtCoversIsVoid) {
  for (const char* name : {"p1", "p2"}) {
    write_file(folder / (std::string(name) + ".asc"),
               "ncols 4\nnrows 4\nxllcorner 0\nyllcorner 0\ncellsize 10\n9 8 7 6 5 4 3 2 9 8 7 6 5 4 3 2\n");
  }
  const auto source = [](const char* name, int at) {
    return std::string("<SimpleSource><SourceFilename relativeToVRT=\"1\">") + name +
           ".asc</SourceFilename><SourceBand>1</SourceBand><SrcRect xOff=\"0\" yOff=\"0\" xSize=\"4\" ySize=\"4\"/>"
           "<DstRect xOff=\"" +
           std::to_string(at) + "\" yOff=\"" + std::to_string(at) + "\" xSize=\"4\" ySize=\"4\"/></SimpleSource>";
  };
  const auto vrt = [&](const std::string& type, const std::string& nodata) {
    write_file(folder / "a.vrt", "<VRTDataset rasterXSize=\"8\" rasterYSize=\"8\"><VRTRasterBand dataType=\"" + type +
                                     "\" band=\"1\">" + nodata + source("p1", 0) + source("p2", 4) +
                                     "</VRTRasterBand></VRTDataset>");
  };
  for (const char* type : {"Int16", "Float32", "Byte"}) {
    for (const char* nodata : {"", "<NoDataValue>0</NoDataValue>"}) {
      vrt(type, nodata);
      EXPECT_THAT(run({"info", "--stats", "a.vrt"}).out, HasSubstr("32 of them nodata")) << type << nodata;
      // Half of it, and the four nines that the option names.
      EXPECT_THAT(run({"convert", "a.vrt", "a.isohf", "--overwrite", "--nodata", "9"}).out,
                  HasSubstr("nodata in 36 samples"))
          << type << nodata;
    }
  }
  vrt("Int16", "");
  EXPECT_THAT(run({"info", "a.vrt"}).out + run({"info", "a.vrt"}).err, HasSubstr("samples become float64"));
}

}  // namespace
}  // namespace isohf::test
