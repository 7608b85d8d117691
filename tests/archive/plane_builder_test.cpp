#include "isohf/archive/planes/plane_builder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>

#include "isohf/archive/tile/tile_encoder.h"
#include "lattice/vertex_below.h"

namespace isohf {
namespace {

/// Tiles of a rough field, void on the first ones' ground and here and there.
class Field {
 public:
  Field(const TileGrid& grid, CodeType type, bool wraps_x) : grid_(grid), type_(type), wraps_x_(wraps_x) {}

  [[nodiscard]] TileCodes codes(TileIndex tile) const {
    TileCodes codes = void_tile(grid_.shape(), {type_, 0.0, 1.0});
    for (int r = 0; r < grid_.shape().rows(); ++r) {
      for (int c = 0; c < grid_.shape().columns(); ++c) {
        const auto at = static_cast<std::size_t>(r) * static_cast<std::size_t>(grid_.shape().columns()) +
                        static_cast<std::size_t>(c);
        const LatticeVertex v = grid_.lattice_vertex(tile, {c, r});
        const std::int64_t width = grid_.tile_columns() * 2 * grid_.shape().cell_columns();
        const std::uint32_t code = at_place({wraps_x_ ? (v.x + width) % width : v.x, v.z});
        if (code == kVoid) continue;
        if (type_ == CodeType::kF32) codes.heights[at] = static_cast<float>(code) - 90.5F;
        if (type_ != CodeType::kF32) codes.codes[at] = static_cast<std::uint16_t>(code);
      }
    }
    return codes;
  }

 private:
  static constexpr std::uint32_t kVoid = 0xFFFFFFFF;
  [[nodiscard]] std::uint32_t at_place(LatticeVertex v) const {
    if (v.x <= 4 * grid_.shape().cell_columns() && v.z <= 2 * grid_.shape().cell_rows()) return kVoid;
    const auto mixed = static_cast<std::uint32_t>((v.x + 17) * 73856093 ^ (v.z + 31) * 19349663);
    return mixed % 11 == 0 ? kVoid : (mixed >> 7U) % 200;
  }

