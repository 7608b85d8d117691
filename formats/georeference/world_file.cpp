#include "formats/georeference/world_file.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <locale>
#include <sstream>
#include <vector>

#include "formats/files/letter_case.h"
#include "formats/files/raw_file.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::size_t kLongestText = 65536;

std::optional<std::string> text_of(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return std::nullopt;
  std::ifstream in(path, std::ios::binary);
  std::string text(kLongestText, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  return text;
}

std::vector<std::string> spellings(const std::vector<std::string>& extensions) {
  std::vector<std::string> all;
  for (const std::string& extension : extensions) {
    std::string upper = extension;
    std::transform(upper.begin(), upper.end(), upper.begin(),
                   [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    all.push_back(extension);
    all.push_back(upper);
  }
  return all;
}

/// .jgw and .jpgw for .jpg: the first and last letter and a w, or all of them.
std::vector<std::string> world_extensions(const std::string& raster_path) {
  const std::string own = lower_case(std::filesystem::path(raster_path).extension().string());
  if (own == ".flt") return {".flw", ".ftw", ".fltw", ".wld"};
  if (own.size() < 3 || own == ".tif" || own == ".tiff") return {".tfw", ".tifw", ".wld"};
  return {fmt::format(".{}{}w", own[1], own.back()), own + "w", ".wld"};
}

}  // namespace

std::optional<WorldFile> world_file_beside(const std::string& raster_path) {
  for (const std::string& extension : spellings(world_extensions(raster_path))) {
    const std::filesystem::path path = std::filesystem::path(raster_path).replace_extension(extension);
    const std::optional<std::string> text = text_of(path);
    if (!text) continue;
    std::istringstream in(*text);
    in.imbue(std::locale::classic());
    double rotation_y = 0.0;
    double rotation_x = 0.0;
    WorldFile world;
    world.path = path.string();
    if (!(in >> world.dx >> rotation_y >> rotation_x >> world.dy >> world.x0 >> world.y0)) {
      throw Error(ErrorCode::kCorrupt, world.path + ": is not a world file, which has six numbers");
    }
    if (rotation_x != 0.0 || rotation_y != 0.0 || !(world.dx > 0.0) || world.dy == 0.0) {
      throw Error(
          ErrorCode::kUnsupported,
          fmt::format("{}: dx {}, rotations {} and {}, dy {}: isohf reads rasters whose columns run from West to "
                      "East, without rotation",
                      world.path, world.dx, rotation_y, rotation_x, world.dy));
    }
    return world;
  }
  return std::nullopt;
}

std::string prj_beside(const std::string& raster_path) {
  for (const std::string& extension : spellings({".prj"})) {
    if (auto text = text_of(std::filesystem::path(without_gzip(raster_path)).replace_extension(extension))) {
      while (!text->empty() && std::isspace(static_cast<unsigned char>(text->back())) != 0) text->pop_back();
      return *text;
    }
  }
  return {};
}

}  // namespace isohf
