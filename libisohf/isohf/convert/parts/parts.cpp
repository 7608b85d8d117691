#include "isohf/convert/parts/parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "isohf/archive/container/content_hash.h"
#include "isohf/archive/metadata/accuracy_info.h"
#include "isohf/archive/metadata/part_record.h"
#include "isohf/archive/planes/archive_planes.h"
#include "isohf/archive/shadow_seeds/shadow_seeds.h"
#include "isohf/archive/textures/texture_info.h"
#include "isohf/base/arena.h"
#include "isohf/base/file.h"
#include "isohf/convert/job_description.h"
#include "isohf/convert/parts/residual_members.h"
#include "isohf/error.h"
#include "isohf/restore/lossless.h"

namespace isohf {
namespace {

/// Of the rows that coarse planes are made of: more lie in a file beside the output.
constexpr std::uint64_t kMostPlaneBytes = std::uint64_t{16} << 20U;

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

}  // namespace

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

std::string text_of(const TileRange& tiles) {
  return fmt::format("columns {} to {} and rows {} to {}", tiles.first.column, tiles.end.column - 1, tiles.first.row,
                     tiles.end.row - 1);
}

TileRange tiles_here(const ArchiveReader& archive) {
  try {
    return tiles_here(archive.metadata());
  } catch (const Error& error) {
    throw error.within(archive.path());
  }
}

TileRange tiles_of(const Metadata& metadata) {
  return tiles_here(metadata);
}

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

std::string why_other_lattice(const Metadata& one, const Metadata& other) {
  const Quantisation& codes = one.quantisation;
  const Quantisation& others = other.quantisation;
  if (codes.type != others.type || codes.offset != others.offset || codes.scale != others.scale) {
    const auto text = [](const Quantisation& q) {
      return fmt::format("{} {} + {} code", to_string(q.type), q.offset, q.scale);
    };
    return fmt::format("has elevations {}, not {}", text(others), text(codes));
  }
  return why_other_vertices(one, other);
}

void require_copyable(const ArchiveReader& archive) {
  const auto refuse = [&](const char* why) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("{}: {}", archive.path(), why));
  };
  if (archive.reads_by_directory()) refuse("was repacked by another tool");
}

PartOrigin origin_of(const ArchiveReader& archive) {
  const auto part = part_record(archive.metadata());
  if (!part) return {archive.metadata().ground_sha256, archive.metadata_json(), false};
  if (part->shard) return {"plan " + part->shard->plan, {}, true};
  const auto whole = archive.read_member(kWholeName);
  if (!whole) {  // joined from archives of several origins
    return {archive.path(), {}, false};
  }
  std::string json(reinterpret_cast<const char*>(whole->data()), whole->size());
  try {
    const Metadata of_whole = parse_metadata(json);
    if (const std::string why = why_other_lattice(archive.metadata(), of_whole); !why.empty()) {
      throw Error(ErrorCode::kCorrupt, why + " as the archive itself has");
    }
    return {of_whole.ground_sha256, std::move(json), false};
  } catch (const Error& error) {
    throw error.within(fmt::format("{}: {}", archive.path(), kWholeName));
  }
}

namespace {

/// Those of one archive or plan; nullopt where there are none, or not of one.
std::optional<ResidualMembers> residuals_of(const PartsJob& parts, const std::optional<Metadata>& whole) {
  std::optional<LosslessRecord> record;
  if (whole) record = lossless_record(*whole);
  if (!whole && parts.one_origin) record = part_lossless_record(parts.metadata);
  if (!record) return std::nullopt;
  return ResidualMembers(std::move(*record), parts.inputs, parts.tiles, parts.metadata.grid.tile_rows());
}

/// In what an archive was made otherwise than another: "filter, nodata"; empty where in nothing.
std::string made_otherwise(const Metadata& one, const Metadata& other) {
  const auto making = [](const Metadata& metadata) {
    const SourceRecord& source = metadata.source;
    const auto [low, high] = source.valid_range.value_or(std::pair(-HUGE_VAL, HUGE_VAL));
    return std::vector<std::pair<const char*, std::string>>{
        {"source", source.name},
        {"filter", name_of(metadata.filter) + " " + name_of(metadata.edges)},
        {"acquisition", name_of(metadata.acquisition)},
        {"nodata", fmt::format("{} {} {} {}", fmt::join(source.void_values, " "), low, high, source.fill_distance)}};
  };
  std::string names;
  const auto ours = making(one);
  const auto theirs = making(other);
  for (std::size_t i = 0; i < ours.size(); ++i) {
    if (ours[i] != theirs[i]) names += (names.empty() ? "" : ", ") + std::string(ours[i].first);
  }
  return names;
}

}  // namespace

