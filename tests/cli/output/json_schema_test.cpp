/// Every document that --json and --progress json print is what docs/schema says, member by member. Where this fails
/// for a member that you have added: add it to the schema that the failure names, and to docs/cli.md.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>

#include "cli/options/small_grid.h"
#include "commands/command.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

namespace fs = std::filesystem;

const std::string kData = ISOHF_SOURCE_DIR "/testdata/";
const std::string kSchemas = ISOHF_SOURCE_DIR "/docs/schema/";

/// small_grid() with its South-West corner and its spacing elsewhere.
std::string grid_at(double x, double y, double spacing) {
  const std::string rows = small_grid();
  return "ncols 40\nnrows 40\nxllcorner " + std::to_string(x) + "\nyllcorner " + std::to_string(y) + "\ncellsize " +
         std::to_string(spacing) + rows.substr(rows.find('\n', rows.find("cellsize")));
}

/// Collects documents as files SCHEMA.NUMBER.json for the validator.
class Documents {
 public:
  explicit Documents(std::string folder) : folder_(std::move(folder)) { fs::create_directories(folder_); }

  /// Runs and keeps standard output, a document or one a line, and the JSON lines on standard error.
  void run(int exit_code, const std::string& schema, std::vector<std::string> arguments, const RunOptions& how = {}) {
    SCOPED_TRACE(testing::PrintToString(arguments));
    const bool each_line = schema.ends_with("-line");
    arguments.emplace_back("--json");
    const RunResult result = run_isohf(arguments, how);
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    if (!each_line) keep(schema, result.out);
    keep_lines(schema, each_line ? result.out : "");
    if (testing::PrintToString(arguments).find("--progress") != std::string::npos) {
      keep_lines("stderr-line", result.err);
    }
    (exit_code == 0 ? succeeded_ : failed_).insert(arguments.front());
  }

  [[nodiscard]] const std::set<std::string>& succeeded() const { return succeeded_; }
  [[nodiscard]] const std::set<std::string>& failed() const { return failed_; }

 private:
  void keep(const std::string& schema, const std::string& document) {
    write_text(folder_ + "/" + schema + "." + std::to_string(next_++) + ".json", document);
  }
  void keep_lines(const std::string& schema, const std::string& lines) {
    std::istringstream text(lines);
    for (std::string line; std::getline(text, line);) keep(schema, line);
  }

  std::string folder_;
  int next_ = 0;
  std::set<std::string> succeeded_;
  std::set<std::string> failed_;
};

