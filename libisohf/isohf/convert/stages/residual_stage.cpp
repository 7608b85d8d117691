#include "isohf/convert/stages/residual_stage.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "isohf/archive/container/content_hash.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/deflate/deflate_writer.h"
#include "isohf/base/sample.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// Samples of one residual member: enough for its tables, few enough for many to be made side by side.
constexpr std::int64_t kSamplesPerMember = std::int64_t{1} << 19U;

/// Some rows of the source on their way into a member.
struct ResidualBand {
  std::int64_t first_row = 0;
  std::vector<std::byte> raw;
  std::vector<double> predicted;
  std::vector<std::byte> deflated;
  std::size_t payload_bytes = 0;
  std::uint32_t payload_crc32 = 0;

  void encode(const SourceInfo& info, const SampleMapping& mapping) {
    std::vector<float> heights(predicted.size());
    heights_from_samples(info, 0.0, raw, heights);
    std::vector<char> voids(heights.size());
    std::transform(heights.begin(), heights.end(), voids.begin(), [](float h) { return std::isnan(h) ? 1 : 0; });
    const ResidualPayload payload = encode_residuals(mapping, info.width, raw, voids, predicted);
    DeflateWriter writer(deflated);
    std::size_t from = 0;
    for (const std::size_t end : payload.part_ends) {
      writer.add(std::span(payload.bytes).subspan(from, end - from));
      from = end;
    }
    writer.finish();
    payload_bytes = payload.bytes.size();
    payload_crc32 = crc32(payload.bytes);
  }
};

std::int64_t rows_per_member(const SourceInfo& info) {
  return std::clamp<std::int64_t>(kSamplesPerMember / info.width, 8, info.height + 8);
}

}  // namespace

std::uint64_t residual_stage_memory_bytes(const SourceInfo& info, const Plan& plan, int threads,
                                          std::size_t members_at_once) {
  const TileShape& shape = plan.grid.shape();
  const auto width = static_cast<double>(info.width);
  const auto rows = static_cast<double>(std::min(rows_per_member(info), info.height));
  const auto sample = static_cast<double>(size_bytes(info.sample_type));
  // Raw samples, predictions and what they deflate to; in each thread also heights, voids, streams and payload.
  const double members =
      std::min(static_cast<double>(members_at_once), std::ceil(static_cast<double>(info.height) / rows));
  const double bands = members * rows * width * (2.0 * sample + 8.0);
  const double encoding = threads * rows * width * (5.0 + 5.0 * sample);
  if (plan.frame.warp) {
    // A position for each sample of a member, tiles that are kept, and one in each thread.
    const double tile_bytes = 8.0 * static_cast<double>(shape.stored_vertex_count());
    const double mesh = 16.0 * static_cast<double>(PositionMesh::value_count(info.width, info.height));
    return static_cast<std::uint64_t>(bands + encoding + rows * width * 16.0 + mesh + threads * 2.0 * tile_bytes +
                                      static_cast<double>(SamplePredictor::kTileBytes));
  }
  const double tile_rows = std::ceil(rows * plan.frame.spacing_z / plan.grid.extent_z()) + 1.0;
  const double tiles = tile_rows * static_cast<double>(plan.grid.tile_columns()) * 8.0 *
                       static_cast<double>(shape.stored_vertex_count());
  const double lattice_rows = rows * plan.frame.spacing_z / plan.grid.sigma_z() + 2.0 * SplinePredictor::kReach + 2.0;
  return static_cast<std::uint64_t>(bands + encoding + tiles + lattice_rows * width * 17.0);
}

LosslessRecord write_residuals(HeightSource& source, const SourceFrame& frame, const TileGrid& grid,
                               const Quantisation& quantisation, std::size_t members_at_once, ArchiveWriter& writer,
                               const Job& job) {
  const SourceInfo& info = source.info();
  LosslessRecord record;
  record.mapping = {info.sample_type, info.z_scale, info.z_offset};
  record.width = info.width;
  record.height = info.height;
  record.void_values = info.void_values;
  record.rows_per_member = rows_per_member(info);
  writer.flush_tiles();
  const TileStatistics stored = writer.statistics();
  record.fraction_bits = FixedHeights::bits_for(quantisation, std::max(std::abs(stored.min), std::abs(stored.max)));
  std::vector<std::byte> nodes;
  if (frame.warp) {
    const ExactWarp warp(*frame.warp);
    const PlaceMesh places(info.width, info.height, grid, [&](double column, double row) {
      return warp.world_from_source({column, row});
    });
    record.prediction = SamplePrediction::kTriangles;
    nodes = places.bytes();
    writer.add_member(kNodesName, nodes, true);
  }
  const ReadTiles read_tiles = [&](std::span<const TileIndex> tiles) {
    std::vector<TileCodes> codes;
    for (const TileIndex tile : tiles) codes.push_back(writer.read_tile(tile, quantisation));
    return codes;
  };
  SamplePredictor surface(
      grid, frame.wraps_x, quantisation, read_tiles,
      {frame.width, frame.height, frame.first_sample_x, frame.first_sample_z, frame.spacing_x, frame.spacing_z}, record,
      [&](const char*) { return nodes; });
  Sha256 hash;
  for (std::int64_t row = 0; row < info.height;) {
    std::vector<ResidualBand> bands;
    for (; row < info.height && bands.size() < members_at_once; row += record.rows_per_member) {
      job.throw_if_cancelled();
      ResidualBand& band = bands.emplace_back();
      const std::int64_t rows = std::min(record.rows_per_member, info.height - row);
      band.first_row = row;
      band.predicted.resize(static_cast<std::size_t>(rows * info.width));
      band.raw.resize(band.predicted.size() * size_bytes(info.sample_type));
      source.read_window({0, row, info.width, rows}, band.raw);
      hash.add(band.raw);
      surface.read(row, rows, band.predicted);
    }
    oneapi::tbb::parallel_for(std::size_t{0}, bands.size(),
                              [&](std::size_t i) { bands[i].encode(info, record.mapping); });
    for (const ResidualBand& band : bands) {
      writer.add_deflated_member(residual_name(band.first_row), band.deflated, band.payload_bytes, band.payload_crc32);
      record.residual_bytes += band.deflated.size();
    }
    job.report({"residuals", "rows", std::min(row, info.height), info.height, writer.bytes_written()});
  }
  record.sha256 = hex(hash.finish());
  return record;
}

}  // namespace isohf
