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
constexpr std::size_t kSamplesPerMember = std::size_t{1} << 19U;

/// Some rows of the source on their way into a member.
struct ResidualBand {
  std::int64_t first_row = 0;
  std::vector<std::byte> raw;
  std::vector<double> predicted;
  std::vector<std::byte> deflated;
  std::size_t payload_bytes = 0;
  std::uint32_t payload_crc32 = 0;

  void encode(const SourceInfo& info, const SampleMapping& mapping) {
    std::vector<char> voids(predicted.size());
    std::vector<float> heights(std::min(kSamplesPerMember / 8, voids.size()));
    for (std::size_t from = 0; from < voids.size(); from += heights.size()) {
      heights.resize(std::min(heights.size(), voids.size() - from));
      const std::size_t bytes = size_bytes(info.sample_type);
      heights_from_samples(info, 0.0, std::span(raw).subspan(from * bytes, heights.size() * bytes), heights);
      std::transform(heights.begin(), heights.end(), voids.begin() + static_cast<std::ptrdiff_t>(from),
                     [](float h) { return std::isnan(h) ? 1 : 0; });
    }
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
  return std::clamp<std::int64_t>(static_cast<std::int64_t>(kSamplesPerMember) / info.width, 8, info.height + 8);
}

}  // namespace

std::uint64_t residual_stage_memory_bytes(const SourceInfo& info, const Plan& plan, int threads,
                                          std::size_t members_at_once, bool in_scratch) {
  const TileShape& shape = plan.grid.shape();
  const auto width = static_cast<double>(info.width);
  const auto rows = static_cast<double>(std::min(rows_per_member(info), info.height));
  const auto sample = static_cast<double>(size_bytes(info.sample_type));
  // Raw samples, predictions and what they deflate to; in each thread also voids, streams and payload.
  const double members =
      std::min(static_cast<double>(members_at_once), std::ceil(static_cast<double>(info.height) / rows));
  const double bands = members * rows * width * (2.0 * sample + 8.0);
  const double encoding = std::min<double>(threads, members) * rows * width * (1.0 + 5.0 * sample);
  if (plan.frame.warp) {
    // A position for each sample of a member, tiles that are kept, and one in each thread.
    const double tile_bytes = 8.0 * static_cast<double>(shape.stored_vertex_count());
    const double mesh = 16.0 * static_cast<double>(PlaceMesh::value_count(info.width, info.height));
    return static_cast<std::uint64_t>(bands + encoding + rows * width * 16.0 + mesh + threads * 2.0 * tile_bytes +
                                      static_cast<double>(SamplePredictor::kTileBytes));
  }
  const double lattice_rows = rows * plan.frame.spacing_z / plan.grid.sigma_z();
  return static_cast<std::uint64_t>(
             bands + std::max(encoding, SplinePredictor::lines_bytes(plan.grid, threads, in_scratch)) +
             SplinePredictor::rows_bytes(plan.grid, info.width, lattice_rows, threads, in_scratch)) +
         residual_stage_kept_bytes(info, plan, in_scratch);
}

std::uint64_t residual_stage_kept_bytes(const SourceInfo& info, const Plan& plan, bool in_scratch) {
  return plan.frame.warp ? 0 : SplinePredictor::kept_bytes(info.width, in_scratch);
}

ResidualStage::ResidualStage(HeightSource& source, const SourceFrame& frame, const TileGrid& grid,
                             const Quantisation& quantisation, double largest, const RowRange& tile_rows,
                             const ScratchFolder& scratch)
    : source_(source) {
  const SourceInfo& info = source.info();
  record_.mapping = {info.sample_type, info.z_scale, info.z_offset};
  record_.width = info.width;
  record_.height = info.height;
  record_.void_values = info.void_values;
  record_.rows_per_member = rows_per_member(info);
  record_.fraction_bits = FixedHeights::bits_for(quantisation, largest);
  rows_ = residual_rows_at(record_, grid.tile_rows(), tile_rows);
  if (frame.warp) {
    const ExactWarp warp(*frame.warp);
    const PlaceMesh places(info.width, info.height, grid, [&](double column, double row) {
      return warp.world_from_source({column, row});
    });
    record_.prediction = SamplePrediction::kTriangles;
    nodes_ = places.bytes();
  }
  surface_.emplace(
      grid, frame.wraps_x, quantisation, [this](TileIndex tile) { return read_tile_(tile); },
      SampleGrid{frame.width, frame.height, frame.first_sample_x, frame.first_sample_z, frame.spacing_x,
                 frame.spacing_z},
      record_, [this] { return nodes_; }, scratch);
}

RowRange ResidualStage::tile_rows_needed() const {
  if (rows_.first > rows_.last) return {0, -1};
  return surface_->tile_rows_needed(rows_.first, rows_.last - rows_.first + 1);
}

LosslessRecord ResidualStage::write(const ReadTile& read_tile, std::size_t members_at_once,
                                    const std::optional<std::string>& sha256, ArchiveWriter& writer, const Job& job) {
  const SourceInfo& info = source_.info();
  const std::int64_t end = rows_.last + 1;
  LosslessRecord record = record_;
  read_tile_ = read_tile;
  if (!nodes_.empty() && rows_.first == 0) writer.add_member(kNodesName, nodes_, true);
  Sha256 hash;
  for (std::int64_t row = rows_.first; row < end;) {
    std::vector<ResidualBand> bands;
    for (; row < end && bands.size() < members_at_once; row += record.rows_per_member) {
      job.throw_if_cancelled();
      ResidualBand& band = bands.emplace_back();
      const std::int64_t rows = std::min(record.rows_per_member, info.height - row);
      band.first_row = row;
      band.predicted.resize(static_cast<std::size_t>(rows * info.width));
      band.raw.resize(band.predicted.size() * size_bytes(info.sample_type));
      source_.read_window({0, row, info.width, rows}, band.raw);
      if (!sha256) hash.add(band.raw);
      surface_->read(row, rows, band.predicted);
    }
    oneapi::tbb::parallel_for(std::size_t{0}, bands.size(),
                              [&](std::size_t i) { bands[i].encode(info, record.mapping); });
    for (const ResidualBand& band : bands) {
      writer.add_deflated_member(residual_name(band.first_row), band.deflated, band.payload_bytes, band.payload_crc32);
      record.residual_bytes += band.deflated.size();
    }
    job.report({"residuals", "rows", std::min(row, end) - rows_.first, end - rows_.first, writer.bytes_written()});
  }
  record.sha256 = sha256 ? *sha256 : hex(hash.finish());
  return record;
}

std::string hash_of_samples(HeightSource& source, const Job& job) {
  const SourceInfo& info = source.info();
  Sha256 hash;
  std::vector<std::byte> raw;
  const std::int64_t step = rows_per_member(info);
  for (std::int64_t row = 0; row < info.height; row += step) {
    job.throw_if_cancelled();
    const std::int64_t rows = std::min(step, info.height - row);
    raw.resize(static_cast<std::size_t>(rows * info.width) * size_bytes(info.sample_type));
    source.read_window({0, row, info.width, rows}, raw);
    hash.add(raw);
    job.report({"hash", "rows", row + rows, info.height});
  }
  return hex(hash.finish());
}

}  // namespace isohf
