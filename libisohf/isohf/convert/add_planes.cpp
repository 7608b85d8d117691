#include <filesystem>
#include <optional>

#include "isohf/archive/planes/archive_planes.h"
#include "isohf/archive/writer.h"
#include "isohf/base/arena.h"
#include "isohf/base/memory/memory_budget.h"
#include "isohf/convert.h"
#include "isohf/convert/parts/assembly.h"
#include "isohf/convert/parts/parts.h"
#include "isohf/convert/stages/plane_stage.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr const char* kPlanesFolder = "planes/";
/// In each thread, of each vertex of the tiles that are read together.
constexpr double kBatchBytesPerVertex = 8.0 * 4.0;
/// Of each tile of a row.
constexpr double kBytesPerRowTile = 100.0;

ScratchFolder room_for_planes(const Metadata& metadata, const Job& job) {
  const TileGrid& grid = metadata.grid;
  const auto bytes = [&](bool in_scratch) {
    return reading_bytes(job, static_cast<double>(grid.shape().stored_vertex_count())) +
           threads_of(job) * static_cast<double>(grid.shape().stored_vertex_count()) *
               (kBytesPerVertex + kBatchBytesPerVertex) +
           kBytesPerTile * static_cast<double>(grid.tile_count()) +
           2.0 * kBytesPerRowTile * static_cast<double>(grid.tile_columns()) +
           static_cast<double>(plane_builder_memory_bytes(planes_of(metadata), metadata.quantisation.type, in_scratch));
  };
  return scratch_for(job, bytes(false), bytes(true), "making planes");
}

}  // namespace

AddPlanesSummary add_planes(const std::string& archive, const std::string& output, bool overwrite, const Job& job) {
  const ArchiveReader reader(archive);
  std::error_code none;
  const bool in_place = std::filesystem::equivalent(archive, output, none);
  Metadata metadata = reader.metadata();
  metadata.planes = planes_for(metadata.grid);
  const ScratchFolder scratch = room_for_planes(metadata, job);
  WriterOptions options;
  options.overwrite = overwrite || in_place;
  options.journal = false;
  options.planes = metadata.planes;
  options.type = metadata.quantisation.type;
  ArchiveWriter writer(output, metadata.grid, options);
  AddPlanesSummary summary;
  Arena(job).execute([&] {
    std::optional<PlaneStage> planes;
    if (metadata.planes.count > 0) {
      planes.emplace(planes_of(metadata), metadata.quantisation, metadata.effort.value_or(Effort::kDefault), writer,
                     RowRange{0, metadata.grid.tile_rows() - 1}, nullptr, scratch);
    }
    const TileRange tiles = tiles_here(reader);
    Assembly copy(metadata, writer,
                  {{{part_file(reader), tiles}}, tiles, planes ? &*planes : nullptr, false, true, false, true}, job);
    copy.add_tiles();
    copy.add_other_members(true);
  });
  if (writer.content_hash(metadata) != reader.metadata().content_sha256) {
    throw Error(ErrorCode::kCorrupt, archive + ": its tiles differ from its content hash; see isohf verify");
  }
  count_members(writer, metadata);  // another tool may have packed them again
  const MemberTotals totals = writer.members_in(kPlanesFolder);
  summary.planes = metadata.planes;
  summary.tiles = totals.members;
  summary.plane_bytes = totals.bytes;
  summary.archive_bytes_before = reader.size_bytes();
  summary.archive_bytes = writer.finish(metadata);
  return summary;
}

}  // namespace isohf
