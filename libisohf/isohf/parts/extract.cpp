#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/container/content_hash.h"
#include "isohf/archive/container/member_tables.h"
#include "isohf/archive/metadata/accuracy_info.h"
#include "isohf/archive/metadata/cut_record.h"
#include "isohf/archive/metadata/shard_record.h"
#include "isohf/archive/planes/archive_planes.h"
#include "isohf/archive/shadow_seeds/shadow_seeds.h"
#include "isohf/archive/textures/texture_info.h"
#include "isohf/archive/tile_statistics.h"
#include "isohf/archive/writer.h"
#include "isohf/base/arena.h"
#include "isohf/base/source_bytes.h"
#include "isohf/convert/stages/seed_row.h"
#include "isohf/error.h"
#include "isohf/parts/parts.h"
#include "isohf/restore/lossless.h"
#include "isohf/surface.h"

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

/// The metadata of an archive of some tiles of a plane. The world begins at the first of them, and everything that is
/// placed in it moves.
Metadata metadata_of_cut(const Metadata& whole, int plane, const TileRange& tiles) {
  Metadata metadata = whole;
  const TileGrid from = whole.plane_grid(plane);
  metadata.grid = TileGrid::make(from.shape(), tiles.end.column - tiles.first.column, tiles.end.row - tiles.first.row,
                                 from.extent_x(), from.extent_z());
  metadata.planes = planes_for(metadata.grid);
  const double west = static_cast<double>(tiles.first.column) * from.extent_x();
  const double north = static_cast<double>(tiles.first.row) * from.extent_z();
  SourceRecord& source = metadata.source;
  source.first_sample_x -= west;
  source.first_sample_z -= north;
  if (metadata.projection) {
    metadata.projection->origin.easting += west;
    metadata.projection->origin.northing -= north;
  }
  WorldBounds& valid = metadata.valid;
  valid.x1 = std::clamp(valid.x1 - west, 0.0, metadata.grid.world_width());
  valid.z1 = std::clamp(valid.z1 - north, 0.0, metadata.grid.world_height());
  metadata.wraps_x = whole.wraps_x && metadata.grid.world_width() == whole.grid.world_width();
  if (whole.wraps_x && !metadata.wraps_x && source.registration != Registration::kArea && !is_warped(whole)) {
    // Between the last column of posts and the first no source lies.
    const double last = source.first_sample_x + static_cast<double>(source.width - 1) * source.spacing_x;
    valid.x1 = std::clamp(last, 0.0, valid.x1);
  }
  for (const char* name : {kAccuracyName, kJobName, kLosslessName}) drop_extension(metadata, name);
  if (plane > 0) {
    metadata.textures.clear();
    for (const char* name : {kShadowSeedsName, kTileTexturesName}) drop_extension(metadata, name);
  }
  CutRecord cut = cut_record(whole).value_or(CutRecord{});
  cut.column = tiles.first.column;
  cut.row = tiles.first.row;
  if (plane > 0) cut.coarser = cut.coarser.value_or(1) * std::llround(from.sigma_z() / whole.grid.sigma_z());
  set_extension(metadata, kCutName, write_extension(cut, cut_members));
  return metadata;
}

/// Copies tiles of one plane of an archive to an archive of their own, as convert() writes it: a tile's textures, the
/// tile; after a row, planes and seeds. On the caller's oneTBB arena. Stage "tiles".
class Extraction {
 public:
  Extraction(const ArchiveReader& from, int plane, const TileRange& tiles, const Metadata& metadata,
             ArchiveWriter& writer, PlaneStage* planes, const Job& job)
      : from_(from),
        plane_(plane),
        tiles_(tiles),
        metadata_(metadata),
        writer_(writer),
        planes_(planes),
        job_(job),
        counted_(metadata),
        void_codes_(void_tile(metadata.grid.shape(), metadata.quantisation)),
        void_digest_(tile_content_digest(void_codes_)) {
    if (const auto info = shadow_seed_info(metadata))
      seeds_.emplace(metadata.grid, metadata.quantisation, *info, metadata.valid);
    for (const MemberTable& table : from.tables()) {
      const bool is_by_tile = table.name.find("{column}") != std::string::npos;
      if (plane == 0 && is_by_tile && !table.name.starts_with("seeds/") && !is_in_tile_folder(table.name))
        tables_.push_back(table.name);
    }
  }

