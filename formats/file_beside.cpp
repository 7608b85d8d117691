#include "formats/file_beside.h"

#include <algorithm>
#include <cctype>
#include <filesystem>

namespace isohf {
namespace {

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

}  // namespace

std::string file_beside(const std::string& beside, const std::string& name) {
  const std::filesystem::path folder = std::filesystem::path(beside).parent_path();
  std::error_code ignored;
  if (std::filesystem::is_regular_file(folder / name, ignored)) return (folder / name).string();
  std::string found;
  for (const auto& entry : std::filesystem::directory_iterator(folder.empty() ? "." : folder, ignored)) {
    const std::string candidate = entry.path().filename().string();
    if (lower(candidate) == lower(name) && (found.empty() || candidate < found)) found = candidate;
  }
  return found.empty() ? found : (folder / found).string();
}

}  // namespace isohf
