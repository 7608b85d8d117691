#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>

#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// A raster and its archive, which nothing may harm.
class OutputFiles : public ::testing::Test {
 protected:
  OutputFiles() {
    std::filesystem::copy_file(ISOHF_SOURCE_DIR "/testdata/voids_200x150_int16.tif", folder / "a.tif");
    std::filesystem::copy_file(ISOHF_SOURCE_DIR "/testdata/voids_200x150_int16.tif", folder / "b.tif");
    raster = read_file(folder / "a.tif");
    EXPECT_EQ(run_isohf({"convert", folder / "a.tif", folder / "a.isohf", "-q"}).exit_code, 0);
  }
  /// Runs in the folder; nothing but one line that holds `why` may come out.
  void expect_refused(const std::vector<std::string>& arguments, const std::string& why, int exit_code = 2) {
    const std::vector<std::string> before = folder.names();
    RunOptions options;
    options.folder = folder.path();
    const RunResult result = run_isohf(arguments, options);
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_THAT(result.err, HasSubstr(why));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_EQ(folder.names(), before);
    EXPECT_EQ(read_file(folder / "a.tif"), raster);
    EXPECT_EQ(read_file(folder / "b.tif"), raster);
  }
  RunResult run(const std::vector<std::string>& arguments) {
    RunOptions options;
    options.folder = folder.path();
    RunResult result = run_isohf(arguments, options);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result;
  }

  TemporaryFolder folder;
  std::string raster;
};

TEST_F(OutputFiles, AnOutputThatIsNotCalledIsohfNeedsItsOption) {
  expect_refused({"convert", "a.tif", "b.tif"}, "b.tif is an input");
  expect_refused({"convert", "a.tif", "b.tif", "--overwrite"}, "b.tif is an input");
  expect_refused({"convert", "a.tif", "new.zip"}, "new.zip is an input");
  run({"convert", "a.tif", "-o", "new.zip", "-q"});
  run({"convert", "a.tif", "NEW.ISOHF", "-q"});
}

TEST_F(OutputFiles, AnArchiveReplacesNothingElse) {
  expect_refused({"convert", "a.tif", "-o", "b.tif", "--overwrite"}, "b.tif: exists and is a raster (TIFF)");
  // Nor is --overwrite named where it would not help.
  expect_refused({"convert", "a.tif", "-o", "b.tif"}, "b.tif: exists and is a raster (TIFF)");
  write_file(folder / "notes.isohf", "my notes");
  expect_refused({"convert", "a.tif", "notes.isohf", "--overwrite"}, "notes.isohf: exists and is no isohf archive");
  EXPECT_EQ(read_file(folder / "notes.isohf"), "my notes");
  write_file(folder / "empty", "");
  run({"convert", "a.tif", "-o", "empty", "--overwrite", "-q"});
  run({"convert", "a.tif", "-o", "empty", "--overwrite", "-q"});
}

TEST_F(OutputFiles, ARasterReplacesNothingElse) {
  write_file(folder / "notes.png", "my notes");
  write_file(folder / "sky.hdr", "#?RADIANCE\n");
  std::filesystem::copy_file(folder / "a.isohf", folder / "c.tif");
  for (const std::string command : {"export", "shade"}) {
    expect_refused({command, "a.isohf", "notes.png", "--overwrite"}, "notes.png: exists and is no PNG");
    expect_refused({command, "a.isohf", "c.tif", "--overwrite"}, "c.tif: exists and is a ZIP archive");
  }
  expect_refused({"export", "a.isohf", "sky.flt", "--overwrite"}, "sky.hdr: exists and is no .hdr of a raster");
  run({"export", "a.isohf", "b.tif", "--overwrite", "-q"});  // asked for, and of the kind
}

TEST_F(OutputFiles, ARasterIsNeverItsInput) {
  expect_refused({"export", "a.isohf", "b.tif", "--like", "b.tif", "--overwrite"}, "is one of the inputs");
  run({"export", "a.isohf", "grid.flt", "-q"});
  expect_refused({"export", "a.isohf", "grid.flt", "--like", "grid.hdr", "--overwrite"},
                 "writes grid.hdr, which is one of the inputs");
}

TEST_F(OutputFiles, ADashIsRefusedBeforeTheWork) {
  expect_refused({"convert", "a.tif", "-o", "-"}, "-: standard output is not written to");
  for (const std::string command : {"export", "shade"}) {
    expect_refused({command, "a.isohf", "-o", "-"}, "-: standard output is not written to");
  }
}

TEST_F(OutputFiles, LinksAreWrittenThrough) {
  std::filesystem::create_directory(folder / "disk");
  const std::vector<std::pair<std::string, std::vector<std::string>>> outputs = {{"x.isohf", {"convert", "a.tif"}},
                                                                                 {"x.tif", {"export", "a.isohf"}},
                                                                                 {"x.r16", {"export", "a.isohf"}},
                                                                                 {"x.png", {"shade", "a.isohf"}}};
  for (const auto& [name, command] : outputs) {
    std::filesystem::create_symlink("disk/" + name, folder / name);
    std::vector<std::string> arguments = command;
    arguments.insert(arguments.end(), {"-o", name, "--overwrite", "-q"});
    expect_refused(arguments, name + ": is a link to disk/" + name + ", which does not exist");
    write_file(folder / ("disk/" + name), "");
    run(arguments);
    EXPECT_TRUE(std::filesystem::is_symlink(folder / name));
    EXPECT_GT(std::filesystem::file_size(folder / ("disk/" + name)), 100U);
    EXPECT_FALSE(std::filesystem::exists(folder / ("disk/" + name + ".part")));
  }
}

TEST_F(OutputFiles, AFolderThatMayNotBeWrittenIsNoticedFirst) {
  std::filesystem::create_directory(folder / "locked");
  ASSERT_EQ(::chmod((folder / "locked").c_str(), 0555), 0);
  ASSERT_EQ(::chmod(folder.path().c_str(), 0755), 0);
  RunOptions options;
  options.folder = folder.path();
  options.without_privileges = true;
  const RunResult result = run_isohf({"convert", "gone.tif", "locked/x.isohf"}, options);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("locked/x.isohf: cannot write into folder locked: Permission denied"));
}

TEST_F(OutputFiles, OverwritingKeepsPermissions) {
  ASSERT_EQ(::chmod((folder / "a.isohf").c_str(), 0640), 0);
  run({"convert", "a.tif", "a.isohf", "--overwrite", "-q"});
  run({"export", "a.isohf", "x.r16", "-q"});
  ASSERT_EQ(::chmod((folder / "x.r16").c_str(), 0600), 0);
  run({"export", "a.isohf", "x.r16", "--overwrite", "-q"});
  struct stat status {};
  ASSERT_EQ(::stat((folder / "a.isohf").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0640U);
  ASSERT_EQ(::stat((folder / "x.r16").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0600U);
}

TEST_F(OutputFiles, ProgressNeverGoesIntoTheOutput) {
  run({"export", "a.isohf", "good.tif", "-q"});
  RunOptions options;
  options.folder = folder.path();
  const RunResult result = run_program(
      {"/bin/sh", "-c", "exec \"$0\" export a.isohf closed.tif --progress plain <&- 2>&-", isohf_path()}, options);
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(read_file(folder / "closed.tif"), read_file(folder / "good.tif"));
}

}  // namespace
}  // namespace isohf::test