PartSummary write_parts(PartsJob parts, const std::string& output, const PartOptions& options, const Job& job) {
  Metadata& metadata = parts.metadata;
  PartSummary summary;
  summary.tiles = parts.tiles;
  summary.is_whole = parts.tiles == all_tiles(metadata.grid);
  drop_extension(metadata, kPartName);
  std::optional<Metadata> whole;
  if (!parts.whole_json.empty()) whole.emplace(parse_metadata(parts.whole_json));
  std::optional<ResidualMembers> residuals = residuals_of(parts, whole);
  if (residuals && summary.is_whole && !residuals->are_complete())
    residuals.reset();  // older programs cut without them
  const auto has_some = [](const AssemblyInput& input) {
    const auto& tables = input.file->archive().tables();
    return std::any_of(tables.begin(), tables.end(), [](const auto& table) { return is_residual(table.name); });
  };
  if (!residuals && !parts.statistics && parts.plane == 0 &&
      std::any_of(parts.inputs.begin(), parts.inputs.end(), has_some)) {
    summary.warnings.push_back(loss("residuals are left out: they are not those of all that is joined"));
  }
  for (const AssemblyInput& input : parts.inputs) {
    const ArchiveReader& archive = input.file->archive();
    const std::string names = parts.one_origin ? "" : made_otherwise(metadata, archive.metadata());
    if (names.empty()) continue;
    summary.warnings.push_back(
        loss(fmt::format("{}: was made with another {} than {}, of which alone the archive tells", archive.path(),
                         names, parts.inputs.front().file->archive().path())));
  }
  drop_extension(metadata, kLosslessName);
  drop_extension(metadata, kPartLosslessName);
  if (options.strict && !summary.warnings.empty()) throw error_from(summary.warnings);
  WriterOptions how;
  how.overwrite = options.overwrite;
  how.journal = false;  // copying again takes no longer than a look at what is there
  how.planes = metadata.planes;
  how.type = metadata.quantisation.type;
  ArchiveWriter writer(output, metadata.grid, how);
  Arena(job).execute([&] {
    std::optional<PlaneStage> planes;
    if (metadata.planes.count > 0) {
      const Planes all = planes_of(metadata);
      const CodeType type = metadata.quantisation.type;
      ScratchFolder scratch;
      if (plane_builder_memory_bytes(all, type, false) > kMostPlaneBytes) scratch = folder_of(output);
      planes.emplace(all, metadata.quantisation, metadata.effort.value_or(Effort::kDefault), writer,
                     RowRange{0, metadata.grid.tile_rows() - 1}, nullptr, scratch);
    }
    AssemblyRequest request{parts.inputs,
                            parts.tiles,
                            planes ? &*planes : nullptr,
                            parts.has_plane_rows,
                            parts.one_origin,
                            !parts.statistics,
                            parts.plane};
    Assembly assembly(metadata, writer, std::move(request), job);
    assembly.add_tiles();
    if (residuals) residuals->copy_to(writer);
    assembly.add_other_members();
  });
  if (whole && summary.is_whole && whole->content_sha256 == writer.content_hash(*whole)) {
    summary.same_as_whole = residuals || !lossless_record(*whole);
    if (!residuals) drop_extension(*whole, kLosslessName);
    metadata = *whole;
  } else {
    for (const char* name : {kAccuracyName, kJobName}) {
      if (!parts.statistics) drop_extension(metadata, name);
    }
    const Statistics before = metadata.statistics;
    metadata.statistics = parts.statistics ? *parts.statistics : total_statistics(writer.statistics());
    if (!parts.statistics) {
      // Of each tile these are not known: they are no more than in the whole.
      metadata.statistics.worst_rounding = before.worst_rounding;
      metadata.statistics.clamped = before.clamped;
    }
    if (residuals && summary.is_whole) set_extension(metadata, kLosslessName, format_lossless(residuals->record()));
    if (!summary.is_whole) {
      PartRecord record;
      record.tiles = parts.tiles;
      set_extension(metadata, kPartName, format_part_record(record));
      if (!parts.whole_json.empty()) {
        writer.add_member(kWholeName, std::as_bytes(std::span<const char>(parts.whole_json)), true);
      }
    }
  }
  count_members(writer, metadata);
  summary.tiles_stored = writer.tiles_stored();
  summary.content_sha256 = writer.content_hash(metadata);
  summary.archive_bytes = writer.finish(metadata);
  return summary;
}

