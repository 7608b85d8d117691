#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "isohf/error.h"
#include "isohf/light/normals.h"
#include "verify/verify_view.h"

namespace isohf::view {
namespace {

constexpr double kNormalTolerance = 1e-4;  ///< float roundings of 1

std::uint64_t lattice_key(LatticeVertex vertex) {
  return static_cast<std::uint64_t>(vertex.x) * 0x1000000000U + (static_cast<std::uint64_t>(vertex.z) & 0xFFFFFFFFFU);
}

class TileVerifier {
 public:
  explicit TileVerifier(const CheckContext& context)
      : context_(context),
        source_(context.source),
        report_(context.report),
        probe_(context.probe),
        slot_(context.shared),
        codes_(static_cast<std::size_t>(source_.grid().shape().stored_vertex_count())),
        normals_(codes_.size()) {}

  /// Tiles in flat-index order.
  void verify(TileIndex tile);

 private:
  /// What some tile said of a vertex that others store too.
  struct SharedVertex {
    std::uint16_t code = 0;
    bool is_visible = false;  ///< has a place and a normal
    ProbedVertex drawn{};
    TileIndex tile{};
  };

  void check_vertices(TileIndex tile);
  void check_shared(TileIndex tile);
  void check_level(TileIndex tile, int level, const PixelWindow& window);

