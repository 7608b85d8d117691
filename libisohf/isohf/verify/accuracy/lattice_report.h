#pragma once

#include <cstdint>
#include <optional>

#include "isohf/archive.h"
#include "isohf/raster.h"
#include "isohf/verify/accuracy/twin_meshes.h"

namespace isohf {

/// What the iso lattice buys on one source: its archive beside ortho meshes of the same source.
///
/// Bytes are compared by one yardstick for both, plain_coding.h, without the padding that an archive's tiles repeat of
/// their neighbours and without the twin's last row and column. tile_bytes is what the archive really takes, by its own
/// codec and with padding.
struct LatticeReport {
  std::int64_t vertices = 0;      ///< of all tiles, each shared one counted once; the twin has as many
  std::int64_t triangles = 0;     ///< at full detail: twice the vertices, on either lattice
  std::uint64_t tile_bytes = 0;   ///< of all tiles as stored
  std::uint64_t plain_bytes = 0;  ///< of the vertices, each once
  MeshErrors twin;                ///< as many vertices in squares
  double regular_rms = 0.0;       ///< of the iso lattice as dense, placed as the twin is
  /// Every k-th sample of the source kept as a vertex, k the nearest to the archive's density; nullopt where that is 1.
  struct Decimated {
    std::int64_t stride = 0;
    MeshErrors mesh;
    double iso_rms = 0.0;  ///< of an iso lattice of just as many vertices
  };
  std::optional<Decimated> decimated;
  /// The ortho mesh whose rms error is the iso surface's. Meshes of other spacings are measured until one lies beyond
  /// it (seldom more than one), then the spacing is interpolated, log rms over log spacing, and that mesh is measured
  /// itself. nullopt where either rms is no more than the rounding of floats, or where it is not met with a quarter to
  /// four times the vertices.
  std::optional<MeshErrors> equal;
};

/// `iso_rms` as compare_with_source found it. Deterministic; cost: most often six times that of
/// measuring one mesh. Stages
/// "ortho 1", "ortho 2", ... Throws as measure_meshes does.
[[nodiscard]] LatticeReport compare_lattices(const ArchiveReader& archive, HeightSource& source, double iso_rms,
                                             const Job& job);

}  // namespace isohf
