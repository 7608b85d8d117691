#include "formats/files/file_beside.h"

#include <filesystem>

#include "formats/files/letter_case.h"

namespace isohf {

std::string file_beside(const std::string& beside, const std::string& name) {
  const std::filesystem::path folder = std::filesystem::path(beside).parent_path();
  std::error_code ignored;
  if (std::filesystem::is_regular_file(folder / name, ignored)) return (folder / name).string();
  std::string found;
  for (const auto& entry : std::filesystem::directory_iterator(folder.empty() ? "." : folder, ignored)) {
    const std::string candidate = entry.path().filename().string();
    if (lower_case(candidate) == lower_case(name) && (found.empty() || candidate < found)) found = candidate;
  }
  return found.empty() ? found : (folder / found).string();
}

}  // namespace isohf
