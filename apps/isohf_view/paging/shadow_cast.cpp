#include "paging/shadow_cast.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "isohf/error.h"
#include "isohf/light/shadow_sweep.h"

namespace isohf::view {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

TileRange range_of(const std::vector<TileIndex>& tiles) {
  const auto alone = [](TileIndex tile) { return TileRange{tile, {tile.column + 1, tile.row + 1}}; };
  TileRange range = alone(tiles.front());
  for (const TileIndex tile : tiles) range = around(range, alone(tile));
  return range;
}

SweptSun swept(const TileSource& source, const CastingSun& sun) {
  const Metadata* const metadata = source.metadata();
  const double radius = sun_radius_deg(metadata != nullptr ? metadata->source.body : std::string());
  const double scale = source.scale().scale;
  return swept_sun(sun.azimuth_deg, sun.elevation_deg, radius, sun.exaggeration, 1.0 / scale);
}

/// Lowest elevation of the stored tiles of a range; infinite where there are none.
double lowest(const TileSource& source, const TileRange& range) {
  double low = std::numeric_limits<double>::infinity();
  for_each_tile(range, [&](TileIndex tile) {
    const TileBounds bounds = source.bounds(tile);
    if (bounds.stored) low = std::min(low, bounds.low);
  });
  return low;
}

}  // namespace

TileRange casting_range(const TileSource& source, const CastingSun& sun, const TileRange& shaded,
                        const CastingLimits& limits) {
  const TileGrid& grid = source.grid();
  const double fall = swept(source, sun).lower_fall * source.scale().scale;
  double reach = std::max(0.0, (whole_bounds(source).high - lowest(source, shaded)) / fall);
  for (;; reach *= 0.9) {
    // A lane more, as light drifts between lanes.
    const auto tiles = [reach](double towards, double extent, double lane) {
      return std::abs(towards) < 1e-9 ? 0.0 : std::min(std::ceil((reach * std::abs(towards) + lane) / extent), 1e9);
    };
    const double towards_x = std::sin(sun.azimuth_deg * kDegree);
    const double towards_z = -std::cos(sun.azimuth_deg * kDegree);
    const auto x = static_cast<std::int64_t>(tiles(towards_x, grid.extent_x(), 2.0 * grid.sigma_x()));
    const auto z = static_cast<std::int64_t>(tiles(towards_z, grid.extent_z(), 2.0 * grid.sigma_z()));
    TileRange range = shaded;
    // On its other side the last lane lies between two lines.
    const std::int64_t other = x > 0 && z > 0 ? 1 : 0;
    range.first.column -= towards_x < 0.0 ? x : other;
    range.end.column += towards_x > 0.0 ? x : other;
    if (towards_z < 0.0) range.first.row -= z;
    if (towards_z > 0.0) range.end.row += z;
    range = intersection(range, {{0, 0}, {grid.tile_columns(), grid.tile_rows()}});
    const bool fits = range.count() <= limits.tiles && range.end.column - range.first.column <= limits.columns;
    if (fits || reach < 1e-3 * grid.extent_x()) return range;
  }
}

namespace {

/// A pass of light over a range of tiles.
class RangeSweep {
 public:
  RangeSweep(const TileSource& source, const SweptSun& sun, const TileRange& range)
      : source_(source),
        range_(range),
        box_(TileGrid::make(source.grid().shape(), columns(), rows(), source.grid().extent_x(),
                            source.grid().extent_z())),
        sweep_(box_, covered(), sun),
        heights_(box_, std::nullopt),
        hidden_(box_, std::nullopt) {
    const TileGrid& grid = source.grid();
    // Lines of light lie where a sweep over all tiles would have them, so that shadows go on from one range to the
    // next.
    sweep_.begin_behind(range.first.column, grid.tile_columns() - range.end.column,
                        sweep_.from_south() ? grid.tile_rows() - range.end.row : range.first.row);
  }

  /// Appends the shadows of those of the tiles that lie in the range.
  void cast(const std::vector<TileIndex>& tiles, bool from_seeds, const std::atomic<bool>& cancelled,
            std::string& unread, std::vector<TileShadow>& shadows);