  void run() {
    const std::int64_t batch = std::int64_t{8} * threads_of(job_);
    const std::int64_t columns = metadata_.grid.tile_columns();
    for (std::int64_t row = 0; row < metadata_.grid.tile_rows(); ++row) {
      SeedRow::Tiles seeds(std::nullopt);
      for (std::int64_t first = 0; first < columns; first += batch) {
        job_.throw_if_cancelled();
        std::vector<Tile> some(static_cast<std::size_t>(std::min(batch, columns - first)));
        oneapi::tbb::parallel_for(std::size_t{0}, some.size(), [&](std::size_t i) {
          some[i] = read({first + static_cast<std::int64_t>(i), row});
        });
        for (std::size_t i = 0; i < some.size(); ++i) {
          if (!some[i].encoded.is_empty) add_textures({first + static_cast<std::int64_t>(i), row});
          writer_.add_tile(some[i].encoded);
          if (planes_ != nullptr) planes_->add(some[i].sample);
          if (seeds_) seeds.add(some[i].seeds);
        }
      }
      if (seeds_) seeds_->write(seeds, row, writer_);
      job_.report({"tiles", "tiles", (row + 1) * columns, metadata_.grid.tile_count(), writer_.bytes_written()});
    }
    for (const MemberEntry& member : from_.loose_members()) {
      const bool is_own = member.name == kMediaTypeName || member.name == kMetadataName || member.name == kIndexName;
      if (!is_own && !member.name.starts_with("residual/")) copy(member, member.name);
    }
  }

 private:
  struct Tile {
    EncodedTile encoded;
    PlaneSample sample;
    SeedRow::Tile seeds;
  };

  /// The tile's place in the whole.
  [[nodiscard]] TileIndex origin_of(TileIndex index) const {
    return {tiles_.first.column + index.column, tiles_.first.row + index.row};
  }

  /// Any thread.
  [[nodiscard]] Tile read(TileIndex index) const {
    Tile tile;
    EncodedTile& encoded = tile.encoded;
    const TileEntry entry = from_.tile_entry(origin_of(index), plane_);
    encoded.is_empty = !entry.stored;
    const TileCodes codes = entry.stored ? from_.read_tile(origin_of(index), plane_) : void_codes_;
    if (entry.stored) {
      encoded.deflated = bytes_of(entry.offset_bytes, entry.compressed_bytes);
      encoded.payload_bytes = entry.payload_bytes;
      encoded.payload_crc32 = entry.payload_crc32;
      encoded.code_min = entry.code_min;
      encoded.code_max = entry.code_max;
      encoded.has_voids = entry.has_voids;
      if (plane_ > 0) set_own_range(codes, metadata_.quantisation, encoded);
      if (planes_ != nullptr) tile.sample = planes_->sample(codes, encoded);
    }
    encoded.content_digest = entry.stored ? tile_content_digest(codes) : void_digest_;
    encoded.statistics = tile_statistics(counted_, index, codes, metadata_.quantisation);
    if (seeds_) tile.seeds = seeds_->prepare(index, codes);
    tile.seeds.is_empty = encoded.is_empty;
    return tile;
  }

  [[nodiscard]] std::vector<std::byte> bytes_of(std::uint64_t offset, std::uint64_t size) const {
    try {
      return SourceBytes(from_.source(), offset, size).take();
    } catch (const Error& error) {
      throw error.within(from_.path());
    }
  }

  void copy(const MemberEntry& member, const std::string& name) {
    const std::vector<std::byte> data = bytes_of(member.offset_bytes, member.compressed_bytes);
    if (member.deflated) writer_.add_deflated_member(name, data, member.bytes, member.crc32);
    if (!member.deflated) writer_.add_member(name, data, false);
  }

