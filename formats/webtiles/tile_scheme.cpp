#include "formats/webtiles/tile_scheme.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <pugixml.hpp>
#include <string>

#include "formats/io/raw_file.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// nullopt: it states nothing of this.
std::optional<TileScheme> scheme_in_xml(const std::string& path, const std::string& text) {
  pugi::xml_document document;
  const pugi::xml_parse_result parsed = document.load_buffer(text.data(), text.size());
  if (!parsed) throw Error(ErrorCode::kCorrupt, fmt::format("{}: is no whole XML: {}", path, parsed.description()));
  const pugi::xml_node map = document.child("TileMap");
  if (!map) return std::nullopt;
  const std::string profile = map.child("TileSets").attribute("profile").value();
  const std::string system = map.child("SRS").text().get();
  bool is_mercator = profile.find("mercator") != std::string::npos;
  for (const char* code : {"3857", "900913", "3785", "102113", "102100"})
    is_mercator = is_mercator || system.find(code) != std::string::npos;
  if (!is_mercator && !(profile.empty() && system.empty())) return TileScheme::kOtherMap;
  return map.child("Origin").attribute("y").as_double() > 0.0 ? TileScheme::kFromNorth : TileScheme::kFromSouth;
}

std::optional<TileScheme> scheme_in_json(const std::string& text) {
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  const auto scheme = json.is_object() ? json.find("scheme") : json.end();
  if (!json.is_object() || scheme == json.end()) return std::nullopt;
  return *scheme == "tms"   ? std::optional(TileScheme::kFromSouth)
         : *scheme == "xyz" ? std::optional(TileScheme::kFromNorth)
                            : std::nullopt;
}

}  // namespace

TileScheme tile_scheme_of(const std::filesystem::path& folder) {
  constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 20U;
  std::optional<TileScheme> found;
  std::string found_in;
  for (const char* name : {"tilemapresource.xml", "metadata.json", "tiles.json", "tile.json", "tilejson.json"}) {
    const std::string path = (folder / name).string();
    if (!is_file(path)) continue;
    const std::string text = first_bytes(RawFile(path), kMostBytes);
    const auto stated = path.ends_with(".xml") ? scheme_in_xml(path, text) : scheme_in_json(text);
    if (!stated) continue;
    if (found && found != stated) {
      throw Error(ErrorCode::kCorrupt,
                  fmt::format("{} and {} contradict each other on how rows of tiles are counted; remove the wrong one",
                              found_in, path));
    }
    found = stated;
    found_in = path;
  }
  return found.value_or(TileScheme::kFromNorth);
}

}  // namespace isohf
