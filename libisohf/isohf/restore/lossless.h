#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "isohf/restore/grid_sampler.h"
#include "isohf/restore/point_sampler.h"
#include "isohf/restore/position_mesh.h"
#include "isohf/restore/residual_codec.h"
#include "isohf/surface.h"

namespace isohf {

/// The metadata's member beside the residual members: a LosslessRecord.
inline constexpr const char* kLosslessName = "lossless";
/// Its JSON text.
[[nodiscard]] std::string format_lossless(const LosslessRecord& record);

/// "residual/00000000": the member that starts with source row `first_row`.
[[nodiscard]] std::string residual_name(std::int64_t first_row);

/// Where the samples of a source that was projected lie: a PositionMesh's values, as doubles.
inline constexpr const char* kPositionsName = "residual/places";
[[nodiscard]] std::vector<std::byte> bytes_of(const PositionMesh& positions);
/// Throws Error{kCorrupt} where the bytes are no mesh of that size.
[[nodiscard]] PositionMesh positions_from_bytes(std::int64_t width, std::int64_t height,
                                                std::span<const std::byte> bytes);

/// Predicts the samples of a source, row by row from North to South: on its own grid, or at positions of their own.
class SamplePredictor {
 public:
  /// What tiles under samples with positions of their own take at most, beside one tile a thread.
  static constexpr std::uint64_t kTileBytes = std::uint64_t{32} << 20U;

  /// positions  nullopt where the source's rows are rows of the world
  SamplePredictor(const TileGrid& grid, bool wraps_x, const Quantisation& quantisation, ReadTiles read_tiles,
                  const SampleGrid& samples, RestoreMethod method, std::optional<PositionMesh> positions);

  /// As GridSampler::read.
  void read(std::int64_t first, std::int64_t rows, std::span<double> predicted);

 private:
  SampleGrid samples_;
  std::optional<PositionMesh> positions_;
  std::optional<GridSampler> rows_;
  std::optional<PointSampler> points_;
};

}  // namespace isohf
