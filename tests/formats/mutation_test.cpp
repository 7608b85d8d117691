/// Every reader over every truncation of a small file, and over hundreds of damaged ones: each is read, or refused
/// with one line that names it.

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <random>
#include <set>

#include "formats/reader_cases.h"
#include "formats/reader_failure.h"
#include "isohf/error.h"
#include "support/rasters/samples.h"
#include "support/sanitizers.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

/// Of each file; ISOHF_MUTATIONS asks for another number, and for every truncation under the sanitizers too, which take
/// ten times as long.
int mutations() {
  const char* const wanted = std::getenv("ISOHF_MUTATIONS");
  return wanted != nullptr ? std::stoi(wanted) : 300;
}
int truncation_step() {
  return kSanitized && std::getenv("ISOHF_MUTATIONS") == nullptr ? 3 : 1;
}
constexpr unsigned kSeed = 20040808;

const std::vector<ReaderCase>& cases() {
  set_module_folder(ISOHF_BIN_DIR);
  static const std::vector<ReaderCase> all = reader_cases();
  return all;
}

/// A folder in memory where there is one: tens of thousands of files are written.
std::filesystem::path fast_parent() {
  const std::filesystem::path in_memory = "/dev/shm";
  return std::filesystem::is_directory(in_memory) ? in_memory : std::filesystem::temp_directory_path();
}

// ISOHF_READER_CASES=FOLDER writes every case to FOLDER/NAME, beside .opened, which names what is opened: for
// scripts/dev/portability.
TEST(ReaderCases, AreWrittenWhereScriptsWantThem) {
  const char* const folder = std::getenv("ISOHF_READER_CASES");
  if (folder == nullptr) GTEST_SKIP() << "ISOHF_READER_CASES names no folder";
  for (const ReaderCase& each : cases()) {
    const std::filesystem::path own = std::filesystem::path(folder) / each.name;
    std::filesystem::create_directories(own);
    for (const auto& [name, bytes] : each.beside) write_file(own / name, bytes);
    write_file(own / each.file_name, each.bytes);
    write_file(own / ".opened", each.opened.empty() ? each.file_name : each.opened);
  }
}

class ReaderMutation : public ::testing::TestWithParam<std::size_t> {
 protected:
  void SetUp() override {
    for (const auto& [name, bytes] : tested().beside) write_file(folder_ / name, bytes);
    if (kSanitized) return;  // it reserves terabytes itself
    // What a few bytes claim must not be believed: an allocation of more than this fails, and is no Error.
    ::rlimit limit{};
    ::getrlimit(RLIMIT_AS, &limit);
    limit.rlim_cur = rlim_t{4} << 30U;
    ::setrlimit(RLIMIT_AS, &limit);
  }

  [[nodiscard]] const ReaderCase& tested() const { return cases()[GetParam()]; }

  /// Reads the first and the last samples; returns what went wrong, empty where nothing did.
  [[nodiscard]] std::string outcome(const std::string& bytes) const {
    const std::string path = folder_ / tested().file_name;
    write_file(path, bytes);
    try {
      const auto source = tested().open(tested().opened.empty() ? path : folder_ / tested().opened, tested().options);
      const SourceInfo& info = source->info();
      const Georeference& place = info.georeference;
      EXPECT_GE(std::min(info.width, info.height), 1);
      EXPECT_TRUE(std::isfinite(info.z_scale) && info.z_scale != 0.0 && std::isfinite(info.z_offset));
      EXPECT_TRUE(std::min(place.spacing_x, place.spacing_y) > 0.0 && std::isfinite(place.spacing_x + place.spacing_y));
      EXPECT_TRUE(std::isfinite(place.origin_x) && std::isfinite(place.origin_y));
      read_corner(*source);
      const Window last{info.width - std::min<std::int64_t>(info.width, 64),
                        info.height - std::min<std::int64_t>(info.height, 8), std::min<std::int64_t>(info.width, 64),
                        std::min<std::int64_t>(info.height, 8)};
      (void)read_window(*source, last);
      for (const std::string& warning : info.warnings) expect_one_line(warning);
      return {};
    } catch (const Error& error) {
      const std::string message = error.what();
      EXPECT_EQ(message.rfind(folder_.path(), 0), 0U) << message;
      expect_one_line(message);
      code_ = error.code();
      return message.empty() ? "an empty message" : message;
    }
  }

  static void expect_one_line(const std::string& message) {
    EXPECT_EQ(message.find_first_of("\n\r"), std::string::npos) << message;
  }

  const TemporaryFolder folder_{fast_parent()};
  mutable ErrorCode code_ = ErrorCode::kCancelled;  ///< of the last error
};

