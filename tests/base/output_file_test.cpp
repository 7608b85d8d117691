#include "isohf/base/output_file.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>

#include "isohf/error.h"
#include "support/error_of.h"
#include "support/temporary_folder.h"

namespace {

/// What the next system calls of each kind answer instead of doing anything; 0: they do their work.
struct Faults {
  int flock = 0;
  int flock_times = 0;
  int ftruncate = 0;
  int folder_fsync = 0;
} faults;

int refuse(int error) {
  errno = error;
  return -1;
}

}  // namespace

// The program's own definitions go before the C library's.
extern "C" int flock(int file, int operation) {
  if (faults.flock_times > 0) {
    --faults.flock_times;
    return refuse(faults.flock);
  }
  return static_cast<int>(::syscall(SYS_flock, file, operation));
}
extern "C" int ftruncate(int file, off_t size) noexcept {
  return faults.ftruncate != 0 ? refuse(faults.ftruncate) : static_cast<int>(::syscall(SYS_ftruncate, file, size));
}
extern "C" int fsync(int file) {
  struct stat status {};
  if (faults.folder_fsync != 0 && ::fstat(file, &status) == 0 && S_ISDIR(status.st_mode)) {
    return refuse(faults.folder_fsync);
  }
  return static_cast<int>(::syscall(SYS_fsync, file));
}

