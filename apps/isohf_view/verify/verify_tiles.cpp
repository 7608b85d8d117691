#include "verify/verify_tiles.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "isohf/error.h"
#include "isohf/lattice/lod.h"
#include "verify/verify_places.h"

namespace isohf::view {
namespace {

constexpr double kNormalTolerance = 1e-4;  ///< float roundings of 1

std::uint64_t lattice_key(LatticeVertex vertex) {
  return static_cast<std::uint64_t>(vertex.x) * 0x1000000000U + (static_cast<std::uint64_t>(vertex.z) & 0xFFFFFFFFFU);
}

}  // namespace

TileVerifier::TileVerifier(const TileSource& source, const SharedGeometry& shared, MeshOracle& oracle, TileProbe& probe,
                           const VerifyOptions& options, VerifyReport& report)
    : source_(source),
      options_(options),
      report_(report),
      oracle_(oracle),
      probe_(probe),
      slot_(shared),
      codes_(static_cast<std::size_t>(source.grid().shape().stored_vertex_count())),
      normals_(codes_.size()) {}

void TileVerifier::compute_normals() {
  const TileShape& shape = source_.grid().shape();
  std::vector<float> heights(codes_.size());
  std::transform(codes_.begin(), codes_.end(), heights.begin(), [this](std::uint16_t code) {
    return code == kVoidCode ? std::numeric_limits<float>::quiet_NaN()
                             : static_cast<float>(source_.scale().scale * code);
  });
  tile_normals(source_.grid(), View2D<const float>(heights.data(), shape.columns(), shape.rows()),
               View2D<Normal>(normals_.data(), shape.columns(), shape.rows()));
}

void TileVerifier::verify(TileIndex tile) {
  ++report_.tiles;
  const TileBounds bounds = source_.bounds(tile);
  try {
    source_.read(tile, codes_);
  } catch (const Error& error) {
    report_.add({Check::kReadable, tile, 0.0, error.what(), 0.0, 1});
    return;
  }
  slot_.upload(codes_);
  compute_normals();
  const bool voids = bounds.has_voids || !bounds.stored;
  probe_.capture(slot_, voids, captured_);
  check_vertices(tile);
  check_shared(tile);
  const int levels = source_.grid().shape().levels();
  for (const PixelWindow& window : oracle_.windows()) {
    for (int level = 0; level < levels; ++level) {
      check_level(tile, voids, level, window);
      if (level + 1 == levels) continue;
      for (const double fraction : options_.fractions) check_transition(tile, voids, level + fraction, window);
    }
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
  if (worst.any()) report_.add(worst.finding(Check::kVertex, tile, 0.0));
}

// Every stored vertex near the rim lies in a neighbour's array as well, padding included: the codes must be the same
// and, where both see the vertex, the shader's normals must be the same bits.
void TileVerifier::check_shared(TileIndex tile) {
  const TileGrid& grid = source_.grid();
  const TileShape& shape = grid.shape();
  if (tile.row != seen_row_) {
    seen_row_ = tile.row;
    std::erase_if(seen_, [&](const auto& entry) { return entry.second.tile.row < tile.row - 1; });
  }
  Worst worst;
  for (int row = 0; row < shape.rows(); ++row) {
    const bool rim_row = row < 3 || row >= shape.rows() - 3;
    for (int column = 0; column < shape.columns(); ++column) {
      if (!rim_row && column == 3 && shape.columns() > 8) column = shape.columns() - 5;
      if (row % 2 == 1 && column == shape.columns() - 1) continue;  // stored, but nobody's neighbour
      const GridVertex vertex{column, row};
      const auto i = static_cast<std::size_t>(row * shape.columns() + column);
      SharedVertex here{codes_[i], is_visible(shape, vertex), 0.0F, 0.0F, 0.0F, tile};
      if (here.has_normal) {
        here.nx = captured_[i].nx;
        here.ny = captured_[i].ny;
        here.nz = captured_[i].nz;
      }
      const auto [found, fresh] = seen_.try_emplace(lattice_key(grid.lattice_vertex(tile, vertex)), here);
      if (fresh) continue;
      SharedVertex& there = found->second;
      ++report_.shared_vertices;
      if (there.code != here.code) {
        worst.add(std::abs(there.code - here.code), [&] {
          return fmt::format("{}: code {}, tile ({},{}) stores {} at the same place", vertex_name(vertex), here.code,
                             there.tile.column, there.tile.row, there.code);
        });
      } else if (there.has_normal && here.has_normal &&
                 (there.nx != here.nx || there.ny != here.ny || there.nz != here.nz)) {
        worst.add(std::max(std::abs(there.nx - here.nx), std::abs(there.nz - here.nz)), [&] {
          return fmt::format("{}: normal ({}, {}, {}), in tile ({},{}) ({}, {}, {})", vertex_name(vertex), here.nx,
                             here.ny, here.nz, there.tile.column, there.tile.row, there.nx, there.ny, there.nz);
        });
      }
      if (!there.has_normal && here.has_normal) there = here;
    }
  }
  if (worst.any()) report_.add(worst.finding(Check::kShared, tile, 0.0));
}

void TileVerifier::check_level(TileIndex tile, bool voids, int level, const PixelWindow& window) {
  const TileShape& shape = source_.grid().shape();
  const std::span<const PixelSample> samples = oracle_.samples(level, window);
  probe_.draw_level(slot_, voids, level, window, true, pixels_);
  ++report_.pictures;
  Worst coverage;
  Worst height;
  Worst normal;
  const int target_width = probe_.width();
  for (int j = 0; j < window.height; ++j) {
    for (int i = 0; i < window.width; ++i) {
      const PixelSample& sample = samples[static_cast<std::size_t>(j * window.width + i)];
      const std::size_t at = 4 * static_cast<std::size_t>((window.height - 1 - j) * target_width + i);
      const SampledCode want = sample_code(sample, codes_);
      const float* got = pixels_.data() + at;
      ++report_.pixels;
      const float required = want.valid ? 1.0F : 0.0F;
      if (got[3] != required) {
        coverage.add(std::abs(got[3] - required), [&] {
          return fmt::format("{}: drawn {} times, required {}", pixel_name(shape, window, i, j, sample), got[3],
                             required);
        });
        continue;
      }
      if (!want.valid) continue;
      const double reach = window.x0 + window.z0 + window.width + window.height;
      const double off = std::abs(got[0] - want.code);
      report_.worst_height = std::max(report_.worst_height, off);
      if (off > kCodeTolerance + want.spread * reach * kPerPixel) {
        height.add(off, [&] {
          return fmt::format("{}: code {:.3f}, library {:.3f}", pixel_name(shape, window, i, j, sample), got[0],
                             want.code);
        });
      }
      double nx = 0.0;
      double nz = 0.0;
      for (std::size_t k = 0; k < 3; ++k) {
        nx += static_cast<double>(sample.weights[k]) * normals_[sample.vertices[k]].x;
        nz += static_cast<double>(sample.weights[k]) * normals_[sample.vertices[k]].z;
      }
      const double turn = std::max(std::abs(got[1] - nx), std::abs(got[2] - nz));
      report_.worst_normal = std::max(report_.worst_normal, turn);
      if (turn > kNormalTolerance + 2.0 * reach * kPerPixel) {
        normal.add(turn, [&] {
          return fmt::format("{}: normal x, z ({:.5f}, {:.5f}), library ({:.5f}, {:.5f})",
                             pixel_name(shape, window, i, j, sample), got[1], got[2], nx, nz);
        });
      }
    }
  }
  if (coverage.any()) diagnose_coverage(voids, level, window, coverage.finding(Check::kCoverage, tile, level));
  if (height.any()) report_.add(height.finding(Check::kHeight, tile, level));
  if (normal.any()) report_.add(normal.finding(Check::kNormal, tile, level));
}

/// A tile that is whole once back faces are drawn too has triangles that wind the wrong way.
void TileVerifier::diagnose_coverage(bool voids, int level, const PixelWindow& window, const Finding& finding) {
  const std::span<const PixelSample> samples = oracle_.samples(level, window);
  probe_.draw_level(slot_, voids, level, window, false, pixels_);
  bool whole = true;
  for (int j = 0; j < window.height && whole; ++j) {
    for (int i = 0; i < window.width && whole; ++i) {
      const SampledCode want = sample_code(samples[static_cast<std::size_t>(j * window.width + i)], codes_);
      const std::size_t at = 4 * static_cast<std::size_t>((window.height - 1 - j) * probe_.width() + i);
      whole = pixels_[at + 3] == (want.valid ? 1.0F : 0.0F);
    }
  }
  Finding shown = finding;
  if (whole) {
    shown.check = Check::kWinding;
    shown.where += " (whole once back faces are drawn: the triangle faces down)";
  }
  report_.add(shown);
}

// Seen from above the first mesh covers all; the second, fading in with alpha, shows where it lies higher.
void TileVerifier::check_transition(TileIndex tile, bool voids, double level, const PixelWindow& window) {
  const TileShape& shape = source_.grid().shape();
  const LodBlend blend = lod_blend(level, shape.levels());
  const std::span<const PixelSample> first_kept = oracle_.samples(blend.first, window);
  const std::vector<PixelSample> first(first_kept.begin(), first_kept.end());
  const std::span<const PixelSample> second = oracle_.samples(blend.second, window);
  probe_.draw_blend(slot_, voids, blend, window, pixels_);
  ++report_.pictures;
  Worst worst;
  const double reach = window.x0 + window.z0 + window.width + window.height;
  for (int j = 0; j < window.height; ++j) {
    for (int i = 0; i < window.width; ++i) {
      const auto k = static_cast<std::size_t>(j * window.width + i);
      const SampledCode under = sample_code(first[k], codes_);
      const SampledCode over = sample_code(second[k], codes_);
      if (!under.valid || !over.valid) continue;
      ++report_.pixels;
      const double want = under.code + blend.alpha * std::max(over.code - under.code, 0.0);
      const double got = pixels_[4 * static_cast<std::size_t>((window.height - 1 - j) * probe_.width() + i)];
      const double off = std::abs(got - want);
      report_.worst_height = std::max(report_.worst_height, off);
      if (off > 2.0 * kCodeTolerance + (under.spread + over.spread) * reach * kPerPixel) {
        worst.add(off, [&] {
          return fmt::format("{}: code {:.3f}, required {:.3f} (levels {} at {:.3f} and {} at {:.3f}, alpha {:.2f})",
                             pixel_name(shape, window, i, j, first[k]), got, want, blend.first, under.code,
                             blend.second, over.code, blend.alpha);
        });
      }
    }
  }
  if (worst.any()) report_.add(worst.finding(Check::kTransition, tile, level));
}

}  // namespace isohf::view