TEST(JsonSchema, HoldsForEveryCommandsSuccessAndFailure) {
  if (std::system("python3 -c 'import jsonschema' >/dev/null 2>&1") != 0) {
    GTEST_SKIP() << "python3-jsonschema is not installed";
  }
  const TemporaryFolder folder;
  const char* const kept = std::getenv("ISOHF_KEEP_DOCUMENTS");  // a folder, to see them
  const std::string collected = kept != nullptr ? kept : folder / "documents";
  Documents documents(collected);
  const std::string coast = kData + "coast_512x384_int16.tif";
  const std::string voids = kData + "voids_200x150_int16.tif";
  const std::string peaks = kData + "peaks_256x256_uint16.png";
  const std::string a = folder / "a.isohf";
  const std::string b = folder / "b.isohf";
  write_text(folder / "odd.asc", small_grid(0, "-9999"));
  const std::string d = folder / "d.isohf";
  const std::string degrees = folder / "degrees.asc";
  write_text(degrees, grid_at(7.0, 46.0, 0.001));
  const std::string west = folder / "west.asc";
  const std::string east = folder / "east.asc";
  write_text(west, grid_at(0.0, 0.0, 30.0));
  write_text(east, grid_at(1200.0, 0.0, 30.0));
  write_text(folder / "bad.asc", "ncols 2\nnrows 2\ncellsize 1\n1 2 three 4\n");
  write_text(folder / "bad.isohf", "no archive");

  documents.run(0, "convert", {"convert", coast, a, "--shadow-seeds", "--lossless", "--progress", "json"});
  documents.run(0, "convert", {"convert", voids, b, "--fill", "--z-range", "0:1000", "--clamp-range"});
  documents.run(0, "convert", {"convert", peaks, folder / "c.isohf", "--type", "f32"});
  documents.run(0, "convert", {"convert", coast, a, "--shadow-seeds", "--lossless", "--resume"});
  documents.run(0, "convert", {"convert", degrees, d, "--max-error", "20"});
  documents.run(0, "convert", {"convert", west, east, folder / "joined.isohf", "--texture", peaks});
  documents.run(0, "plan", {"plan", coast, folder / "none.isohf", "--memory", "200M"});
  documents.run(1, "error", {"convert", folder / "none.tif", folder / "none.isohf"});
  documents.run(2, "error", {"convert", coast, a, "--progress", "json"});
  documents.run(1, "error", {"convert", folder / "odd.asc", folder / "none.isohf", "--strict", "--progress", "json"});
  documents.run(1, "convert-each-line",
                {"convert", coast, folder / "bad.asc", voids, "--out-dir", folder / "each", "--keep-going",
                 "--progress", "json"});
  documents.run(0, "convert-each-line", {"convert", coast, voids, "--out-dir", folder / "each", "--resume", "-v"});
  documents.run(0, "convert-each-line", {"convert", coast, "--out-dir", folder / "each", "--resume"});

  documents.run(0, "plan", {"plan"});
  documents.run(0, "plan", {"plan", "--shape", "212x243"});
  documents.run(0, "plan", {"plan", coast});
  documents.run(0, "plan", {"plan", folder / "odd.asc"});
  documents.run(0, "plan", {"plan", degrees});
  documents.run(2, "error", {"plan", "--shape", "5"});

  documents.run(0, "info", {"info", a, "--tiles"});
  documents.run(0, "info", {"info", b});
  documents.run(0, "info", {"info", coast, "--stats"});
  documents.run(0, "info", {"info", peaks});
  documents.run(0, "info", {"info", folder / "odd.asc", "--stats"});
  documents.run(0, "info", {"info", d});
  documents.run(0, "info", {"info", folder / "joined.isohf"});
  documents.run(0, "info", {"info", degrees});
  documents.run(0, "info-line", {"info", a, peaks, degrees});
  documents.run(1, "info-line", {"info", a, folder / "bad.isohf", folder / "none.tif"});
  for (const char* good : {"u16", "f32", "u16-globe-lossless", "seeds-hulls", "projected-lossless", "textures-png"}) {
    documents.run(0, "info", {"info", kData + "conformance/good/" + good + ".isohf"});
  }
  documents.run(2, "info-line", {"info", a, b, "--nonsense"});
  documents.run(1, "error", {"info", folder / "bad.isohf"});

  documents.run(0, "verify", {"verify", a});
  documents.run(0, "verify", {"verify", a, "--against", coast, "--progress", "json"});
  documents.run(3, "verify", {"verify", a, "--against", coast, "--max-error", "0.1"});
  documents.run(3, "verify", {"verify", folder / "bad.isohf"});
  documents.run(0, "verify-line", {"verify", a, b});
  documents.run(1, "verify-line", {"verify", a, folder / "bad.isohf", folder / "none.isohf"});
  documents.run(1, "error", {"verify", folder / "none.isohf"});

  documents.run(0, "export", {"export", a, folder / "a.tif"});
  documents.run(0, "export", {"export", a, folder / "a.glb", "--level", "1"});
  documents.run(0, "export", {"export", a, folder / "a.ply", "--max-error", "5"});
  documents.run(0, "export", {"export", b, folder / "b.npy", "--size", "50x50", "--progress", "json"});
  documents.run(0, "export", {"export", d, folder / "d.tif", "--like", degrees});
  documents.run(2, "error", {"export", a, folder / "a.tif"});
  documents.run(0, "export",
                {"export", a, folder / "t.r16", "--size", "40x40", "--tile-size", "20", "--progress", "json"});
  documents.run(0, "export", {"export", a, folder / "t.asc", "--size", "30x20"});
  documents.run(2, "error", {"export", a, folder / "t.xyz"});

  RunOptions places;
  places.input = "100 100\n-5 2\n";
  documents.run(0, "sample-line", {"sample", b}, places);
  documents.run(0, "sample-line", {"sample", d}, places);
  places.input = "100 100\nnowhere\n";
  documents.run(1, "sample-line", {"sample", a}, places);
  documents.run(0, "shade", {"shade", a, "-o", folder / "s.png", "--progress", "json"});
  documents.run(2, "error", {"shade", a});
  documents.run(0, "formats", {"formats"});
  documents.run(0, "program", {"--version"});
  documents.run(0, "part", {"extract", b, "-o", folder / "one.isohf", "--tiles", "0:1,0:1"});
  documents.run(2, "error", {"extract", b, "-o", folder / "one.isohf", "--tiles", "0:1,0:1"});
  documents.run(0, "diff", {"diff", b, b, "--surface", "--raster", folder / "difference.tif"});
  documents.run(3, "diff", {"diff", a, b});
  documents.run(1, "error", {"diff", a, folder / "none.isohf"});
  const auto shard = [&](const char* number) {
    return std::vector<std::string>{"convert",   coast,        "--shard", number,
                                    "--z-range", "-1000:5000", "-o",      folder / (std::string("p") + number[0])};
  };
  documents.run(0, "shards", shard("1/2"));
  documents.run(0, "shards", shard("1/2"));
  documents.run(0, "shards", {"merge", folder / "p1", "--missing"});
  documents.run(2, "error", {"merge", folder / "p1", "-o", folder / "land.isohf"});
  documents.run(0, "shards", shard("2/2"));
  documents.run(0, "part", {"merge", folder / "p1", folder / "p2", "-o", folder / "land.isohf"});
  documents.run(2, "error", {"formats", "all"});
  documents.run(2, "error", {"frmats"});

  // No command was left out, neither doing what it is for nor failing.
  for (const cli::Command& command : cli::kIsohf.commands) {
    if (command.program != nullptr) continue;
    EXPECT_TRUE(documents.succeeded().contains(command.name)) << command.name;
    EXPECT_TRUE(documents.failed().contains(command.name)) << command.name;
  }
  const RunResult valid = run_program(
      {"/usr/bin/env", "python3", ISOHF_SOURCE_DIR "/tests/cli/output/validate_documents.py", kSchemas, collected});
  EXPECT_EQ(valid.exit_code, 0) << valid.out << valid.err;
}

TEST(JsonSchema, RejectsAMemberThatNoSchemaKnows) {
  if (std::system("python3 -c 'import jsonschema' >/dev/null 2>&1") != 0) {
    GTEST_SKIP() << "python3-jsonschema is not installed";
  }
  const TemporaryFolder folder;
  const auto validate = [&](const std::string& error) {
    write_text(folder / "error.0.json", R"({"error":{"code":"io","message":"m")" + error + "}}");
    return run_program({"/usr/bin/env", "python3", ISOHF_SOURCE_DIR "/tests/cli/output/validate_documents.py", kSchemas,
                        folder.path()});
  };
  EXPECT_EQ(validate(R"(,"exit_code":1)").exit_code, 0);
  EXPECT_EQ(validate("").exit_code, 1);
  const RunResult unknown = validate(R"(,"exit_code":1,"colour":"red")");
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_THAT(unknown.out, testing::HasSubstr("'colour' was unexpected"));
}

}  // namespace
}  // namespace isohf::test
