#include "isohf/verify/accuracy/ortho_rows.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "isohf/archive/codec/quantise.h"
#include "isohf/base/assert.h"
#include "isohf/restore/archive_geometry.h"
#include "isohf/verify/accuracy/plain_coding.h"

namespace isohf {
namespace {

constexpr std::int64_t kTileSide = 256;

ElevationRange code_range(const Metadata& surface, double datum) {
  const CodeLimits limits = code_limits(surface);
  return {limits.lowest - datum, limits.highest - datum};
}

/// Appends columns [first, first + count) of a row.
void append(const TileCodes& row, std::size_t first, std::size_t count, TileCodes& tile) {
  const auto at = static_cast<std::ptrdiff_t>(first);
  const auto end = static_cast<std::ptrdiff_t>(first + count);
  if (row.type == CodeType::kF32) {
    tile.heights.insert(tile.heights.end(), row.heights.begin() + at, row.heights.begin() + end);
  } else {
    tile.codes.insert(tile.codes.end(), row.codes.begin() + at, row.codes.begin() + end);
  }
}

}  // namespace

OrthoGround OrthoGround::make(const Metadata& surface, const Kernel& kernel, double datum, double spacing) {
  const SourceRecord& source = surface.source;
  const Registration registration = source.registration;
  const Outside outside = known(surface.outside, "outside");
  const double continued = kContinuedSteps * spacing;
  const SourceAxis x(source.width, source.first_sample_x, source.spacing_x, registration, outside, continued);
  const SourceAxis z(source.height, source.first_sample_z, source.spacing_z, registration, outside, continued);
  return {surface, x, z, kernel, RowSampler(x, z, kernel, code_range(surface, datum)), datum};
}

OrthoRows::OrthoRows(const OrthoGround& ground, double spacing, OrthoPhase phase, bool is_coded)
    : ground_(ground),
      spacing_(spacing),
      first_x_(-phase.x * spacing),
      first_z_(-phase.z * spacing),
      columns_(2 + static_cast<std::int64_t>((ground.surface.grid.world_width() - first_x_) / spacing)),
      rows_(2 + static_cast<std::int64_t>((ground.surface.grid.world_height() - first_z_) / spacing)),
      is_coded_(is_coded) {
  std::vector<double> world_x(static_cast<std::size_t>(columns_));
  for (std::size_t c = 0; c < world_x.size(); ++c) world_x[c] = first_x_ + static_cast<double>(c) * spacing_;
  taps_ = make_column_taps(ground.axis_x, ground.kernel, world_x);
}

OrthoRows::Place OrthoRows::place(double world, double first, std::int64_t count) const {
  const double at = (world - first) / spacing_;
  const std::int64_t index = std::clamp<std::int64_t>(static_cast<std::int64_t>(std::floor(at)), 0, count - 2);
  return {index, std::clamp(at - static_cast<double>(index), 0.0, 1.0)};
}

void OrthoRows::open(double world_z, double world_end) {
  const std::int64_t first = row_at(world_z).index;
  end_row_ = std::max(end_row_, std::isinf(world_end) ? rows_ : row_at(world_end).index + 2);
  while (!kept_.empty() && first_row_ < first) {
    kept_.pop_front();
    ++first_row_;
  }
  kept_.resize(static_cast<std::size_t>(end_row_ - first_row_));
  clamped_.assign(static_cast<std::size_t>(opened()), 0);
  if (is_coded_) codes_.resize(codes_.size() + clamped_.size());
}

void OrthoRows::add_rows_needed(RowRange& range) const {
  for (std::int64_t row = filled_row_; row < end_row_; ++row) {
    ground_.sampler.add_rows_needed(first_z_ + static_cast<double>(row) * spacing_, range);
  }
}

void OrthoRows::fill(std::int64_t index, const SourceBand& band, RowSampler::Scratch& scratch) {
  const std::int64_t row = filled_row_ + index;
  std::vector<float> heights(static_cast<std::size_t>(columns_));
  ground_.sampler.sample(band, first_z_ + static_cast<double>(row) * spacing_, taps_, scratch, heights);
  TileCodes codes;
  const Quantisation& quantisation = ground_.surface.quantisation;
  const QuantiserCounts counts = quantise(quantisation, code_limits(ground_.surface), ground_.datum, heights, codes);
  clamped_[static_cast<std::size_t>(index)] = counts.below + counts.above;
  kept_[static_cast<std::size_t>(row - first_row_)] = elevations_of(codes, quantisation);
  if (is_coded_) codes_[codes_.size() - static_cast<std::size_t>(opened() - index)] = std::move(codes);
}

void OrthoRows::close() {
  filled_row_ = end_row_;
  for (const std::int64_t count : clamped_) clamped_total_ += count;
  while (static_cast<std::int64_t>(codes_.size()) >= kTileSide) code_tiles(kTileSide);
  if (end_row_ == rows_ && !codes_.empty()) code_tiles(static_cast<std::int64_t>(codes_.size()));
}

void OrthoRows::code_tiles(std::int64_t rows) {
  // As many rows and columns as the ground holds spacings: the next ground's first vertices are not this one's.
  const auto spacings = [&](double length) { return std::max(std::llround(length / spacing_), 1LL); };
  const std::int64_t columns = std::min<std::int64_t>(spacings(ground_.surface.grid.world_width()), columns_);
  const std::int64_t wanted = spacings(ground_.surface.grid.world_height()) - coded_rows_;
  coded_rows_ += rows;
  const auto tile_rows = static_cast<std::size_t>(std::clamp<std::int64_t>(wanted, 0, rows));
  std::vector<std::uint64_t> bytes(static_cast<std::size_t>((columns + kTileSide - 1) / kTileSide));
  oneapi::tbb::parallel_for(std::size_t{0}, bytes.size(), [&](std::size_t t) {
    const auto first = static_cast<std::int64_t>(t) * kTileSide;
    const std::int64_t width = std::min(kTileSide, columns - first);
    TileCodes tile;
    tile.type = ground_.surface.quantisation.type;
    for (std::size_t r = 0; r < tile_rows; ++r) {
      append(codes_[r], static_cast<std::size_t>(first), static_cast<std::size_t>(width), tile);
    }
    if (tile_rows > 0) bytes[t] = plainly_coded_bytes(tile, std::vector<std::int64_t>(tile_rows, width));
  });
  for (const std::uint64_t tile : bytes) plain_bytes_ += tile;
  codes_.erase(codes_.begin(), codes_.begin() + rows);
}

}  // namespace isohf
