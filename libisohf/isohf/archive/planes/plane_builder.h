#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "isohf/archive/tile/tile_codes.h"
#include "isohf/base/memory/kept_rows.h"
#include "isohf/lattice/planes.h"

namespace isohf {

/// What a tile brings to the plane above: every S-th of its vertices, and the range of all that it stands for.
struct PlaneSample {
  std::vector<std::byte> codes;  ///< 2(C-4)/S + 1 by (R-3)/S + 1, as TileCodes has them; none where the tile is void
  std::uint32_t code_min = 0;    ///< as in TileEntry
  std::uint32_t code_max = 0;
  bool is_void = true;  ///< neither it nor what lies below has an elevation
};

/// Peak memory of a PlaneBuilder, bytes; an estimate.
[[nodiscard]] std::uint64_t plane_builder_memory_bytes(const Planes& planes, CodeType type, bool in_scratch);

/// Makes coarse planes of tiles that come in flat order. Of each plane it keeps the vertices of one row of its tiles
/// and of a row of the tiles below more. What comes out depends on nothing but the tiles' codes.
class PlaneBuilder {
 public:
  /// Makes of codes what is handed on. Any thread.
  using Encode = std::function<EncodedTile(const TileCodes& codes)>;
  /// Takes a finished tile, also where it is empty, in flat order within a plane; code_min and code_max are of all that
  /// lies below it. One thread.
  using Take = std::function<void(int plane, TileIndex tile, const EncodedTile& encoded)>;
  /// planes.count() >= 1.
  ///   scratch  keeps the vertices where memory has no room for them
  PlaneBuilder(const Planes& planes, CodeType type, Encode encode, Take take, const ScratchFolder& scratch);
  ~PlaneBuilder();

  /// Any thread; code_min and code_max as encode_tile() gives them, or a plane's tile has them.
  [[nodiscard]] PlaneSample sample(const TileCodes& codes, std::uint32_t code_min, std::uint32_t code_max) const;

  /// The next tile. After the last one of a row, rows of planes may be finished: encoded on the caller's oneTBB arena
  /// and handed on, the finer plane first. One thread.
  void add(const PlaneSample& sample);

  /// Reads what was handed on before, or added: a tile of a plane with its range, and its codes where they are stored.
  struct Stored {
    EncodedTile entry;  ///< is_empty, code_min and code_max
    TileCodes codes;
  };
  using Read = std::function<Stored(int plane, TileIndex tile)>;
  /// Goes on where a builder stood after so many tiles, before any is added: what that one had handed on is there to be
  /// read, and isn't handed on again.
  void resume_after(std::int64_t tiles, const Read& read);

  /// Instead of the tiles of plane 0: the next one of plane 1, as a builder made it. It is not handed on.
  ///   sample  as sample_of() gives it
  void add_finished(const PlaneSample& sample) { add(2, sample); }
  /// What a finished tile brings to the plane above: of one that isn't stored the range of what lies below it. Any thread.
  [[nodiscard]] PlaneSample sample_of(int plane, TileIndex tile, const Read& read) const;

 private:
  class Level;
  void add(int plane, const PlaneSample& sample);
  void finish_row(int plane);

  Planes planes_;
  CodeType type_;
  Encode encode_;
  Take take_;
  std::vector<std::unique_ptr<Level>> levels_;  ///< of planes 1 to count
};

}  // namespace isohf
