#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "isohf/error.h"
#include "isohf/lattice/barycentric.h"
#include "verify/verify_view.h"

namespace isohf::view {
namespace {

constexpr int kBlockTiles = 3;  ///< in each direction; neighbouring blocks overlap by one tile
constexpr int kMargin_px = 40;  ///< beside the slanted picture
constexpr int kLargest_px = 4096;

/// Firsts of blocks along an axis, so that every two neighbours are together in one.
std::vector<std::int64_t> block_firsts(std::int64_t from, std::int64_t end) {
  std::vector<std::int64_t> firsts;
  for (std::int64_t first = from; first == from || first < end - 1; first += kBlockTiles - 1) firsts.push_back(first);
  return firsts;
}

class SeamVerifier {
 public:
  explicit SeamVerifier(const CheckContext& context);
  /// All blocks.
  void verify();

 private:
  struct Block {
    TileIndex first{};
    int columns = 0;
    int rows = 0;
    std::vector<std::vector<std::uint16_t>> codes;  ///< voids filled: a hole is no crack
  };
  struct Slant {
    bool along_x = true;
    double px_per_code = 0.0;  ///< k, with its sign
  };

  bool load(Block& block);
  void verify_block(const Block& block, std::int64_t number);
  void slanted(const Block& block, int even_level, int odd_level, const Slant& slant);
  void from_above(const Block& block, int even_level, int odd_level);
  /// Background is black.
  [[nodiscard]] std::vector<std::uint8_t> draw(const Block& block, const TerrainFrame& frame, int even_level,
                                               int odd_level, int width, int height);
  [[nodiscard]] double code_at(const Block& block, double x, double z) const;  ///< block's object space
  [[nodiscard]] double rough_step(const Block& block) const;
  [[nodiscard]] ViewFinding describe(const Block& block, const Slant& slant, int even_level, int odd_level,
                                     double along_px, double across) const;

