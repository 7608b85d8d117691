/// System calls that fail, one by one: nothing is left half-written, nothing that was complete is lost, and what could
/// not be done is said in one line with the file's name and the cause.
///
/// ISOHF_FAULTS=all tries every call with every error and a thousand allocations of each command (scripts/dev/faults);
/// otherwise those that differ most.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <sstream>

#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

namespace fs = std::filesystem;

bool tries_all() {
  const char* wanted = std::getenv("ISOHF_FAULTS");
  return wanted != nullptr && std::string(wanted) == "all";
}

struct Job {
  std::string name;
  std::vector<std::string> arguments;
  std::vector<std::string> outputs;  ///< the one that is named first
  bool resumes = false;
  bool replaces = false;  ///< other files of these names are there before
};

void PrintTo(const Job& job, std::ostream* out) {
  *out << job.name;
}

const std::vector<Job>& jobs() {
  static const std::vector<Job> all = {
      {"convert", {"convert", "in.tif", "out.isohf", "--lossless"}, {"out.isohf"}, true},
      {"convert_over", {"convert", "in.tif", "out.isohf", "--overwrite"}, {"out.isohf"}, true, true},
      {"convert_asc", {"convert", "in.asc", "out.isohf"}, {"out.isohf"}, true},
      {"convert_npy", {"convert", "in.npy", "out.isohf", "--nodata", "-32768"}, {"out.isohf"}, true},
      {"export_source", {"export", "in.isohf", "out.tif"}, {"out.tif"}},
      {"export_source_over", {"export", "in.isohf", "out.asc", "--overwrite"}, {"out.asc", "out.prj"}, false, true},
      {"export", {"export", "in.isohf", "out.r16", "--method", "hex"}, {"out.r16", "out.r16.json"}},
      {"export_over",
       {"export", "in.isohf", "out.r16", "--method", "hex", "--overwrite"},
       {"out.r16", "out.r16.json"},
       false,
       true},
      {"export_tiles",
       {"export", "in.isohf", "out.png", "--tile-size", "100x150"},
       {"out_x0_y0.png", "out_x0_y0.png.json", "out_x0_y0.pgw", "out_x0_y0.png.aux.xml", "out_x1_y0.png",
        "out_x1_y0.png.json", "out_x1_y0.pgw", "out_x1_y0.png.aux.xml"}},
      {"shade", {"shade", "in.isohf", "out.png"}, {"out.png", "out.pgw", "out.png.aux.xml"}},
      {"shade_over", {"shade", "in.isohf", "out.tif", "--overwrite"}, {"out.tif"}, false, true},
      {"verify", {"verify", "in.isohf", "--against", "in.tif"}, {}},
      {"info", {"info", "in.isohf"}, {}},
      {"info_raster", {"info", "in.tif"}, {}},
  };
  return all;
}

class Faults : public testing::TestWithParam<Job> {
 protected:
  Faults() {
    fs::copy_file(ISOHF_SOURCE_DIR "/testdata/voids_200x150_int16.tif", folder / "in.tif");
    run_plainly({"convert", "in.tif", "in.isohf", "--lossless", "-q"});
    run_plainly({"export", "in.isohf", "in.npy", "-q"});
    run_plainly({"export", "in.isohf", "in.asc", "-q"});
    if (!job().replaces) return;
    std::vector<std::string> arguments = job().arguments;
    arguments.insert(arguments.end(), {"-q"});
    if (job().name == "convert_over") arguments.insert(arguments.end(), {"--effort", "fast"});
    if (job().name != "convert_over")
      arguments.insert(arguments.end(), {job().name == "shade_over" ? "--size" : "--size", "40x30"});
    run_plainly(arguments);
    for (const std::string& name : job().outputs) before[name] = read_file(folder / name);
  }

  static const Job& job() { return GetParam(); }

  void run_plainly(const std::vector<std::string>& arguments) {
    RunOptions options;
    options.folder = folder.path();
    const RunResult result = run_isohf(arguments, options);
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }

  RunResult run(const std::string& fault, const std::string& threads = "1") {
    std::vector<std::string> command = {"/usr/bin/env", "LD_PRELOAD=" ISOHF_FAULT_INJECTOR};
    command.push_back(fault.empty() ? "ISOHF_FAULT_COUNTS=" + counts_path : "ISOHF_FAULT=" + fault);
    command.push_back(isohf_path());
    command.insert(command.end(), job().arguments.begin(), job().arguments.end());
    if (job().name != "verify") command.emplace_back("-q");  // whose findings are its words
    if (!job().name.starts_with("info")) command.insert(command.end(), {"-j", threads});
    RunOptions options;
    options.folder = folder.path();
    ++runs;
    return run_program(command, options);
  }

