/// isohf info: what an archive or a raster holds.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "commands/command.h"
#include "input/input_files.h"
#include "input/options_source.h"
#include "input/source_place.h"
#include "input/source_size.h"
#include "isohf/archive.h"
#include "isohf/archive/metadata/shard_record.h"
#include "isohf/archive/textures/texture_info.h"
#include "isohf/archive/tile/quantise.h"
#include "isohf/archive/tile_statistics.h"
#include "isohf/error.h"
#include "isohf/parts.h"
#include "isohf/raster.h"
#include "isohf/surface.h"
#include "open_archive.h"
#include "options/command_line.h"
#include "options/describe.h"
#include "output/accuracy_output.h"
#include "output/json_output.h"
#include "output/raster_info.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

constexpr const char* kInfoFooter =
    R"(Of an archive, the index and the metadata are read, no tile; of a raster, no sample unless --stats is given.

Examples:
  isohf info dem.isohf
  isohf info *.tif *.isohf --json     one JSON object a line
  isohf info dem.tif --stats          what is understood of a raster, its range and its voids
  isohf info dem.isohf --tiles        one line a tile: column row bytes minimum maximum voids
  isohf info dem.isohf --json         the metadata and what follows from it)";

struct InfoOptions {
  const Common& common;
  std::vector<std::string> inputs{};
  bool tiles = false;
  OpenOptions open{};
  bool stats = false;
  std::string for_rasters{};  ///< an option given that only rasters take
};

/// The elevation that the index's code stands for.
double elevation_of(const Quantisation& quantisation, std::uint32_t code) {
  if (quantisation.type == CodeType::kF32) return static_cast<double>(std::bit_cast<float>(code));
  return elevation_from_code(quantisation, code);
}

struct Derived {
  std::uint64_t tile_bytes = 0;    ///< compressed, all tiles
  std::uint64_t member_bytes = 0;  ///< compressed, everything else
};

Derived derive(const ArchiveReader& archive) {
  Derived derived;
  derived.tile_bytes = archive.tables().front().compressed_bytes;
  for (const MemberTable& table : archive.tables()) derived.member_bytes += table.compressed_bytes;
  derived.member_bytes -= derived.tile_bytes;
  for (const MemberEntry& member : archive.loose_members()) derived.member_bytes += member.compressed_bytes;
  return derived;
}

ordered_json json_from_tiles(const ArchiveReader& archive) {
  const TileGrid& grid = archive.grid();
  const Quantisation& quantisation = archive.metadata().quantisation;
  ordered_json tiles = ordered_json::array();
  for (std::int64_t i = 0; i < grid.tile_count(); ++i) {
    const TileIndex tile = grid.tile_at(i);
    const TileEntry entry = archive.tile_entry(tile);
    ordered_json json = {{"column", tile.column}, {"row", tile.row}, {"stored", entry.stored}};
    if (entry.stored) {
      json["offset_bytes"] = entry.offset_bytes;
      json["compressed_bytes"] = entry.compressed_bytes;
      json["min"] = elevation_of(quantisation, entry.code_min);
      json["max"] = elevation_of(quantisation, entry.code_max);
      json["has_voids"] = entry.has_voids;
    }
    tiles.push_back(std::move(json));
  }
  return tiles;
}

void print_json(const InfoOptions& options, const ArchiveReader& archive, bool is_one_of_many) {
  const Derived derived = derive(archive);
  const SizeBesideSource size(archive.metadata(), derived.tile_bytes);
  ordered_json members = ordered_json::array();
  for (const MemberEntry& member : archive.loose_members()) {
    members.push_back({{"name", member.name},
                       {"offset_bytes", member.offset_bytes},
                       {"compressed_bytes", member.compressed_bytes},
                       {"bytes", member.bytes},
                       {"deflated", member.deflated}});
  }
  ordered_json tables = ordered_json::array();
  for (const MemberTable& table : archive.tables()) {
    tables.push_back({{"name", table.name},
                      {"columns", table.columns},
                      {"rows", table.rows},
                      {"stored", table.stored},
                      {"compressed_bytes", table.compressed_bytes}});
  }
  ordered_json document = {
      {"archive", archive.path()},
      {"bytes", archive.size_bytes()},
      {"metadata", ordered_json::parse(archive.metadata_json())},
      {"shape", json_from(archive.grid().shape())},
      {"grid", json_from(archive.grid())},
      {"lossless", lossless_record(archive.metadata()).has_value()},
      {"tile_bytes", derived.tile_bytes},
      {"lattice_samples", archive.grid().shape().stored_vertex_count() * archive.grid().tile_count()},
      {"source_samples", size.source_samples},
      {"source_bytes", size.source_bytes},
      {"bits_per_source_sample", size.bits_per_source_sample},
      {"ratio_to_source", size.ratio_to_source},
      {"reads_by_directory", archive.reads_by_directory()},
      {"warnings", json_from(archive.warnings())},
      {"tables", tables},
      {"members", members}};
  add_source_place(source_place(archive.metadata()), document);
  if (options.tiles) document["tiles"] = json_from_tiles(archive);
  StandardOutput out(options.common);
  out.write(is_one_of_many ? json_line(document) : json_text(document));
  out.finish();
}

