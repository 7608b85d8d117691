/// Inputs and outputs that cannot work: each is one clear line, exit code 1 or 2, and nothing is written.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>

#include "support/rasters/plain_tiff.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using testing::AnyOf;
using testing::HasSubstr;

class BadInput : public testing::Test {
 protected:
  /// Converts `input` and expects that it fails with one line holding all of `parts`, and leaves the folder as it was.
  void expect_refused(const std::string& input, const std::vector<std::string>& parts,
                      const std::vector<std::string>& more = {}, std::optional<int> code = std::nullopt) {
    const std::vector<std::string> before = folder.names();
    const RunResult result = run_isohf(with_more({"convert", input, folder / "out.isohf"}, more));
    EXPECT_THAT(result.exit_code, AnyOf(code.value_or(1), code.value_or(2)));
    EXPECT_EQ(result.out, "");
    EXPECT_THAT(result.err, testing::StartsWith("isohf convert: "));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    for (const std::string& part : parts) EXPECT_THAT(result.err, HasSubstr(part));
    EXPECT_EQ(folder.names(), before);
  }

  void write_hills(const std::string& name, std::uint32_t size = 64) const {
    write_int16_tiff(folder / name, size, size, [](std::int64_t c, std::int64_t r) {
      return static_cast<std::int16_t>(500 + 100 * std::sin(0.1 * static_cast<double>(c)) *
                                                 std::cos(0.07 * static_cast<double>(r)));
    });
  }

  TemporaryFolder folder;
};

TEST_F(BadInput, MissingFile) {
  expect_refused(folder / "none.tif", {"none.tif", "no such file"});
  expect_refused("-", {"standard input", "save it in a file"});
}

TEST_F(BadInput, AScaleThatMakesEveryElevationInfinite) {
  write_hills("a.tif");
  for (const char* scale : {"1e300", "-1e300", "1e-300", "0"}) {
    expect_refused(folder / "a.tif", {"--z-scale", "must be from 1e-20 to 1e20"}, {std::string("--z-scale=") + scale},
                   2);
  }
}

TEST_F(BadInput, UnreadableFileAndFolder) {
  write_hills("secret.tif");
  write_hills("open.tif");
  ::chmod((folder / "secret.tif").c_str(), 0);
  ::chmod((folder / "open.tif").c_str(), 0444);
  std::filesystem::create_directory(folder / "out");
  ::chmod((folder / "out").c_str(), 0777);
  ::chmod(folder.path().c_str(), 0555);
  RunOptions plain_user;
  plain_user.without_privileges = true;
  if (run_isohf({"--version"}, plain_user).exit_code != 0) GTEST_SKIP() << "other users cannot run the program";
  const RunResult input = run_isohf({"convert", folder / "secret.tif", folder / "out/out.isohf"}, plain_user);
  EXPECT_EQ(input.exit_code, 1);
  EXPECT_THAT(input.err, HasSubstr("secret.tif: cannot open: Permission denied\n"));
  const RunResult output = run_isohf({"convert", folder / "open.tif", folder / "out.isohf"}, plain_user);
  EXPECT_EQ(output.exit_code, 1);
  EXPECT_THAT(output.err, HasSubstr("out.isohf"));
  EXPECT_THAT(output.err, HasSubstr("Permission denied\n"));
  EXPECT_EQ(std::count(output.err.begin(), output.err.end(), '\n'), 1) << output.err;
  ::chmod(folder.path().c_str(), 0755);
  EXPECT_EQ(folder.names(), (std::vector<std::string>{"open.tif", "out", "secret.tif"}));
}

TEST_F(BadInput, NothingButNaN) {
  write_float_tiff(folder / "nan.tif", 40, 30,
                   [](std::int64_t, std::int64_t) { return std::numeric_limits<float>::quiet_NaN(); });
  expect_refused(folder / "nan.tif", {"nan.tif", "void"}, {}, 1);
  expect_refused(folder / "nan.tif", {"nan.tif", "void"}, {"--z-range", "0:1"}, 1);
  expect_refused(folder / "nan.tif", {"nan.tif", "void"}, {"--type", "f32"}, 1);
}

TEST_F(BadInput, OneRowOneColumnOneSample) {
  const auto level = [](std::int64_t, std::int64_t) { return std::int16_t{5}; };
  for (const auto& [width, height] : {std::pair{1U, 50U}, {50U, 1U}, {1U, 1U}}) {
    write_int16_tiff(folder / "thin.tif", width, height, level);
    expect_refused(folder / "thin.tif", {"thin.tif", std::to_string(width) + "x" + std::to_string(height), "2x2"}, {},
                   1);
  }
}

