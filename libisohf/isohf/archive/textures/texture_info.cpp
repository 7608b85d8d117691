#include "isohf/archive/textures/texture_info.h"

#include <fmt/format.h>

#include <bit>

#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/metadata/json_members.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr int kSmallestSize = 64;
constexpr int kLargestSize = 4096;
constexpr int kSmallestLevel = 4;

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

void texture_members(JsonMembers& json, TextureInfo& info) {
  constexpr double kAny = 9007199254740992.0;
  std::string format = to_string(info.format);
  json("format", format);
  if (format != "png" && format != "jpeg") {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("{}.format: is \"{}\", png and jpeg are read", kTileTexturesName, format));
  }
  info.format = texture_format_from_string(format);
  const bool is_jpeg = info.format == TextureFormat::kJpeg;
  json("channels", info.channels, {.least = 1, .most = 4});
  if (info.channels == 2 || (info.channels == 4 && is_jpeg))
    json.refuse("channels", fmt::format("is {}, must be 1, 3 or, with png, 4", info.channels));
  json("size", info.size, {.least = kSmallestSize, .most = kLargestSize});
  json("levels", info.levels, {.least = 1, .most = 11});
  if (json.reads() && !std::has_single_bit(static_cast<unsigned>(info.size))) json.refuse("size", "is no power of two");
  if (json.reads() && (info.size >> (info.levels - 1)) < kSmallestLevel) {
    json.refuse("levels", fmt::format("is {}, the coarsest must have {} texels or more", info.levels, kSmallestLevel));
  }
  std::optional<int> quality = is_jpeg ? std::optional(info.quality) : std::nullopt;
  json("quality", quality, {.presence = JsonRule::kAbsent, .least = 1, .most = 100});
  if (is_jpeg && !quality) json.refuse("quality", "is missing");
  info.quality = is_jpeg ? *quality : 0;
  json.object("photo", [&](JsonMembers& photo) {
    photo("name", info.photo_name);
    photo("format", info.photo_format);
    photo("width", info.photo_width, {.least = 1, .most = kAny});
    photo("height", info.photo_height, {.least = 1, .most = kAny});
  });
  WorldBounds& bounds = info.placement;
  json.object("placement", "by", info.placed_by, "x0", bounds.x0, "z0", bounds.z0, "x1", bounds.x1, "z1", bounds.z1);
  json.all("members", info.members, "bytes", info.bytes);
}

std::string format_texture_info(const TextureInfo& info) {
  return write_extension(info, texture_members);
}

std::optional<TextureInfo> texture_info(const Metadata& metadata) {
  return read_extension(metadata, kTileTexturesName, texture_members);
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
    return TexturePlace{tile->tile, level};
  }
  return std::nullopt;
}

}  // namespace isohf
