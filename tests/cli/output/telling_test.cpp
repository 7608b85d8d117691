/// How errors and warnings are told of: to programs, to people, and where nobody wants any.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "cli/options/small_grid.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

/// A raster that nothing is said about; one whose reference system is missed (a loss); one that looks odd (a note).
struct Rasters {
  explicit Rasters(const TemporaryFolder& folder)
      : plain(folder / "plain.asc"), lossy(folder / "lossy.asc"), odd(folder / "odd.asc"), out(folder / "out.isohf") {
    write_text(plain, small_grid());
    write_text(lossy, small_grid());
    write_text(folder / "lossy.prj", "LOCAL_CS[\"Mine\",UNIT[\"metre\",1]]");
    write_text(odd, small_grid(0, "-9999"));
  }
  std::string plain;
  std::string lossy;
  std::string odd;
  std::string out;
};

json error_of(const std::vector<std::string>& arguments, int exit_code) {
  const RunResult result = run_isohf(arguments);
  SCOPED_TRACE(testing::PrintToString(arguments) + result.err);
  EXPECT_EQ(result.exit_code, exit_code);
  const json document = json::parse(result.out, nullptr, false);
  if (document.is_discarded() || !document.contains("error")) {
    ADD_FAILURE() << result.out;
    return {};
  }
  const json error = document.at("error");
  EXPECT_EQ(error.at("exit_code"), exit_code);
  // The line for people says the same.
  EXPECT_EQ(result.err, "isohf " + arguments.front() + ": " + error.at("message").get<std::string>() + "\n");
  return error;
}

TEST(JsonError, HasTheMessageAndItsParts) {
  const TemporaryFolder folder;
  const std::string raw = folder / "a.raw";
  write_text(raw, std::string(10, 'x'));
  const json error = error_of({"info", raw, "--raw", "4x4:u16le", "--json"}, 1);
  EXPECT_EQ(error.at("where"), raw);
  EXPECT_EQ(error.at("found"), "10 bytes");
  EXPECT_EQ(error.at("required"), "32 bytes");
}

TEST(JsonFiles, AreAllThatExportAndShadeWrote) {
  const TemporaryFolder folder;
  const Rasters rasters(folder);
  ASSERT_EQ(run_isohf({"convert", rasters.plain, rasters.out}).exit_code, 0);
  int run = 0;
  const auto expect_all = [&](std::vector<std::string> arguments, const std::string& name, std::size_t count) {
    SCOPED_TRACE(testing::PrintToString(arguments) + name);
    const std::string to = folder / ("to" + std::to_string(run++));
    std::filesystem::create_directory(to);
    arguments.insert(arguments.begin() + 1, {rasters.out, "-o", to + "/" + name, "--json"});
    const RunResult result = run_isohf(arguments);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    std::set<std::string> there;
    for (const auto& entry : std::filesystem::directory_iterator(to)) there.insert(entry.path().string());
    const std::vector<std::string> told = json::parse(result.out).at("files_written");
    EXPECT_EQ(told.size(), count);
    EXPECT_EQ(std::set<std::string>(told.begin(), told.end()), there);
  };
  expect_all({"export"}, "a.tif", 1);
  expect_all({"export", "--size", "20x20"}, "a.flt", 2);
  expect_all({"export"}, "a.r16", 2);
  expect_all({"export", "--size", "40x40", "--tile-size", "20"}, "a.r16", 8);
  expect_all({"shade"}, "a.png", 3);  // with a world file and .aux.xml
}

TEST(Strict, AWarningIsAnErrorAndNothingIsWritten) {
  const TemporaryFolder folder;
  const Rasters rasters(folder);
  for (const std::string& input : {rasters.lossy, rasters.odd}) {
    const json error = error_of({"convert", input, rasters.out, "--strict", "--json"}, 1);
    EXPECT_EQ(error.at("code"), "warning");
    EXPECT_THAT(error.at("message").get<std::string>(), HasSubstr(input == rasters.lossy ? "it is ignored" : "-9999"));
    for (const char* ending : {"", ".part", ".part.journal"}) {
      EXPECT_FALSE(std::filesystem::exists(rasters.out + ending)) << ending;
    }
    EXPECT_EQ(run_isohf({"info", input, "--strict"}).exit_code, 1);
    EXPECT_EQ(run_isohf({"plan", input, "--strict"}).exit_code, 1);
  }
}

TEST(Strict, ChangesNothingWhereThereIsNoWarning) {
  const TemporaryFolder folder;
  const Rasters rasters(folder);
  const RunResult result = run_isohf({"convert", rasters.plain, rasters.out, "--strict"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err, "");
}

TEST(Strict, RefusesWhatWasClamped) {
  const TemporaryFolder folder;
  const Rasters rasters(folder);
  const RunResult result =
      run_isohf({"convert", rasters.plain, rasters.out, "--z-range", "0:110", "--clamp-range", "--strict"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("lay outside 0 to 110 and were moved"));
  EXPECT_FALSE(std::filesystem::exists(rasters.out));
}

TEST(Quiet, TellsOfLostDataAndOfNothingElse) {
  const TemporaryFolder folder;
  const Rasters rasters(folder);
  const RunResult lost = run_isohf({"convert", rasters.lossy, rasters.out, "-q"});
  EXPECT_EQ(lost.exit_code, 0);
  EXPECT_EQ(lost.out, "");
  EXPECT_THAT(lost.err, testing::StartsWith("isohf convert: warning: "));
  EXPECT_THAT(lost.err, HasSubstr("it is ignored"));
  const RunResult odd = run_isohf({"convert", rasters.odd, rasters.out, "-q", "--overwrite"});
  EXPECT_EQ(odd.exit_code, 0);
  EXPECT_EQ(odd.err, "");
  EXPECT_THAT(run_isohf({"info", rasters.lossy, "-q"}).err, HasSubstr("it is ignored"));
}

TEST(JsonProgress, LeavesNothingButJsonLinesOnStandardError) {
  const TemporaryFolder folder;
  const Rasters rasters(folder);
  const auto lines_of = [](const RunResult& result) {
    std::vector<json> lines;
    std::istringstream text(result.err);
    for (std::string line; std::getline(text, line);) {
      lines.push_back(json::parse(line, nullptr, false));
      EXPECT_FALSE(lines.back().is_discarded()) << line;
    }
    return lines;
  };
  const std::vector<json> warned =
      lines_of(run_isohf({"convert", rasters.lossy, rasters.out, "--progress", "json", "-v"}));
  const auto of_kind = [](const std::vector<json>& lines, const char* member) {
    return std::count_if(lines.begin(), lines.end(), [&](const json& line) { return line.contains(member); });
  };
  EXPECT_GE(of_kind(warned, "progress"), 1);
  ASSERT_EQ(of_kind(warned, "warning"), 1);
  for (const json& line : warned) {
    if (line.contains("warning")) {
      EXPECT_EQ(line.at("warning").at("kind"), "loss");
    }
  }
  const std::vector<json> failed = lines_of(run_isohf({"convert", rasters.plain, rasters.out, "--progress=json"}));
  ASSERT_EQ(failed.size(), 1U);
  EXPECT_EQ(failed[0].at("error").at("found"), "exists");
}

}  // namespace
}  // namespace isohf::test
