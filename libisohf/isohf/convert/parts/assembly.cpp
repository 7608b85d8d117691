#include "isohf/convert/parts/assembly.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <utility>

#include "isohf/archive/codec/tile_encoder.h"
#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/container/content_hash.h"
#include "isohf/archive/container/member_tables.h"
#include "isohf/archive/metadata/part_record.h"
#include "isohf/archive/planes/archive_planes.h"
#include "isohf/base/arena.h"
#include "isohf/byte_source.h"
#include "isohf/error.h"
#include "isohf/lattice/shared_vertices.h"

namespace isohf {
namespace {

/// The range of a tile's own codes: of a coarse plane's tile another one is stated.
void set_own_range(const TileCodes& codes, const Quantisation& quantisation, EncodedTile& tile) {
  bool is_first = true;
  const auto add = [&](std::uint32_t code) {
    TileEntry entry;
    entry.code_min = entry.code_max = code;
    widen(entry, std::exchange(is_first, false), tile.code_min, tile.code_max);
  };
  for (const std::uint16_t code : codes.codes) {
    if (code != quantisation.void_code()) add(code);
  }
  for (const float height : codes.heights) {
    if (!std::isnan(height)) add(std::bit_cast<std::uint32_t>(height));
  }
}

/// Tiles that a thread reads one after the other.
constexpr std::size_t kTilesTogether = 8;
/// Tiles of a row whose records are looked at together.
constexpr std::int64_t kColumnsAtOnce = 4096;
const std::string kSeedTable = "seeds/{row}/{column}.seed";

struct Texture {
  std::int64_t column;
  const std::string* table;
  TableRecord record;
};

std::span<const std::byte> bytes_of(const ArchiveReader& from, std::uint64_t offset, std::uint64_t size,
                                    ReadAhead& ahead) {
  try {
    return ahead.bytes(from.source(), offset, size);
  } catch (const Error& error) {
    throw error.within(from.path());
  }
}

/// A tile's record and bytes.
EncodedTile encoded_tile(const ArchiveReader& from, TileIndex index, int plane, ReadAhead& ahead) {
  EncodedTile encoded;
  const TileEntry entry = from.tile_entry(index, plane);
  encoded.is_empty = !entry.stored;
  if (encoded.is_empty) return encoded;
  const auto data = bytes_of(from, entry.offset_bytes, entry.compressed_bytes, ahead);
  encoded.deflated.assign(data.begin(), data.end());
  encoded.payload_bytes = entry.payload_bytes;
  encoded.payload_crc32 = entry.payload_crc32;
  encoded.code_min = entry.code_min;
  encoded.code_max = entry.code_max;
  encoded.has_voids = entry.has_voids;
  if (const auto digest = from.tile_digest(index, plane)) encoded.content_digest.assign(digest->begin(), digest->end());
  return encoded;
}

}  // namespace

Assembly::Assembly(const Metadata& metadata, ArchiveWriter& writer, AssemblyRequest request, const Job& job)
    : metadata_(metadata),
      writer_(writer),
      request_(std::move(request)),
      job_(job),
      void_codes_(void_tile(metadata.grid.shape(), metadata.quantisation)),
      void_digest_(tile_content_digest(void_codes_)) {
  if (request_.recount) counted_.emplace(metadata);
  const auto info = shadow_seed_info(metadata);
  has_seeds_ = info.has_value();
  if (!request_.one_origin && info) seeds_.emplace(metadata.grid, metadata.quantisation, *info);
}

bool Assembly::decodes() const {
  const bool for_planes = request_.planes != nullptr && !request_.has_plane_rows;
  return for_planes || request_.recount || !request_.one_origin;
}

void Assembly::add_tiles() {
  const TileGrid& grid = metadata_.grid;
  const std::int64_t columns = grid.tile_columns();
  const auto batch = kTilesTogether * static_cast<std::size_t>(threads_of(job_));
  Row above;
  for (std::int64_t row = 0; row < grid.tile_rows(); ++row) {
    const std::vector<const AssemblyInput*> inputs = inputs_of_row(row);
    if (!decodes() && inputs.size() <= 1) {
      inputs.empty() ? writer_.skip_tiles(columns) : copy_row(row, *inputs.front());
      if (request_.planes != nullptr) add_plane_rows(row);
      if (!inputs.empty() && has_seeds_) copy_seeds(row, *inputs.front());
      close_before(row);
      job_.report({"tiles", "tiles", (row + 1) * columns, grid.tile_count(), writer_.bytes_written()});
      continue;
    }
    Row tiles{std::vector<const ArchiveReader*>(static_cast<std::size_t>(columns)),
              std::vector<TileCodes>(request_.one_origin ? 0 : static_cast<std::size_t>(columns))};
    for (std::size_t first = 0; first < tiles.from.size(); first += batch) {
      job_.throw_if_cancelled();
      std::vector<Tile> some(std::min(batch, tiles.from.size() - first));
      if (!inputs.empty()) read(inputs, {static_cast<std::int64_t>(first), row}, some);
      for (std::size_t i = 0; i < some.size(); ++i) {
        const TileIndex index{static_cast<std::int64_t>(first + i), row};
        Tile& tile = some[i];
        if (tile.tables != nullptr) add_textures(index, tile);
        request_.tiles.contains(index) ? writer_.add_tile(tile.encoded) : writer_.skip_tiles(1);
        if (request_.planes != nullptr && !request_.has_plane_rows) request_.planes->add(tile.sample);
        tiles.from[first + i] = tile.from;
        if (!request_.one_origin) tiles.codes[first + i] = std::move(tile.codes);
      }
    }
    if (request_.planes != nullptr && request_.has_plane_rows) add_plane_rows(row);
    if (!inputs.empty() && has_seeds_) add_seeds(row, tiles);
    if (!request_.one_origin) compare_edges(row, tiles, above);
    if (!request_.one_origin) above = std::move(tiles);
    close_before(row);
    job_.report({"tiles", "tiles", (row + 1) * columns, grid.tile_count(), writer_.bytes_written()});
  }
  writer_.end_copies();
}

/// What one archive has of a row, without a look at the tiles: void ones are not there.
void Assembly::copy_row(std::int64_t row, const AssemblyInput& input) {
  const std::int64_t columns = metadata_.grid.tile_columns();
  const TileRange range = intersection(request_.tiles, input.tiles);
  std::int64_t next = 0;
  for (std::int64_t first = range.first.column; first < range.end.column; first += kColumnsAtOnce) {
    job_.throw_if_cancelled();
    const std::pair some(first, std::min(first + kColumnsAtOnce, range.end.column));
    std::vector<Texture> textures;
    for (const std::string& table : input.file->tile_tables()) {
      for (const PartFile::Stored& texture : input.file->stored(table, row, some))
        textures.push_back({texture.column, &table, texture.record});
    }
    std::sort(textures.begin(), textures.end(), [](const Texture& a, const Texture& b) {
      return std::pair(a.column, a.record.entry.offset_bytes) < std::pair(b.column, b.record.entry.offset_bytes);
    });
    auto texture = textures.begin();
    for (const PartFile::Stored& tile : input.file->stored(tile_table_name(0), row, some)) {
      writer_.skip_tiles(tile.column - next);
      next = tile.column + 1;
      for (; texture != textures.end() && texture->column <= tile.column; ++texture) {
        if (texture->column == tile.column)
          writer_.copy_member(input.file->source(), {*texture->table, row, tile.column}, texture->record);
      }
      writer_.copy_tile(input.file->source(), {0, {tile.column, row}}, tile.record, tile.digest);
    }
  }
  writer_.skip_tiles(columns - next);
}

void Assembly::copy_seeds(std::int64_t row, const AssemblyInput& input) {
  const TileRange range = intersection(request_.tiles, input.tiles);
  for (std::int64_t first = range.first.column; first < range.end.column; first += kColumnsAtOnce) {
    const std::pair some(first, std::min(first + kColumnsAtOnce, range.end.column));
    for (const PartFile::Stored& seed : input.file->stored(kSeedTable, row, some))
      writer_.copy_member(input.file->source(), {kSeedTable, row, seed.column}, seed.record);
  }
}

/// Closes what no row needs any more, the first plane's of these rows included.
void Assembly::close_before(std::int64_t row) {
  for (const AssemblyInput& input : request_.inputs) {
    const std::int64_t done = input.tiles.end.row + std::max<std::int64_t>(metadata_.planes.stride, 1) + 1;
    if (row != done) continue;
    input.file->close();
    tile_bytes_ = member_bytes_ = {};  // another source may get its address
  }
}

/// Rows of the first plane that were finished when all tiles of `row` were there: copied; the planes above are made of them.
void Assembly::add_plane_rows(std::int64_t row) {
  const Planes planes = planes_of(metadata_);
  const TileGrid& grid = planes.grid(1);
  const auto batch = static_cast<std::int64_t>(kTilesTogether) * threads_of(job_);
  for (; next_plane_row_ < grid.tile_rows(); ++next_plane_row_) {
    const std::int64_t needed = std::min((next_plane_row_ + 1) * planes.stride() + 1, metadata_.grid.tile_rows());
    if (row + 1 < needed) return;
    PartFile& file = *inputs_of_row(next_plane_row_ * planes.stride()).front()->file;
    for (std::int64_t first = 0; first < grid.tile_columns(); first += batch) {
      job_.throw_if_cancelled();
      std::vector<PlaneSample> samples(static_cast<std::size_t>(std::min(batch, grid.tile_columns() - first)));
      const std::pair some(first, first + static_cast<std::int64_t>(samples.size()));
      const std::vector<PartFile::Stored> tiles = file.stored(tile_table_name(1), next_plane_row_, some);
      // Of a void tile those below are asked.
      const ArchiveReader* const below = tiles.size() == samples.size() ? nullptr : &file.archive();
      const std::size_t groups = planes.count() > 1 ? (samples.size() + kTilesTogether - 1) / kTilesTogether : 0;
      oneapi::tbb::parallel_for(std::size_t{0}, groups, [&](std::size_t group) {
        const auto begin = std::partition_point(tiles.begin(), tiles.end(), [&](const PartFile::Stored& tile) {
          return tile.column < first + static_cast<std::int64_t>(group * kTilesTogether);
        });
        const auto end = std::partition_point(begin, tiles.end(), [&](const PartFile::Stored& tile) {
          return tile.column < first + static_cast<std::int64_t>((group + 1) * kTilesTogether);
        });
        std::vector<TileCodes> codes = file.decode(metadata_.grid.shape(), metadata_.quantisation.type, {begin, end});
        for (std::size_t i = group * kTilesTogether; i < std::min(samples.size(), (group + 1) * kTilesTogether); ++i) {
          const TileIndex index{first + static_cast<std::int64_t>(i), next_plane_row_};
          const auto read = [&](int plane, TileIndex tile) {
            PlaneBuilder::Stored stored;
            const auto at = std::find_if(begin, end, [&](const auto& one) { return one.column == tile.column; });
            const TileEntry entry = plane == 0  ? below->tile_entry(tile, 0)
                                    : at != end ? at->record.entry
                                                : TileEntry{};
            stored.entry.is_empty = !entry.stored;
            stored.entry.code_min = entry.code_min;
            stored.entry.code_max = entry.code_max;
            if (entry.stored) {
              stored.codes =
                  plane == 0 ? below->read_tile(tile) : std::move(codes[static_cast<std::size_t>(at - begin)]);
            }
            return stored;
          };
          samples[i] = request_.planes->finished_sample(index, read);
        }
      });
      for (const PartFile::Stored& tile : tiles)
        writer_.copy_tile(file.source(), {1, {tile.column, next_plane_row_}}, tile.record, tile.digest);
      for (std::size_t i = 0; i < samples.size() && planes.count() > 1; ++i) request_.planes->add_finished(samples[i]);
    }
  }
}

std::vector<const AssemblyInput*> Assembly::inputs_of_row(std::int64_t row) const {
  std::vector<const AssemblyInput*> found;
  if (row < request_.tiles.first.row || row >= request_.tiles.end.row) return found;
  for (auto input = request_.inputs.rbegin(); input != request_.inputs.rend(); ++input) {
    if (row >= input->tiles.first.row && row < input->tiles.end.row) found.push_back(&*input);
  }
  return found;
}

void Assembly::read(std::span<const AssemblyInput* const> inputs, TileIndex first, std::span<Tile> tiles) {
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    const TileIndex index{first.column + static_cast<std::int64_t>(i), first.row};
    if (!request_.tiles.contains(index)) continue;
    for (const AssemblyInput* const input : inputs) {
      if (!input->tiles.contains(index)) continue;
      const ArchiveReader& archive = input->file->archive();
      tiles[i].encoded = encoded_tile(archive, index, request_.plane, tile_bytes_);
      if (tiles[i].encoded.is_empty) continue;
      tiles[i].from = &archive;
      if (request_.plane == 0) tiles[i].tables = &input->file->tile_tables();
      break;
    }
    if (tiles[i].from == nullptr) make_void(index, tiles[i].encoded);
  }
  if (!decodes()) return;
  oneapi::tbb::parallel_for(
      std::size_t{0}, (tiles.size() + kTilesTogether - 1) / kTilesTogether, [&](std::size_t group) {
        const std::size_t begin = group * kTilesTogether;
        const auto lanes = tiles.subspan(begin, std::min(kTilesTogether, tiles.size() - begin));
        const auto index_of = [&](std::size_t i) {
          return TileIndex{first.column + static_cast<std::int64_t>(begin + i), first.row};
        };
        std::map<const ArchiveReader*, std::vector<std::size_t>> stored;
        for (std::size_t i = 0; i < lanes.size(); ++i) {
          if (lanes[i].from != nullptr) stored[lanes[i].from].push_back(i);
        }
        for (const auto& [archive, places] : stored) {
          std::vector<TileIndex> indices;
          for (const std::size_t i : places) indices.push_back(index_of(i));
          for (std::size_t k = 0; k < places.size(); ++k) {
            Tile& tile = lanes[places[k]];
            EncodedTile& encoded = tile.encoded;
            tile.codes = archive->read_tile(indices[k], request_.plane);
            if (request_.plane != 0) set_own_range(tile.codes, metadata_.quantisation, encoded);
            if (counted_)
              encoded.statistics = tile_statistics(*counted_, indices[k], tile.codes, metadata_.quantisation);
            if (request_.planes != nullptr) tile.sample = request_.planes->sample(tile.codes, encoded);
          }
        }
      });
}