  TileGrid grid_;
  CodeType type_;
  bool wraps_x_;
};

/// A finished plane's tiles.
struct Made {
  TileCodes codes;
  EncodedTile encoded;
};
using MadeTiles = std::map<std::tuple<int, std::int64_t, std::int64_t>, Made>;

class Recorder {
 public:
  explicit Recorder(const Planes& planes, CodeType type, const ScratchFolder& scratch = std::nullopt)
      : builder(
            planes, type,
            [&planes](const TileCodes& codes) {
              EncodedTile encoded = encode_tile(planes.grid(0).shape(), codes, Effort::kFast);
              encoded.deflated.clear();
              const auto bytes = [&](const auto& values) {
                const auto span = std::as_bytes(std::span(values));
                encoded.deflated.assign(span.begin(), span.end());
              };
              codes.type == CodeType::kF32 ? bytes(codes.heights) : bytes(codes.codes);
              return encoded;
            },
            [this](int plane, TileIndex tile, const EncodedTile& encoded) {
              order.push_back({plane, tile.row, tile.column});
              Made& now = made[order.back()];
              now.encoded = encoded;
            },
            scratch) {}
  std::vector<std::tuple<int, std::int64_t, std::int64_t>> order;
  MadeTiles made;
  PlaneBuilder builder;
};

template <typename T>
T value(const EncodedTile& encoded, std::size_t at) {
  T value;
  std::memcpy(&value, encoded.deflated.data() + at * sizeof value, sizeof value);
  return value;
}

PlaneSample sample_of(const PlaneBuilder& builder, const TileShape& shape, const TileCodes& codes) {
  const EncodedTile encoded = encode_tile(shape, codes, Effort::kFast);
  return encoded.is_empty ? PlaneSample() : builder.sample(codes, encoded.code_min, encoded.code_max);
}

std::uint32_t bits(float height) {
  return std::isnan(height) ? 0xFFFFFFFF : std::bit_cast<std::uint32_t>(height);
}

struct Case {
  TileShape shape;
  int stride;
  std::int64_t columns;
  std::int64_t rows;
  CodeType type;
  bool wraps_x;
};

std::vector<Case> cases() {
  std::vector<Case> all;
  const TileShape shape = TileShape::make(12, 19, 4);
  for (const CodeType type : {CodeType::kU16, CodeType::kU8, CodeType::kF32}) {
    for (const auto& [columns, rows] : {std::pair{9, 10}, {8, 3}, {1, 17}, {17, 2}}) {
      all.push_back({shape, 8, columns, rows, type, false});
    }
    all.push_back({shape, 8, 8, 9, type, true});
    all.push_back({shape, 8, 9, 8, type, true});
    all.push_back({TileShape::make(8, 7, 2), 2, 11, 13, type, false});
    all.push_back({TileShape::make(8, 11, 3), 4, 16, 5, type, true});
  }
  return all;
}

std::string name_of(const Case& c) {
  return std::to_string(c.columns) + "x" + std::to_string(c.rows) + " tiles, stride " + std::to_string(c.stride) +
         ", " + to_string(c.type) + (c.wraps_x ? ", joined" : "");
}

TEST(PlaneBuilder, CodesAreThoseOfTheVerticesBelow) {
  for (const Case& c : cases()) {
    const TileGrid grid = TileGrid::make(c.shape, c.columns, c.rows, 1.0, 1.0);
    const Planes planes(grid, c.stride, plane_count(grid, c.stride), c.wraps_x);
    const Field field(grid, c.type, c.wraps_x);
    Recorder recorder(planes, c.type);
    std::vector<TileCodes> tiles;
    for (std::int64_t i = 0; i < grid.tile_count(); ++i) {
      tiles.push_back(field.codes(grid.tile_at(i)));
      recorder.builder.add(sample_of(recorder.builder, c.shape, tiles.back()));
    }
    for (int plane = 1; plane <= planes.count(); ++plane) {
      const TileGrid& coarse = planes.grid(plane);
      for (std::int64_t i = 0; i < coarse.tile_count(); ++i) {
        const TileIndex tile = coarse.tile_at(i);
        ASSERT_TRUE(recorder.made.count({plane, tile.row, tile.column})) << name_of(c);
        const EncodedTile& made = recorder.made.at({plane, tile.row, tile.column}).encoded;
        bool is_void = true;
        for (std::int64_t v = 0; v < c.shape.stored_vertex_count(); ++v) {
          const GridVertex vertex{static_cast<int>(v % c.shape.columns()), static_cast<int>(v / c.shape.columns())};
          const test::TileVertex below = test::vertex_below(planes, plane, tile, vertex);
          const TileCodes& from = tiles[static_cast<std::size_t>(grid.flat_index(below.tile))];
          const auto at = static_cast<std::size_t>(below.vertex.row * c.shape.columns() + below.vertex.column);
          const bool beyond = planes.is_beyond(plane, coarse.lattice_vertex(tile, vertex));
          std::uint32_t wanted = 0;
          std::uint32_t none = 0;
          if (c.type == CodeType::kF32) {
            none = bits(NAN);
            wanted = bits(from.heights[at]);
          } else {
            none = Quantisation{c.type, 0.0, 1.0}.void_code();
            wanted = from.codes[at];
          }
          if (beyond) wanted = none;
          is_void = is_void && wanted == none;
          if (made.deflated.empty()) continue;
          ASSERT_EQ(c.type == CodeType::kF32 ? bits(value<float>(made, static_cast<std::size_t>(v)))
                                             : value<std::uint16_t>(made, static_cast<std::size_t>(v)),
                    wanted)
              << name_of(c) << " plane " << plane << " tile " << tile.column << "," << tile.row << " column "
              << vertex.column << " row " << vertex.row;
        }
        ASSERT_EQ(made.is_empty, is_void) << name_of(c);
      }
    }
  }
}

TEST(PlaneBuilder, RangesAreThoseOfAllTilesBelow) {
  for (const Case& c : cases()) {
    const TileGrid grid = TileGrid::make(c.shape, c.columns, c.rows, 1.0, 1.0);
    const Planes planes(grid, c.stride, plane_count(grid, c.stride), c.wraps_x);
    const Field field(grid, c.type, c.wraps_x);
    Recorder recorder(planes, c.type);
    const auto value_of = [&](std::uint32_t code) {
      return c.type == CodeType::kF32 ? std::bit_cast<float>(code) : static_cast<float>(code);
    };
    std::map<std::tuple<int, std::int64_t, std::int64_t>, std::pair<float, float>> wanted;
    for (std::int64_t i = 0; i < grid.tile_count(); ++i) {
      const EncodedTile encoded = encode_tile(c.shape, field.codes(grid.tile_at(i)), Effort::kFast);
      recorder.builder.add(sample_of(recorder.builder, c.shape, field.codes(grid.tile_at(i))));
      if (encoded.is_empty) continue;
      TileIndex above = grid.tile_at(i);
      for (int plane = 1; plane <= planes.count(); ++plane) {
        above = planes.above(above);
        auto& [low, high] = wanted.try_emplace({plane, above.row, above.column}, 1e9F, -1e9F).first->second;
        low = std::min(low, value_of(encoded.code_min));
        high = std::max(high, value_of(encoded.code_max));
      }
    }
    for (const auto& [place, range] : wanted) {
      const EncodedTile& made = recorder.made.at(place).encoded;
      ASSERT_EQ(value_of(made.code_min), range.first) << name_of(c);
      ASSERT_EQ(value_of(made.code_max), range.second) << name_of(c);
    }
  }
}

TEST(PlaneBuilder, GoesOnAfterAnyTileAsIfItHadNeverStoppedInMemoryAndInAScratchFile) {
  for (const Case& c : cases()) {
    const TileGrid grid = TileGrid::make(c.shape, c.columns, c.rows, 1.0, 1.0);
    const Planes planes(grid, c.stride, plane_count(grid, c.stride), c.wraps_x);
    const Field field(grid, c.type, c.wraps_x);
    Recorder whole(planes, c.type);
    std::vector<std::size_t> handed_on;  // before each tile
    for (std::int64_t i = 0; i < grid.tile_count(); ++i) {
      handed_on.push_back(whole.order.size());
      whole.builder.add(sample_of(whole.builder, c.shape, field.codes(grid.tile_at(i))));
    }
    for (std::int64_t done = 0; done < grid.tile_count(); done += 1 + done / 3) {
      Recorder rest(planes, c.type, done % 2 == 0 ? ScratchFolder(testing::TempDir()) : std::nullopt);
      rest.builder.resume_after(done, [&](int plane, TileIndex tile) {
        PlaneBuilder::Stored stored;
        if (plane == 0) {
          stored.codes = field.codes(tile);
          stored.entry = encode_tile(c.shape, stored.codes, Effort::kFast);
          return stored;
        }
        stored.entry = whole.made.at({plane, tile.row, tile.column}).encoded;
        stored.codes = void_tile(c.shape, {c.type, 0.0, 1.0});
        const auto copy = [&](auto& values) {
          std::memcpy(values.data(), stored.entry.deflated.data(), stored.entry.deflated.size());
        };
        if (stored.entry.is_empty) stored.entry.code_min = stored.entry.code_max = 0;  // as an archive says
        c.type == CodeType::kF32 ? copy(stored.codes.heights) : copy(stored.codes.codes);
        return stored;
      });
      for (std::int64_t i = done; i < grid.tile_count(); ++i) {
        rest.builder.add(sample_of(rest.builder, c.shape, field.codes(grid.tile_at(i))));
      }
      const auto first = whole.order.begin() + static_cast<std::ptrdiff_t>(handed_on[static_cast<std::size_t>(done)]);
      ASSERT_EQ(rest.order, (std::vector(first, whole.order.end()))) << name_of(c) << " after " << done;
      for (const auto& [place, made] : rest.made) {
        const EncodedTile& wanted = whole.made.at(place).encoded;
        ASSERT_EQ(made.encoded.content_digest, wanted.content_digest) << name_of(c) << " after " << done;
        ASSERT_EQ(made.encoded.code_min, wanted.code_min) << name_of(c) << " after " << done;
        ASSERT_EQ(made.encoded.code_max, wanted.code_max) << name_of(c) << " after " << done;
      }
    }
  }
}

TEST(PlaneBuilder, NegativeZeroComesBeforeZeroWhicheverTileIsFirst) {
  const TileGrid grid = TileGrid::make(TileShape::make(8, 7, 2), 2, 1, 1.0, 1.0);
  const Planes planes(grid, 2, 1, false);
  for (const float first : {0.0F, -0.0F}) {
    Recorder recorder(planes, CodeType::kF32);
    TileCodes tile = void_tile(grid.shape(), {CodeType::kF32, 0.0, 1.0});
    for (const float height : {first, -first}) {
      std::ranges::fill(tile.heights, height);
      recorder.builder.add(sample_of(recorder.builder, grid.shape(), tile));
    }
    const EncodedTile& made = recorder.made.at({1, 0, 0}).encoded;
    EXPECT_EQ(made.code_min, bits(-0.0F));
    EXPECT_EQ(made.code_max, bits(0.0F));
  }
}

}  // namespace
}  // namespace isohf
