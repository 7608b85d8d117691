#include "isohf/convert/stages/residual_stage.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "isohf/archive/container/content_hash.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/deflate/deflate_writer.h"
#include "isohf/base/memory/memory_budget.h"
#include "isohf/base/sample.h"
#include "isohf/error.h"

namespace isohf {
namespace {

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
    std::vector<float> heights(std::min<std::size_t>(kSamplesPerResidualMember / 8, voids.size()));
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

/// SHA-256 of all samples, as LosslessRecord states it. Stage "hash".
std::string hash_of_samples(HeightSource& source, const Job& job) {
  const SourceInfo& info = source.info();
  Sha256 hash;
  std::vector<std::byte> raw;
  const std::int64_t step = rows_per_residual_member(info);
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

}  // namespace

ResidualStage::ResidualStage(const Conversion& conversion, const RowRange& tile_rows)
    : conversion_(conversion), source_(conversion.source.as_stored()) {
  const SourceFrame& frame = conversion.plan.frame;
  const TileGrid& grid = conversion.plan.grid;
  const SourceInfo& info = source_.info();
  record_.mapping = {info.sample_type, info.z_scale, info.z_offset};
  record_.width = info.width;
  record_.height = info.height;
  record_.void_values = info.void_values;
  record_.rows_per_member = rows_per_residual_member(info);
  record_.fraction_bits = FixedHeights::bits_for(conversion.quantisation, conversion.largest);
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
      grid, frame.wraps_x, conversion.quantisation, [this](TileIndex tile) { return read_tile_(tile); },
      SampleGrid{frame.width, frame.height, frame.first_sample_x, frame.first_sample_z, frame.spacing_x,
                 frame.spacing_z},
      record_, [this] { return nodes_; },
      conversion.memory.residuals_in_scratch ? ScratchFolder(conversion.job.scratch_folder) : std::nullopt);
}

RowRange ResidualStage::tile_rows_needed() const {
  if (rows_.first > rows_.last) return {0, -1};
  return surface_->tile_rows_needed(rows_.first, rows_.last - rows_.first + 1);
}

void ResidualStage::finish(ArchiveWriter& writer, const Job& job) {
  const SourceInfo& info = source_.info();
  const std::int64_t end = rows_.last + 1;
  // A shard does not pass all samples.
  const bool is_whole = around_ == nullptr;
  if (!is_whole) record_.sha256 = hash_of_samples(source_, job);
  writer.flush_tiles();
  if (conversion_.memory.residuals_in_scratch) give_back_freed_memory();
  read_tile_ = [&](TileIndex tile) {
    const bool is_beside = around_ != nullptr && around_->holds(tile);
    return is_beside ? around_->codes(tile) : writer.read_tile(tile, conversion_.quantisation);
  };
  if (!nodes_.empty() && rows_.first == 0) writer.add_member(kNodesName, nodes_, true);
  Sha256 hash;
  for (std::int64_t row = rows_.first; row < end;) {
    std::vector<ResidualBand> bands;
    for (; row < end && bands.size() < conversion_.memory.members_at_once; row += record_.rows_per_member) {
      job.throw_if_cancelled();
      ResidualBand& band = bands.emplace_back();
      const std::int64_t rows = std::min(record_.rows_per_member, info.height - row);
      band.first_row = row;
      band.predicted.resize(static_cast<std::size_t>(rows * info.width));
      band.raw.resize(band.predicted.size() * size_bytes(info.sample_type));
      source_.read_window({0, row, info.width, rows}, band.raw);
      if (is_whole) hash.add(band.raw);
      surface_->read(row, rows, band.predicted);
    }
    oneapi::tbb::parallel_for(std::size_t{0}, bands.size(),
                              [&](std::size_t i) { bands[i].encode(info, record_.mapping); });
    for (const ResidualBand& band : bands) {
      writer.add_deflated_member(residual_name(band.first_row), band.deflated, band.payload_bytes, band.payload_crc32);
      record_.residual_bytes += band.deflated.size();
    }
    job.report({"residuals", "rows", std::min(row, end) - rows_.first, end - rows_.first, writer.bytes_written()});
  }
  if (is_whole) record_.sha256 = hex(hash.finish());
}

void ResidualStage::describe(const ArchiveWriter& /*writer*/, Metadata& metadata, ConvertSummary& summary) const {
  summary.residual_bytes = record_.residual_bytes;
  metadata.extensions.emplace_back(kLosslessName, format_lossless(record_));
}

}  // namespace isohf
