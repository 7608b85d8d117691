#include "isohf/verify/texture_check.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <array>
#include <optional>

#include "isohf/archive/container/member_tables.h"
#include "isohf/archive/textures/texture_reader.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// The outermost texels of one level of a tile; empty where it could not be read.
struct Border {
  std::vector<std::uint8_t> north;
  std::vector<std::uint8_t> south;
  std::vector<std::uint8_t> west;
  std::vector<std::uint8_t> east;
};

Border border_of(const Picture& picture) {
  Border border;
  const auto channels = static_cast<std::size_t>(picture.channels);
  const int last = picture.height - 1;
  border.north.assign(picture.row(0), picture.row(0) + picture.row_bytes());
  border.south.assign(picture.row(last), picture.row(last) + picture.row_bytes());
  for (int row = 0; row < picture.height; ++row) {
    const std::uint8_t* const west = picture.pixel(0, row);
    const std::uint8_t* const east = picture.pixel(picture.width - 1, row);
    border.west.insert(border.west.end(), west, west + channels);
    border.east.insert(border.east.end(), east, east + channels);
  }
  return border;
}

struct CheckedTile {
  std::vector<Border> levels;
  std::vector<std::string> problems;
};

class TextureCheck {
 public:
  explicit TextureCheck(const ArchiveReader& archive) : archive_(archive), grid_(archive.grid()), reader_(archive) {}

  std::vector<std::string> run() {
    check_names();
    std::vector<CheckedTile> above;
    for (std::int64_t row = 0; row < grid_.tile_rows(); ++row) {
      std::vector<CheckedTile> tiles(static_cast<std::size_t>(grid_.tile_columns()));
      oneapi::tbb::parallel_for(std::size_t{0}, tiles.size(), [&](std::size_t column) {
        read_tile({static_cast<std::int64_t>(column), row}, tiles[column]);
      });
      compare_row(row, tiles, above);
      for (CheckedTile& tile : tiles) {
        for (std::string& problem : tile.problems) problems_.push_back(std::move(problem));
      }
      above = std::move(tiles);
    }
    return std::move(problems_);
  }

 private:
  void check_names() {
    const TextureInfo& info = reader_.info();
    std::int64_t members = 0;
    std::uint64_t bytes = 0;
    for (const MemberTable& table : archive_.tables()) {
      if (!table.name.starts_with(kTextureFolder)) continue;
      const auto place = place_from_texture_name(info, member_name(table.name, table.rows - 1, table.columns - 1));
      if (!place || !grid_.contains(place->tile)) {
        problems_.push_back(fmt::format("members \"{}\" are not all levels of a tile's texture", table.name));
      }
      members += table.stored;
      bytes += table.compressed_bytes;
    }
    for (const MemberEntry& member : archive_.loose_members()) {
      if (!member.name.starts_with(kTextureFolder)) continue;
      const auto place = place_from_texture_name(info, member.name);
      if (!place || !grid_.contains(place->tile)) {
        problems_.push_back(
            fmt::format("member \"{}\" at byte {} is no level of a tile's texture", member.name, member.offset_bytes));
        continue;
      }
      ++members;
      bytes += member.compressed_bytes;
    }
    if (members != info.members || (bytes != info.bytes && !archive_.reads_by_directory())) {
      problems_.push_back(fmt::format("there are {} textures of {} bytes, the metadata says {} of {}", members, bytes,
                                      info.members, info.bytes));
    }
  }

  void read_tile(TileIndex tile, CheckedTile& checked) const {
    const int levels = reader_.info().levels;
    checked.levels.resize(static_cast<std::size_t>(levels));
    int present = 0;
    for (int level = 0; level < levels; ++level) {
      if (!reader_.has(tile, level)) continue;
      ++present;
      try {
        const Picture picture = reader_.read(tile, level);
        if (reader_.info().format == TextureFormat::kPng) {
          checked.levels[static_cast<std::size_t>(level)] = border_of(picture);
        }
      } catch (const Error& error) {
        checked.problems.emplace_back(error.what());
      }
    }
    if (present != 0 && present != levels) {
      checked.problems.push_back(
          fmt::format("tile ({},{}) has {} of {} levels of its texture", tile.column, tile.row, present, levels));
    }
  }

  void compare_row(std::int64_t row, std::vector<CheckedTile>& tiles, const std::vector<CheckedTile>& above) const {
    for (std::size_t column = 0; column < tiles.size(); ++column) {
      const TileIndex tile{static_cast<std::int64_t>(column), row};
      for (std::size_t level = 0; level < tiles[column].levels.size(); ++level) {
        const Border& here = tiles[column].levels[level];
        const auto compare = [&](const std::vector<std::uint8_t>& mine, const std::vector<std::uint8_t>& other,
                                 TileIndex there) {
          if (mine.empty() || other.empty() || mine == other) return;
          tiles[column].problems.push_back(
              fmt::format("member \"{}\" shares an edge with tile ({},{}), but not its texels",
                          texture_name(reader_.info(), tile, static_cast<int>(level)), there.column, there.row));
        };
        if (column > 0) compare(here.west, tiles[column - 1].levels[level].east, {tile.column - 1, row});
        if (!above.empty()) compare(here.north, above[column].levels[level].south, {tile.column, row - 1});
      }
    }
  }

  const ArchiveReader& archive_;
  const TileGrid& grid_;
  TextureReader reader_;
  std::vector<std::string> problems_;
};

}  // namespace

std::vector<std::string> check_textures(const ArchiveReader& archive) {
  try {
    if (!texture_info(archive.metadata())) return {};
    return TextureCheck(archive).run();
  } catch (const Error& error) {
    return {error.what()};
  }
}

}  // namespace isohf