  void add_textures(TileIndex index) {
    const TileIndex origin = origin_of(index);
    std::vector<std::pair<MemberEntry, std::string>> members;
    for (const std::string& table : tables_) {
      if (auto member = from_.find_member(member_name(table, origin.row, origin.column)))
        members.emplace_back(std::move(*member), member_name(table, index.row, index.column));
    }
    std::ranges::sort(members, {}, [](const auto& member) { return member.first.offset_bytes; });
    for (const auto& [member, name] : members) copy(member, name);
  }

  const ArchiveReader& from_;
  int plane_;
  TileRange tiles_;
  const Metadata& metadata_;
  ArchiveWriter& writer_;
  PlaneStage* planes_;
  const Job& job_;
  CountedVertices counted_;
  TileCodes void_codes_;
  Digest void_digest_;
  std::optional<SeedRow> seeds_;
  std::vector<std::string> tables_;  ///< of textures
};

}  // namespace

TileRange tiles_touching(const TileGrid& grid, const WorldBounds& bounds) {
  const auto range = [](double first, double last, double extent, std::int64_t tiles) {
    const double most = static_cast<double>(tiles);
    return std::pair(static_cast<std::int64_t>(std::clamp(std::floor(first / extent), 0.0, most)),
                     static_cast<std::int64_t>(std::clamp(std::ceil(last / extent), 0.0, most)));
  };
  const auto [west, east] = range(bounds.x0, bounds.x1, grid.extent_x(), grid.tile_columns());
  const auto [north, south] = range(bounds.z0, bounds.z1, grid.extent_z(), grid.tile_rows());
  if (!(west < east && north < south)) {
    throw Error(ErrorCode::kInvalidArgument, "the rectangle lies outside of what the archive covers");
  }
  return {{west, north}, {east, south}};
}

TileRange plane_tiles_of(const ArchiveReader& archive, int plane) {
  const Metadata& metadata = archive.metadata();
  if (plane < 0 || plane > metadata.planes.count) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: has {} overviews, not an overview {}", archive.path(), metadata.planes.count, plane));
  }
  const TileGrid grid = metadata.plane_grid(plane);
  return {{0, 0}, {grid.tile_columns(), grid.tile_rows()}};
}

PartSummary extract_tiles(const std::string& archive, const std::string& output, int plane, const TileRange& tiles,
                          const PartOptions& options, const Job& job) {
  const ArchiveReader reader(archive);
  require_copyable(reader);
  if (const TileRange here = plane_tiles_of(reader, plane); tiles.is_empty() || intersection(tiles, here) != tiles) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: {} of tiles are asked for, it holds {}", archive, text_of(tiles), text_of(here)));
  }
  Metadata metadata = metadata_of_cut(reader.metadata(), plane, tiles);
  PartSummary summary;
  if (plane == 0 && lossless_record(reader.metadata())) {
    summary.warnings.push_back(
        loss(archive + ": residuals are left out; the extract does not return the samples of the source bit for bit"));
  }
  if (options.strict && !summary.warnings.empty()) throw error_from(summary.warnings);
  ArchiveWriter writer(output, metadata.grid, options_while_copying(metadata, options));
  Arena(job).execute([&] {
    const std::unique_ptr<PlaneStage> planes = planes_while_copying(metadata, writer, output);
    Extraction(reader, plane, tiles, metadata, writer, planes.get(), job).run();
  });
  const Statistics before = metadata.statistics;
  metadata.statistics = total_statistics(writer.statistics());
  // These are not known of each tile. They are no more than in the whole, or than there are elevations here.
  metadata.statistics.worst_rounding = before.worst_rounding;
  metadata.statistics.clamped = std::min(before.clamped, metadata.statistics.vertices - metadata.statistics.voids);
  finish_copy(writer, metadata, summary);
  return summary;
}

}  // namespace isohf
