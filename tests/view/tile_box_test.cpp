#include "paging/tile_box.h"

#include <atomic>
#include <chrono>
#include <future>
#include <thread>

#include "gl_test.h"
#include "memory_tiles.h"

namespace isohf::view {
namespace {

using std::chrono::milliseconds;
using test::MemoryTiles;

TileGrid wide_grid() {
  return TileGrid::make(TileShape::make(12, 11, 3), 30, 20, 100.0, 100.0);
}

template <typename Value>
std::vector<Value> on_gpu(GLint buffer, int first) {
  std::vector<Value> values(static_cast<std::size_t>(wide_grid().shape().stored_vertex_count()));
  glBindBuffer(GL_COPY_READ_BUFFER, static_cast<GLuint>(buffer));
  glGetBufferSubData(GL_COPY_READ_BUFFER, 2 * first, static_cast<GLsizeiptr>(2 * values.size()), values.data());
  return values;
}
/// Of the buffer texture on the unit where shaders fetch codes. A row and two vertices of nothing lie before them.
std::vector<std::uint16_t> codes_on_gpu(const TileSlot& slot) {
  slot.bind();
  GLint buffer = 0;
  glActiveTexture(GL_TEXTURE2);
  glGetTexLevelParameteriv(GL_TEXTURE_BUFFER, 0, GL_TEXTURE_BUFFER_DATA_STORE_BINDING, &buffer);
  glActiveTexture(GL_TEXTURE0);
  glBindVertexArray(0);
  return on_gpu<std::uint16_t>(buffer, wide_grid().shape().columns() + 2);
}
/// Of the vertex attribute; empty where it has no buffer.
std::vector<std::int16_t> shadow_on_gpu(const TileSlot& slot) {
  slot.bind();
  GLint enabled = 0;
  GLint buffer = 0;
  glGetVertexAttribiv(1, GL_VERTEX_ATTRIB_ARRAY_ENABLED, &enabled);
  glGetVertexAttribiv(1, GL_VERTEX_ATTRIB_ARRAY_BUFFER_BINDING, &buffer);
  glBindVertexArray(0);
  return enabled == 0 ? std::vector<std::int16_t>() : on_gpu<std::int16_t>(buffer, 0);
}

class TileBoxTest : public test::GlTest {
 protected:
  static TileBoxLimits limits_for(std::uint64_t tiles, std::uint64_t per_frame) {
    const std::uint64_t bytes = TileSlot::bytes(wide_grid().shape());
    return {tiles * bytes, per_frame * bytes};
  }
  Workers workers_{2};
};

TEST_F(TileBoxTest, HoldsTheBoundingSquareOfTheCircle) {
  const MemoryTiles source(wide_grid());
  const SharedGeometry shared(source.grid().shape(), make_index_arrays(source.grid().shape()));
  TileBox box(source, shared, {}, workers_);
  box.finish({1550.0, 1050.0}, 220.0);
  for (std::int64_t row = 0; row < 20; ++row) {
    for (std::int64_t column = 0; column < 30; ++column) {
      const bool near =
          std::abs(static_cast<double>(column) - 15.0) < 2.8 && std::abs(static_cast<double>(row) - 10.0) < 2.8;
      EXPECT_TRUE(!near || box.resident({column, row}) != nullptr) << column << "," << row;
    }
  }
  EXPECT_LE(box.figures().resident_tiles, 36);
}

TEST_F(TileBoxTest, SwapsOnlyWhatEntersWhenItMovesByOneTile) {
  const MemoryTiles source(wide_grid());
  const SharedGeometry shared(source.grid().shape(), make_index_arrays(source.grid().shape()));
  TileBox box(source, shared, {}, workers_);
  box.finish({1050.0, 1050.0}, 300.0);
  const int reads = source.reads;
  const std::int64_t rows = box.range().end.row - box.range().first.row;
  box.finish({1150.0, 1050.0}, 300.0);
  EXPECT_EQ(source.reads - reads, rows);
  box.finish({1150.0, 1050.0}, 300.0);
  EXPECT_EQ(source.reads - reads, rows);
}

TEST_F(TileBoxTest, NeverExceedsItsMemoryAndSaysHowFarItReaches) {
  const MemoryTiles source(wide_grid());
  const SharedGeometry shared(source.grid().shape(), make_index_arrays(source.grid().shape()));
  for (const std::uint64_t tiles : {20, 60, 130}) {
    const TileBoxLimits limits = limits_for(tiles, 2);
    TileBox box(source, shared, limits, workers_);
    for (int step = 0; step < 60; ++step) {
      box.update({40.0 * step, 30.0 * step}, 900.0);
      EXPECT_LE(box.figures().resident_bytes, limits.memory_bytes);
      EXPECT_LE(box.figures().upload_bytes, limits.upload_bytes_per_frame);
      EXPECT_LT(box.figures().radius, 900.0);
      std::this_thread::sleep_for(milliseconds(1));
    }
    box.finish({1500.0, 1000.0}, 900.0);
    EXPECT_LE(box.figures().resident_bytes, limits.memory_bytes);
    EXPECT_NE(box.resident({15, 10}), nullptr);
  }
}

TEST_F(TileBoxTest, NeverWaitsForATile) {
  // No tile can be read until the gate opens; an update that waited for one would never come back.
  std::promise<void> gate;
  const std::shared_future<void> opened = gate.get_future().share();
  const MemoryTiles source(wide_grid(), {}, [&] { opened.wait(); });
  const SharedGeometry shared(source.grid().shape(), make_index_arrays(source.grid().shape()));
  TileBox box(source, shared, limits_for(1000, 4), workers_);
  for (int frame = 0; frame < 10; ++frame) {
    box.update({1000.0 + 90.0 * frame, 1000.0}, 900.0);
    EXPECT_EQ(box.figures().resident_tiles, 0);
    EXPECT_GT(box.figures().missing_tiles, 100);
  }
  gate.set_value();
  box.finish({1500.0, 1000.0}, 200.0);
  EXPECT_EQ(box.figures().missing_tiles, 0);
}

TEST_F(TileBoxTest, ShowsTheSameBytesWhateverTheRoute) {
  // After any flight, each resident tile's buffer holds that tile's codes and no other's.
  const MemoryTiles source(wide_grid());
  const SharedGeometry shared(source.grid().shape(), make_index_arrays(source.grid().shape()));
  TileBox box(source, shared, limits_for(100, 3), workers_);
  for (int step = 0; step < 40; ++step) {
    box.update({static_cast<double>(step * 977 % 3000), static_cast<double>(step * 571 % 2000)}, 300.0);
    std::this_thread::sleep_for(milliseconds(1));
  }
  box.finish({700.0, 900.0}, 300.0);
  std::int64_t seen = 0;
  for (std::int64_t flat = 0; flat < source.grid().tile_count(); ++flat) {
    const TileSlot* slot = box.resident(source.grid().tile_at(flat));
    if (slot == nullptr) continue;
    ++seen;
    EXPECT_EQ(codes_on_gpu(*slot), test::analytic_tile(source.grid(), source.grid().tile_at(flat)));
  }
  EXPECT_EQ(seen, box.figures().resident_tiles);
  EXPECT_GT(seen, 40);
}

std::vector<std::int16_t> shadow_of(const MemoryTiles& source, TileIndex tile, const CastingSun& sun) {
  const std::atomic<bool> leaves{false};
  std::string unread;
  return cast_shadows(source, sun, {tile}, {}, leaves, unread).front().depths;
}

TEST_F(TileBoxTest, ShadesAllTilesAnewWhenTheSunMoves) {
  const MemoryTiles source(wide_grid());
  const SharedGeometry shared(source.grid().shape(), make_index_arrays(source.grid().shape()));
  TileBox box(source, shared, limits_for(400, 4), workers_);
  for (const CastingSun& sun : {CastingSun{270.0, 2.0}, CastingSun{131.0, 6.0}}) {
    box.set_sun(sun);
    box.finish({700.0, 900.0}, 300.0);
    EXPECT_EQ(box.figures().shadows_to_come, 0);
    EXPECT_LE(box.figures().resident_bytes, limits_for(400, 4).memory_bytes);
    int shaded = 0;
    for (std::int64_t flat = 0; flat < source.grid().tile_count(); ++flat) {
      const TileIndex tile = source.grid().tile_at(flat);
      const TileSlot* slot = box.resident(tile);
      if (slot == nullptr) continue;
      EXPECT_EQ(codes_on_gpu(*slot), test::analytic_tile(source.grid(), tile));
      EXPECT_GT(slot->shadow_gain(), 0.0F);
      EXPECT_EQ(shadow_on_gpu(*slot), shadow_of(source, tile, sun)) << tile.column << ',' << tile.row;
      ++shaded;
    }
    EXPECT_GT(shaded, 40);
  }
}

TEST_F(TileBoxTest, KeepsOldShadowsUntilNewOnesAreThere) {
  const CastingSun old_sun{250.0, 2.0};
  std::promise<void> gate;
  const std::shared_future<void> opened = gate.get_future().share();
  std::atomic<bool> closed{false};
  const MemoryTiles source(wide_grid(), {}, [&] {
    if (closed) opened.wait();
  });
  const SharedGeometry shared(source.grid().shape(), make_index_arrays(source.grid().shape()));
  TileBox box(source, shared, limits_for(400, 4), workers_);
  box.set_sun(old_sun);
  box.finish({700.0, 900.0}, 300.0);
  closed = true;
  for (int frame = 0; frame < 5; ++frame) {
    box.set_sun(CastingSun{250.0, 3.0 + frame});
    box.update({700.0, 900.0}, 300.0);
    EXPECT_EQ(box.figures().shadows_to_come, box.figures().resident_tiles);
  }
  closed = false;
  const auto kept = shadow_on_gpu(*box.resident({7, 9}));
  gate.set_value();
  EXPECT_EQ(kept, shadow_of(source, {7, 9}, old_sun));
  box.finish({700.0, 900.0}, 300.0);
  EXPECT_EQ(shadow_on_gpu(*box.resident({7, 9})), shadow_of(source, {7, 9}, {250.0, 7.0}));
}

TEST_F(TileBoxTest, NamesATileThatCastsNothingAsItCannotBeRead) {
  MemoryTiles source(wide_grid());
  source.set_heights([](TileIndex tile, std::span<float>) {
    if (tile == TileIndex{7, 9}) throw Error(ErrorCode::kCorrupt, "tile (7,9)");
  });
  const SharedGeometry shared(source.grid().shape(), make_index_arrays(source.grid().shape()));
  TileBox box(source, shared, limits_for(400, 4), workers_);
  box.set_sun(CastingSun{});
  box.finish({700.0, 900.0}, 300.0);
  ASSERT_NE(box.resident({7, 9}), nullptr);
  EXPECT_EQ(box.figures().shadows_to_come, 0);
  EXPECT_EQ(box.error(), "tile (7,9)");
}

TEST_F(TileBoxTest, RefusesTooLittleMemory) {
  const MemoryTiles source(wide_grid());
  const SharedGeometry shared(source.grid().shape(), make_index_arrays(source.grid().shape()));
  EXPECT_THROW(TileBox(source, shared, limits_for(7, 1), workers_), Error);
}

}  // namespace
}  // namespace isohf::view