 private:
  [[nodiscard]] std::int64_t columns() const { return range_.end.column - range_.first.column; }
  [[nodiscard]] std::int64_t rows() const { return range_.end.row - range_.first.row; }
  [[nodiscard]] WorldBounds covered() const {
    const WorldBounds all = source_.covered();
    const double x = static_cast<double>(range_.first.column) * box_.extent_x();
    const double z = static_cast<double>(range_.first.row) * box_.extent_z();
    return {all.x0 - x, all.z0 - z, all.x1 - x, all.z1 - z};
  }

  const TileSource& source_;
  TileRange range_;
  TileGrid box_;
  ShadowSweep sweep_;
  TileRowValues heights_;
  TileRowValues hidden_;
};

void RangeSweep::cast(const std::vector<TileIndex>& tiles, bool from_seeds, const std::atomic<bool>& cancelled,
                      std::string& unread, std::vector<TileShadow>& shadows) {
  const auto vertices = static_cast<std::size_t>(box_.shape().stored_vertex_count());
  const auto gain = static_cast<float>(0.5 + sweep_.range());
  std::vector<float> read(vertices);
  ShadowSweep::State light;
  for (std::int64_t k = 0; k < rows() && !cancelled; ++k) {
    const std::int64_t row = sweep_.from_south() ? rows() - 1 - k : k;
    for (std::int64_t column = 0; column < columns(); ++column) {
      const TileIndex at{range_.first.column + column, range_.first.row + row};
      std::fill(read.begin(), read.end(), std::numeric_limits<float>::quiet_NaN());
      try {
        if (from_seeds) {
          light = sweep_.entering(row, source_.read_casters(at, *sweep_.travel(), read), read);
        } else if (source_.bounds(at).stored) {
          source_.read_heights(at, read);
        }
      } catch (const Error& error) {
        if (unread.empty()) unread = error.what();
      }
      heights_.write_tile(column, read);
    }
    const auto lies_here = [&](TileIndex tile) { return tile.row == range_.first.row + row && range_.contains(tile); };
    const bool wanted = std::any_of(tiles.begin(), tiles.end(), lies_here);
    light = sweep_.pass(row, light, heights_, wanted ? &hidden_ : nullptr);
    for (const TileIndex shaded : tiles) {
      if (!lies_here(shaded)) continue;
      const std::vector<float> found = hidden_.tile(shaded.column - range_.first.column);
      TileShadow shadow{shaded, std::vector<std::int16_t>(vertices), gain};
      std::transform(found.begin(), found.end(), shadow.depths.begin(), [gain](float part) {
        return static_cast<std::int16_t>(std::lround(std::clamp(part * kDepthSteps / gain, -kDepthSteps, kDepthSteps)));
      });
      shadows.push_back(std::move(shadow));
    }
  }
}

}  // namespace

bool uses_seeds(const TileSource& source, const CastingSun& sun) {
  const bool is_along_rows = std::abs(std::cos(sun.azimuth_deg * kDegree)) < 1e-9;
  return is_along_rows && source.has_seeds(swept(source, sun).lower_fall * source.grid().sigma_x());
}

std::vector<TileShadow> cast_shadows(const TileSource& source, const CastingSun& sun,
                                     const std::vector<TileIndex>& tiles, const CastingLimits& limits,
                                     const std::atomic<bool>& cancelled, std::string& unread) {
  std::vector<TileShadow> shadows;
  if (tiles.empty()) return shadows;
  const SweptSun light = swept(source, sun);
  if (limits.uses_seeds && uses_seeds(source, sun)) {
    for (const TileIndex tile : tiles) {
      RangeSweep(source, light, range_of({tile})).cast({tile}, true, cancelled, unread, shadows);
    }
    return shadows;
  }
  RangeSweep(source, light, casting_range(source, sun, range_of(tiles), limits))
      .cast(tiles, false, cancelled, unread, shadows);
  return shadows;
}

}  // namespace isohf::view
