#include "isohf/parts/assembly.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <utility>

#include "isohf/archive/container/member_tables.h"
#include "isohf/archive/planes/archive_planes.h"
#include "isohf/archive/shadow_seeds/shadow_seeds.h"
#include "isohf/base/arena.h"
#include "isohf/base/source_bytes.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// Tiles of a row whose records are read together.
constexpr std::int64_t kColumnsAtOnce = 4096;
const std::string kSeedTable = "seeds/{row}/{column}.seed";

struct Texture {
  std::int64_t column;
  const std::string* table;
  TableRecord record;
};

}  // namespace

Assembly::Assembly(const Metadata& metadata, ArchiveWriter& writer, std::vector<AssemblyInput> shards,
                   PlaneStage* planes, bool has_plane_rows, const Job& job)
    : metadata_(metadata),
      writer_(writer),
      shards_(std::move(shards)),
      planes_(planes),
      has_plane_rows_(has_plane_rows),
      job_(job) {}

const AssemblyInput& Assembly::input_of(std::int64_t row) const {
  return *std::ranges::find_if(shards_, [&](const AssemblyInput& shard) { return row < shard.end_row; });
}

void Assembly::add_tiles() {
  const TileGrid& grid = metadata_.grid;
  const bool has_seeds = shadow_seed_info(metadata_).has_value();
  for (std::int64_t row = 0; row < grid.tile_rows(); ++row) {
    const AssemblyInput& input = input_of(row);
    copy_row(row, input);
    if (planes_ != nullptr) has_plane_rows_ ? add_plane_rows(row) : decode_row(row, input);
    if (has_seeds) copy_seeds(row, input);
    // No later row needs these any more, the first plane's included.
    for (const AssemblyInput& shard : shards_) {
      if (row == shard.end_row + std::max<std::int64_t>(metadata_.planes.stride, 1) + 1) shard.file->close();
    }
    job_.report({"tiles", "tiles", (row + 1) * grid.tile_columns(), grid.tile_count(), writer_.bytes_written()});
  }
  writer_.end_copies();
}