  /// What the outputs are when nothing fails, and how many calls there are of each kind.
  std::map<std::string, long> learn(const std::string& threads = "1") {
    const RunResult result = run("", threads);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    for (const std::string& name : job().outputs) after[name] = read_file(folder / name);
    std::map<std::string, long> counts;
    std::istringstream lines(read_file(counts_path));
    std::string name;
    for (long count = 0; lines >> name >> count;) counts[name] = count;
    fs::remove(counts_path);
    start_again();
    return counts;
  }

  void start_again() {
    for (const std::string& name : folder.names()) {
      if (name.starts_with("out")) fs::remove(folder / name);
    }
    for (const auto& [name, bytes] : before) write_file(folder / name, bytes);
  }

  /// Runs with the fault, and holds the result against the claims above.
  void try_fault(const std::string& call, int error, const std::string& which, const std::string& threads = "1") {
    SCOPED_TRACE(job().name + ": " + call + " " + which + ": " + std::strerror(error));
    const RunResult result = run(call + " " + std::to_string(error) + " " + which, threads);
    const bool done = result.exit_code == 0;
    const bool found = job().name == "verify" && result.exit_code == 3;
    EXPECT_TRUE(done || found || result.exit_code == 1) << result.exit_code << result.err;
    if (error == EINTR && call != "rename") {
      EXPECT_EQ(result.exit_code, 0) << result.err;
    }
    if (done) {
      EXPECT_EQ(result.err, "");
    }
    if (!done) expect_one_line(result, call, error);
    bool kept = false;
    for (const std::string& name : folder.names()) {
      if (!name.starts_with("out")) continue;
      const bool is_part = name.ends_with(".part") || name.ends_with(".journal");
      kept = kept || (is_part && job().resumes);
      // Where memory is lacking and no exception may pass, the program ends as if it had been killed.
      if (is_part && call != "malloc") {
        EXPECT_TRUE(!done && result.err.find(job().resumes ? "--resume" : name) != std::string::npos)
            << name << ": " << result.err;
      }
      if (is_part) continue;
      const std::string bytes = read_file(folder / name);
      const auto old = before.find(name);
      EXPECT_TRUE(bytes == after.at(name) || (!done && old != before.end() && bytes == old->second)) << name;
    }
    for (const std::string& name : job().outputs) {
      const bool exists = fs::exists(folder / name);
      if (done) {
        EXPECT_TRUE(exists) << name;
      }
      // What was there and is not replaced stays.
      if (!done && job().replaces && job().outputs.size() == 1) {
        EXPECT_TRUE(exists) << name;
      }
    }
    if (kept) {
      std::vector<std::string> arguments = job().arguments;
      arguments.insert(arguments.end(), {"-q", "--resume"});
      run_plainly(arguments);
      EXPECT_TRUE(read_file(folder / job().outputs.front()) == after.at(job().outputs.front()));
      EXPECT_FALSE(fs::exists(folder / (job().outputs.front() + ".part")));
    }
    start_again();
  }

  void expect_one_line(const RunResult& result, const std::string& call, int error) const {
    const bool is_finding = result.err.empty() && result.out.starts_with("ISOHF-");
    EXPECT_TRUE(is_finding || std::count(result.err.begin(), result.err.end(), '\n') == 1) << result.err;
    EXPECT_TRUE(is_finding || result.err.starts_with("isohf ")) << result.err;
    if (call == "malloc") return;
    EXPECT_EQ(result.err.find("internal error"), std::string::npos) << result.err;
    if (call == "pthread_create") return;
    EXPECT_THAT(result.err + result.out, testing::HasSubstr(std::strerror(error)));
    EXPECT_THAT(result.err + result.out, testing::AnyOf(testing::HasSubstr("in."), testing::HasSubstr("out"),
                                                        testing::HasSubstr("standard output")));
  }

  /// All of 1 to `count`, or those that `most` allows: the first and the last ones, and some between.
  static std::vector<long> chosen(long count, long most) {
    std::vector<long> all;
    for (long n = 1; n <= count; ++n) {
      if (tries_all() || n <= most / 2 || n > count - most / 4 || n % std::max(1L, 4 * count / most) == 0)
        all.push_back(n);
    }
    return all;
  }

  TemporaryFolder folder;
  std::string counts_path = folder / "counts";
  std::map<std::string, std::string> before;
  std::map<std::string, std::string> after;
  int runs = 0;
};

