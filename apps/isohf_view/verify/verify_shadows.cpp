#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "isohf/error.h"
#include "paging/shadow_cast.h"
#include "verify/verify_view.h"

namespace isohf::view {
namespace {

/// Codes: heights that are floats are rounded where they are drawn.
constexpr double kRounding = 0.501;
constexpr double kElevations_deg[] = {3.0, 7.0, 15.0, 35.0};

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
  source_.read(swept.tile, codes_);
  slot_.upload(codes_);
  slot_.upload_shadow(drawn.depths, drawn.gain);
  probe_.capture(slot_, {0, 0}, captured_);
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
