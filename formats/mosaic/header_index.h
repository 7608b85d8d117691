#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "formats/files/file_stamp.h"
#include "isohf/raster.h"

namespace isohf {

/// What the headers of many files say, in the order in which they are named, as a file keeps it: who has it need not
/// open them. Files that say the same but for size and place share a record.
class HeaderIndex {
 public:
  struct Header {
    SourceInfo info;  ///< without its path
    FileStamp stamp;  ///< size and time alone: devices have other numbers on other machines
    std::uint64_t reader_bytes = 0;
  };

  /// key  what it belongs to
  /// Empty, to be filled.
  HeaderIndex() = default;
  /// What bytes() gave. Throws Error{kCorrupt} where it is damaged or of another key.
  HeaderIndex(const std::string& bytes, const std::string& key);
  [[nodiscard]] std::string bytes(const std::string& key) const;

  [[nodiscard]] std::size_t size() const { return files_.size(); }
  /// Whether the files are these, in this order.
  [[nodiscard]] bool is_of(std::span<const std::string> paths) const;
  [[nodiscard]] Header header(std::size_t i) const;
  /// Takes the next one.
  void add(const std::string& path, const Header& header);

 private:
  struct File {
    std::string path;
    std::uint32_t kind = 0;
    std::int64_t width = 0;
    std::int64_t height = 0;
    double origin_x = 0.0;
    double origin_y = 0.0;
    FileStamp stamp;
    std::uint64_t reader_bytes = 0;
  };
  template <typename Io>
  static void each(Io& io, File& file);

  std::vector<SourceInfo> kinds_;        ///< size and place left out
  std::vector<std::string> kind_bytes_;  ///< the same, to be compared
  std::vector<File> files_;
};

}  // namespace isohf
