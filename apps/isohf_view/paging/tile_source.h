#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "isohf/archive.h"
#include "isohf/archive/textures/texture_info.h"
#include "isohf/lattice.h"
#include "isohf/lattice/planes.h"
#include "isohf/lattice/shadow_path.h"
#include "isohf/metadata.h"
#include "isohf/picture.h"
#include "isohf/restore/ground_scale.h"
#include "isohf/shade.h"
#include "view_state.h"

namespace isohf::view {

/// The code that means "void" on the GPU, whatever the archive's own is.
inline constexpr std::uint16_t kVoidCode = 65535;

/// How the viewer's 16-bit codes become heights: height = offset + scale * code, world units. Where the unit of
/// elevations is known and another than that of the ground (feet over metres), it has been converted.
struct ViewScale {
  double offset = 0.0;
  double scale = 1.0;
};

/// What is known of a tile before it is read.
struct TileBounds {
  bool stored = false;  ///< false: wholly void
  bool has_voids = false;
  double low = 0.0;  ///< world units
  double high = 0.0;
};

/// The names of a place.
struct Place {
  WorldPoint at{};              ///< in the archive's world
  double elevation = 0.0;       ///< in `unit`
  std::string unit;             ///< empty where it is not known
  int decimals = 0;             ///< of the elevation: as many as codes have steps
  std::optional<MapPoint> map;  ///< in the source's system, where that is a map
  std::optional<GeoPoint> geo;
};

/// Where tiles come from. All functions may be called from any number of threads at once.
class TileSource {
 public:
  TileSource() = default;
  TileSource(const TileSource&) = delete;
  TileSource& operator=(const TileSource&) = delete;
  virtual ~TileSource() = default;

  [[nodiscard]] virtual const TileGrid& grid() const = 0;
  [[nodiscard]] virtual ViewScale scale() const = 0;
  /// False where the ground's unit is not known, so that heights may have any proportion to it.
  [[nodiscard]] virtual bool is_to_scale() const { return true; }
  /// The part of the world that the source covers; what lies beyond is made up.
  [[nodiscard]] virtual WorldBounds covered() const { return {0.0, 0.0, grid().world_width(), grid().world_height()}; }
  [[nodiscard]] virtual TileBounds bounds(TileIndex tile) const = 0;
  /// codes [C x R] out, 0..65534, or kVoidCode. Throws Error naming the tile.
  virtual void read(TileIndex tile, std::span<std::uint16_t> codes) const = 0;
  /// The coarse planes above the tiles; nullptr where there are none.
  [[nodiscard]] virtual const Planes* planes() const { return nullptr; }
  /// A plane as a source of its own, 0 <= plane <= planes()->count(): its grid, ranges of all that lies below, codes of
  /// the same scale. It covers what this one does.
  [[nodiscard]] virtual const TileSource& plane(int) const { return *this; }
  /// A tile's heights in codes, not rounded, NaN where void: what shadows are computed from. [C x R] out.
  virtual void read_heights(TileIndex tile, std::span<float> heights) const;
  /// Whether shadow seeds serve light along the rows that falls by so many codes, and no less, in a half step.
  [[nodiscard]] virtual bool has_seeds(double) const { return false; }
  /// The casters of a tile's seeds, their heights like those that read_heights gives, which it gives as well.
  virtual CasterRows read_casters(TileIndex tile, LightTravel travel, std::span<float> heights) const;
  /// From the archive's world to that of all else here.
  [[nodiscard]] virtual GroundScale ground_scale() const { return {}; }
  [[nodiscard]] WorldPoint from_archive(WorldPoint at) const;
  [[nodiscard]] WorldPoint to_archive(WorldPoint at) const;
  /// All names of a place of that height, world units.
  [[nodiscard]] virtual Place describe(WorldPoint at, double height) const;
  /// World units of one elevation unit; 1 where either is not known.
  [[nodiscard]] virtual double world_per_elevation() const { return 1.0; }
  /// nullptr where there is no archive.
  [[nodiscard]] virtual const Metadata* metadata() const { return nullptr; }
  /// Names of the ground's and the elevations' units; empty where they are not known.
  [[nodiscard]] std::string ground_unit() const;
  [[nodiscard]] std::string height_unit() const;
  /// Throws Error{kInvalidArgument} where the sun's way is not known.
  [[nodiscard]] virtual DaySky sky() const;
  /// The record of the textures; nullptr where the source has none.
  [[nodiscard]] virtual const TextureInfo* textures() const { return nullptr; }
  [[nodiscard]] virtual bool has_texture(TileIndex) const { return false; }
  /// A level of a tile's texture as RGBA with straight alpha. Throws Error naming the tile.
  [[nodiscard]] virtual Picture read_texture(TileIndex tile, int level) const;

 private:
  friend TileBounds whole_bounds(const TileSource& source);
  mutable std::once_flag whole_once_;
  mutable TileBounds whole_;
};

/// Opens an archive for viewing. 16- and 8-bit codes are taken as they are; float elevations are rounded to 65535
/// steps between the dataset's smallest and largest elevation. Throws what ArchiveReader throws.
/// name  what messages call it; empty: its path
[[nodiscard]] std::unique_ptr<TileSource> open_archive(const std::string& path, const std::string& name = "");

/// Tile columns and rows first..last, inclusive; empty where last < first.
struct TileRange {
  std::int64_t first_column = 0;
  std::int64_t last_column = -1;
  std::int64_t first_row = 0;
  std::int64_t last_row = -1;

  [[nodiscard]] bool contains(TileIndex tile) const {
    return tile.column >= first_column && tile.column <= last_column && tile.row >= first_row && tile.row <= last_row;
  }
  friend bool operator==(const TileRange&, const TileRange&) = default;
};

/// The box around a tile, from the eye.
struct TileVolume {
  Vec3 low;
  Vec3 high;
  /// From the eye to the nearest point of the box.
  [[nodiscard]] double distance() const {
    return length({std::clamp(0.0, low.x, high.x), std::clamp(0.0, low.y, high.y), std::clamp(0.0, low.z, high.z)});
  }
};
[[nodiscard]] TileVolume tile_volume(const TileGrid& grid, TileIndex tile, const TileBounds& bounds,
                                     const ViewState& view);

/// Its planes, or its tiles alone.
[[nodiscard]] Planes planes_of(const TileSource& source);

/// Lowest and highest elevation of the tiles together; {0, 0} where all is void. Found once, and kept.
[[nodiscard]] TileBounds whole_bounds(const TileSource& source);

}  // namespace isohf::view
