#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

namespace isohf::test {

/// An archive taken apart, altered, and put together again with right checksums, index and directory: what only somebody
/// who means it would make.
class AlteredArchive {
 public:
  explicit AlteredArchive(const std::string& path);

  nlohmann::json metadata;
  std::map<std::string, std::pair<std::uint32_t, std::uint32_t>> ranges;  ///< of codes, instead of the index's

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
  [[nodiscard]] nlohmann::json stated() const;

  std::string original_;         ///< the archive that was taken apart; must still be there
  std::vector<Member> members_;  ///< without metadata and index
};

}  // namespace isohf::test