namespace {

/// Of an archive that can be cut: a shard cannot.
PartOrigin cuttable(const ArchiveReader& reader) {
  require_copyable(reader);
  PartOrigin origin = origin_of(reader);
  if (origin.is_shard) {
    throw Error(ErrorCode::kInvalidArgument, reader.path() + ": is a shard of a plan; join the shards first");
  }
  return origin;
}

void require_tiles(const TileRange& tiles, const TileRange& here, const std::string& archive) {
  if (!tiles.is_empty() && intersection(tiles, here) == tiles) return;
  throw Error(ErrorCode::kInvalidArgument,
              fmt::format("{}: {} of tiles are asked for, it holds {}", archive, text_of(tiles), text_of(here)));
}

}  // namespace

PartSummary extract_tiles(const std::string& archive, const std::string& output, const TileRange& tiles,
                          const PartOptions& options, const Job& job) {
  const ArchiveReader reader(archive);
  require_copyable(reader);
  require_tiles(tiles, tiles_here(reader), archive);
  const PartOrigin origin = cuttable(reader);
  return write_parts(
      {{{part_file(reader), tiles}}, tiles, reader.metadata(), origin.whole_json, true, false, std::nullopt}, output,
      options, job);
}

TileRange plane_tiles_of(const ArchiveReader& archive, int plane) {
  const Metadata& metadata = archive.metadata();
  if (plane < 0 || plane > metadata.planes.count) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("{}: has {} coarse planes, plane {} is asked for",
                                                         archive.path(), metadata.planes.count, plane));
  }
  const TileRange here = tiles_here(archive);
  const std::int64_t scale = planes_of(metadata).scale(plane);
  return {{here.first.column / scale, here.first.row / scale},
          {(here.end.column + scale - 1) / scale, (here.end.row + scale - 1) / scale}};
}

PartSummary extract_plane(const std::string& archive, const std::string& output, int plane, const TileRange& tiles,
                          const PartOptions& options, const Job& job) {
  if (plane == 0) return extract_tiles(archive, output, tiles, options, job);
  const ArchiveReader reader(archive);
  (void)cuttable(reader);
  require_tiles(tiles, plane_tiles_of(reader, plane), archive);
  Metadata metadata = reader.metadata();
  const std::int64_t columns = metadata.grid.tile_columns();
  metadata.grid = metadata.plane_grid(plane);
  metadata.planes = planes_for(metadata.grid);
  const double width = static_cast<double>(metadata.grid.tile_columns()) * metadata.grid.extent_x();
  metadata.wraps_x = metadata.wraps_x && width == static_cast<double>(columns) * reader.grid().extent_x();
  metadata.textures.clear();
  for (const char* name :
       {kShadowSeedsName, kTileTexturesName, kLosslessName, kPartLosslessName, kAccuracyName, kJobName, kPartName}) {
    drop_extension(metadata, name);
  }
  return write_parts({{{part_file(reader), tiles}}, tiles, std::move(metadata), {}, true, false, std::nullopt, plane},
                     output, options, job);
}

}  // namespace isohf
