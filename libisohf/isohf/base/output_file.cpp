#include "isohf/base/output_file.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <system_error>

#include "isohf/base/text/number_text.h"
#include "isohf/error.h"

namespace isohf {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kWritebackBytes = std::uint64_t{4} << 20U;

[[noreturn]] void refuse(const std::string& why) {
  throw Error(ErrorCode::kInvalidArgument, why);
}

/// Opens and locks a file, again where it was renamed between the two.
File open_locked(const std::string& path) {
  for (int attempt = 0; attempt < 8; ++attempt) {
    File file(path, File::Mode::kReadWrite);
    struct stat status {};
    if (::fstat(file.descriptor(), &status) == 0 && !S_ISREG(status.st_mode)) refuse(path + " is no regular file");
    if (!file.try_lock()) break;
    if (file.is_at_path()) return file;
  }
  throw Error(ErrorCode::kIo, fmt::format("another process is writing {}; wait for it, or choose another name", path));
}

[[noreturn]] void refuse_to_replace(const std::string& part) {
  throw Error(ErrorCode::kIo, fmt::format("was made by another program meanwhile; what was to replace it is {}", part));
}

std::vector<std::byte> room_for(std::size_t bytes) {
  std::vector<std::byte> buffer;
  buffer.reserve(bytes);
  return buffer;
}

}  // namespace

void require_writable_folder(const std::string& folder) {
  struct stat status {};
  const bool found = ::stat(folder.c_str(), &status) == 0;
  if (found && !S_ISDIR(status.st_mode)) throw Error(ErrorCode::kIo, folder + " is no folder");
  if (found && ::access(folder.c_str(), W_OK | X_OK) == 0) return;
  throw Error(ErrorCode::kIo, fmt::format("cannot write into folder {}: {}", folder, reason(errno)));
}

std::string output_place(const std::string& path, bool overwrite) {
  if (path == "-") {
    refuse(
        "standard output is not written to: the file gets its name when it is complete; name a file (./- for one "
        "that is called so)");
  }
  struct stat status {};
  if (::lstat(path.c_str(), &status) != 0) {
    if (errno != ENOENT) {
      if (errno == ENOTDIR) require_writable_folder(folder_of(path));
      throw Error(ErrorCode::kIo, fmt::format("cannot be looked at: {}", reason(errno)));
    }
    if (path.empty() || path.back() == '/') refuse("names a folder, the output must be a file name");
    require_writable_folder(folder_of(path));
    return path;
  }
  std::string place = path;
  if (S_ISLNK(status.st_mode)) {
    std::error_code failure;
    if (::stat(path.c_str(), &status) != 0) {
      refuse(fmt::format("is a link to {}, which does not exist; remove the link, or choose another name",
                         fs::read_symlink(path, failure).string()));
    }
    const fs::path named = fs::canonical(path, failure);
    if (!failure) place = named.string();  // what has no path, as a pipe, is no regular file
  }
  if (::stat(place.c_str(), &status) != 0) throw Error(ErrorCode::kIo, "cannot be looked at: " + reason(errno));
  if (S_ISDIR(status.st_mode)) refuse("is a folder, the output must be a file name");
  if (!S_ISREG(status.st_mode)) refuse("is no regular file, the output must be one");
  if (!overwrite) throw Error(ErrorCode::kInvalidArgument, {"", "exists", "", "`overwrite` replaces it"});
  require_writable_folder(folder_of(place));
  return place;
}

void require_room(const std::string& path, double least_bytes) {
  std::error_code failure;
  const std::string folder = folder_of(fs::weakly_canonical(fs::absolute(path, failure), failure).string());
  const fs::space_info space = fs::space(folder, failure);
  if (failure || space.capacity == 0) return;
  const std::uintmax_t part = fs::file_size(path + ".part", failure);
  const double free = static_cast<double>(space.available) + (failure ? 0.0 : static_cast<double>(part));
  if (least_bytes <= free) return;
  throw Error(ErrorCode::kIo, {"", fmt::format("{} free in {}", in_bytes(free), folder),
                               fmt::format("at least {}, which the output takes", in_bytes(least_bytes)),
                               "ask for fewer samples, make room, or choose another folder"});
}

