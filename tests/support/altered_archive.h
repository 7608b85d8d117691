#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace isohf::test {

/// An archive taken apart, altered, and put together again with right checksums, index and directory, in its own version of the format: what only
/// somebody who means it would make.
class AlteredArchive {
 public:
  explicit AlteredArchive(const std::string& path);

  nlohmann::json metadata;
  std::map<std::string, std::pair<std::uint32_t, std::uint32_t>>
      ranges;                                 ///< of codes, instead of the index's; not of version 1
  std::optional<std::uint64_t> stored_count;  ///< what the index's footer says, instead of the truth; of version 1

  [[nodiscard]] std::vector<std::string> names() const;
  /// A member's bytes, inflated.
  [[nodiscard]] std::vector<std::byte> bytes(const std::string& name) const;
  void set(const std::string& name, const std::vector<std::byte>& bytes);
  void rename(const std::string& name, const std::string& to);
  void remove(const std::string& name);

  /// What members of such names take in the file.
  [[nodiscard]] std::uint64_t compressed_bytes(const std::string& start) const;

  void write(const std::string& path) const;

 private:
  struct Member {
    std::string name;
    bool deflated = false;
    std::uint32_t crc32 = 0;
    std::uint64_t bytes = 0;
    std::vector<std::byte> data;  ///< as it stands in the file
  };
  [[nodiscard]] const Member& member(const std::string& name) const;
  [[nodiscard]] bool is_first_version() const;
  [[nodiscard]] nlohmann::json stated() const;
  void write_now(const std::string& path) const;
  void write_first_version(const std::string& path) const;

  std::string original_;            ///< the archive that was taken apart; must still be there
  std::vector<Member> members_;     ///< without metadata and index
  std::vector<std::byte> records_;  ///< of the index of version 1
  std::int64_t tile_columns_ = 0;   ///< as it was
};

}  // namespace isohf::test
