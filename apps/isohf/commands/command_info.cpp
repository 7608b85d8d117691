/// isohf info: what an archive or a raster holds.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <bit>
#include <cmath>
#include <memory>
#include <optional>

#include "commands/command.h"
#include "input/input_files.h"
#include "input/options_source.h"
#include "isohf/archive.h"
#include "isohf/archive/metadata/shard_record.h"
#include "isohf/archive/textures/texture_info.h"
#include "isohf/archive/tile/quantise.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "isohf/restore/source_size.h"
#include "isohf/surface.h"
#include "open_archive.h"
#include "options/command_line.h"
#include "options/describe.h"
#include "options/work_options.h"
#include "output/accuracy_output.h"
#include "output/json_output.h"
#include "output/lattice_json.h"
#include "output/raster_info.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

constexpr const char* kInfoFooter =
    R"(For an archive, its index and metadata are read, but no tile. For a raster, samples are read only with --stats.
-v prints more, --json all.

Examples:
  isohf info dem.isohf
  isohf info *.tif *.isohf --json     one JSON object a line
  isohf info dem.tif --stats          with the range of elevations and how many samples are nodata
  isohf info dem.isohf --tiles        one line a tile: column row bytes minimum maximum voids)";

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

/// Writes one tile at a time: there may be a million.
void print_tiles(const ArchiveReader& archive, const InfoOptions& options, const ordered_json& document,
                 bool is_one_of_many) {
  const bool is_json = options.common.json;
  const TileGrid& grid = archive.grid();
  const Quantisation& codes = archive.metadata().quantisation;
  const auto number = [](double value) { return std::isfinite(value) ? fmt::format("{}", value) : "null"; };
  StandardOutput out(options.common);
  if (is_json) {
    std::string text = is_one_of_many ? json_line(document) : json_text(document);
    text.resize(text.find_last_not_of("}\n ") + 1);
    out.write(text + ",\"tiles\":[");
  } else {
    out.write("# column row bytes minimum maximum voids\n");
  }
  for (std::int64_t i = 0; i < grid.tile_count(); ++i) {
    const TileIndex tile = grid.tile_at(i);
    const TileEntry entry = archive.tile_entry(tile);
    const double least = elevation_of(codes, entry.code_min);
    const double most = elevation_of(codes, entry.code_max);
    if (!is_json && !entry.stored) {
      out.write(fmt::format("{} {} 0 void void all\n", tile.column, tile.row));
    } else if (!is_json) {
      out.write(fmt::format("{} {} {} {:.9g} {:.9g} {}\n", tile.column, tile.row, entry.compressed_bytes, least, most,
                            entry.has_voids ? "some" : "none"));
    } else {
      out.write(fmt::format(R"({}{}{{"column":{},"row":{},"stored":{})", i > 0 ? "," : "", is_one_of_many ? "" : "\n  ",
                            tile.column, tile.row, entry.stored));
      if (entry.stored) {
        out.write(fmt::format(R"(,"offset_bytes":{},"compressed_bytes":{},"min":{},"max":{},"has_voids":{})",
                              entry.offset_bytes, entry.compressed_bytes, number(least), number(most),
                              entry.has_voids));
      }
      out.write("}");
    }
  }
  if (is_json) out.write("]}\n");
  out.finish();
}

void add_source(const Metadata& metadata, Report& report) {
  const SourceRecord& source = metadata.source;
  report.line("source", fmt::format("{}: {}, {} x {} {}{}, {}", source.name, source.format, source.width, source.height,
                                    source.sample_type, source.channel.empty() ? "" : ", channel " + source.channel,
                                    to_string(source.registration)));
  if (source.mosaic) {
    const MosaicRecord& mosaic = *source.mosaic;
    const auto more = mosaic.files - static_cast<std::int64_t>(mosaic.first_names.size());
    report.detail("joined from", fmt::format("{} files, the {} on top: {}{}", describe_count(mosaic.files),
                                             mosaic.overlap, fmt::join(mosaic.first_names, ", "),
                                             more > 0 ? fmt::format(" and {} more", describe_count(more)) : ""));
  }
  if (source.z_scale != 1.0 || source.z_offset != 0.0) {
    report.detail("scale", fmt::format("elevation = sample * {:.12g} + {:.12g}", source.z_scale, source.z_offset));
  }
  report.line("reference", describe_reference(source_georeference(source).system));
  add_place(source_place(metadata), report);
}

