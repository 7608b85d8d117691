#pragma once

#include <cstdint>
#include <memory>
#include <utility>

#include "isohf/archive/tile/tile_codes.h"
#include "isohf/archive/writer.h"
#include "isohf/convert.h"
#include "isohf/job.h"

namespace isohf {

/// What goes into an archive beside its tiles, made while these are made, or after them.
class Stage {
 public:
  Stage() = default;
  Stage(Stage&&) = default;
  virtual ~Stage() = default;

  /// What a stage makes of one tile, for its own add_before() or add_after().
  struct Made {
    virtual ~Made() = default;
  };
  template <typename T>
  struct MadeOf final : Made {
    explicit MadeOf(T made) : value(std::move(made)) {}
    T value;
  };

  /// The first tile that it takes, where the writer goes on at `next_tile`.
  [[nodiscard]] virtual std::int64_t first_tile(std::int64_t next_tile) const { return next_tile; }
  /// Of any tile, on any thread; nullptr: nothing.
  [[nodiscard]] virtual std::unique_ptr<Made> make(TileIndex /*tile*/, const TileCodes& /*codes*/,
                                                   const EncodedTile& /*encoded*/) const {
    return nullptr;
  }
  /// Take what was made of the next tile in flat order, before and after the tile goes to the writer. One thread.
  virtual void add_before(TileIndex /*tile*/, const Made* /*made*/, ArchiveWriter& /*writer*/) {}
  virtual void add_after(TileIndex /*tile*/, const Made* /*made*/, ArchiveWriter& /*writer*/) {}
  /// Takes a tile after a shard's last one.
  virtual void pass_over(TileIndex /*tile*/) {}
  /// After all tiles. On the caller's oneTBB arena.
  virtual void finish(ArchiveWriter& /*writer*/, const Job& /*job*/) {}
  /// Once everything is written.
  virtual void describe(const ArchiveWriter& /*writer*/, Metadata& /*metadata*/, ConvertSummary& /*summary*/) const {}
};

}  // namespace isohf