std::string describe_crs(const SourceRecord& source) {
  std::string text = source.crs_name;
  if (source.crs_epsg) text += fmt::format("{}EPSG:{}", text.empty() ? "" : ", ", *source.crs_epsg);
  if (!source.body.empty()) text += fmt::format("{}{}", text.empty() ? "" : ", ", source.body);
  if (text.empty()) text = source.crs_wkt.empty() ? "not known" : "as WKT in the metadata";
  if (!source.vertical_datum.empty()) text += ", heights above " + source.vertical_datum;
  if (source.vertical_epsg) text += fmt::format(", vertical EPSG:{}", *source.vertical_epsg);
  return text;
}

/// Those of one folder together, with what they take of the archive.
std::string describe_members(const ArchiveReader& archive) {
  struct Group {
    std::string name;
    std::int64_t members = 0;
    std::uint64_t bytes = 0;
  };
  std::vector<Group> groups;
  const auto add = [&](const std::string& path, std::int64_t members, std::uint64_t bytes) {
    const std::string folder = path.substr(0, path.find('/') + 1);
    const std::string& name = folder.empty() ? path : folder;
    auto group = std::find_if(groups.begin(), groups.end(), [&](const Group& g) { return g.name == name; });
    if (group == groups.end()) group = groups.insert(groups.end(), {name});
    group->members += members;
    group->bytes += bytes;
  };
  const std::vector<MemberTable>& tables = archive.tables();
  for (auto table = tables.begin() + 1; table != tables.end(); ++table)
    add(table->name, table->stored, table->compressed_bytes);
  for (const MemberEntry& member : archive.loose_members()) add(member.name, 1, member.compressed_bytes);
  std::string text;
  for (const Group& group : groups) {
    text += fmt::format("{}{} ({}{})", text.empty() ? "" : ", ", group.name,
                        group.name.back() == '/' ? fmt::format("{} members, ", describe_count(group.members)) : "",
                        describe_bytes(group.bytes));
  }
  return text;
}

std::string describe_options(const std::vector<std::pair<std::string, std::string>>& options) {
  constexpr std::size_t kMostShown = 60;  // WKT has thousands
  std::string text;
  for (const auto& [name, value] : options) {
    const std::string shown = value.size() > kMostShown ? value.substr(0, kMostShown) + "..." : value;
    text += fmt::format("{}--{}{}", text.empty() ? "" : " ", name, shown == "true" ? "" : " " + shown);
  }
  return text;
}

std::string describe_mosaic(const MosaicRecord& mosaic) {
  const auto shown = static_cast<std::int64_t>(mosaic.first_names.size());
  std::string names = fmt::format("{}", fmt::join(mosaic.first_names, ", "));
  if (mosaic.files > shown) names += fmt::format(" and {} more", describe_count(mosaic.files - shown));
  return fmt::format("{} files, the {} on top: {}", describe_count(mosaic.files), mosaic.overlap, names);
}

std::string describe_planes(const ArchiveReader& archive, std::uint64_t tile_bytes) {
  std::int64_t tiles = 0;
  std::uint64_t bytes = 0;
  for (const MemberTable& table : archive.tables()) {
    if (table.name.rfind("planes/", 0) != 0) continue;
    tiles += table.stored;
    bytes += table.compressed_bytes;
  }
  const PlaneInfo& planes = archive.metadata().planes;
  return fmt::format("{}, each of every {}th vertex of the one before; {} tiles, {}, {:.1f} % of the tiles'",
                     planes.count, planes.stride, describe_count(tiles), describe_bytes(bytes),
                     100.0 * static_cast<double>(bytes) / static_cast<double>(tile_bytes));
}

