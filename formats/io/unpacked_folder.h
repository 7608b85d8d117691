#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "formats/io/packed_files.h"

namespace isohf {

/// A folder for what is unpacked, which goes with all that is in it.
///
/// It lies in its process's folder among the temporary files (TMPDIR), which goes with the last of them and whose name
/// tells its process: isohf-unpacked_HOST_NAMESPACE_PROCESS_START_XXXXXX. A process that is killed leaves its folder, and
/// the next one that unpacks removes it by one rule: the folder is of the same host, space of process numbers and user,
/// and no process of that number and start time runs. Other nodes' folders in a shared TMPDIR stay.
class UnpackedFolder {
 public:
  /// `archive` is what messages name. Throws Error{kIo} where no folder can be made.
  explicit UnpackedFolder(const std::string& archive);
  ~UnpackedFolder();
  UnpackedFolder(const UnpackedFolder&) = delete;
  UnpackedFolder& operator=(const UnpackedFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Throws Error{kIo} with the figures where the temporary files have no room for so many bytes more.
  void require_room(std::uint64_t bytes) const;
  /// Writes what `files` is at into the folder, as `name`.
  void add(const std::string& name, PackedFiles& files);
  /// Whether all that this process has unpacked takes no more than half of the room that there was for it.
  [[nodiscard]] bool has_room_to_stay() const;

 private:
  std::string archive_;
  std::shared_ptr<const std::filesystem::path> of_process_;
  std::filesystem::path path_;
  std::uint64_t bytes_ = 0;
};

}  // namespace isohf