TEST_F(BadInput, OutputIsAFolder) {
  write_hills("a.tif");
  const RunResult result = run_isohf({"convert", folder / "a.tif", "-o", folder.path(), "--overwrite"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("is a folder"));
}

TEST_F(BadInput, OutputExists) {
  write_hills("a.tif");
  ASSERT_EQ(run_isohf({"convert", folder / "a.tif", folder / "out.isohf"}).exit_code, 0);
  const std::string before = read_file(folder / "out.isohf");
  expect_refused(folder / "a.tif", {"out.isohf: exists", "--overwrite"});
  EXPECT_EQ(read_file(folder / "out.isohf"), before);
  // Said before the input is looked at.
  expect_refused(folder / "none.tif", {"out.isohf: exists"});
}

TEST_F(BadInput, OutputIsTheInputByWhateverName) {
  write_hills("a.tif");
  ASSERT_EQ(::symlink("a.tif", (folder / "symbolic.tif").c_str()), 0);
  ASSERT_EQ(::link((folder / "a.tif").c_str(), (folder / "hard.tif").c_str()), 0);
  const std::string before = read_file(folder / "a.tif");
  for (const char* name : {"a.tif", "symbolic.tif", "hard.tif", "./a.tif"}) {
    const RunResult result = run_isohf({"convert", folder / "a.tif", "-o", folder / name, "--overwrite"});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("is the input"));
  }
  EXPECT_EQ(read_file(folder / "a.tif"), before);
  // The part file is written as well.
  ASSERT_EQ(::rename((folder / "a.tif").c_str(), (folder / "b.isohf.part").c_str()), 0);
  const RunResult part = run_isohf({"convert", folder / "b.isohf.part", folder / "b.isohf"});
  EXPECT_EQ(part.exit_code, 2);
  EXPECT_THAT(part.err, HasSubstr("is the input"));
  EXPECT_EQ(read_file(folder / "b.isohf.part"), before);
}

/// Which no codec makes small.
void write_noise(const std::string& path, int side) {
  std::uint32_t state = 1;
  write_int16_tiff(path, side, side, [&](std::int64_t, std::int64_t) {
    state = state * 1664525U + 1013904223U;
    return static_cast<std::int16_t>(state >> 16);
  });
}

/// A file system in memory that holds so many bytes; needs the right to mount one.
class SmallDisk {
 public:
  SmallDisk(std::string path, std::uint64_t bytes) : path_(std::move(path)) {
    std::filesystem::create_directory(path_);
    is_there_ = ::mount("none", path_.c_str(), "tmpfs", 0, ("size=" + std::to_string(bytes)).c_str()) == 0;
  }
  ~SmallDisk() {
    if (is_there_) ::umount2(path_.c_str(), MNT_DETACH);
    std::filesystem::remove(path_);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

  [[nodiscard]] bool is_there() const { return is_there_; }
  bool grow(std::uint64_t bytes) const {
    return ::mount("none", path_.c_str(), "tmpfs", MS_REMOUNT, ("size=" + std::to_string(bytes)).c_str()) == 0;
  }

 private:
  std::string path_;
  bool is_there_ = false;
};

TEST_F(BadInput, ADiskThatFillsAnywhereKeepsPartAndJournalAndAResumeGivesTheSameBytes) {
  write_noise(folder / "noise.tif", 1000);
  const std::vector<std::vector<std::string>> kinds = {{}, {"--lossless"}, {"--shadow-seeds", "--memory", "60M"}};
  for (const std::vector<std::string>& more : kinds) {
    const auto convert = [&](const std::string& output, std::vector<std::string> also) {
      also.insert(also.begin(), {"/usr/bin/env", "TMPDIR=" + folder.path(), isohf_path(), "convert",
                                 folder / "noise.tif", output, "-q"});
      also.insert(also.end(), more.begin(), more.end());
      return run_program(also);
    };
    ASSERT_EQ(convert(folder / "whole.isohf", {"--overwrite"}).exit_code, 0);
    const std::string whole = read_file(folder / "whole.isohf");
    for (const double share : {0.05, 0.3, 0.6, 0.98}) {
      SCOPED_TRACE((more.empty() ? "plain" : more[0]) + " at " + std::to_string(share));
      const SmallDisk disk(folder / "disk", static_cast<std::uint64_t>(share * static_cast<double>(whole.size())));
      if (!disk.is_there()) GTEST_SKIP() << "no right to mount a file system in memory";
      const std::string output = folder / "disk/out.isohf";
      const RunResult full = convert(output, {});
      EXPECT_EQ(full.exit_code, 1);
      EXPECT_THAT(full.err, HasSubstr("No space left on device"));
      EXPECT_THAT(full.err, HasSubstr("out.isohf.part keeps what is done, --resume goes on from there"));
      EXPECT_EQ(std::count(full.err.begin(), full.err.end(), '\n'), 1) << full.err;
      EXPECT_TRUE(std::filesystem::exists(output + ".part") && std::filesystem::exists(output + ".part.journal"));
      // Another try is no better, and loses nothing.
      EXPECT_EQ(convert(output, {"--resume"}).exit_code, 1);
      EXPECT_TRUE(std::filesystem::exists(output + ".part") && std::filesystem::exists(output + ".part.journal"));
      ASSERT_TRUE(disk.grow(4 * whole.size()));
      const RunResult done = convert(output, {"--resume"});
      EXPECT_EQ(done.exit_code, 0) << done.err;
      EXPECT_TRUE(read_file(output) == whole);
      EXPECT_FALSE(std::filesystem::exists(output + ".part") || std::filesystem::exists(output + ".part.journal"));
    }
  }
}

}  // namespace
}  // namespace isohf::test
