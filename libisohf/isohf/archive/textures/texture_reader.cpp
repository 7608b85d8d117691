#include "isohf/archive/textures/texture_reader.h"

#include <fmt/format.h>

#include "isohf/archive/textures/picture_codec.h"
#include "isohf/error.h"

namespace isohf {
namespace {

TextureInfo info_of(const ArchiveReader& archive) {
  const auto info = texture_info(archive.metadata());
  if (!info) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: has no textures; convert with `texture`", archive.path()));
  }
  return *info;
}

}  // namespace

TextureReader::TextureReader(const ArchiveReader& archive) : archive_(archive), info_(info_of(archive)) {}

std::optional<MemberEntry> TextureReader::member(TileIndex tile, int level) const {
  if (!archive_.grid().contains(tile) || level < 0 || level >= info_.levels) return std::nullopt;
  return archive_.find_member(texture_name(info_, tile, level));
}

bool TextureReader::has(TileIndex tile, int level) const {
  return member(tile, level).has_value();
}

Picture TextureReader::read(TileIndex tile, int level) const {
  const auto found = member(tile, level);
  if (!found) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("{}: tile ({},{}) has no texture of level {}", archive_.path(),
                                                         tile.column, tile.row, level));
  }
  const int size = info_.level_size(level);
  try {
    const auto pixels = static_cast<std::uint64_t>(size) * static_cast<std::uint64_t>(size);
    if (found->bytes > 8 * pixels + 65536)
      throw Error(ErrorCode::kCorrupt, fmt::format("has {} bytes, too many for {} pixels", found->bytes, pixels));
    const std::vector<std::byte> bytes = archive_.read_member(*found);
    Picture picture = info_.format == TextureFormat::kPng ? decode_png(bytes, size) : decode_jpeg(bytes, size);
    if (picture.width != size || picture.height != size || picture.channels != info_.channels) {
      throw Error(ErrorCode::kCorrupt,
                  fmt::format("is {} x {} pixels of {} channels, must be {} x {} of {}", picture.width, picture.height,
                              picture.channels, size, size, info_.channels));
    }
    return picture;
  } catch (const Error& error) {
    throw error.within(fmt::format("{}: member \"{}\" at byte {}", archive_.path(), found->name, found->offset_bytes));
  }
}

Picture TextureReader::read_rgba(TileIndex tile, int level) const {
  Picture picture = read(tile, level);
  if (picture.channels == 4) return picture;
  Picture rgba(picture.width, picture.height, 4);
  const std::size_t channels = static_cast<std::size_t>(picture.channels);
  const std::size_t pixels = rgba.samples.size() / 4;
  for (std::size_t i = 0; i < pixels; ++i) {
    for (std::size_t c = 0; c < 3; ++c)
      rgba.samples[4 * i + c] = picture.samples[i * channels + (channels == 1 ? 0 : c)];
    rgba.samples[4 * i + 3] = 255;
  }
  return rgba;
}

}  // namespace isohf
