#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

namespace isohf::test {

/// Folder of the real elevation files; it is no part of the repository and may be absent.
inline std::filesystem::path real_data() {
  return ISOHF_SOURCE_DIR "/../shared/data";
}

/// Why a test that needs them is skipped.
inline constexpr const char* kNoRealFiles = "no shared/data folder beside this checkout";

/// The real files, in the folder and its folder derived/, whose names end in one of `endings`; all where it is empty.
inline std::vector<std::filesystem::path> real_files(const std::vector<std::string>& endings = {}) {
  std::vector<std::filesystem::path> files;
  for (const auto& folder : {real_data(), real_data() / "derived"}) {
    if (!std::filesystem::is_directory(folder)) continue;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      const std::string name = entry.path().filename();
      const bool wanted = endings.empty() || std::any_of(endings.begin(), endings.end(),
                                                         [&](const auto& ending) { return name.ends_with(ending); });
      if (wanted && entry.is_regular_file()) files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace isohf::test
