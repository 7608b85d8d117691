#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "isohf/error.h"
#include "paging/shadow_cast.h"
#include "verify/verify_view.h"

namespace isohf::view {
namespace {

/// Codes: heights that are floats are rounded where they are drawn.
constexpr double kRounding = 0.501;
constexpr double kElevations_deg[] = {3.0, 7.0, 15.0, 35.0};

/// Suns whose shadows are compared with rays: one whose light is swept by rows, and one by columns.
constexpr CastingSun kRaySuns[] = {{15.0, 12.0}, {233.0, 12.0}};
/// Tiles and vertices of each that rays start from.
constexpr std::int64_t kRayTiles = 48;
constexpr std::int64_t kRayVertices = 250;
/// Parts of the dark vertices that may be drawn otherwise than rays find them: either way, and in balance. In small
/// samples some more may be, by chance.
constexpr double kMostEachWay = 0.02;
constexpr double kMostNet = 0.01;
constexpr double kByChance = 4.0;

struct RowSun {
  LightTravel travel;
  double elevation_deg;
  [[nodiscard]] CastingSun casting() const { return {travel == LightTravel::kEastward ? 270.0 : 90.0, elevation_deg}; }
};

std::string sun_name(const RowSun& sun) {
  return fmt::format("sun in the {} at {:g} degrees", sun.travel == LightTravel::kEastward ? "West" : "East",
                     sun.elevation_deg);
}

class ShadowVerifier {
 public:
  explicit ShadowVerifier(const CheckContext& context);
  void verify();

 private:
  void verify_row(std::int64_t row);
  void verify_by_rays(const CastingSun& sun);
  /// Draws a tile with that shadow, and captures its vertices.
  void capture(const TileShadow& drawn);
  [[nodiscard]] bool are_heights_drawn(TileIndex tile);
  /// swept, drawn  the shadow of a whole row's sweep, and the one that pictures are drawn with
  void verify_tile(const TileShadow& swept, const TileShadow& drawn, const RowSun& sun);

