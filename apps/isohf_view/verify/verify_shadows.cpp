#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "isohf/error.h"
#include "isohf/light/shadow.h"
#include "paging/shadow_cast.h"
#include "verify/verify_view.h"

namespace isohf::view {
namespace {

/// k of Eq. 16 for the pictures looked at, codes: wide enough for many pixels to lie in half shadow.
constexpr double kSoftness = 64.0;
/// Codes: heights that are floats are rounded here but not where shadows come from, and light falls step by step in
/// floats.
constexpr double kTolerance = 2.01;
constexpr int kDepthSteps = 32767;
constexpr double kElevations_deg[] = {3.0, 7.0, 15.0, 35.0};

struct RowSun {
  LightTravel travel;
  double elevation_deg;
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
  void verify_row(std::int64_t row, LightTravel travel);
  void verify_tile(TileIndex tile, const RowSun& sun, std::size_t sun_number, std::vector<double>& entering);
  void check_vertices(TileIndex tile, const RowSun& sun);
  void check_share(TileIndex tile, const RowSun& sun, int level, const PixelWindow& window);

  const CheckContext& context_;
  const TileSource& source_;
  TileProbe& probe_;
  ViewReport& report_;
  TileSlot slot_;
  std::vector<std::uint16_t> codes_;
  std::vector<float> heights_;          ///< the same, NaN where void
  std::vector<float> carried_;          ///< shadow heights by the library
  TileShadow cast_;                     ///< what pictures are drawn with
  std::vector<std::uint16_t> sampled_;  ///< its depths, from 0 on
  std::vector<ProbedVertex> captured_;
  std::vector<float> pixels_;
};

ShadowVerifier::ShadowVerifier(const CheckContext& context)
    : context_(context),
      source_(context.source),
      probe_(context.probe),
      report_(context.report),
      slot_(context.shared),
      codes_(static_cast<std::size_t>(source_.grid().shape().stored_vertex_count())),
      carried_(codes_.size()),
      sampled_(codes_.size()) {}

void ShadowVerifier::verify() {
  const TileGrid& grid = source_.grid();
  report_.suns_deg.assign(std::begin(kElevations_deg), std::end(kElevations_deg));
  const auto& wanted = context_.options.tiles;
  for (std::int64_t row = 0; row < grid.tile_rows(); ++row) {
    if (wanted && (row < wanted->first.row || row >= wanted->end.row)) continue;
    verify_row(row, LightTravel::kEastward);
    verify_row(row, LightTravel::kWestward);
    if (context_.options.progress) context_.options.progress("shadows", row + 1, grid.tile_rows());
  }
}

void ShadowVerifier::verify_row(std::int64_t row, LightTravel travel) {
  const TileGrid& grid = source_.grid();
  const std::vector<double>& suns_deg = report_.suns_deg;
  const std::vector<double> dark(static_cast<std::size_t>(visible_rows(grid.shape())), kNoShadow);
  std::vector<std::vector<double>> entering(suns_deg.size(), dark);
  // As along the row, ground that lies beyond the source casts too.
  const CastingLimits all_ground{.ground = WorldBounds{0.0, 0.0, grid.world_width(), grid.world_height()}};
  std::vector<TileIndex> tiles;
  for (std::int64_t i = 0; i < grid.tile_columns(); ++i) tiles.push_back({i, row});
  std::vector<std::vector<TileShadow>> cast;
  const std::atomic<bool> leaves{false};
  for (const double elevation_deg : suns_deg) {
    std::string unread;  // the tile's own check says so
    cast.push_back(cast_shadows(
        source_, {travel == LightTravel::kEastward ? 270.0 : 90.0, elevation_deg, kSoftness * source_.scale().scale},
        tiles, all_ground, leaves, unread));
  }
  for (std::int64_t i = 0; i < grid.tile_columns(); ++i) {
    const TileIndex tile{travel == LightTravel::kEastward ? i : grid.tile_columns() - 1 - i, row};
    try {
      source_.read(tile, codes_);
    } catch (const Error&) {
      return;  // the tile's own check has said so, and nothing can be carried past it
    }
    heights_ = heights_from(codes_);
    slot_.upload(codes_);
    for (std::size_t k = 0; k < entering.size(); ++k) {
      cast_ = std::move(cast[k][static_cast<std::size_t>(tile.column)]);
      verify_tile(tile, {travel, suns_deg[k]}, k, entering[k]);
    }
  }
}

void ShadowVerifier::verify_tile(TileIndex tile, const RowSun& sun, std::size_t sun_number,
                                 std::vector<double>& entering) {
  const TileGrid& grid = source_.grid();
  const TileShape& shape = grid.shape();
  const double fall = std::tan(sun.elevation_deg * std::numbers::pi / 180.0) / source_.scale().scale;
  tile_shadow(grid, View2D<const float>(heights_.data(), shape.columns(), shape.rows()), {sun.travel, fall}, entering,
              View2D<float>(carried_.data(), shape.columns(), shape.rows()), entering);
  std::transform(cast_.depths.begin(), cast_.depths.end(), sampled_.begin(),
                 [](std::int16_t depth) { return static_cast<std::uint16_t>(depth + kDepthSteps); });
  slot_.upload_shadow(cast_.depths, cast_.gain);
  probe_.capture(slot_, {0, 0}, context_.has_voids(tile), captured_);
  check_vertices(tile, sun);
  // Each tile at one level a sun, all levels in turn.
  const auto turn = static_cast<std::size_t>(tile.column + tile.row) + sun_number;
  const int level = static_cast<int>(turn % static_cast<std::size_t>(shape.levels()));
  for (const PixelWindow& window : context_.oracle.windows()) check_share(tile, sun, level, window);
}

void ShadowVerifier::check_vertices(TileIndex tile, const RowSun& sun) {
  const TileShape& shape = source_.grid().shape();
  const double deepest = 0.5 * cast_.gain * kSoftness;  // codes that 32767 stands for, with Eq. 16
  Worst worst;
  for (int row = 1; row < shape.rows() - 1; ++row) {
    for (int column = 1; column <= last_visible_column(shape, row); ++column) {
      const auto i = static_cast<std::size_t>(row * shape.columns() + column);
      if (codes_[i] == kVoidCode) continue;
      ++report_.shadow_vertices;
      const double got = std::max(0.0, captured_[i].shadow * deepest);
      const double want = std::clamp(static_cast<double>(carried_[i]) - codes_[i], 0.0, deepest);
      const double off = std::abs(got - want);
      report_.worst_shadow = std::max(report_.worst_shadow, off);
      if (off <= kTolerance) continue;
      worst.add(off, [&] {
        return fmt::format("{}, {}: {:.2f} codes below the shadow, carried along the row {:.2f}, ground {}",
                           vertex_name({column, row}), sun_name(sun), got, want, codes_[i]);
      });
    }
  }
  worst.report(report_, finding::kDrawnShadow, tile, 0.0);
}

// The vertices' depths have been looked at: from them the library's barycentric depth and Eq. 16.
void ShadowVerifier::check_share(TileIndex tile, const RowSun& sun, int level, const PixelWindow& window) {
  const TileShape& shape = source_.grid().shape();
  probe_.draw_shadow(slot_, context_.has_voids(tile), level, window, cast_.gain, pixels_);
  ++report_.pictures;
  const std::span<const PixelSample> samples = context_.oracle.samples(level, window);
  const double reach = window.x0 + window.z0 + window.width + window.height;
  Worst worst;
  for_each_pixel(window, probe_.width(), [&](int i, int j, std::size_t k, std::size_t at) {
    const SampledCode ground = sample_code(samples[k], codes_);
    const float* got = pixels_.data() + at;
    if (!ground.valid || got[3] != 1.0F) return;  // coverage is another check's
    ++report_.pixels;
    const SampledCode depth = sample_code(samples[k], sampled_);
    const double deep = (depth.code - kDepthSteps) / kDepthSteps;
    const double want = std::clamp(1.0 - cast_.gain * deep, 0.0, 1.0);
    const double off = std::abs(got[0] - want);
    report_.worst_share = std::max(report_.worst_share, off);
    if (off <= cast_.gain * (kCodeTolerance + depth.spread * reach * kPerPixel) / kDepthSteps) return;
    worst.add(off, [&] {
      return fmt::format("{}, {}: share {:.4f} of the sun, library {:.4f}", pixel_name(shape, window, i, j, samples[k]),
                         sun_name(sun), got[0], want);
    });
  });
  worst.report(report_, finding::kDrawnSunShare, tile, level);
}

}  // namespace

void verify_shadows(const CheckContext& context) {
  ShadowVerifier(context).verify();
}

}  // namespace isohf::view
