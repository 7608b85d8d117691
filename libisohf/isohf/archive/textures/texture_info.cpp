#include "isohf/archive/textures/texture_info.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>

#include "isohf/archive/container/archive_directory.h"
#include "isohf/error.h"

namespace isohf {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kSmallestSize = 64;
constexpr int kLargestSize = 4096;
constexpr int kSmallestLevel = 4;

[[noreturn]] void refuse(const std::string& member, const std::string& why) {
  throw Error(ErrorCode::kCorrupt, fmt::format("{}.{}: {}", kTileTexturesName, member, why));
}

const Json& member_of(const Json& json, const char* object, const char* member) {
  static const Json none;
  const Json& inside = *object == '\0' ? json : (json.contains(object) ? json[object] : none);
  if (!inside.is_object() || !inside.contains(member))
    refuse(fmt::format("{}{}{}", object, *object ? "." : "", member), "is missing");
  return inside[member];
}

std::int64_t whole_number(const Json& json, const char* object, const char* member, std::int64_t least,
                          std::int64_t most) {
  const Json& value = member_of(json, object, member);
  if (!value.is_number_integer() || value.get<double>() < static_cast<double>(least) ||
      value.get<double>() > static_cast<double>(most)) {
    refuse(member, fmt::format("is {}, must be a whole number from {} to {}", value.dump(), least, most));
  }
  return value.get<std::int64_t>();
}

double number(const Json& json, const char* object, const char* member) {
  const Json& value = member_of(json, object, member);
  if (!value.is_number() || !std::isfinite(value.get<double>())) refuse(member, "is no number");
  return value.get<double>();
}

std::string text(const Json& json, const char* object, const char* member) {
  const Json& value = member_of(json, object, member);
  if (!value.is_string()) refuse(member, "is no string");
  return value.get<std::string>();
}

const char* extension(TextureFormat format) {
  return format == TextureFormat::kPng ? "png" : "jpg";
}

}  // namespace

std::string to_string(TextureFormat format) {
  return format == TextureFormat::kPng ? "png" : "jpeg";
}

TextureFormat texture_format_from_string(const std::string& name) {
  if (name == "png") return TextureFormat::kPng;
  if (name == "jpeg") return TextureFormat::kJpeg;
  throw Error(ErrorCode::kInvalidArgument, fmt::format("texture format is \"{}\", must be png or jpeg", name));
}

std::string format_texture_info(const TextureInfo& info) {
  Json json;
  json["format"] = to_string(info.format);
  json["channels"] = info.channels;
  json["size"] = info.size;
  json["levels"] = info.levels;
  if (info.format == TextureFormat::kJpeg) json["quality"] = info.quality;
  json["photo"] = {{"name", info.photo_name},
                   {"format", info.photo_format},
                   {"width", info.photo_width},
                   {"height", info.photo_height}};
  json["placement"] = {{"by", info.placed_by},
                       {"x0", info.placement.x0},
                       {"z0", info.placement.z0},
                       {"x1", info.placement.x1},
                       {"z1", info.placement.z1}};
  json["members"] = info.members;
  json["bytes"] = info.bytes;
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

TextureInfo parse_texture_info(const std::string& json_text) {
  const Json json = Json::parse(json_text, nullptr, false);
  if (!json.is_object()) throw Error(ErrorCode::kCorrupt, fmt::format("{}: is no object", kTileTexturesName));
  TextureInfo info;
  const std::string format = text(json, "", "format");
  if (format != "png" && format != "jpeg") {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("{}.format: is \"{}\", png and jpeg are read", kTileTexturesName, format));
  }
  info.format = texture_format_from_string(format);
  info.channels = static_cast<int>(whole_number(json, "", "channels", 1, 4));
  if (info.channels == 2 || (info.channels == 4 && info.format == TextureFormat::kJpeg)) {
    refuse("channels", fmt::format("is {}, must be 1, 3 or, with png, 4", info.channels));
  }
  info.size = static_cast<int>(whole_number(json, "", "size", kSmallestSize, kLargestSize));
  if (!std::has_single_bit(static_cast<unsigned>(info.size))) refuse("size", "is no power of two");
  info.levels = static_cast<int>(whole_number(json, "", "levels", 1, 11));
  if ((info.size >> (info.levels - 1)) < kSmallestLevel) {
    refuse("levels", fmt::format("is {}, the coarsest must have {} texels or more", info.levels, kSmallestLevel));
  }
  if (info.format == TextureFormat::kJpeg) info.quality = static_cast<int>(whole_number(json, "", "quality", 1, 100));
  constexpr std::int64_t kAny = std::int64_t{1} << 53;
  info.photo_name = text(json, "photo", "name");
  info.photo_format = text(json, "photo", "format");
  info.photo_width = whole_number(json, "photo", "width", 1, kAny);
  info.photo_height = whole_number(json, "photo", "height", 1, kAny);
  info.placed_by = text(json, "placement", "by");
  info.placement = {number(json, "placement", "x0"), number(json, "placement", "z0"), number(json, "placement", "x1"),
                    number(json, "placement", "z1")};
  info.members = whole_number(json, "", "members", 0, kAny);
  info.bytes = static_cast<std::uint64_t>(whole_number(json, "", "bytes", 0, kAny));
  return info;
}

std::optional<TextureInfo> texture_info(const Metadata& metadata) {
  for (const auto& [name, value] : metadata.extensions) {
    if (name == kTileTexturesName) return parse_texture_info(value);
  }
  return std::nullopt;
}

std::string texture_name_pattern(TextureFormat format) {
  return fmt::format("{}ROW/COLUMN/SIZE.{}", kTextureFolder, extension(format));
}

std::string texture_name(const TextureInfo& info, TileIndex tile, int level) {
  return fmt::format("{}{}/{}/{}.{}", kTextureFolder, tile.row, tile.column, info.level_size(level),
                     extension(info.format));
}

std::optional<TexturePlace> place_from_texture_name(const TextureInfo& info, std::string_view name) {
  if (!name.starts_with(kTextureFolder)) return std::nullopt;
  const std::string_view path = name.substr(std::string_view(kTextureFolder).size());
  const std::size_t slash = path.rfind('/');
  if (slash == std::string_view::npos) return std::nullopt;
  const std::string_view file = path.substr(slash + 1);
  for (int level = 0; level < info.levels; ++level) {
    if (file != fmt::format("{}.{}", info.level_size(level), extension(info.format))) continue;
    const auto tile = tile_from_name(fmt::format("tiles/{}.tile", path.substr(0, slash)));
    if (!tile) return std::nullopt;
    return TexturePlace{*tile, level};
  }
  return std::nullopt;
}

}  // namespace isohf
