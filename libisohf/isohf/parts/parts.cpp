#include "isohf/parts/parts.h"

#include <fmt/format.h>

#include <algorithm>

#include "isohf/archive/container/content_hash.h"
#include "isohf/archive/planes/archive_planes.h"
#include "isohf/archive/shadow_seeds/shadow_seeds.h"
#include "isohf/archive/textures/texture_info.h"
#include "isohf/base/file.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// Of the rows that coarse planes are made of: more lie in a file beside the output.
constexpr std::uint64_t kMostPlaneBytes = std::uint64_t{16} << 20U;

}  // namespace

void drop_extension(Metadata& metadata, const char* name) {
  std::erase_if(metadata.extensions, [&](const auto& extension) { return extension.first == name; });
}

void set_extension(Metadata& metadata, const char* name, std::string text) {
  const auto at = std::find_if(metadata.extensions.begin(), metadata.extensions.end(),
                               [&](const auto& extension) { return extension.first == name; });
  if (at != metadata.extensions.end())
    at->second = std::move(text);
  else
    metadata.extensions.emplace_back(name, std::move(text));
}

namespace {

/// Writes in the metadata how many seeds and textures were written, and how large they are.
void count_members(const ArchiveWriter& writer, Metadata& metadata) {
  const auto count = [&](auto info, const char* folder, const char* name, auto format) {
    if (!info) return;
    const MemberTotals totals = writer.members_in(folder);
    info->members = totals.members;
    info->bytes = totals.bytes;
    set_extension(metadata, name, format(*info));
  };
  count(shadow_seed_info(metadata), "seeds/", kShadowSeedsName, format_shadow_seed_info);
  count(texture_info(metadata), kTextureFolder, kTileTexturesName, format_texture_info);
}

}  // namespace

std::string text_of(const TileRange& tiles) {
  return fmt::format("columns {} to {} and rows {} to {}", tiles.first.column, tiles.end.column - 1, tiles.first.row,
                     tiles.end.row - 1);
}

std::string why_other_vertices(const Metadata& one, const Metadata& other) {
  const TileGrid& a = one.grid;
  const TileGrid& b = other.grid;
  const auto shape = [](const TileGrid& grid) {
    return fmt::format("{}x{} tiles of {}x{}", grid.tile_columns(), grid.tile_rows(), grid.shape().columns(),
                       grid.shape().rows());
  };
  if (shape(a) != shape(b)) return fmt::format("has {}, not {}", shape(b), shape(a));
  if (!(a.shape() == b.shape())) return fmt::format("has {} levels, not {}", b.shape().levels(), a.shape().levels());
  if (a.extent_x() != b.extent_x() || a.extent_z() != b.extent_z()) {
    return fmt::format("has tiles of {} by {} world units, not {} by {}", b.extent_x(), b.extent_z(), a.extent_x(),
                       a.extent_z());
  }
  const auto ground = [](Metadata metadata) {
    metadata.content_sha256.clear();
    return ground_hash(metadata);
  };
  if (ground(one) != ground(other)) return "lies on other ground: projection, place, reference system or unit differ";
  return {};
}

void require_copyable(const ArchiveReader& archive) {
  const auto refuse = [&](const char* why) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("{}: {}", archive.path(), why));
  };
  if (archive.reads_by_directory()) refuse("was repacked by another tool");
}

std::unique_ptr<PlaneStage> planes_while_copying(const Metadata& metadata, ArchiveWriter& writer,
                                                 const std::string& output) {
  if (metadata.planes.count == 0) return nullptr;
  const Planes all = planes_of(metadata);
  const CodeType type = metadata.quantisation.type;
  ScratchFolder scratch;
  if (plane_builder_memory_bytes(all, type, false) > kMostPlaneBytes) scratch = folder_of(output);
  return std::make_unique<PlaneStage>(all, metadata.quantisation, metadata.effort.value_or(Effort::kDefault), writer,
                                      RowRange{0, metadata.grid.tile_rows() - 1}, nullptr, scratch);
}

WriterOptions options_while_copying(const Metadata& metadata, const PartOptions& options) {
  WriterOptions how;
  how.overwrite = options.overwrite;
  how.journal = false;  // copying again takes no longer than a look at what is there
  how.planes = metadata.planes;
  return how;
}

void finish_copy(ArchiveWriter& writer, Metadata& metadata, PartSummary& summary) {
  count_members(writer, metadata);
  summary.tiles_stored = writer.tiles_stored();
  summary.content_sha256 = writer.content_hash(metadata);
  summary.archive_bytes = writer.finish(metadata);
}

}  // namespace isohf
