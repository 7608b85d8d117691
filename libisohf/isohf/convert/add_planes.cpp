#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <filesystem>
#include <optional>

#include "isohf/archive/codec/simd/batch_decoder.h"
#include "isohf/archive/codec/tile_encoder.h"
#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/container/content_hash.h"
#include "isohf/archive/planes/archive_planes.h"
#include "isohf/archive/writer.h"
#include "isohf/base/arena.h"
#include "isohf/byte_source.h"
#include "isohf/convert.h"
#include "isohf/convert/stages/plane_stage.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr const char* kPlanesFolder = "planes/";

/// Copies an archive, its tiles decoded on the way.
class Copy {
 public:
  Copy(const ArchiveReader& archive, ArchiveWriter& writer, PlaneStage* planes, const Job& job)
      : archive_(archive), writer_(writer), planes_(planes), job_(job) {
    for (const MemberEntry& member : archive.members()) {
      const bool is_own = member.name == kMediaTypeName || member.name == kMetadataName || member.name == kIndexName;
      if (!is_own && member.name.rfind(kPlanesFolder, 0) != 0) {
        members_.push_back(member);
      }
    }
  }

  void run() {
    const TileGrid& grid = archive_.grid();
    const std::int64_t batch = static_cast<std::int64_t>(kBatchLanes) * threads_of(job_);
    for (std::int64_t first = 0; first < grid.tile_count(); first += batch) {
      job_.throw_if_cancelled();
      std::vector<Tile> tiles(static_cast<std::size_t>(std::min(batch, grid.tile_count() - first)));
      oneapi::tbb::parallel_for(std::size_t{0}, (tiles.size() + kBatchLanes - 1) / kBatchLanes, [&](std::size_t group) {
        const std::size_t begin = group * kBatchLanes;
        read(first + static_cast<std::int64_t>(begin),
             std::span(tiles).subspan(begin, std::min(kBatchLanes, tiles.size() - begin)));
      });
      for (const Tile& tile : tiles) write(tile);
      job_.report({"planes", "tiles", writer_.next_tile(), grid.tile_count(), writer_.bytes_written()});
    }
    add_members(archive_.size_bytes());
    if (hash_.finish(archive_.metadata()) != archive_.metadata().content_sha256) {
      throw Error(ErrorCode::kCorrupt, archive_.path() + ": its tiles differ from its content hash; see isohf verify");
    }
  }

 private:
  struct Tile {
    std::uint64_t offset_bytes = 0;
    EncodedTile encoded;
    PlaneSample sample;
  };

  /// Tiles from flat index `first` on.
  void read(std::int64_t first, std::span<Tile> tiles) const {
    std::vector<TileIndex> stored;
    std::vector<Tile*> to;
    for (std::size_t i = 0; i < tiles.size(); ++i) {
      const TileIndex index = archive_.grid().tile_at(first + static_cast<std::int64_t>(i));
      const TileEntry entry = archive_.tile_entry(index);
      EncodedTile& encoded = tiles[i].encoded;
      encoded.is_empty = !entry.stored;
      if (!entry.stored) {
        encoded.content_digest = void_digest_;
        continue;
      }
      tiles[i].offset_bytes = entry.offset_bytes;
      encoded.deflated.resize(entry.compressed_bytes);
      read_range(entry.offset_bytes, encoded.deflated);
      encoded.payload_bytes = entry.payload_bytes;
      encoded.payload_crc32 = entry.payload_crc32;
      encoded.code_min = entry.code_min;
      encoded.code_max = entry.code_max;
      encoded.has_voids = entry.has_voids;
      stored.push_back(index);
      to.push_back(&tiles[i]);
    }
    const std::vector<TileCodes> codes = archive_.read_tiles(stored);
    for (std::size_t i = 0; i < codes.size(); ++i) {
      to[i]->encoded.content_digest = tile_content_digest(codes[i]);
      if (planes_ != nullptr) to[i]->sample = planes_->sample(codes[i], to[i]->encoded);
    }
  }

  void read_range(std::uint64_t offset, std::span<std::byte> to) const {
    if (archive_.source().read(offset, to) != to.size()) {
      throw Error(ErrorCode::kIo, archive_.path() + ": byte " + std::to_string(offset) + " cannot be read");
    }
  }

  void write(const Tile& tile) {
    if (!tile.encoded.is_empty) add_members(tile.offset_bytes);
    hash_.add_tile(tile.encoded.content_digest);
    writer_.add_tile(tile.encoded);
    if (planes_ != nullptr) planes_->add(tile.sample);
  }

  /// Those that stand before a place in the archive.
  void add_members(std::uint64_t end) {
    for (; next_ < members_.size() && members_[next_].offset_bytes < end; ++next_) {
      const MemberEntry& member = members_[next_];
      std::vector<std::byte> data(member.compressed_bytes);
      read_range(member.offset_bytes, data);
      if (member.deflated) writer_.add_deflated_member(member.name, data, member.bytes, member.crc32);
      if (!member.deflated) writer_.add_member(member.name, data, false);
    }
  }

  const ArchiveReader& archive_;
  ArchiveWriter& writer_;
  PlaneStage* planes_;
  const Job& job_;
  std::vector<MemberEntry> members_;
  std::size_t next_ = 0;  ///< of members_
  ContentHash hash_;
  std::vector<std::byte> void_digest_ =
      tile_content_digest(void_tile(archive_.grid().shape(), archive_.metadata().quantisation));
};

}  // namespace

AddPlanesSummary add_planes(const std::string& archive, const std::string& output, bool overwrite, const Job& job) {
  const ArchiveReader reader(archive);
  std::error_code none;
  const bool in_place = std::filesystem::equivalent(archive, output, none);
  Metadata metadata = reader.metadata();
  metadata.planes = planes_for(metadata.grid);
  WriterOptions options;
  options.overwrite = overwrite || in_place;
  options.planes = metadata.planes;
  ArchiveWriter writer(output, metadata.grid, options);
  AddPlanesSummary summary;
  Arena(job).execute([&] {
    std::optional<PlaneStage> planes;
    if (metadata.planes.count > 0) {
      planes.emplace(planes_of(metadata), metadata.quantisation, metadata.level.value_or(kDefaultLevel), writer);
    }
    Copy(reader, writer, planes ? &*planes : nullptr, job).run();
  });
  const MemberTotals totals = writer.members_in(kPlanesFolder);
  summary.planes = metadata.planes;
  summary.tiles = totals.members;
  summary.plane_bytes = totals.bytes;
  summary.archive_bytes_before = reader.size_bytes();
  summary.archive_bytes = writer.finish(metadata);
  return summary;
}

}  // namespace isohf