/// Tiles and textures of a row, without decoding them: void tiles are not there.
void Assembly::copy_row(std::int64_t row, const AssemblyInput& input) {
  const std::int64_t columns = metadata_.grid.tile_columns();
  std::int64_t next = 0;
  for (std::int64_t first = 0; first < columns; first += kColumnsAtOnce) {
    job_.throw_if_cancelled();
    const std::pair some(first, std::min(first + kColumnsAtOnce, columns));
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
  const std::int64_t columns = metadata_.grid.tile_columns();
  for (std::int64_t first = 0; first < columns; first += kColumnsAtOnce) {
    const std::pair some(first, std::min(first + kColumnsAtOnce, columns));
    for (const PartFile::Stored& seed : input.file->stored(kSeedTable, row, some))
      writer_.copy_member(input.file->source(), {kSeedTable, row, seed.column}, seed.record);
  }
}

/// Hands a row of tiles to the planes.
void Assembly::decode_row(std::int64_t row, const AssemblyInput& input) {
  const std::int64_t columns = metadata_.grid.tile_columns();
  const std::int64_t batch = std::int64_t{8} * threads_of(job_);
  for (std::int64_t first = 0; first < columns; first += batch) {
    job_.throw_if_cancelled();
    const std::pair some(first, std::min(first + batch, columns));
    const std::vector<PartFile::Stored> tiles = input.file->stored(tile_table_name(0), row, some);
    std::vector<PlaneSample> samples(static_cast<std::size_t>(some.second - first));
    oneapi::tbb::parallel_for(std::size_t{0}, tiles.size(), [&](std::size_t i) {
      EncodedTile encoded;
      encoded.code_min = tiles[i].record.entry.code_min;
      encoded.code_max = tiles[i].record.entry.code_max;
      samples[static_cast<std::size_t>(tiles[i].column - first)] =
          planes_->sample(input.file->decode(metadata_.grid.shape(), metadata_.quantisation.type, tiles[i]), encoded);
    });
    for (const PlaneSample& sample : samples) planes_->add(sample);
  }
}

/// Rows of the first plane that were finished with the tiles of `row`: copied. The planes above are made of them.
void Assembly::add_plane_rows(std::int64_t row) {
  const Planes planes = planes_of(metadata_);
  const TileGrid& grid = planes.grid(1);
  const std::int64_t batch = std::int64_t{8} * threads_of(job_);
  for (; next_plane_row_ < grid.tile_rows(); ++next_plane_row_) {
    const std::int64_t needed = std::min((next_plane_row_ + 1) * planes.stride() + 1, metadata_.grid.tile_rows());
    if (row + 1 < needed) return;
    PartFile& file = *input_of(next_plane_row_ * planes.stride()).file;
    for (std::int64_t first = 0; first < grid.tile_columns(); first += batch) {
      job_.throw_if_cancelled();
      std::vector<PlaneSample> samples(static_cast<std::size_t>(std::min(batch, grid.tile_columns() - first)));
      const std::pair some(first, first + static_cast<std::int64_t>(samples.size()));
      const std::vector<PartFile::Stored> tiles = file.stored(tile_table_name(1), next_plane_row_, some);
      if (planes.count() > 1) {
        // The range of a void tile is that of the tiles below it.
        const ArchiveReader* const below = tiles.size() == samples.size() ? nullptr : &file.archive();
        oneapi::tbb::parallel_for(std::size_t{0}, samples.size(), [&](std::size_t i) {
          const auto read = [&](int plane, TileIndex tile) {
            PlaneBuilder::Stored stored;
            const auto at = std::ranges::find(tiles, tile.column, &PartFile::Stored::column);
            const TileEntry entry = plane == 0          ? below->tile_entry(tile, 0)
                                    : at != tiles.end() ? at->record.entry
                                                        : TileEntry{};
            stored.entry.is_empty = !entry.stored;
            stored.entry.code_min = entry.code_min;
            stored.entry.code_max = entry.code_max;
            if (!entry.stored) return stored;
            stored.codes = plane == 0 ? below->read_tile(tile)
                                      : file.decode(metadata_.grid.shape(), metadata_.quantisation.type, *at);
            return stored;
          };
          samples[i] = planes_->finished_sample({first + static_cast<std::int64_t>(i), next_plane_row_}, read);
        });
      }
      for (const PartFile::Stored& tile : tiles)
        writer_.copy_tile(file.source(), {1, {tile.column, next_plane_row_}}, tile.record, tile.digest);
      for (std::size_t i = 0; i < samples.size() && planes.count() > 1; ++i) planes_->add_finished(samples[i]);
    }
  }
}

std::uint64_t Assembly::add_residuals(const LosslessRecord& record) {
  const ArchiveReader& first = shards_.front().file->archive();
  if (first.find_member(kNodesName)) copy_member(first, kNodesName);
  const std::int64_t members = (record.height + record.rows_per_member - 1) / record.rows_per_member;
  std::uint64_t bytes = 0;
  const AssemblyInput* before = &shards_.front();
  for (std::int64_t member = 0; member < members; ++member) {
    const AssemblyInput& input = input_of(member * metadata_.grid.tile_rows() / members);
    if (&input != before) before->file->close();
    before = &input;
    bytes += copy_member(input.file->archive(), residual_name(member * record.rows_per_member));
  }
  before->file->close();
  return bytes;
}

std::uint64_t Assembly::copy_member(const ArchiveReader& from, const std::string& name) {
  try {
    const auto member = from.find_member(name);
    if (!member) throw Error(ErrorCode::kCorrupt, name + ": is missing");
    const SourceBytes data(from.source(), member->offset_bytes, member->compressed_bytes);
    if (member->deflated) writer_.add_deflated_member(name, data.bytes(), member->bytes, member->crc32);
    if (!member->deflated) writer_.add_member(name, data.bytes(), false);
    return member->compressed_bytes;
  } catch (const Error& error) {
    throw error.within(from.path());
  }
}

}  // namespace isohf
