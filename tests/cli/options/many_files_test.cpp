/// `info` and `verify` of several files.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;
using Words = std::vector<std::string>;

const std::string kKept = ISOHF_SOURCE_DIR "/testdata/conformance/good/";
const std::string kRaster = ISOHF_SOURCE_DIR "/testdata/voids_200x150_int16.tif";

std::vector<json> lines_of(const std::string& text) {
  std::vector<json> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(json::parse(line));
  return lines;
}

class ManyFiles : public testing::Test {
 protected:
  ManyFiles() {
    std::filesystem::create_directories(folder / "in/deeper");
    std::filesystem::copy(kKept + "u8.isohf", folder / "in/a.isohf");
    std::filesystem::copy(kKept + "u16-globe-lossless.isohf", folder / "in/deeper/c.isohf");
    std::filesystem::copy(kRaster, folder / "in/b.tif");
  }

  TemporaryFolder folder;
};

TEST_F(ManyFiles, AreVerifiedInOrderAndTheBadOneStopsNoOther) {
  std::string damaged = read_file(kKept + "u16.isohf");
  damaged[damaged.size() / 2] ^= 1;
  write_file(folder / "damaged.isohf", damaged);
  const Words files = {kKept + "u16-globe-lossless.isohf", folder / "none.isohf", folder / "damaged.isohf",
                       kKept + "u8.isohf"};
  Words command = {"verify"};
  command.insert(command.end(), files.begin(), files.end());
  const RunResult text = run_isohf(command);
  EXPECT_EQ(text.exit_code, 1);  // one could not be checked at all, which is worse than differences
  EXPECT_THAT(text.out, testing::AllOf(HasSubstr("u16-globe-lossless.isohf: passed"),
                                       HasSubstr("damaged.isohf: FAILED"), HasSubstr("u8.isohf: passed")));
  EXPECT_LT(text.out.find("u16-globe-lossless.isohf"), text.out.find("u8.isohf"));
  EXPECT_THAT(text.err, HasSubstr("none.isohf: "));
  EXPECT_THAT(text.err, HasSubstr("isohf verify: 4 files: 2 done, 1 with differences, 1 failed\n"));

  command.emplace_back("--json");
  const std::vector<json> lines = lines_of(run_isohf(command).out);
  ASSERT_EQ(lines.size(), 4U);
  EXPECT_EQ(lines[0].at("archive"), files[0]);
  EXPECT_TRUE(lines[0].at("passed"));
  EXPECT_EQ(lines[1].at("file"), files[1]);
  EXPECT_EQ(lines[1].at("error").at("exit_code"), 1);
  EXPECT_FALSE(lines[2].at("passed"));
  EXPECT_EQ(run_isohf({"verify", files[0], files[2]}).exit_code, 3);
  const RunResult quiet = run_isohf({"verify", files[0], files[3], "--quiet"});
  EXPECT_EQ(quiet.exit_code, 0);
  EXPECT_EQ(quiet.out + quiet.err, "");
}

TEST_F(ManyFiles, FoldersPatternsAndListsAreTaken) {
  const auto archives = [&](const Words& named) {
    const RunResult result = run_isohf(with_more({"verify", "--json"}, named));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    std::vector<std::string> names;
    const std::vector<json> documents =
        result.out.starts_with("{\n") ? std::vector<json>{json::parse(result.out)} : lines_of(result.out);
    for (const json& line : documents) {
      names.push_back(std::filesystem::path(line.at("archive").get<std::string>()).filename());
    }
    return names;
  };
  EXPECT_THAT(archives({folder / "in"}), ElementsAre("a.isohf"));
  EXPECT_THAT(archives({folder / "in/*.isohf", folder / "in/deeper/c.isohf"}), ElementsAre("a.isohf", "c.isohf"));
  write_file(folder / "list.txt", std::string_view("in/deeper/c.isohf\nin/a.isohf\n"));
  EXPECT_THAT(archives({"@" + (folder / "list.txt")}), ElementsAre("c.isohf", "a.isohf"));
  EXPECT_EQ(run_isohf({"verify", folder / "in/a.isohf", folder / "in/deeper/c.isohf", "--against", kRaster}).exit_code,
            2);
}

TEST_F(ManyFiles, DataOfEnviAreRastersOfAFolderWhereTheirHeaderIsThere) {
  std::filesystem::create_directory(folder / "envi");
  write_file(folder / "envi/a.dat", std::string_view("abcd"));
  write_file(folder / "envi/a.hdr", std::string_view("ENVI\nsamples = 2\nlines = 2\nbands = 1\ndata type = 1\n"));
  write_file(folder / "envi/notes.dat", std::string_view("none"));
  const RunResult result = run_isohf({"info", folder / "envi"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("a.dat: ENVI"));
  EXPECT_THAT(result.out, testing::Not(HasSubstr("notes.dat")));
}

TEST_F(ManyFiles, AreDescribedOneAfterTheOther) {
  const RunResult text = run_isohf({"info", folder / "in", folder / "in/deeper"});
  EXPECT_EQ(text.exit_code, 0) << text.err;
  EXPECT_THAT(text.out, testing::AllOf(HasSubstr("archive      "), HasSubstr("\n\nraster       ")));
  EXPECT_EQ(text.err, "isohf info: 3 files: 3 done, 0 failed\n");
  const std::vector<json> lines = lines_of(run_isohf({"info", folder / "in", folder / "in/deeper", "--json"}).out);
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_TRUE(lines[0].contains("archive"));
  EXPECT_TRUE(lines[1].contains("raster"));
  // One file is one document, as ever.
  const std::string one = run_isohf({"info", folder / "in/a.isohf", "--json"}).out;
  EXPECT_TRUE(one.starts_with("{\n  \"archive\""));
  const RunResult mixed = run_isohf({"info", folder / "none.tif", folder / "in/a.isohf"});
  EXPECT_EQ(mixed.exit_code, 1);
  EXPECT_THAT(mixed.out, HasSubstr("a.isohf"));
}

}  // namespace
}  // namespace isohf::test
