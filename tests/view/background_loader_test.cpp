#include "paging/background_loader.h"

#include <gtest/gtest.h>

#include <chrono>
#include <set>
#include <thread>

#include "isohf/archive.h"
#include "isohf/convert.h"
#include "support/rasters/memory_source.h"
#include "support/temporary_folder.h"

namespace isohf::view {
namespace {

struct Loaded {
  TileIndex tile{};
  TileCodes codes;
};

/// For ThreadSanitizer above all (scripts/dev/tsan): workers read one archive while their owner asks and collects.
TEST(BackgroundLoader, GivesEachTileOnceAsTheArchiveHasIt) {
  const test::TemporaryFolder folder;
  test::MemorySource<std::int16_t> source(SampleType::kInt16, 300, 200, [](std::int64_t c, std::int64_t r) {
    return static_cast<double>((c * 7 + r * 13) % 500);
  });
  ConvertOptions options;
  options.plan.shape = {36, 35};
  options.plan.levels = 3;
  (void)convert(source, folder / "a.isohf", options);
  const ArchiveReader archive(folder / "a.isohf");
  const TileGrid& grid = archive.grid();
  std::set<std::int64_t> seen;
  {
    Workers workers(4);
    BackgroundLoader<TileIndex, Loaded> loader(
        [&](const TileIndex& tile) {
          return Loaded{tile, archive.read_tile(tile)};
        },
        workers);
    std::deque<Loaded> ready;
    for (std::int64_t flat = 0; flat < grid.tile_count() || loader.in_flight() > 0;) {
      if (flat < grid.tile_count()) loader.request(grid.tile_at(flat++));
      loader.collect(ready);
      for (; !ready.empty(); ready.pop_front()) {
        EXPECT_TRUE(seen.insert(grid.flat_index(ready.front().tile)).second);
        EXPECT_EQ(ready.front().codes, archive.read_tile(ready.front().tile));
      }
      std::this_thread::yield();
    }
    for (std::int64_t flat = 0; flat < grid.tile_count(); ++flat) loader.request(grid.tile_at(flat));
  }  // ends while requests wait
  EXPECT_EQ(seen.size(), static_cast<std::size_t>(grid.tile_count()));
}

}  // namespace
}  // namespace isohf::view