TEST_P(Faults, ACallThatFailsLeavesAllOrNothing) {
  const std::map<std::string, long> counts = learn();
  for (const auto& [call, count] : counts) {
    if (call == "malloc" || call == "pthread_create") continue;
    const bool few = call != "pread" || tries_all();
    for (const long n : chosen(count, few ? count * 4 : 6)) {
      for (const int error : {EINTR, EIO, ENOSPC, EMFILE, ENOLCK}) {
        // Of the calls that are many, each fails in one way.
        const bool is_one_of_many = call == "open" || call == "close" || call == "pread";
        const bool likely = (is_one_of_many ? error == (n % 2 == 0 ? EINTR : EIO) : error == EINTR || error == EIO) ||
                            (error == ENOSPC && (call == "write" || call == "ftruncate")) ||
                            (error == EMFILE && call == "open" && n % 3 == 0) || (error == ENOLCK && call == "flock");
        if (likely || tries_all()) try_fault(call, error, std::to_string(n));
      }
    }
  }
  RecordProperty("runs", runs);
}

TEST_P(Faults, MemoryThatRunsOutEndsInOneLine) {
  // Where memory ran out as it set up its threads, oneTBB 2021.8 may wait for them for ever.
  if (!tries_all()) GTEST_SKIP() << "scripts/dev/faults does this";
  // PROJ tells no lack of memory from a system that it does not know; the archive then lacks its WKT.
  if (job().name == "convert_asc") GTEST_SKIP() << "the .prj is read by PROJ";
  const long count = learn()["malloc"];
  const long most = tries_all() ? 500 : 10;
  for (long i = 0; i < most; ++i) {
    const std::string n = std::to_string(1 + i * count / most);
    try_fault("malloc", ENOMEM, n);
    try_fault("malloc", ENOMEM, n + "+");
  }
  RecordProperty("runs", runs);
}

TEST_P(Faults, ThreadsThatCannotBeMadeAreNotNeeded) {
  if (job().name == "info") return;
  const long count = learn("3")["pthread_create"];
  for (const long n : chosen(count, 4)) {
    try_fault("pthread_create", EAGAIN, std::to_string(n), "3");
    try_fault("pthread_create", EAGAIN, std::to_string(n) + "+", "3");
  }
}

/// An archive that only lacks its name: the rename failed.
class Resuming : public testing::Test {
 protected:
  RunResult run(const std::vector<std::string>& more, bool fails = false) {
    std::vector<std::string> command = {"/usr/bin/env"};
    if (fails) command.insert(command.end(), {"LD_PRELOAD=" ISOHF_FAULT_INJECTOR, "ISOHF_FAULT=rename 5 1"});
    command.insert(command.end(), {isohf_path(), "convert", kRaster, "out.isohf", "-q"});
    command.insert(command.end(), more.begin(), more.end());
    RunOptions options;
    options.folder = folder.path();
    return run_program(command, options);
  }

  const std::string kRaster = ISOHF_SOURCE_DIR "/testdata/coast_512x384_int16.tif";
  TemporaryFolder folder;
};

TEST_F(Resuming, OtherTapsAreAnotherJob) {
  EXPECT_THAT(run({"--acquisition", "0.1,0.8,0.1"}, true).err, testing::HasSubstr("--resume goes on from there"));
  const RunResult refused = run({"--acquisition", "0.15,0.7,0.15", "--resume"});
  EXPECT_EQ(refused.exit_code, 2) << refused.err;
  EXPECT_THAT(refused.err, testing::HasSubstr("out.isohf.part belongs to another input or other options"));
}

TEST(EachOnAFullDisk, BeginsNoOtherFileAndSaysSoOnce) {
  const TemporaryFolder folder;
  const std::string raster = ISOHF_SOURCE_DIR "/testdata/voids_200x150_int16.tif";
  for (const char* name : {"a.tif", "b.tif", "c.tif", "d.tif"}) fs::copy_file(raster, folder / name);
  const RunResult result =
      run_program({"/usr/bin/env", "LD_PRELOAD=" ISOHF_FAULT_INJECTOR, "ISOHF_FAULT=ftruncate 28 1+", isohf_path(),
                   "convert", folder.path(), "--out-dir", folder / "out", "--keep-going", "-j", "2"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, testing::HasSubstr("a.isohf: "));
  EXPECT_THAT(result.err, testing::HasSubstr(std::strerror(ENOSPC)));
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_THAT(result.out, testing::StartsWith("files        4: 0 converted, 1 failed, 3 not done in "));
}

INSTANTIATE_TEST_SUITE_P(All, Faults, testing::ValuesIn(jobs()), [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace isohf::test