void Assembly::make_void(TileIndex index, EncodedTile& tile) const {
  tile.is_empty = true;
  tile.content_digest = void_digest_;
  if (counted_) tile.statistics = tile_statistics(*counted_, index, void_codes_, metadata_.quantisation);
}

void copy_member(const ArchiveReader& from, const MemberEntry& member, ArchiveWriter& writer, ReadAhead& ahead) {
  const auto data = bytes_of(from, member.offset_bytes, member.compressed_bytes, ahead);
  if (member.deflated) writer.add_deflated_member(member.name, data, member.bytes, member.crc32);
  if (!member.deflated) writer.add_member(member.name, data, false);
}

void Assembly::add_textures(TileIndex index, const Tile& tile) {
  std::vector<MemberEntry> members;
  for (const std::string& table : *tile.tables) {
    if (auto member = tile.from->find_member(member_name(table, index.row, index.column))) {
      members.push_back(std::move(*member));
    }
  }
  std::sort(members.begin(), members.end(),
            [](const auto& a, const auto& b) { return a.offset_bytes < b.offset_bytes; });
  for (const MemberEntry& member : members) copy_member(*tile.from, member, writer_, member_bytes_);
}

/// Copied where what they tell of is of one origin, else made of the row as it is now.
void Assembly::add_seeds(std::int64_t row, const Row& tiles) {
  const ArchiveReader* first = nullptr;
  bool is_one = true;
  for (const ArchiveReader* const from : tiles.from) {
    if (from == nullptr) continue;  // void, or not asked for
    if (first == nullptr) first = from;
    is_one = is_one && from == first;
  }
  if (!seeds_ || is_one) {
    for (std::size_t i = 0; i < tiles.from.size(); ++i) {
      if (tiles.from[i] == nullptr) continue;
      const auto member = tiles.from[i]->find_member(seed_name({static_cast<std::int64_t>(i), row}));
      if (member) copy_member(*tiles.from[i], *member, writer_, member_bytes_);
    }
    return;
  }
  std::vector<SeedRow::Tile> prepared(tiles.from.size());
  oneapi::tbb::parallel_for(std::size_t{0}, tiles.from.size(), [&](std::size_t i) {
    const bool is_void = tiles.from[i] == nullptr;
    prepared[i] = seeds_->prepare(is_void ? void_codes_ : tiles.codes[i]);
    prepared[i].is_empty = is_void;
  });
  SeedRow::Tiles all(std::nullopt);
  for (const SeedRow::Tile& tile : prepared) all.add(tile);
  seeds_->encode(all, [&](std::size_t from, std::span<const EncodedSeeds> members) {
    for (std::size_t i = 0; i < members.size(); ++i) {
      if (members[i].payload_bytes == 0) continue;
      writer_.add_deflated_member(seed_name({static_cast<std::int64_t>(from + i), row}), members[i].deflated,
                                  members[i].payload_bytes, members[i].payload_crc32);
    }
  });
}

