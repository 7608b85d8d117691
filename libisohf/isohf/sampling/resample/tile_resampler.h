#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>

#include "isohf/lattice.h"
#include "isohf/raster.h"
#include "isohf/sampling/resample/kernels.h"
#include "isohf/sampling/resample/source_warp.h"
#include "isohf/sampling/source/source_axis.h"
#include "isohf/sampling/source/source_band.h"
#include "isohf/sampling/source/source_statistics.h"

namespace isohf {

/// Resamples the source at every stored vertex of a tile: visible ones, slid ones where they lie (errata E6), padding.
///
/// An elevation is a pure function of the vertex's place in the whole heightfield, so tiles that share a vertex hold
/// the same bits of it. Thread-safe.
class TileResampler {
 public:
  virtual ~TileResampler() = default;

  /// The source rows that a row of tiles reads, at least one; a superset where the source was projected.
  [[nodiscard]] virtual RowRange rows_needed(std::int64_t tile_row) const = 0;

  /// The part of the source that a tile reads, or more; without columns: none of it. Quick, for reading ahead. nullopt
  /// where only the places of the tile's vertices can show it.
  [[nodiscard]] virtual std::optional<Window> window_about(TileIndex tile) const = 0;

  /// Returns a band that holds at least the window; nullopt: none of its samples has an elevation.
  using ReadBand = std::function<std::optional<SourceBand>(const Window&)>;
  /// Cuts one tile. heights [C x R] out, relative to the band's datum; NaN where void: beyond the surface's end, or where
  /// less than half of the kernel's weight, or none of the nearest samples, is valid. False, and heights are left alone, where
  /// the tile has no elevation.
  virtual bool cut(TileIndex tile, const ReadBand& read, std::span<float> heights) const = 0;
  /// The same from a band that holds all that the tile reads.
  void cut_from(const SourceBand& band, TileIndex tile, std::span<float> heights) const;

 protected:
  TileResampler() = default;
  TileResampler(const TileResampler&) = default;
  TileResampler& operator=(const TileResampler&) = default;
};

/// Where a source's samples lie in the world: all that resampling it needs beside the samples.
struct SourceGeometry {
  std::int64_t width = 0;
  std::int64_t height = 0;
  Registration registration = Registration::kPoint;
  double first_sample_x = 0.0;  ///< world place of sample (0, 0)
  double first_sample_z = 0.0;
  double spacing_x = 1.0;  ///< world units between columns and rows
  double spacing_z = 1.0;
  bool wraps_x = false;  ///< the East edge is the West edge
  /// Steps of the grid, in those of the lattice whose triangles tell which vertices lie beside a void's samples: above 1
  /// for vertices of a coarse plane, which are that lattice's.
  double coarser = 1.0;
  std::optional<WarpPlace> warp;  ///< where the source was projected; first sample and spacings then say nothing
};

/// The source's axes as the cutter of this grid reads them: in world units, or in positions where it was projected.
struct SourceAxes {
  SourceAxis x;
  SourceAxis z;
};
[[nodiscard]] SourceAxes make_axes(const TileGrid& grid, const SourceGeometry& geometry);

/// The resampler for a source of that geometry. `limits`, relative to the band's datum, hold the continuation beyond the
/// source's edge only; elevations of the source itself are never touched.
[[nodiscard]] std::unique_ptr<TileResampler> make_tile_resampler(const TileGrid& grid, const SourceGeometry& geometry,
                                                                 const Kernel& kernel, const ElevationRange& limits);
/// The same where the source's rows are rows of the world, by its axes.
[[nodiscard]] std::unique_ptr<TileResampler> make_grid_resampler(const TileGrid& grid, const SourceAxes& axes,
                                                                 const Kernel& kernel, const ElevationRange& limits,
                                                                 double coarser = 1.0);

}  // namespace isohf
