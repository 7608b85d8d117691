#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gl/tile_buffers.h"
#include "paging/background_loader.h"
#include "paging/shadow_cast.h"
#include "paging/tile_source.h"

namespace isohf::view {

/// Bounds that a TileBox keeps.
struct TileBoxLimits {
  std::uint64_t memory_bytes = std::uint64_t{512} << 20;          ///< tiles on the GPU and on their way there
  std::uint64_t upload_bytes_per_frame = std::uint64_t{4} << 20;  ///< at least one tile a frame goes up all the same
  std::uint64_t enough_mib = 0;                                   ///< of --memory: what a refusal names
};

/// What one update did, and where things stand.
struct TileBoxFigures {
  std::uint64_t upload_bytes = 0;  ///< in this frame
  std::int64_t resident_tiles = 0;
  std::int64_t missing_tiles = 0;    ///< in the box and stored, but not resident yet
  std::uint64_t resident_bytes = 0;  ///< GPU and CPU bytes of tiles: never above memory_bytes
  std::int64_t shadows_to_come = 0;  ///< resident tiles whose shadow is not yet of the sun wanted
  double radius = 0.0;               ///< world units: what was asked for, or less where memory would not do
};

/// The tiles around the camera, kept resident by sliding a box over the heightfield (paper section 3.12): tiles that
/// leave it hand their GPU buffers to those that enter. Workers decode; update() uploads what they have finished,
/// within the frame's budget, and never waits for them. One sweeps light over the tiles whose shadows are not those of
/// the sun, and those that may cast on them; until then the old ones stay. A TileBox lives on the GL thread.
class TileBox {
 public:
  /// Throws Error{kInvalidArgument} where memory_bytes does not hold four tiles.
  TileBox(const TileSource& source, const SharedGeometry& shared, const TileBoxLimits& limits, Workers& workers);
  ~TileBox() { leaves_ = true; }
  TileBox(const TileBox&) = delete;
  TileBox& operator=(const TileBox&) = delete;

  /// The sun that shadows are wanted for; nullopt: none are. From the next update on.
  void set_sun(const std::optional<CastingSun>& sun);

  /// What a tile takes at most, resident or on its way, with a share of what is decoded besides.
  [[nodiscard]] static std::uint64_t most_bytes_of_a_tile(const TileSource& source);

  /// Nothing is wanted in this frame: keeps what there is and asks for nothing.
  void rest();
  /// Moves the box to the bounding square of a circle round `centre`, world units; once a frame.
  void update(WorldPoint centre, double radius) { update(centre, radius, true); }

  /// Updates until the box is complete: for pictures, not for frames.
  void finish(
      WorldPoint centre, double radius, const std::function<void()>& poll = [] {});

  [[nodiscard]] const TileSlot* resident(TileIndex tile) const;
  [[nodiscard]] const TileRange& range() const { return range_; }
  [[nodiscard]] const TileBoxFigures& figures() const { return figures_; }
  /// The first tile that could not be read, as a message.
  [[nodiscard]] const std::optional<std::string>& error() const { return error_; }

 private:
  enum class State { kMissing, kRequested, kResident, kVoid, kBroken };
  struct Cell {
    TileIndex tile;
    State state;
    std::unique_ptr<TileSlot> slot;
    std::uint64_t sun_number = 0;  ///< of the sun that its shadow is of; 0: it has none
  };
  /// A tile that a worker has decoded; no codes where reading failed.
  struct Loaded {
    TileIndex tile{};
    std::vector<std::uint16_t> codes;
    std::string error;
  };
  /// Tiles that a worker shades, and what it has found.
  struct Sweep {
    std::vector<TileIndex> tiles;
    CastingSun sun;
    std::uint64_t sun_number = 0;
    CastingLimits limits;
    std::vector<TileShadow> shadows;
    std::string error;
  };

  [[nodiscard]] static Loaded load(const TileSource& source, TileIndex tile);
  [[nodiscard]] Sweep cast(Sweep sweep) const;
  void update(WorldPoint centre, double radius, bool shades);
  /// The range around a place that memory holds.
  [[nodiscard]] TileIndex tiles_across(double radius) const;
  void move(WorldPoint centre, double radius);
  /// nullptr: not in the box.
  [[nodiscard]] Cell* find(TileIndex tile);
  void upload();
  void place(Loaded& loaded);
  void place(const TileShadow& shadow, std::uint64_t sun_number);
  [[nodiscard]] bool has_room(std::uint64_t bytes) const {
    return figures_.upload_bytes == 0 || figures_.upload_bytes + bytes <= limits_.upload_bytes_per_frame;
  }
  [[nodiscard]] bool is_outdated(const Cell& cell) const {
    return sun_ && cell.state == State::kResident && cell.sun_number != sun_number_;
  }
  void request(WorldPoint centre);
  void request_shadows();
  /// Tile columns that a sweep holds at most, for a box of so many.
  [[nodiscard]] static std::int64_t swept_columns(std::int64_t columns) { return 2 * columns + 8; }
  /// Whether memory holds a box of so many tiles, with their shadows.
  [[nodiscard]] bool fits(TileIndex across) const;
  void count();

  const TileSource& source_;
  const SharedGeometry& shared_;
  TileBoxLimits limits_;
  std::uint64_t slot_bytes_;
  std::uint64_t depth_bytes_;    ///< of a tile's shadow
  std::uint64_t at_work_bytes_;  ///< of a tile that is decoded or swept
  std::size_t in_flight_limit_;
  TileRange range_;
  std::map<std::int64_t, Cell> cells_;
  std::vector<std::unique_ptr<TileSlot>> spare_;
  std::deque<Loaded> waiting_;  ///< for a later frame's budget, as is
  std::deque<Sweep> swept_;
  std::optional<CastingSun> sun_;
  std::uint64_t sun_number_ = 0;  ///< counts suns
  TileBoxFigures figures_;
  std::optional<std::string> error_;
  std::uint64_t sweep_bytes_ = 0;  ///< of the sweep in flight, or of what it has cast
  std::atomic<bool> leaves_{false};
  BackgroundLoader<TileIndex, Loaded> loader_;  // last: they stop first
  BackgroundLoader<Sweep, Sweep> caster_;
};

}  // namespace isohf::view