/// What two tiles share must be equal, also where they come from two archives.
void Assembly::compare_edges(std::int64_t row, const Row& tiles, const Row& above) const {
  const TileShape& shape = metadata_.grid.shape();
  const auto columns = static_cast<std::int64_t>(tiles.from.size());
  using Place = std::pair<const Row*, std::size_t>;
  const auto from = [](const Place& tile) { return tile.first->from[tile.second]; };
  const auto value = [&](const Place& tile, GridVertex vertex) -> double {
    const TileCodes& codes = from(tile) == nullptr ? void_codes_ : tile.first->codes[tile.second];
    const auto at = static_cast<std::size_t>(vertex.row * shape.columns() + vertex.column);
    if (codes.type != CodeType::kF32) return codes.codes[at];
    return codes.heights[at] == codes.heights[at] ? double{codes.heights[at]} : HUGE_VAL;
  };
  for (const TileIndex step : kComparedNeighbours) {
    std::vector<SharedVertex> shared;
    for (std::int64_t column = 0; column < columns; ++column) {
      // This tile is the neighbour's South or East, or the one that looks East.
      std::int64_t other = step.row == 0 ? column + 1 : column - step.column;
      if (metadata_.wraps_x) other = (other + columns) % columns;
      if (other < 0 || other >= columns || (step.row == 1 && above.from.empty())) continue;
      const TileIndex one = step.row == 0 ? TileIndex{column, row} : TileIndex{other, row - 1};
      const TileIndex two = step.row == 0 ? TileIndex{other, row} : TileIndex{column, row};
      if (!request_.tiles.contains(one) || !request_.tiles.contains(two)) continue;
      const Place here = step.row == 0 ? Place(&tiles, column) : Place(&above, other);
      const Place there(&tiles, step.row == 0 ? other : column);
      if (from(here) == from(there)) continue;
      if (shared.empty()) shared = shared_vertices(shape, step);
      for (const SharedVertex& vertex : shared) {
        if (value(here, vertex.here) == value(there, vertex.there)) continue;
        const auto name = [&](const Place& tile) { return from(tile) == nullptr ? "void" : from(tile)->path(); };
        throw Error(
            ErrorCode::kInvalidArgument,
            fmt::format("tile ({},{}) of {} does not meet its neighbour of {}: a vertex that both hold differs; "
                        "join whole regions that were made alike",
                        column, row, step.row == 0 ? name(here) : name(there),
                        step.row == 0 ? name(there) : name(here)));
      }
    }
  }
}

void Assembly::add_other_members() {
  struct Found {
    const ArchiveReader* from;
    MemberEntry member;
  };
  std::vector<Found> all;
  std::map<std::string, std::size_t> places;
  for (const AssemblyInput& input : request_.inputs) {
    if (!input.file->has_loose_members) continue;
    const ArchiveReader& archive = input.file->archive();
    std::vector<MemberEntry> members;
    for (const MemberEntry& member : archive.loose_members()) {
      const std::string& name = member.name;
      if (!is_own_member(name) && !name.starts_with("residual/") && name != kWholeName) members.push_back(member);
    }
    std::sort(members.begin(), members.end(),
              [](const auto& a, const auto& b) { return a.offset_bytes < b.offset_bytes; });
    for (MemberEntry& member : members) {
      const auto [at, is_new] = places.try_emplace(member.name, all.size());
      if (is_new)
        all.push_back({&archive, std::move(member)});
      else
        all[at->second] = {&archive, std::move(member)};
    }
  }
  for (const auto& [from, member] : all) copy_member(*from, member, writer_, member_bytes_);
}

}  // namespace isohf