  const CheckContext& context_;
  const TileSource& source_;
  ViewReport& report_;
  TileProbe& probe_;
  TileSlot slot_;
  std::vector<std::uint16_t> codes_;
  std::vector<Normal> normals_;
  std::vector<ProbedVertex> captured_;  ///< drawn as tile (0, 0), whose places are exact enough
  std::vector<ProbedVertex> placed_;    ///< drawn as the tile in hand
  std::vector<float> pixels_;
  std::unordered_map<std::uint64_t, SharedVertex> seen_;  ///< of the last two tile rows' rims
  std::int64_t seen_row_ = 0;
};

void TileVerifier::verify(TileIndex tile) {
  ++report_.tiles;
  try {
    source_.read(tile, codes_);
  } catch (const Error& error) {
    report_.add({finding::kTileUndecodable, tile, 0, error.what(), 0.0, 1});
    return;
  }
  slot_.upload(codes_);
  const TileShape& shape = source_.grid().shape();
  const std::vector<float> heights = heights_from(codes_, source_.scale().scale);
  tile_normals(source_.grid(), View2D<const float>(heights.data(), shape.columns(), shape.rows()),
               View2D<Normal>(normals_.data(), shape.columns(), shape.rows()));
  probe_.capture(slot_, {0, 0}, captured_);
  probe_.capture(slot_, tile, placed_);
  check_vertices(tile);
  check_shared(tile);
  const int levels = shape.levels();
  for (const PixelWindow& window : context_.oracle.windows()) {
    for (int level = 0; level < levels; ++level) check_level(tile, level, window);
  }
}

void TileVerifier::check_vertices(TileIndex tile) {
  const TileGrid& grid = source_.grid();
  const TileShape& shape = grid.shape();
  Worst worst;
  for (int row = 1; row < shape.rows() - 1; ++row) {
    for (int column = 1; column < shape.columns() - 1; ++column) {
      const GridVertex vertex{column, row};
      if (!is_visible(shape, vertex)) continue;
      ++report_.vertices;
      const auto i = static_cast<std::size_t>(row * shape.columns() + column);
      const ProbedVertex& got = captured_[i];
      const ObjectVertex place = object_from_grid(shape, vertex);
      const double x = place.x * grid.sigma_x();
      const double z = place.z * grid.sigma_z();
      const double y = source_.scale().scale * codes_[i];
      // Three float roundings of each coordinate.
      const auto near = [](double a, double b) { return std::abs(a - b) <= 4e-7 * std::max(std::abs(b), 1e-30); };
      if (got.code != static_cast<float>(codes_[i]) || !near(got.x, x) || !near(got.y, y) || !near(got.z, z)) {
        worst.add(std::abs(got.code - static_cast<double>(codes_[i])), [&] {
          return fmt::format("{}: drawn at ({}, {}, {}) with code {}, required ({}, {}, {}) with code {}",
                             vertex_name(vertex), got.x, got.y, got.z, got.code, x, y, z, codes_[i]);
        });
      }
      const Normal& want = normals_[i];
      const double off = std::max({std::abs(got.nx - want.x), std::abs(got.ny - want.y), std::abs(got.nz - want.z)});
      report_.worst_normal = std::max(report_.worst_normal, off);
      if (off > kNormalTolerance) {
        worst.add(off, [&] {
          return fmt::format("{}: normal ({}, {}, {}), library ({}, {}, {})", vertex_name(vertex), got.nx, got.ny,
                             got.nz, want.x, want.y, want.z);
        });
      }
    }
  }
  worst.report(report_, finding::kDrawnVertex, tile, 0);
}

// Every stored vertex near the rim lies in a neighbour's array as well, padding included: the codes must be the same
// and, if both see the vertex, the shader must give it the same place and normal, bit for bit.
void TileVerifier::check_shared(TileIndex tile) {
  const TileGrid& grid = source_.grid();
  const TileShape& shape = grid.shape();
  if (tile.row != seen_row_) {
    seen_row_ = tile.row;
    std::erase_if(seen_, [&](const auto& entry) { return entry.second.tile.row < tile.row - 1; });
  }
  Worst codes;
  Worst places;
  Worst normals;
  for (int row = 0; row < shape.rows(); ++row) {
    const bool rim_row = row < 3 || row >= shape.rows() - 3;
    for (int column = 0; column < shape.columns(); ++column) {
      if (!rim_row && column == 3 && shape.columns() > 8) column = shape.columns() - 5;
      if (row % 2 == 1 && column == shape.columns() - 1) continue;  // stored, but nobody's neighbour
      const GridVertex vertex{column, row};
      const auto i = static_cast<std::size_t>(row * shape.columns() + column);
      const SharedVertex here{codes_[i], is_visible(shape, vertex), placed_[i], tile};
      const auto [found, fresh] = seen_.try_emplace(lattice_key(grid.lattice_vertex(tile, vertex)), here);
      if (fresh) continue;
      SharedVertex& there = found->second;
      ++report_.shared_vertices;
      const ProbedVertex& a = here.drawn;
      const ProbedVertex& b = there.drawn;
      const bool both_visible = here.is_visible && there.is_visible;
      if (there.code != here.code) {
        codes.add(std::abs(there.code - here.code), [&] {
          return fmt::format("{}: code {}, tile ({},{}) stores {} at the same place", vertex_name(vertex), here.code,
                             there.tile.column, there.tile.row, there.code);
        });
      } else if (both_visible && (a.x != b.x || a.y != b.y || a.z != b.z)) {
        places.add(std::max({std::abs(a.x - b.x), std::abs(a.y - b.y), std::abs(a.z - b.z)}), [&] {
          return fmt::format("{}: drawn at ({}, {}, {}), in tile ({},{}) at ({}, {}, {})", vertex_name(vertex), a.x,
                             a.y, a.z, there.tile.column, there.tile.row, b.x, b.y, b.z);
        });
      } else if (both_visible && (a.nx != b.nx || a.ny != b.ny || a.nz != b.nz)) {
        normals.add(std::max(std::abs(a.nx - b.nx), std::abs(a.nz - b.nz)), [&] {
          return fmt::format("{}: normal ({}, {}, {}), in tile ({},{}) ({}, {}, {})", vertex_name(vertex), a.nx, a.ny,
                             a.nz, there.tile.column, there.tile.row, b.nx, b.ny, b.nz);
        });
      }
      if (!there.is_visible && here.is_visible) there = here;
    }
  }
  codes.report(report_, finding::kSharedVertex, tile, 0);
  places.report(report_, finding::kDrawnCrack, tile, 0);
  if (!codes.any()) normals.report(report_, finding::kNormal, tile, 0);  // else these follow from the codes
}

void TileVerifier::check_level(TileIndex tile, int level, const PixelWindow& window) {
  const TileShape& shape = source_.grid().shape();
  const std::span<const PixelSample> samples = context_.oracle.samples(level, window);
  probe_.draw_level(slot_, level, window, pixels_);
  ++report_.pictures;
  Worst coverage;
  Worst height;
  const double reach = window.x0 + window.z0 + window.width + window.height;
  for_each_pixel(window, probe_.width(), [&](int i, int j, std::size_t k, std::size_t at) {
    const PixelSample& sample = samples[k];
    const SampledCode want = sample_code(sample, codes_);
    const float* got = pixels_.data() + at;
    ++report_.pixels;
    const float required = want.valid ? 1.0F : 0.0F;
    if (got[3] != required) {
      coverage.add(std::abs(got[3] - required), [&] {
        return fmt::format("{}: drawn {} times, required {}", pixel_name(shape, window, i, j, sample), got[3],
                           required);
      });
      return;
    }
    if (!want.valid) return;
    const double off = std::abs(got[0] - want.code);
    report_.worst_height = std::max(report_.worst_height, off);
    if (off > kCodeTolerance + want.spread * reach * kPerPixel) {
      height.add(off, [&] {
        return fmt::format("{}: code {:.3f}, library {:.3f}", pixel_name(shape, window, i, j, sample), got[0],
                           want.code);
      });
    }
  });
  coverage.report(report_, finding::kDrawnCoverage, tile, level);
  height.report(report_, finding::kDrawnHeight, tile, level);
}

}  // namespace

void verify_tiles(const CheckContext& context) {
  const TileGrid& grid = context.source.grid();
  TileVerifier verifier(context);
  for (std::int64_t flat = 0; flat < grid.tile_count(); ++flat) {
    const TileIndex tile = grid.tile_at(flat);
    if (context.options.tiles && !context.options.tiles->contains(tile)) continue;
    verifier.verify(tile);
    if (context.options.progress) context.options.progress("tiles", flat + 1, grid.tile_count());
  }
}

}  // namespace isohf::view