void add_surface(const Metadata& metadata, Report& report) {
  const TileGrid& grid = metadata.grid;
  const TileShape& shape = grid.shape();
  const Quantisation& codes = metadata.quantisation;
  const Statistics& statistics = metadata.statistics;
  const WorldBounds& valid = metadata.valid;
  const bool metres = metadata.horizontal_unit == "metre";
  const std::string unit = metadata.vertical_unit == "unknown" ? "" : " " + metadata.vertical_unit;
  if (metadata.projection) report.line("projection", describe_projection(*metadata.projection));
  report.line("extent",
              fmt::format("{} by {}; columns {} apart, rows {}{}", describe_length(valid.x1 - valid.x0, metres),
                          describe_length(valid.z1 - valid.z0, metres), describe_length(2.0 * grid.sigma_x(), metres),
                          describe_length(grid.sigma_z(), metres),
                          metadata.wraps_x ? "; the East edge joins the West edge" : ""));
  report.line(
      "elevations",
      fmt::format("{}; {}",
                  statistics.min && statistics.max ? fmt::format("{:.9g} .. {:.9g}{}, mean {:.6g}", *statistics.min,
                                                                 *statistics.max, unit, statistics.mean.value_or(0.0))
                                                   : "none at all",
                  codes.type == CodeType::kF32
                      ? to_string(codes.type)
                      : fmt::format("{} in steps of {:.9g}", to_string(codes.type), codes.scale)));
  if (statistics.voids > 0) {
    report.line("nodata", fmt::format("{} of {} vertices", describe_count(statistics.voids),
                                      describe_count(statistics.vertices)));
  }
  const auto shard = shard_record(metadata);
  const std::int64_t tiles = shard ? (shard->end_row - shard->first_row) * grid.tile_columns() : grid.tile_count();
  const std::int64_t empty = tiles - metadata.tiles_stored;
  report.line("tiles", fmt::format("{} x {} of {}x{} vertices (C x R), {} levels{}", grid.tile_columns(),
                                   grid.tile_rows(), shape.columns(), shape.rows(), shape.levels(),
                                   empty > 0 ? fmt::format("; {} without elevations", describe_count(empty)) : ""));
  if (shard) {
    report.line("shard", fmt::format("{} of {}, rows {} to {} of tiles; isohf merge joins them", shard->number,
                                     shard->count, shard->first_row, shard->end_row - 1));
  }
  report.detail("tile extent", fmt::format("{} by {}", describe_length(grid.extent_x(), metres),
                                           describe_length(grid.extent_z(), metres)));
  report.detail("rounding", fmt::format("worst {:.4g}{}, {} vertices clamped", statistics.worst_rounding, unit,
                                        describe_count(statistics.clamped)));
  report.detail("filter", fmt::format("{}, acquisition {}", name_of(metadata.filter), name_of(metadata.acquisition)));
}

/// What is stored besides elevations, and how much all of it takes.
void add_size(const ArchiveReader& archive, Report& report) {
  const Metadata& metadata = archive.metadata();
  const std::uint64_t tile_bytes = archive.tables().front().compressed_bytes;
  const SizeBesideSource size(metadata, tile_bytes);
  const std::string unit = metadata.vertical_unit == "unknown" ? "" : " " + metadata.vertical_unit;
  const auto lossless = lossless_record(metadata);
  report.add("lossless", lossless.has_value());
  report.add("tile_bytes", tile_bytes, "size", describe_size(metadata, tile_bytes));
  report.add("lattice_samples", archive.grid().shape().stored_vertex_count() * archive.grid().tile_count());
  report.add("source_samples", size.source_samples);
  report.add("source_bytes", size.source_bytes);
  report.add("bits_per_source_sample", size.bits_per_source_sample);
  report.add("ratio_to_source", size.ratio_to_source);
  const auto bytes_in = [&](const char* folder) {
    std::uint64_t bytes = 0;
    for (const MemberTable& table : archive.tables()) {
      if (table.name.starts_with(folder)) bytes += table.compressed_bytes;
    }
    return bytes;
  };
  if (metadata.planes.count > 0) {
    report.line("overviews", fmt::format("{}, each of every {}th vertex of the one before; {}", metadata.planes.count,
                                         metadata.planes.stride, describe_bytes(bytes_in("planes/"))));
  }
  if (const std::uint64_t bytes = bytes_in("seeds/"); bytes > 0) report.line("shadow seeds", describe_bytes(bytes));
  if (const auto info = accuracy_info(metadata)) report.line("error", describe_accuracy(*info, unit));
  if (const auto info = texture_info(metadata)) {
    report.line("textures", fmt::format("{}; from {}, {} x {} pixels, placed by {}", describe_textures(*info),
                                        info->photo_name, info->photo_width, info->photo_height, info->placed_by));
  }
  if (lossless) {
    report.line("lossless", fmt::format("export gives the {} samples bit for bit; residuals of {}",
                                        metadata.source.sample_type, describe_bytes(lossless->residual_bytes)));
  }
}