std::string describe_archive(const ArchiveReader& archive) {
  const Metadata& metadata = archive.metadata();
  const TileGrid& grid = metadata.grid;
  const TileShape& shape = grid.shape();
  const Quantisation& codes = metadata.quantisation;
  const SourceRecord& source = metadata.source;
  const Statistics& statistics = metadata.statistics;
  const bool metres = metadata.horizontal_unit == "metre";
  const std::string unit = metadata.vertical_unit == "unknown" ? "" : " " + metadata.vertical_unit;
  const Derived derived = derive(archive);
  std::string text;
  const auto say = [&](const char* what, const std::string& value) {
    text += fmt::format("{:<12} {}\n", what, printable(value));
  };

  say("archive",
      fmt::format("{}: {}, written by {}", archive.path(), describe_bytes(archive.size_bytes()), metadata.producer));
  const auto shard = shard_record(metadata);
  const std::int64_t tiles = shard ? (shard->end_row - shard->first_row) * grid.tile_columns() : grid.tile_count();
  say("tiles", fmt::format("{} x {} = {}, {} stored, {} wholly void", grid.tile_columns(), grid.tile_rows(),
                           describe_count(grid.tile_count()), describe_count(metadata.tiles_stored),
                           describe_count(tiles - metadata.tiles_stored)));
  if (shard) {
    say("shard", fmt::format("{} of {}, rows {} to {} of tiles; isohf merge joins them", shard->number, shard->count,
                             shard->first_row, shard->end_row - 1));
  }
  say("tile shape", fmt::format("{}x{} (C x R), {} levels, aspect {:.5f}, {} triangles", shape.columns(), shape.rows(),
                                shape.levels(), triangle_aspect(grid), describe_count(shape.triangle_count())));
  if (metadata.planes.count > 0) say("planes", describe_planes(archive, derived.tile_bytes));
  say("tile extent",
      fmt::format("{} by {}", describe_length(grid.extent_x(), metres), describe_length(grid.extent_z(), metres)));
  say("lattice", fmt::format("columns {} apart, rows {}", describe_length(2.0 * grid.sigma_x(), metres),
                             describe_length(grid.sigma_z(), metres)));
  say("covers", fmt::format("{} by {}", describe_length(grid.world_width(), metres),
                            describe_length(grid.world_height(), metres)));
  say("source in", fmt::format("x {:.6g}..{:.6g}, z {:.6g}..{:.6g}; beyond it: {}", metadata.valid.x0,
                               metadata.valid.x1, metadata.valid.z0, metadata.valid.z1, name_of(metadata.outside)));
  if (metadata.projection) say("projection", describe_projection(*metadata.projection));
  if (metadata.wraps_x) say("joins", "the East edge is the West edge");
  if (codes.type == CodeType::kF32) {
    say("elevations", "f32");
  } else {
    say("elevations", fmt::format("{}: {:.9g} + code * {:.9g}{}, worst rounding {:.4g}", to_string(codes.type),
                                  codes.offset, codes.scale, unit, statistics.worst_rounding));
  }
  if (statistics.min && statistics.max) {
    say("range", fmt::format("{:.9g} .. {:.9g}{}{}", *statistics.min, *statistics.max, unit,
                             statistics.mean ? fmt::format(", mean {:.6g}", *statistics.mean) : ""));
  } else {
    say("range", "no elevation at all");
  }
  say("vertices",
      fmt::format(
          "{} on the source's ground, {} void{}", describe_count(statistics.vertices), describe_count(statistics.voids),
          statistics.clamped > 0 ? fmt::format(", {} moved into the range", describe_count(statistics.clamped)) : ""));
  const bool is_scaled = source.z_scale != 1.0 || source.z_offset != 0.0;
  say("source",
      fmt::format("{}: {}, {} x {} {}{}{}, registered as {}", source.name, source.format, source.width, source.height,
                  source.sample_type, source.channel.empty() ? "" : ", channel " + source.channel,
                  is_scaled ? fmt::format(", elevation = sample * {:.12g} + {:.12g}", source.z_scale, source.z_offset)
                            : std::string(),
                  to_string(source.registration)));
  if (source.options && !source.options->empty()) say("read with", describe_options(*source.options));
  if (source.mosaic) say("joined from", describe_mosaic(*source.mosaic));
  say("reference", describe_crs(source));
  if (const auto place = source_place(metadata)) text += text_from(*place);
  say("filter", fmt::format("{}, acquisition {}", name_of(metadata.filter), name_of(metadata.acquisition)));
  say("size", describe_size(metadata, derived.tile_bytes));
  if (const auto info = accuracy_info(metadata)) say("error", describe_accuracy(*info, unit));
  if (const auto info = texture_info(metadata)) {
    say("textures", fmt::format("{}; from {}, {} x {} pixels, placed by {}", describe_textures(*info),
                                info->photo_name, info->photo_width, info->photo_height, info->placed_by));
  }
  if (const auto record = lossless_record(metadata)) {
    say("lossless", fmt::format("export gives the {} samples bit for bit; residuals of {}, {:.3f} bits a sample",
                                source.sample_type, describe_bytes(record->residual_bytes),
                                8.0 * static_cast<double>(record->residual_bytes) /
                                    (static_cast<double>(record->width) * static_cast<double>(record->height))));
  } else {
    say("lossless", "no: export resamples the surface");
  }
  const std::string members = describe_members(archive);
  say("members", members + (members.empty() ? "" : " beside the tiles"));
  say("content", "sha256 " + metadata.content_sha256);
  return text;
}