std::vector<std::byte> head_of_file(const std::string& path, std::size_t most_bytes) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return {};
  std::vector<std::byte> head(most_bytes);
  try {
    head.resize(File(path, File::Mode::kRead).read_at(0, head));
  } catch (const Error& error) {
    throw Error(error.code(), "what it replaces " + error.parts().found);
  }
  return head;
}

// The buffer before the file: where there is no memory for it, no file must be left.
OutputFile::OutputFile(const std::string& path, const Options& options)
    : path_(path),
      place_(output_place(path, options.overwrite)),
      part_path_(place_ + ".part"),
      overwrite_(options.overwrite),
      buffer_(room_for(options.buffer_bytes)),
      buffer_bytes_(options.buffer_bytes),
      file_(open_locked(part_path_)) {
  try {
    file_.leave_path_to_caller();
    struct stat replaced {};
    if (::stat(place_.c_str(), &replaced) == 0) {
      replaced_ = {replaced.st_mode & 07777U, replaced.st_uid, replaced.st_gid};
      // Whoever may not read the file may not read its successor while it is written.
      static_cast<void>(::fchmod(file_.descriptor(), (replaced_->mode & 0777U) | S_IRUSR | S_IWUSR));
    }
    if (!options.keep_contents) file_.truncate(0);
  } catch (...) {
    if (!options.keep_contents) remove_file(part_path_);  // no destructor runs
    throw;
  }
}

OutputFile::~OutputFile() {
  if (file_.is_open() && !keeps_) remove_file(part_path_);
}

void OutputFile::append(std::span<const std::byte> bytes) {
  if (buffer_.size() + bytes.size() > buffer_bytes_) flush();
  if (bytes.size() >= buffer_bytes_) return write(bytes);
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

void OutputFile::write(std::span<const std::byte> bytes) {
  is_synced_ = false;
  file_.write_at(flushed_, bytes);
  // The disk starts at once, so that the last flush does not wait for all of it.
  const std::uint64_t begun = flushed_ / kWritebackBytes * kWritebackBytes;
  flushed_ += bytes.size();
  const std::uint64_t full = flushed_ / kWritebackBytes * kWritebackBytes;
  if (full > begun) file_.start_writeback(begun, full - begun);
}

void OutputFile::flush() {
  if (buffer_.empty()) return;
  write(buffer_);
  buffer_.clear();
}

void OutputFile::write_at(std::uint64_t offset_bytes, std::span<const std::byte> bytes) {
  if (offset_bytes == position()) return append(bytes);
  flush();
  is_synced_ = false;
  file_.write_at(offset_bytes, bytes);
  flushed_ = std::max(flushed_, offset_bytes + bytes.size());
}

void OutputFile::truncate(std::uint64_t size_bytes) {
  buffer_.clear();
  is_synced_ = false;
  file_.truncate(size_bytes);
  flushed_ = size_bytes;
}

void OutputFile::sync() {
  flush();
  if (is_synced_) return;
  file_.sync();
  is_synced_ = true;
}

void OutputFile::hand_rights_on() {
  if (!replaced_) return;
  // Only root gives files away; then bits that lend an owner's rights stay behind.
  const bool given = ::fchown(file_.descriptor(), replaced_->owner, replaced_->group) == 0;
  static_cast<void>(::fchmod(file_.descriptor(), given ? replaced_->mode : replaced_->mode & 0777U));
}

void OutputFile::complete() {
  sync();
  hand_rights_on();
  keeps_ = true;
  file_ = File();
  buffer_ = {};
}

void OutputFile::commit() {
  sync();
  hand_rights_on();
  if (!rename_file(part_path_, place_, overwrite_)) {
    keeps_ = true;
    refuse_to_replace(part_path_);
  }
  // In place and on the disk: what fails from here on takes nothing back.
  keeps_ = true;
  sync_folder_of(place_);
  file_ = File();
}

void name_part(const std::string& path, bool overwrite) {
  const std::string place = output_place(path, overwrite);
  if (!rename_file(place + ".part", place, overwrite)) refuse_to_replace(place + ".part");
  sync_folder_of(place);
}

void write_output(const std::string& path, std::string_view text, bool overwrite) {
  try {
    OutputFile file(path, {overwrite});
    file.append(text);
    file.commit();
  } catch (const Error& error) {
    throw error.within(path);
  }
}

}  // namespace isohf
