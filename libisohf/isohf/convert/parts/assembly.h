#pragma once

#include <optional>
#include <vector>

#include "isohf/archive.h"
#include "isohf/archive/tile_statistics.h"
#include "isohf/archive/writer.h"
#include "isohf/base/memory/read_ahead.h"
#include "isohf/convert/parts/part_file.h"
#include "isohf/convert/stages/plane_stage.h"
#include "isohf/convert/stages/seed_row.h"
#include "isohf/job.h"
#include "isohf/tile_range.h"

namespace isohf {

/// An archive that tiles are copied from, and which of them.
struct AssemblyInput {
  std::shared_ptr<PartFile> file;
  TileRange tiles;
};

/// What becomes of what is copied.
struct AssemblyRequest {
  std::vector<AssemblyInput> inputs;  ///< the last that holds a tile gives it; all on one grid
  TileRange tiles;                    ///< that are to be there
  PlaneStage* planes = nullptr;       ///< takes all tiles
  bool has_plane_rows = false;        ///< no: the inputs hold the first plane's tiles as they will be
  bool one_origin = true;             ///< edges meet and seeds hold wherever the inputs are joined
  bool recount = false;               ///< give the writer each tile's statistics, by counting
  int plane = 0;                      ///< of the inputs, whose tiles these become; another one: with `recount`
};

/// Copies a member as it is.
void copy_member(const ArchiveReader& from, const MemberEntry& member, ArchiveWriter& writer, ReadAhead& ahead);

/// Writes an archive of other archives' tiles, which are not coded again, in the order in which convert() does: a tile's
/// textures, the tile; behind a row, planes and seeds. On the caller's oneTBB arena. Stage "tiles".
class Assembly {
 public:
  /// metadata  of what is written: grid, quantisation, seeds
  Assembly(const Metadata& metadata, ArchiveWriter& writer, AssemblyRequest request, const Job& job);
  Assembly(const Assembly&) = delete;
  Assembly& operator=(const Assembly&) = delete;
  ~Assembly() { writer_.stop_copies(); }

  /// All tiles with what belongs to them. Throws Error{kInvalidArgument} where edges don't meet.
  void add_tiles();
  /// Members of no tile, in file order: once each by name, the last archive's.
  void add_other_members();

 private:
  struct Tile {
    const ArchiveReader* from = nullptr;               ///< nullptr: void
    const std::vector<std::string>* tables = nullptr;  ///< of members that come with it
    EncodedTile encoded;
    TileCodes codes;
    PlaneSample sample;
  };
  /// What is kept of a row's tiles.
  struct Row {
    std::vector<const ArchiveReader*> from;
    std::vector<TileCodes> codes;  ///< where origins differ
  };

  [[nodiscard]] std::vector<const AssemblyInput*> inputs_of_row(std::int64_t row) const;
  void read(std::span<const AssemblyInput* const> inputs, TileIndex first, std::span<Tile> tiles);
  void copy_row(std::int64_t row, const AssemblyInput& input);
  void copy_seeds(std::int64_t row, const AssemblyInput& input);
  void make_void(TileIndex index, EncodedTile& tile) const;
  void add_plane_rows(std::int64_t row);
  void add_textures(TileIndex index, const Tile& tile);
  void close_before(std::int64_t row);
  void add_seeds(std::int64_t row, const Row& tiles);
  void compare_edges(std::int64_t row, const Row& tiles, const Row& above) const;
  [[nodiscard]] bool decodes() const;

  const Metadata& metadata_;
  ArchiveWriter& writer_;
  AssemblyRequest request_;
  const Job& job_;
  bool has_seeds_ = false;
  std::optional<SeedRow> seeds_;
  std::optional<CountedVertices> counted_;
  TileCodes void_codes_;
  std::vector<std::byte> void_digest_;
  std::int64_t next_plane_row_ = 0;
  ReadAhead tile_bytes_;  ///< each kind stands in its own order
  ReadAhead member_bytes_;
};

}  // namespace isohf