namespace isohf {
namespace {

using test::error_of;
using test::read_file;
using test::TemporaryFolder;
using test::write_file;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

void write(const std::string& path, std::string_view text, bool overwrite) {
  OutputFile file(path, {overwrite});
  file.append(text);
  file.commit();
}

class OutputFileTest : public ::testing::Test {
 protected:
  ~OutputFileTest() override { faults = {}; }
  TemporaryFolder folder;
};

TEST_F(OutputFileTest, GetsItsNameWhenItIsComplete) {
  {
    OutputFile file(folder / "a", {});
    file.append("abc");
    EXPECT_THAT(folder.names(), ElementsAre("a.part"));
    file.write_at(1, std::as_bytes(std::span("X", 1)));
    file.append("d");
    EXPECT_EQ(file.position(), 4U);
    file.commit();
    EXPECT_THAT(folder.names(), ElementsAre("a"));
  }
  EXPECT_EQ(read_file(folder / "a"), "aXcd");
  { OutputFile(folder / "b", {}).append("lost"); }
  EXPECT_THAT(folder.names(), ElementsAre("a"));
}

TEST_F(OutputFileTest, RetriesALockThatASignalInterrupts) {
  faults.flock = EINTR;
  faults.flock_times = 2;
  write(folder / "a", "x", false);
  EXPECT_EQ(faults.flock_times, 0);
  EXPECT_THAT(folder.names(), ElementsAre("a"));
}

TEST_F(OutputFileTest, DoesWithoutLocksWhereTheFileSystemHasNone) {
  for (const int error : {ENOLCK, EOPNOTSUPP, ENOSYS}) {
    faults.flock = error;
    faults.flock_times = 1;
    write(folder / "a", "x", true);
  }
  const OutputFile first(folder / "a", {true});
  EXPECT_THAT(error_of([&] { OutputFile(folder / "a", {true}); }).what(), HasSubstr("another process is writing"));
}

TEST_F(OutputFileTest, LeavesNothingWhereItCannotBeEmptied) {
  faults.ftruncate = EIO;
  EXPECT_EQ(error_of([&] { OutputFile(folder / "a", {}); }).code(), ErrorCode::kIo);
  EXPECT_THAT(folder.names(), ElementsAre());
}

TEST_F(OutputFileTest, StandsWhereItsFolderCannotBeFlushed) {
  faults.folder_fsync = EIO;
  write(folder / "a", "x", false);
  EXPECT_THAT(folder.names(), ElementsAre("a"));
}

TEST_F(OutputFileTest, KeepsWhatAppearedMeanwhileAndItself) {
  {
    OutputFile file(folder / "a", {});
    file.append("mine");
    write_file(folder / "a", "theirs");
    EXPECT_THAT(error_of([&] { file.commit(); }).what(), HasSubstr("a.part"));
  }
  EXPECT_EQ(read_file(folder / "a"), "theirs");
  EXPECT_EQ(read_file(folder / "a.part"), "mine");
}

TEST_F(OutputFileTest, WritesThroughALink) {
  std::filesystem::create_directory(folder / "elsewhere");
  write_file(folder / "elsewhere/file", "old");
  std::filesystem::create_symlink("elsewhere/file", folder / "link");
  EXPECT_THAT(error_of([&] { OutputFile(folder / "link", {}); }).what(), HasSubstr("exists"));
  {
    OutputFile file(folder / "link", {true});
    file.append("new");
    EXPECT_TRUE(std::filesystem::exists(folder / "elsewhere/file.part"));
    file.commit();
  }
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
  EXPECT_EQ(read_file(folder / "elsewhere/file"), "new");
  EXPECT_THAT(folder.names(), ElementsAre("elsewhere", "link"));
}

TEST_F(OutputFileTest, RefusesALinkToNothing) {
  std::filesystem::create_symlink("gone", folder / "link");
  const Error error = error_of([&] { OutputFile(folder / "link", {true}); });
  EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
  EXPECT_THAT(error.what(), HasSubstr("is a link to gone, which does not exist"));
  EXPECT_THAT(folder.names(), ElementsAre("link"));
}

TEST_F(OutputFileTest, FollowsNoLinkThatIsCalledAsItsPart) {
  write_file(folder / "precious", "all of it");
  std::filesystem::create_symlink("precious", folder / "a.part");
  EXPECT_EQ(error_of([&] { OutputFile(folder / "a", {}); }).code(), ErrorCode::kIo);
  EXPECT_EQ(read_file(folder / "precious"), "all of it");
}

TEST_F(OutputFileTest, HandsPermissionsOn) {
  write_file(folder / "a", "old");
  for (const ::mode_t mode : {0600U, 0644U, 0440U, 0755U}) {
    ASSERT_EQ(::chmod((folder / "a").c_str(), mode), 0);
    {
      OutputFile file(folder / "a", {true});
      struct stat part {};
      ASSERT_EQ(::stat(file.part_path().c_str(), &part), 0);
      EXPECT_EQ(part.st_mode & 0777U & ~(mode | 0600U), 0U) << "readable while it is written";
      file.commit();
    }
    struct stat status {};
    ASSERT_EQ(::stat((folder / "a").c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 07777U, mode);
  }
}

TEST_F(OutputFileTest, RefusesNamesThatAreNoFiles) {
  for (const std::string name : {"-", "/dev/null", "/dev/stdout"}) {
    EXPECT_EQ(error_of([&] { OutputFile(name, {true}); }).code(), ErrorCode::kInvalidArgument) << name;
  }
  EXPECT_THAT(error_of([&] { OutputFile(folder / "a/b", {}); }).what(), HasSubstr("cannot write into folder"));
  write_file(folder / "file", "");
  EXPECT_THAT(error_of([&] { OutputFile(folder / "file/b", {}); }).what(), HasSubstr("file is no folder"));
  EXPECT_THAT(error_of([&] { OutputFile(folder / "a/", {}); }).what(), HasSubstr("names a folder"));
}

TEST(StandardDescriptors, StayClosedToWhoeverUsesThem) {
  const TemporaryFolder folder;
  const ::pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    for (const int descriptor : {0, 1, 2}) ::close(descriptor);
    occupy_standard_descriptors();
    const int opened = ::open((folder / "file").c_str(), O_RDWR | O_CREAT, 0600);
    char byte = 0;
    const bool refused = ::write(1, "x", 1) < 0 && ::write(2, "x", 1) < 0 && ::read(0, &byte, 1) < 0;
    ::_exit(opened > 2 && refused ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace isohf
