#include "commands/export_mesh.h"

#include <fmt/format.h>

#include <memory>
#include <vector>

#include "formats/mesh/create_mesh.h"
#include "isohf/archive/textures/texture_info.h"
#include "isohf/base/arena.h"
#include "isohf/error.h"
#include "isohf/parts.h"
#include "isohf/projection/crs/source_system.h"
#include "isohf/restore/ground_scale.h"
#include "isohf/surface.h"
#include "open_archive.h"
#include "options/describe.h"
#include "output/output_kinds.h"
#include "output/report.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

/// What the file states: where its corner is, and in which units.
MeshSpec spec_of(const ArchiveReader& archive, const MeshPlan& plan) {
  const Metadata& metadata = archive.metadata();
  MeshSpec spec;
  spec.name = metadata.source.name;
  spec.producer = metadata.producer;
  spec.unit = metadata.horizontal_unit;
  spec.elevation_scale = plan.elevation_scale;
  spec.pieces = plan.tiles.count();
  const SampleGrid grid = natural_grid(metadata);
  if (const auto place = grid_georeference(metadata, grid)) {
    spec.crs = name_of(*place);
    spec.origin = {place->origin_x + (plan.corner.x - grid.first_x) / grid.spacing_x * place->spacing_x,
                   place->origin_y - (plan.corner.z - grid.first_z) / grid.spacing_z * place->spacing_y};
  }
  if (const WorldGeoreference world(metadata); world.has_geo()) spec.origin_geo = world.geo_from_world(plan.corner);
  return spec;
}

}  // namespace

int export_mesh(const ExportMeshOptions& options, const Common& common, const WorkOptions& work) {
  ArchiveReader archive = open_with_source(options.archive);
  check_mesh_output({options.archive}, options.output, options.overwrite);
  const Metadata& metadata = archive.metadata();
  if (metadata.horizontal_unit != "metre" && metadata.source.crs_unit == "degree") {
    throw Error(ErrorCode::kInvalidArgument, {options.archive, "lies on degrees, and its elevations do not", "",
                                              "a mesh needs lengths: convert it with --to-crs auto"});
  }
  MeshRequest request = options.mesh;
  request.elevation_scale = ground_scale(metadata).elevation * options.exaggeration;
  const std::optional<TextureInfo> textures = texture_info(metadata);
  if (options.bbox) {
    request.tiles = tiles_touching(metadata.grid, ground_in_box(archive, *options.bbox, AcrossEnds::kRefused));
  }

  ProgressDisplay display(common, work.progress);
  const Job job = job_from(work, display);
  MeshPlan plan;
  std::unique_ptr<MeshSink> sink;
  std::int64_t pieces = 0;
  Arena(job).execute([&] {
    plan = plan_mesh(archive, request, job);
    const bool has_pictures = textures && plan.plane == 0 && is_textured_mesh_name(options.output);
    if (has_pictures) plan.texture_span = TextureSpan::kTile;
    MeshSpec spec = spec_of(archive, plan);
    spec.overwrite = options.overwrite;
    sink = create_mesh(options.output, spec);
    const auto take = [&](const MeshPiece& piece) {
      std::optional<std::vector<std::byte>> picture;
      if (has_pictures) picture = archive.read_member(texture_name(*textures, piece.tile, 0));
      sink->write(piece, picture.value_or(std::vector<std::byte>()));
      ++pieces;
    };
    read_mesh(archive, plan, take, job);
    sink->finish();
  });
  display.clear();

  const int level = plan.level;
  Report report;
  report.add("archive", options.archive);
  report.add("output", options.output, "mesh",
             fmt::format("{}: {} triangles, {} vertices", options.output, describe_count(sink->triangles()),
                         describe_count(sink->vertices())));
  report.add("triangles", sink->triangles());
  report.add("vertices", sink->vertices());
  report.add("tiles", pieces, "tiles",
             fmt::format("{} of {}", pieces, plan.plane == 0 ? "full size" : fmt::format("overview {}", plan.plane)));
  report.add("overview", plan.plane);
  report.add("level", plan.levels.empty() ? nlohmann::ordered_json(level) : nlohmann::ordered_json(), "level",
             plan.levels.empty() ? std::to_string(level) : "of each tile by --max-error");
  report.print(common);
  return kExitDone;
}

}  // namespace isohf::cli
