#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "isohf/restore/point_sampler.h"
#include "isohf/restore/predict/fixed_point.h"
#include "isohf/restore/predict/place_mesh.h"
#include "isohf/restore/predict/spline_predictor.h"
#include "isohf/restore/residual_codec.h"
#include "isohf/sampling/source/source_band.h"
#include "isohf/surface.h"

namespace isohf {

/// The metadata's member beside the residual members: a LosslessRecord.
inline constexpr const char* kLosslessName = "lossless";
/// Its JSON text.
[[nodiscard]] std::string format_lossless(const LosslessRecord& record);

/// "residual/00000000": the member that starts with source row `first_row`.
[[nodiscard]] std::string residual_name(std::int64_t first_row);

/// Of archives that are cut by rows of tiles each member belongs to one row, evenly: the source's rows that belong to some
/// rows of tiles. Empty where there are more rows of tiles than members.
[[nodiscard]] RowRange residual_rows_at(const LosslessRecord& record, std::int64_t all_tile_rows,
                                        const RowRange& tile_rows);

/// Where the samples of a source that was projected lie: a PlaceMesh's bytes.
inline constexpr const char* kNodesName = "residual/nodes";
/// Whether a member holds residuals.
[[nodiscard]] bool is_residual(const std::string& name);

/// Predicts the samples of a source, row by row from North to South: on its own grid, or at positions of their own.
class SamplePredictor {
 public:
  /// What tiles under samples with places of their own take at most, beside one tile a thread.
  static constexpr std::uint64_t kTileBytes = std::uint64_t{32} << 20U;

  /// As the record says; `read` gives the bytes of the nodes' member, nullopt if there is none.
  using ReadNodes = std::function<std::optional<std::vector<std::byte>>()>;
  SamplePredictor(const TileGrid& grid, bool wraps_x, const Quantisation& quantisation, ReadTile read_tile,
                  const SampleGrid& samples, const LosslessRecord& record, const ReadNodes& read,
                  const ScratchFolder& scratch = {});

  /// The rows of tiles that read() reads; none where there are none under the samples.
  [[nodiscard]] RowRange tile_rows_needed(std::int64_t first, std::int64_t rows) const;
  /// As GridSampler::read.
  void read(std::int64_t first, std::int64_t rows, std::span<double> predicted);

 private:
  [[nodiscard]] std::vector<FixedPlace> places(std::int64_t first, std::int64_t rows) const;

  std::int64_t width_;
  TileGrid grid_;
  FixedHeights heights_;
  std::optional<SplinePredictor> spline_;
  std::optional<PointSampler> points_;
  std::optional<PlaceMesh> nodes_;
};

}  // namespace isohf
