#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "isohf/base/memory/kept_rows.h"
#include "isohf/lattice.h"
#include "isohf/lattice/shadow_path.h"
#include "isohf/light/shadow_front.h"
#include "isohf/metadata.h"

namespace isohf {

/// Values of the stored vertices of a row of tiles, vertex row by vertex row: R rows of [tile columns][C].
class TileRowValues {
 public:
  TileRowValues(const TileGrid& grid, const ScratchFolder& scratch);
  [[nodiscard]] static double memory_bytes(const TileGrid& grid);

  /// A row of some tiles: [tiles * C]; `buffer` holds it where memory does not.
  [[nodiscard]] std::span<const float> row(int row, std::int64_t first_tile, std::int64_t tiles,
                                           std::vector<float>& buffer) const {
    return rows_.read(row, static_cast<std::size_t>(first_tile) * columns_, static_cast<std::size_t>(tiles) * columns_,
                      buffer);
  }
  /// The same tiles of several rows: [tiles * C] each.
  [[nodiscard]] RowParts<float> part(std::int64_t first_tile, std::int64_t tiles) const;
  /// Of as many tiles as there are values. From many threads at once, each on tiles of its own.
  void write_row(int row, std::int64_t first_tile, std::span<const float> values);

  /// values  [C*R] of one tile
  void write_tile(std::int64_t tile, std::span<const float> values);
  [[nodiscard]] std::vector<float> tile(std::int64_t tile) const;

 private:
  int vertex_rows_;
  std::size_t columns_;  ///< of a tile
  KeptRows<float> rows_;
};

/// A sun as it is swept.
struct SweptSun {
  double azimuth_deg = 0.0;  ///< clockwise from North
  /// Of a shadow in one world unit, height units, > 0: of the sun's middle, and of its disc's upper and lower edge.
  double fall = 1.0;
  double upper_fall = 1.0;
  double lower_fall = 1.0;
  /// A penumbra of one width for all distances in place of the disc's: k of Eq. 16, height units, > 0.
  std::optional<double> softness = std::nullopt;
};

/// Half the angle under which the sun's disc is seen, degrees: from Mars, else from the Earth.
[[nodiscard]] double sun_radius_deg(const std::string& body);

/// A disc of that radius over heights that are drawn `exaggeration` times as high. Near the horizon the disc is
/// smaller, so that its lower edge stays above.
/// height_per_world  height units in a world unit
[[nodiscard]] SweptSun swept_sun(double azimuth_deg, double elevation_deg, double radius_deg, double exaggeration,
                                 double height_per_world);

/// Light that passes over the tiles of an archive, a row of them at a time, from the sun's side.
///
/// The steps of the light are rows of the lattice, or columns half a lattice step apart where it passes more along the
/// rows than across them. On both the mesh's heights between two lanes are linear, so that lines of light lie on the
/// mesh at each step; along the six directions of the lattice they pass through its vertices.
class ShadowSweep {
 public:
  /// ground  that casts shadows: what the source covered
  ShadowSweep(const TileGrid& grid, const WorldBounds& ground, const SweptSun& sun);

  /// For a grid that is part of another: the tiles of that one to its West and East, and the rows of tiles that light
  /// has passed over before it. Lines of light then lie where they would lie over all of it.
  void begin_behind(std::int64_t tiles_west, std::int64_t tiles_east, std::int64_t rows_before);

  /// What is hidden of the sun is cut off so far from 1/2, either way.
  [[nodiscard]] double range() const { return range_; }
  /// Whether light comes to a row of tiles from the row South of it.
  [[nodiscard]] bool from_south() const { return from_south_; }

  /// The way of the light where it runs along the rows, so that nothing passes from one row of tiles to the next.
  [[nodiscard]] std::optional<LightTravel> travel() const;

  /// What passes from one row of tiles to the next: what lines of light carry.
  using State = std::vector<float>;
  [[nodiscard]] std::uint64_t state_bytes() const;
  /// What a pass takes beside that.
  [[nodiscard]] double passing_bytes() const;

  /// In what state light enters a tile that begins the grid, where it has a travel(). The grid's tiles alone then give
  /// the same shadows as all tiles before them do.
  /// casters  on the same ground, in the unit of heights; the falls of the sun's edges are among those that they are for
  /// tile     [C*R] heights, padding included, NaN where void
  [[nodiscard]] State entering(std::int64_t tile_row, const CasterRows& casters, std::span<const float> tile) const;

  /// Passes over a row of tiles.
  /// entering  what the row before it left; empty: nothing, at the first row. Or the state that entering() gives
  /// heights   NaN where void
  /// hidden    part of the sun at visible vertices, interpolable: 0 or less it is seen, 1 or more it is not; null: not
  ///           wanted
  /// Returns what the next row is entered by.
  State pass(std::int64_t tile_row, const State& entering, const TileRowValues& heights, TileRowValues* hidden);

 private:
  State pass_along_rows(std::int64_t tile_row, const State& entering, const TileRowValues& heights,
                        TileRowValues* hidden);
  State pass_along_columns(std::int64_t tile_row, const State& entering, const TileRowValues& heights,
                           TileRowValues* hidden);
  /// Columns or rows whose ground casts shadows, fractional; none if last < first.
  struct Casting {
    double first;
    double last;
  };
  [[nodiscard]] Casting casting_columns() const;
  [[nodiscard]] Casting casting_rows(std::int64_t tile_row) const;

  TileGrid grid_;
  WorldBounds ground_;
  bool from_south_;
  bool by_columns_;
  bool mirrored_;  ///< rows: light drifts West; columns: light travels West
  double shift_ = 0.0;
  std::vector<SunEdge> edges_;
  double range_ = 1.0;
  int half_steps_;                   ///< of a tile's width
  std::int64_t columns_before_ = 0;  ///< tiles of another grid, on the light's way
  std::int64_t rows_before_ = 0;
};

}  // namespace isohf