void print_tiles(const ArchiveReader& archive, StandardOutput& out) {
  const TileGrid& grid = archive.grid();
  const Quantisation& quantisation = archive.metadata().quantisation;
  out.write("# column row bytes minimum maximum voids\n");
  for (std::int64_t i = 0; i < grid.tile_count(); ++i) {
    const TileIndex tile = grid.tile_at(i);
    const TileEntry entry = archive.tile_entry(tile);
    if (!entry.stored) {
      out.write(fmt::format("{} {} 0 void void all\n", tile.column, tile.row));
      continue;
    }
    out.write(fmt::format("{} {} {} {:.9g} {:.9g} {}\n", tile.column, tile.row, entry.compressed_bytes,
                          elevation_of(quantisation, entry.code_min), elevation_of(quantisation, entry.code_max),
                          entry.has_voids ? "some" : "none"));
  }
}

int describe_one(const InfoOptions& options, const std::string& input, bool is_one_of_many) {
  if (!is_archive(input, options.open)) {
    if (options.tiles) {
      throw Error(ErrorCode::kInvalidArgument, "--tiles is for archives, " + input + " is none");
    }
    print_raster_info(input, options.open, options.stats, options.common, is_one_of_many);
    return kExitDone;
  }
  if (!options.for_rasters.empty()) {
    throw Error(ErrorCode::kInvalidArgument, options.for_rasters + " is for rasters, " + input + " is an archive");
  }
  const ArchiveReader archive = open_archive(input, ArchiveReader::Shards::kRead);
  print_warnings(options.common, archive.warnings());
  if (options.common.json) {
    print_json(options, archive, is_one_of_many);
    return kExitDone;
  }
  StandardOutput out(options.common);
  if (!options.common.quiet) {
    if (options.tiles) {
      print_tiles(archive, out);
    } else {
      out.write(describe_archive(archive));
    }
  }
  out.finish();
  return kExitDone;
}

int run(const InfoOptions& options) {
  const std::vector<std::string> files = list_files(options.inputs, false);
  const bool in_blocks = files.size() > 1 && !options.common.json && !options.common.quiet;
  bool is_first = true;
  return for_each_file(files, options.common, [&](const std::string& file) {
    if (in_blocks && !std::exchange(is_first, false)) {
      StandardOutput out(options.common);
      out.write("\n");
      out.finish();
    }
    return describe_one(options, file, files.size() > 1);
  });
}

}  // namespace

Run add_info(CLI::App& line, Common& common) {
  const auto kept = std::make_shared<InfoOptions>(InfoOptions{common});
  InfoOptions& options = *kept;
  positionals(line, "INPUT...", "Archives and rasters to describe: files, folders, \"patterns*\" and @lists",
              options.inputs)
      ->required();
  line.add_flag("--tiles", options.tiles, "List an archive's tiles");
  line.add_flag("--stats", options.stats, "Read all samples of a raster: range, mean, nodata");
  group(line, "Input");
  add_part_options(line, options.open);
  add_raw_option(line, options.open);
  line.footer(kInfoFooter);
  return [kept, &line] {
    kept->for_rasters = kept->stats ? "--stats" : first_given(line, {"Input"});
    return run(*kept);
  };
}

}  // namespace isohf::cli
