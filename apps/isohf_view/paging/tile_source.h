#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
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
#include "isohf/surface.h"
#include "isohf/tile_range.h"
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
  double low = 0.0;     ///< world units
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

/// What a source is, whatever its tiles hold.
struct SourceFacts {
  TileGrid grid;
  ViewScale scale{};
  WorldBounds covered{};           ///< the part of the world that the source covers; what lies beyond is made up
  GroundScale ground_scale{};      ///< from the archive's world to that of all else here
  std::optional<Planes> planes{};  ///< the coarse planes above the tiles
  std::optional<TextureInfo> textures{};
  /// The least that light along the rows falls in a half step, codes, where shadow seeds serve it; nullopt: there are
  /// none.
  std::optional<double> seeded_fall{};
  bool is_to_scale = true;  ///< false where the ground's unit is not known: heights may have any proportion to it
};
/// A source that covers all of the world.
[[nodiscard]] inline SourceFacts facts_of(const TileGrid& grid, ViewScale scale) {
  return {grid, scale, {0.0, 0.0, grid.world_width(), grid.world_height()}};
}

/// Where tiles come from. All functions may be called from any number of threads at once.
class TileSource {
 public:
  explicit TileSource(SourceFacts facts) : facts_(std::move(facts)) {}
  TileSource(const TileSource&) = delete;
  TileSource& operator=(const TileSource&) = delete;
  virtual ~TileSource() = default;

  [[nodiscard]] virtual TileBounds bounds(TileIndex tile) const = 0;
  /// codes [C x R] out, 0..65534, or kVoidCode. Throws Error naming the tile.
  virtual void read(TileIndex tile, std::span<std::uint16_t> codes) const = 0;
  /// A plane as a source of its own, 0 <= plane <= planes()->count(): its grid, ranges of all that lies below, codes of
  /// the same scale. It covers what this one does.
  [[nodiscard]] virtual const TileSource& plane(int) const { return *this; }
  /// A tile's heights in codes, not rounded, NaN where void: what shadows are computed from. [C x R] out.
  virtual void read_heights(TileIndex tile, std::span<float> heights) const;
  /// The casters of a tile's seeds, their heights like those that read_heights gives, which it gives as well.
  virtual CasterRows read_casters(TileIndex tile, LightTravel travel, std::span<float> heights) const;
  /// The share of the sun at points of the surface, 0 to 1, found by a ray from each; NaN if there is no surface. Empty if
  /// the source has no archive.
  [[nodiscard]] virtual std::vector<float> sun_shares(std::span<const WorldPoint> points, const Sun& sun) const;
  /// All names of a place of that height, world units.
  [[nodiscard]] virtual Place describe(WorldPoint at, double height) const;
  /// nullptr where there is no archive.
  [[nodiscard]] virtual const Metadata* metadata() const { return nullptr; }
  /// Throws Error{kInvalidArgument} where the sun's way is not known.
  [[nodiscard]] virtual DaySky sky() const;
  [[nodiscard]] virtual bool has_texture(TileIndex) const { return false; }
  /// A level of a tile's texture as RGBA with straight alpha. Throws Error naming the tile.
  [[nodiscard]] virtual Picture read_texture(TileIndex tile, int level) const;

  [[nodiscard]] const TileGrid& grid() const { return facts_.grid; }
  [[nodiscard]] ViewScale scale() const { return facts_.scale; }
  [[nodiscard]] bool is_to_scale() const { return facts_.is_to_scale; }
  [[nodiscard]] const WorldBounds& covered() const { return facts_.covered; }
  /// nullptr where there are none.
  [[nodiscard]] const Planes* planes() const { return facts_.planes ? &*facts_.planes : nullptr; }
  [[nodiscard]] const TextureInfo* textures() const { return facts_.textures ? &*facts_.textures : nullptr; }
  [[nodiscard]] bool has_seeds(double fall) const { return facts_.seeded_fall && fall >= *facts_.seeded_fall; }
  [[nodiscard]] WorldPoint from_archive(WorldPoint at) const;
  [[nodiscard]] WorldPoint to_archive(WorldPoint at) const;
  /// World units of one elevation unit; 1 where either is not known.
  [[nodiscard]] double world_per_elevation() const { return facts_.ground_scale.elevation; }
  /// Names of the ground's and the elevations' units; empty where they are not known.
  [[nodiscard]] std::string ground_unit() const;
  [[nodiscard]] std::string height_unit() const;

 protected:
  SourceFacts facts_;

 private:
  friend TileBounds whole_bounds(const TileSource& source);
  mutable std::once_flag whole_once_;
  mutable TileBounds whole_;
};

/// Opens an archive for viewing. 16- and 8-bit codes are taken as they are; float elevations are rounded to 65535
/// steps between the dataset's smallest and largest elevation. Throws what ArchiveReader throws.
/// name  what messages call it; empty: its path
[[nodiscard]] std::unique_ptr<TileSource> open_archive(const std::string& path, const std::string& name = "");

/// Calls use(TileIndex) for each tile of a range, row by row.
template <typename Use>
void for_each_tile(const TileRange& range, const Use& use) {
  for (std::int64_t row = range.first.row; row < range.end.row; ++row) {
    for (std::int64_t column = range.first.column; column < range.end.column; ++column) use(TileIndex{column, row});
  }
}

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
