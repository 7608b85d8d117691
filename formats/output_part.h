#pragma once

#include <string>

namespace isohf {

/// The file NAME.part that becomes NAME when it is complete. Locked against other writers; removed when destroyed
/// before commit(). Errors carry no path.
class OutputPart {
 public:
  /// Makes an empty NAME.part beside `path`. Throws Error{kInvalidArgument}: `path` is a folder, or exists and
  /// `overwrite` is not set; Error{kIo}: the folder is missing or may not be written, or another process writes it.
  OutputPart(const std::string& path, bool overwrite);
  OutputPart(const OutputPart&) = delete;
  OutputPart& operator=(const OutputPart&) = delete;
  ~OutputPart();

  [[nodiscard]] const std::string& path() const { return part_path_; }

  /// Flushes NAME.part to the disk and renames it. Without `overwrite` a file that has appeared meanwhile stays.
  void commit();

 private:
  std::string path_;
  std::string part_path_;
  bool overwrite_;
  int file_ = -1;
};

}  // namespace isohf