  const CheckContext& context_;
  const TileSource& source_;
  TileProbe& probe_;
  ViewReport& report_;
  TileSlot slot_;
  std::vector<std::uint16_t> codes_;
  std::vector<float> heights_;  ///< that cast shadows
  std::vector<ProbedVertex> captured_;
};

ShadowVerifier::ShadowVerifier(const CheckContext& context)
    : context_(context),
      source_(context.source),
      probe_(context.probe),
      report_(context.report),
      slot_(context.shared),
      codes_(static_cast<std::size_t>(source_.grid().shape().stored_vertex_count())),
      heights_(codes_.size()) {}

void ShadowVerifier::verify() {
  const TileGrid& grid = source_.grid();
  report_.suns_deg.assign(std::begin(kElevations_deg), std::end(kElevations_deg));
  const auto& wanted = context_.options.tiles;
  for (std::int64_t row = 0; row < grid.tile_rows(); ++row) {
    if (wanted && (row < wanted->first.row || row >= wanted->end.row)) continue;
    verify_row(row);
    if (context_.options.progress) context_.options.progress("shadows", row + 1, grid.tile_rows());
  }
  for (const CastingSun& sun : kRaySuns) verify_by_rays(sun);
}

void ShadowVerifier::verify_by_rays(const CastingSun& sun) {
  const TileGrid& grid = source_.grid();
  const TileShape& shape = grid.shape();
  const TileRange all{{0, 0}, {grid.tile_columns(), grid.tile_rows()}};
  const TileRange range = context_.options.tiles ? intersection(all, *context_.options.tiles) : all;
  const std::int64_t every = std::max<std::int64_t>(1, range.count() / kRayTiles);
  const std::atomic<bool> leaves{false};
  std::string unread;
  ViewReport::RaySun found{sun.azimuth_deg, sun.elevation_deg};
  std::int64_t number = 0;
  for_each_tile(range, [&](TileIndex tile) {
    if (number++ % every != 0 || !source_.bounds(tile).stored) return;
    const TileShadow drawn = cast_shadows(source_, sun, {tile}, {}, leaves, unread).front();
    capture(drawn);
    std::mt19937 random(static_cast<unsigned>(number));
    std::vector<WorldPoint> points;
    std::vector<bool> are_dark;
    for (std::int64_t n = 0; n < kRayVertices; ++n) {
      const int row = 1 + static_cast<int>(random() % static_cast<unsigned>(shape.rows() - 2));
      const int column = 1 + static_cast<int>(random() % static_cast<unsigned>(last_visible_column(shape, row)));
      const auto i = static_cast<std::size_t>(row * shape.columns() + column);
      if (codes_[i] == kVoidCode) continue;
      points.push_back(grid.world_from_object(
          tile, {static_cast<double>(object_x(shape.columns(), column, row)), static_cast<double>(row - 1)}));
      are_dark.push_back(captured_[i].shadow * drawn.gain > 0.5F);
    }
    const std::vector<float> shares = source_.sun_shares(points, {sun.azimuth_deg, sun.elevation_deg, {}});
    for (std::size_t i = 0; i < shares.size(); ++i) {
      if (std::isnan(shares[i])) continue;
      const bool is_dark = shares[i] < 0.5F;
      ++found.vertices;
      found.dark += is_dark ? 1 : 0;
      found.lit_though_dark += is_dark && !are_dark[i] ? 1 : 0;
      found.dark_though_lit += !is_dark && are_dark[i] ? 1 : 0;
    }
  });
  if (found.vertices == 0) return;
  report_.ray_suns.push_back(found);
  const auto dark = static_cast<double>(found.dark);
  const auto worse = static_cast<double>(std::max(found.lit_though_dark, found.dark_though_lit));
  const auto net = static_cast<double>(std::abs(found.lit_though_dark - found.dark_though_lit));
  if (worse <= kMostEachWay * dark + kByChance && net <= kMostNet * dark + kByChance) return;
  report_.add(
      {finding::kDrawnShadow, range.first, 0,
       fmt::format("sun at {:g},{:g}: rays find {} of {} vertices dark; {} of these are drawn lit, and {} others "
                   "dark",
                   sun.azimuth_deg, sun.elevation_deg, found.dark, found.vertices, found.lit_though_dark,
                   found.dark_though_lit),
       worse / std::max(dark, 1.0), found.lit_though_dark + found.dark_though_lit});
}

void ShadowVerifier::capture(const TileShadow& drawn) {
  source_.read(drawn.tile, codes_);
  slot_.upload(codes_);
  slot_.upload_shadow(drawn.depths, drawn.gain);
  probe_.capture(slot_, {0, 0}, captured_);
}

void ShadowVerifier::verify_row(std::int64_t row) {
  const TileGrid& grid = source_.grid();
  std::vector<TileIndex> tiles;
  for (std::int64_t column = 0; column < grid.tile_columns(); ++column) tiles.push_back({column, row});
  if (!std::all_of(tiles.begin(), tiles.end(), [&](TileIndex tile) { return are_heights_drawn(tile); })) return;
  const CastingLimits whole_row{grid.tile_columns(), grid.tile_columns(), false};
  const std::atomic<bool> leaves{false};
  std::string unread;  // the tile's own check says so
  for (const LightTravel travel : {LightTravel::kEastward, LightTravel::kWestward}) {
    for (const double elevation_deg : kElevations_deg) {
      const RowSun sun{travel, elevation_deg};
      for (const TileShadow& swept : cast_shadows(source_, sun.casting(), tiles, whole_row, leaves, unread)) {
        // By itself, as it is drawn.
        verify_tile(swept, cast_shadows(source_, sun.casting(), {swept.tile}, {}, leaves, unread).front(), sun);
      }
    }
  }
}

/// Whether the heights that shadows are computed from are those that are drawn.
bool ShadowVerifier::are_heights_drawn(TileIndex tile) {
  try {
    source_.read(tile, codes_);
    source_.read_heights(tile, heights_);
  } catch (const Error&) {
    return false;  // the tile's own check has said so
  }
  const TileShape& shape = source_.grid().shape();
  Worst worst;
  for (int row = 1; row < shape.rows() - 1; ++row) {
    for (int column = 1; column <= last_visible_column(shape, row); ++column) {
      const auto i = static_cast<std::size_t>(row * shape.columns() + column);
      if (codes_[i] == kVoidCode && std::isnan(heights_[i])) continue;
      const double off = std::abs(static_cast<double>(heights_[i]) - codes_[i]);
      if (off <= kRounding) continue;
      worst.add(off, [&] {
        return fmt::format("{}: ground {} casts shadows as {:.2f}", vertex_name({column, row}), codes_[i], heights_[i]);
      });
    }
  }
  worst.report(report_, finding::kDrawnShadow, tile, 0);
  return !worst.any();
}

void ShadowVerifier::verify_tile(const TileShadow& swept, const TileShadow& drawn, const RowSun& sun) {
  capture(drawn);
  const TileShape& shape = source_.grid().shape();
  const bool is_seeded = uses_seeds(source_, sun.casting());
  Worst worst;
  for (int row = 1; row < shape.rows() - 1; ++row) {
    for (int column = 1; column <= last_visible_column(shape, row); ++column) {
      const auto i = static_cast<std::size_t>(row * shape.columns() + column);
      if (codes_[i] == kVoidCode) continue;
      ++report_.shadow_vertices;
      report_.seeded_vertices += is_seeded ? 1 : 0;
      float got = captured_[i].shadow;
      float want = static_cast<float>(swept.depths[i]) / kDepthSteps;
      // Seeds give the very state of the sweep. Without them casters that cannot hide anything are not looked for, and
      // in the sun depths say how near a caster's line passes.
      if (!is_seeded) {
        got = std::max(got, 0.0F);
        want = std::max(want, 0.0F);
      }
      if (std::abs(got - want) < 0.5F / kDepthSteps) continue;
      const double off = static_cast<double>(std::abs(got - want) * swept.gain);
      report_.worst_shadow = std::max(report_.worst_shadow, off);
      worst.add(off, [&] {
        return fmt::format("{}, {}: {:.4f} of the sun hidden, swept along the row {:.4f}", vertex_name({column, row}),
                           sun_name(sun), got * swept.gain, want * swept.gain);
      });
    }
  }
  worst.report(report_, finding::kDrawnShadow, swept.tile, 0);
}

}  // namespace

void verify_shadows(const CheckContext& context) {
  ShadowVerifier(context).verify();
}

}  // namespace isohf::view
