#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

namespace isohf::test {

/// A member of a tar archive (ustar): its header, and its contents in whole blocks.
inline std::string tar_member(const std::string& name, const std::string& contents, char type = '0') {
  std::string block(512, '\0');
  block.replace(0, name.size(), name);
  char digits[13];
  std::snprintf(digits, sizeof digits, "%011llo", static_cast<unsigned long long>(contents.size()));
  block.replace(124, 11, digits);
  block[156] = type;
  block.replace(257, 5, "ustar");
  block.replace(263, 2, "00");
  block.replace(148, 8, std::string(8, ' '));
  unsigned sum = 0;
  for (const char c : block) sum += static_cast<unsigned char>(c);
  std::snprintf(digits, sizeof digits, "%06o", sum);
  block.replace(148, 7, std::string(digits) + '\0');
  const std::string padding((512 - contents.size() % 512) % 512, '\0');
  return block + contents + padding;
}

/// One that ends with the one block of zeros that must be there.
inline std::string tar_archive(const std::vector<std::pair<std::string, std::string>>& files) {
  std::string tar;
  for (const auto& [name, contents] : files) tar += tar_member(name, contents);
  return tar + std::string(512, '\0');
}

}  // namespace isohf::test