Report describe_archive(const ArchiveReader& archive) {
  const Metadata& metadata = archive.metadata();
  Report report;
  report.add(
      "archive", archive.path(), "archive",
      fmt::format("{}: {}, written by {}", archive.path(), describe_bytes(archive.size_bytes()), metadata.producer));
  report.add("bytes", archive.size_bytes());
  report.add("metadata", ordered_json::parse(archive.metadata_json()));
  report.add("shape", json_from(archive.grid().shape()));
  report.add("grid", json_from(archive.grid()));
  add_source(metadata, report);
  add_surface(metadata, report);
  add_size(archive, report);
  report.add("warnings", json_from(archive.warnings()));
  ordered_json tables = ordered_json::array();
  for (const MemberTable& table : archive.tables()) {
    tables.push_back({{"name", table.name},
                      {"columns", table.columns},
                      {"rows", table.rows},
                      {"stored", table.stored},
                      {"compressed_bytes", table.compressed_bytes}});
  }
  report.add("tables", tables);
  report.detail("content", "sha256 " + metadata.content_sha256);
  return report;
}

void describe(const InfoOptions& options, const std::string& input, bool is_one_of_many) {
  const Common& common = options.common;
  if (!is_archive(input, options.open)) {
    if (options.tiles) {
      throw Error(ErrorCode::kInvalidArgument, "--tiles is for archives, " + input + " is a raster");
    }
    ProgressDisplay display(common, ProgressMode::kAuto);
    const Job job = job_from({}, display);
    const RasterInfo raster = describe_raster(input, options.open, options.stats ? &job : nullptr);
    display.clear();
    print_warnings(common, raster.warnings);
    return raster.report.print(common, is_one_of_many);
  }
  if (!options.for_rasters.empty()) {
    throw Error(ErrorCode::kInvalidArgument, options.for_rasters + " is for rasters, " + input + " is an archive");
  }
  const ArchiveReader archive = open_archive(input, ArchiveReader::Shards::kRead);
  print_warnings(common, archive.warnings());
  const Report report = describe_archive(archive);
  if (!options.tiles || (common.quiet && !common.json)) return report.print(common, is_one_of_many);
  print_tiles(archive, options, report.json(), is_one_of_many);
}

int run(const InfoOptions& options) {
  const std::vector<std::string> files = list_files(options.inputs, false);
  bool is_next = false;
  return for_each_file(files, options.common, [&](const std::string& file) {
    StandardOutput out(options.common);
    if (is_next && !options.common.json && !options.common.quiet) out.write("\n");
    out.finish();
    is_next = true;
    describe(options, file, files.size() > 1);
    return kExitDone;
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
  line.add_flag("--stats", options.stats, "Read all samples of a raster for their range, mean and nodata");
  group(line, "Input");
  add_part_options(line, options.open);
  add_scale_options(line, options.open);
  add_raw_option(line, options.open);
  line.footer(kInfoFooter);
  return [kept, &line] {
    kept->for_rasters = kept->stats ? "--stats" : first_given(line, {"Input"});
    return run(*kept);
  };
}

}  // namespace isohf::cli