/// One to four changes, most of them near the beginning, where headers are.
std::string mutated(const std::string& bytes, bool text, std::mt19937& random) {
  const auto pick = [&](std::size_t below) {
    return static_cast<std::size_t>(random()) % std::max<std::size_t>(below, 1);
  };
  const std::string digits = "0123456789-+.eE \n:=(),'\"*<>";
  std::string damaged = bytes;
  for (std::size_t change = pick(4) + 1; change > 0 && !damaged.empty(); --change) {
    const std::size_t head = std::min<std::size_t>(damaged.size(), 512);
    const std::size_t at = pick(4) == 0 ? pick(damaged.size()) : pick(head);
    switch (pick(text ? 9 : 6)) {
      case 0:
        damaged[at] = static_cast<char>(damaged[at] ^ static_cast<char>(1U << pick(8)));
        break;
      case 1:
        damaged[at] = static_cast<char>(random());
        break;
      case 2: {  // a number of several bytes at an end of its range
        const char extreme = pick(2) == 0 ? '\0' : '\xFF';
        for (std::size_t i = at; i < std::min(at + (std::size_t{1} << pick(4)), damaged.size()); ++i)
          damaged[i] = extreme;
        break;
      }
      case 3:
        damaged.insert(at, 1, static_cast<char>(random()));
        break;
      case 4:
        damaged.erase(at, 1 + pick(8));
        break;
      case 5:
        damaged.insert(at, damaged.substr(pick(damaged.size()), pick(32)));
        break;
      default:
        damaged[at] = digits[pick(digits.size())];
        break;
    }
  }
  return damaged;
}

TEST_P(ReaderMutation, ReadsTheFileAsItIs) {
  EXPECT_EQ(outcome(tested().bytes), "");
}

TEST_P(ReaderMutation, RefusesOrReadsEveryTruncation) {
  const ReaderCase& each = tested();
  for (std::size_t length = 0; length < each.bytes.size();
       length += static_cast<std::size_t>(each.share * truncation_step())) {
    const std::string what = outcome(each.bytes.substr(0, length));
    const bool must_fail = each.shortest_valid == 0 || (each.shortest_valid > 1 && length < each.shortest_valid);
    EXPECT_TRUE(!must_fail || !what.empty()) << length << " of " << each.bytes.size() << " bytes";
    // A number that is cut off may be one that is not read.
    if (!what.empty() && each.name != "EhdrHeader") {
      EXPECT_EQ(code_, ErrorCode::kCorrupt) << length << ": " << what;
    }
    if (HasFailure()) return;
  }
}

TEST_P(ReaderMutation, SurvivesDamagedFiles) {
  const ReaderCase& each = tested();
  const auto found = std::filesystem::path(ISOHF_SOURCE_DIR) / "tests/fuzz/corpus/reader" / each.name;
  if (std::filesystem::is_directory(found)) {  // by scripts/dev/fuzz
    for (const auto& entry : std::filesystem::directory_iterator(found)) {
      SCOPED_TRACE(entry.path().string());
      (void)outcome(read_file(entry.path()));
    }
  }
  const int rounds = mutations() / each.share;
  std::mt19937 random(kSeed);
  int read = 0;
  for (int round = 0; round < rounds; ++round) {
    const std::string damaged = mutated(each.bytes, each.text, random);
    read += outcome(damaged).empty() ? 1 : 0;
    if (!HasFailure()) continue;
    const std::string kept = (std::filesystem::temp_directory_path() / ("mutation_" + each.file_name)).string();
    write_file(kept, damaged);
    FAIL() << "round " << round << " of seed " << kSeed << "; the file is kept as " << kept;
  }
  std::cout << rounds << " mutations from seed " << kSeed << ": " << read << " read, " << rounds - read << " refused\n";
  // A .prj that says nothing is passed over, with a warning.
  EXPECT_TRUE(read < rounds || each.name == "EhdrProjection");
}

INSTANTIATE_TEST_SUITE_P(Formats, ReaderMutation, ::testing::Range<std::size_t>(0, cases().size()),
                         [](const ::testing::TestParamInfo<std::size_t>& each) { return cases()[each.param].name; });

/// A reader that is not in the table is one that nobody damages.
TEST(ReaderCases, HaveAFileForEveryNativeFormat) {
  std::set<std::string> covered;
  const TemporaryFolder folder;
  for (const ReaderCase& each : cases()) {
    for (const auto& [name, bytes] : each.beside) write_file(folder / name, bytes);
    write_file(folder / each.file_name, each.bytes);
    const std::string opened = folder / (each.opened.empty() ? each.file_name : each.opened);
    covered.insert(native_format_of(opened, each.options)->name);
    for (const auto& entry : std::filesystem::directory_iterator(folder / ".")) std::filesystem::remove(entry);
  }
  for (const Format& format : native_formats()) {
    EXPECT_EQ(covered.count(format.name), 1U) << format.name;
  }
}

}  // namespace
}  // namespace isohf::test