  const CheckContext& context_;
  const TileSource& source_;
  const SharedGeometry& shared_;
  const ViewChecks& options_;
  const isohf::TileRange here_;
  ViewReport& report_;
  TerrainProgram program_;
  std::vector<TileSlot> slots_;
  std::uint16_t fill_;
  double middle_;
  std::optional<Offscreen> target_;
};

SeamVerifier::SeamVerifier(const CheckContext& context)
    : context_(context),
      source_(context.source),
      shared_(context.shared),
      options_(context.options),
      here_(context.here),
      report_(context.report),
      program_("seam", false, flat_fragment_shader(false)) {
  const TileBounds whole = whole_bounds(source_);
  const ViewScale scale = source_.scale();
  fill_ = static_cast<std::uint16_t>(std::clamp((whole.low - scale.offset) / scale.scale, 0.0, 65534.0));
  middle_ = (0.5 * (whole.low + whole.high) - scale.offset) / scale.scale;
  for (int i = 0; i < kBlockTiles * kBlockTiles; ++i) slots_.emplace_back(shared_);
}

bool SeamVerifier::load(Block& block) {
  const TileGrid& grid = source_.grid();
  block.columns = static_cast<int>(std::min<std::int64_t>(kBlockTiles, here_.end.column - block.first.column));
  block.rows = static_cast<int>(std::min<std::int64_t>(kBlockTiles, here_.end.row - block.first.row));
  for (int row = 0; row < block.rows; ++row) {
    for (int column = 0; column < block.columns; ++column) {
      std::vector<std::uint16_t> codes(static_cast<std::size_t>(grid.shape().stored_vertex_count()));
      try {
        source_.read({block.first.column + column, block.first.row + row}, codes);
      } catch (const Error&) {
        return false;  // the tile's own check has said so
      }
      std::replace(codes.begin(), codes.end(), kVoidCode, fill_);
      slots_[block.codes.size()].upload(codes);
      block.codes.push_back(std::move(codes));
    }
  }
  return true;
}

void SeamVerifier::verify() {
  std::int64_t number = 0;
  std::int64_t seen = 0;
  const auto rows = block_firsts(here_.first.row, here_.end.row);
  const auto columns = block_firsts(here_.first.column, here_.end.column);
  for (const std::int64_t row : rows) {
    for (const std::int64_t column : columns) {
      Block block;
      block.first = {column, row};
      const isohf::TileRange whole{{column, row}, {column + kBlockTiles, row + kBlockTiles}};
      const auto& wanted = options_.tiles;
      const bool is_wanted = number % options_.every == 0 && (!wanted || !intersection(*wanted, whole).is_empty());
      if (is_wanted && load(block)) verify_block(block, seen++);
      ++number;
      if (options_.progress)
        options_.progress("seams", number, static_cast<std::int64_t>(rows.size() * columns.size()));
    }
  }
}

void SeamVerifier::verify_block(const Block& block, std::int64_t number) {
  const int levels = source_.grid().shape().levels();
  const bool every_pair = source_.grid().tile_count() <= 16;
  // Shear so that an ordinary step of height is about one step of x; then four and sixteen times as much, for gentler
  // seams.
  const double gentle = 2.0 / std::max(rough_step(block), 1.0);
  int picture = 0;
  for (int even = 0; even < levels; ++even) {
    if (!context_.has_turn(number / levels, even, levels)) continue;
    for (int shift = 0; shift < levels; ++shift) {
      if (!every_pair && shift != number % levels) continue;
      const int odd = (even + shift) % levels;
      for (const bool along_x : {true, false}) {
        const double k = gentle * std::array{1.0, 4.0, 16.0}[static_cast<std::size_t>(picture++ % 3)];
        slanted(block, even, odd, {along_x, k});
        slanted(block, even, odd, {along_x, -k});
      }
      if (every_pair || context_.takes_turns || even == number % levels) from_above(block, even, odd);
    }
  }
}

double SeamVerifier::rough_step(const Block& block) const {
  std::vector<int> steps;
  for (const auto& codes : block.codes) {
    for (std::size_t i = 1; i < codes.size(); i += 37) steps.push_back(std::abs(codes[i] - codes[i - 1]));
  }
  const auto at = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() * 9 / 10);
  std::nth_element(steps.begin(), at, steps.end());
  return *at;
}

double SeamVerifier::code_at(const Block& block, double x, double z) const {
  const TileShape& shape = source_.grid().shape();
  const double width = 2.0 * shape.cell_columns();
  const double height = shape.cell_rows();
  const int column = std::clamp(static_cast<int>(x / width), 0, block.columns - 1);
  const int row = std::clamp(static_cast<int>(z / height), 0, block.rows - 1);
  const auto& codes = block.codes[static_cast<std::size_t>(row * block.columns + column)];
  return interpolate(barycentric(shape, {x - column * width, z - row * height}),
                     View2D<const std::uint16_t>(codes.data(), shape.columns(), shape.rows()));
}

std::vector<std::uint8_t> SeamVerifier::draw(const Block& block, const TerrainFrame& frame, int even_level,
                                             int odd_level, int width, int height) {
  if (!target_ || target_->width() != width || target_->height() != height) {
    target_.reset();
    target_.emplace(width, height, GL_RGBA8);
  }
  target_->bind();
  glViewport(0, 0, width, height);
  glClearColor(0.0F, 0.0F, 0.0F, 0.0F);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  // Slanted, triangles may stand edge-on; a driver may call such a one back-facing and yet need it for a pixel. Which
  // way triangles face is checked from above.
  glDisable(GL_CULL_FACE);
  const TileGrid& grid = source_.grid();
  program_.begin(grid, frame);
  glUniform4f(program_.uniform("flat_colour"), 1.0F, 1.0F, 1.0F, 1.0F);
  for (int row = 0; row < block.rows; ++row) {
    for (int column = 0; column < block.columns; ++column) {
      const int level = (row + column) % 2 == 0 ? even_level : odd_level;
      program_.set_tile(grid, frame, {block.first.column + column, block.first.row + row});
      slots_[static_cast<std::size_t>(row * block.columns + column)].bind();
      shared_.draw_strip(level);
      if (shared_.has_stitch(level)) shared_.draw_stitch(level);
    }
  }
  ++report_.pictures;
  return target_->read_rgba8();
}

void SeamVerifier::slanted(const Block& block, int even_level, int odd_level, const Slant& slant) {
  const TileGrid& grid = source_.grid();
  const double width = 2.0 * grid.shape().cell_columns() * block.columns;
  const double height = static_cast<double>(grid.shape().cell_rows()) * block.rows;
  // Along the slant two pixels a step of x, four a row of z; across it one pixel a step.
  const double along_size = slant.along_x ? width : height;
  const double across_size = slant.along_x ? height : width;
  const double along_px = std::min(slant.along_x ? 2.0 : 4.0, (kLargest_px - 2 * kMargin_px) / along_size);
  const double across_px = std::min(1.0, kLargest_px / across_size);
  const int along_count = static_cast<int>(along_size * along_px) + 2 * kMargin_px;
  const int across_count = std::max(1, static_cast<int>(across_size * across_px));
  const int picture_width = slant.along_x ? along_count : across_count;
  const int picture_height = slant.along_x ? across_count : along_count;

  TerrainFrame frame;
  frame.anchor_tile = block.first;
  frame.code_height = source_.scale().scale;
  frame.code_slope = frame.code_height;
  const double shear = slant.px_per_code / frame.code_height;
  Mat4 clip;
  const double x_px = slant.along_x ? along_px : across_px;
  const double z_px = slant.along_x ? across_px : along_px;
  clip.at(0, 0) = 2.0 * x_px / (grid.sigma_x() * picture_width);
  clip.at(1, 2) = -2.0 * z_px / (grid.sigma_z() * picture_height);
  clip.at(0, 3) = -1.0;
  clip.at(1, 3) = 1.0;
  const double offset_px = kMargin_px - slant.px_per_code * middle_;
  if (slant.along_x) {
    clip.at(0, 1) = 2.0 * shear / picture_width;
    clip.at(0, 3) += 2.0 * offset_px / picture_width;
  } else {
    clip.at(1, 1) = -2.0 * shear / picture_height;
    clip.at(1, 3) -= 2.0 * offset_px / picture_height;
  }
  clip.at(3, 3) = 1.0;
  frame.clip_from_eye = clip;
  const std::vector<std::uint8_t> pixels = draw(block, frame, even_level, odd_level, picture_width, picture_height);

  std::int64_t bare = 0;
  ViewFinding worst{};
  for (int line = 0; line < across_count; ++line) {
    const double across = (line + 0.5) / across_px;
    const auto end = [&](double along) {
      const double code = slant.along_x ? code_at(block, along, across) : code_at(block, across, along);
      return along * along_px + slant.px_per_code * code + offset_px;
    };
    const int from = std::max(0, static_cast<int>(std::ceil(end(0.0) + 0.1)));
    const int to = std::min(along_count, static_cast<int>(std::floor(end(along_size) - 1.1)) + 1);
    for (int i = from; i < to; ++i) {
      ++report_.seam_pixels;
      const int x = slant.along_x ? i : line;
      const int y = slant.along_x ? line : i;
      if (pixels[4 * static_cast<std::size_t>(y * picture_width + x)] != 0) continue;
      if (bare++ == 0) {
        worst = describe(block, slant, even_level, odd_level, (i + 0.5 - offset_px) / along_px, across);
      }
    }
  }
  if (bare == 0) return;
  worst.deviation = static_cast<double>(bare);
  worst.count = bare;
  report_.add(worst);
}

/// The place of the full-detail surface that would have been drawn at a bare pixel.
ViewFinding SeamVerifier::describe(const Block& block, const Slant& slant, int even_level, int odd_level, double along,
                                   double across) const {
  const TileShape& shape = source_.grid().shape();
  const double width = 2.0 * shape.cell_columns();
  const double height = shape.cell_rows();
  const double size = slant.along_x ? width * block.columns : height * block.rows;
  const double per_code = slant.px_per_code / (slant.along_x ? 2.0 : 4.0);
  double best = 0.0;
  double nearest = 1e300;
  for (double at = 0.0; at <= size; at += 0.5) {
    const double code = slant.along_x ? code_at(block, at, across) : code_at(block, across, at);
    const double miss = std::abs(at + per_code * code - along);
    if (miss < nearest) {
      nearest = miss;
      best = at;
    }
  }
  const double x = slant.along_x ? best : across;
  const double z = slant.along_x ? across : best;
  const int column = std::clamp(static_cast<int>(x / width), 0, block.columns - 1);
  const int row = std::clamp(static_cast<int>(z / height), 0, block.rows - 1);
  const TileIndex tile{block.first.column + column, block.first.row + row};
  const int level = (row + column) % 2 == 0 ? even_level : odd_level;
  return {finding::kDrawnCrack,
          tile,
          static_cast<double>(level),
          fmt::format("background shows near object space ({:.1f}, {:.1f}), slanted along {}, neighbours at level {}",
                      x - column * width, z - row * height, slant.along_x ? "x" : "z",
                      level == even_level ? odd_level : even_level),
          0.0,
          1};
}

void SeamVerifier::from_above(const Block& block, int even_level, int odd_level) {
  constexpr int kSize_px = 512;
  const TileGrid& grid = source_.grid();
  // Heights are squeezed to a fifth of the block, the eye stands two fifths above them and looks down at 80 degrees
  // with a field of view of 70: its view meets the lowest ground within half of the block's size.
  const double size = std::min(grid.extent_x() * block.columns, grid.extent_z() * block.rows);
  TerrainFrame frame;
  frame.anchor_tile = block.first;
  frame.code_height = 0.2 * size / 65535.0;
  frame.code_slope = frame.code_height;
  const double radians = std::acos(-1.0) / 180.0;
  frame.anchor = {-0.5 * grid.extent_x() * block.columns, -0.45 * size, -0.5 * grid.extent_z() * block.rows};
  const Vec3 forward{0.0, -std::sin(80.0 * radians), -std::cos(80.0 * radians)};
  frame.clip_from_eye = perspective(70.0 * radians, 1.0, 0.05 * size, 2.0 * size) * look_along(forward);
  const std::vector<std::uint8_t> pixels = draw(block, frame, even_level, odd_level, kSize_px, kSize_px);
  std::int64_t bare = 0;
  std::size_t first = 0;
  for (std::size_t i = 0; i < pixels.size(); i += 4) {
    if (pixels[i] == 0 && bare++ == 0) first = i / 4;
  }
  report_.seam_pixels += kSize_px * kSize_px;
  if (bare == 0) return;
  report_.add({finding::kDrawnCrack,
               {block.first.column + block.columns / 2, block.first.row + block.rows / 2},
               static_cast<double>(even_level),
               fmt::format("background shows through the block of {} x {} tiles from tile ({},{}), seen from above, at "
                           "pixel ({}, {}) of {}, levels {} and {}",
                           block.columns, block.rows, block.first.column, block.first.row, first % kSize_px,
                           first / kSize_px, kSize_px, even_level, odd_level),
               static_cast<double>(bare),
               bare});
}

}  // namespace

void verify_seams(const CheckContext& context) {
  SeamVerifier(context).verify();
}

}  // namespace isohf::view
