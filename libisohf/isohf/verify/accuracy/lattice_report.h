#pragma once

#include <cstdint>
#include <optional>

#include "isohf/archive.h"
#include "isohf/raster.h"
#include "isohf/verify/accuracy/ortho_twin.h"

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
  OrthoErrors twin;               ///< as many vertices
  /// The ortho mesh whose rms error is the iso surface's. Meshes of other spacings are measured until one lies beyond
  /// it (seldom more than one), then the spacing is interpolated, log rms over log spacing, and that mesh is measured
  /// itself. nullopt where either rms is no more than the rounding of floats, or where it is not met with a quarter to
  /// four times the vertices.
  std::optional<OrthoErrors> equal;
};

/// `iso_rms` as compare_with_source found it. Deterministic; cost: most often three times measure_ortho_twin's. Stages
/// "ortho 1", "ortho 2", ... Throws as measure_ortho_twin does.
[[nodiscard]] LatticeReport compare_lattices(const ArchiveReader& archive, HeightSource& source, double iso_rms,
                                             const Job& job);

}  // namespace isohf
