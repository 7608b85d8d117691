// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "isohf/archive.h"
#include "isohf/job.h"
#include "isohf/metadata.h"
#include "isohf/surface.h"
#include "isohf/tile_range.h"

/// Archives that are cut, joined and compared without coding a tile again (docs/cluster.md). A part is an archive on the
/// whole's lattice, tiles under the whole's names, that says in its metadata which tiles it holds; of the others it says
/// nothing.

namespace isohf {

/// The tiles that an archive is to hold: a part's, or all of the grid. Throws Error{kCorrupt}.
[[nodiscard]] TileRange tiles_of(const Metadata& metadata);
/// The tiles that a rectangle of the world touches. Throws Error{kInvalidArgument} where there are none.
[[nodiscard]] TileRange tiles_touching(const TileGrid& grid, const WorldBounds& bounds);

/// What may become of an output that exists, and of warnings.
struct PartOptions {
  bool overwrite = false;
  bool strict = false;  ///< a warning is an Error{kWarning}, and nothing is written
};

/// What extract_tiles() or merge_archives() wrote.
struct PartSummary {
  TileRange tiles;             ///< that are to be there
  bool is_whole = false;       ///< these are all of the grid
  bool same_as_whole = false;  ///< the archive that the parts were cut from came out again
  std::int64_t tiles_stored = 0;
  std::uint64_t archive_bytes = 0;
  std::string content_sha256;
  std::vector<Warning> warnings;
};

/// Writes some tiles of an archive as one of their own. Tiles, their textures and their seeds are copied byte for byte,
/// coarse planes are made anew; residual members belong to tiles of the first column, and come along with these (the
/// samples come back once the parts are joined). Stage "tiles". Memory: a batch of tiles, and
/// what planes need. Throws Error{kInvalidArgument} where `tiles` reach beyond the archive, where it was
/// repacked by another tool, and where `output` exists without overwrite; Error{kCorrupt} for damage.
PartSummary extract_tiles(const std::string& archive, const std::string& output, const TileRange& tiles,
                          const PartOptions& options = {}, const Job& job = {});

/// The tiles of a coarse plane that stand above those that an archive is to hold; 0: these. Throws
/// Error{kInvalidArgument} where there is no such plane.
[[nodiscard]] TileRange plane_tiles_of(const ArchiveReader& archive, int plane);
/// The same of tiles of a coarse plane, 1 to metadata().planes.count, which become those of an archive of their own: a
/// look from afar, whose lattice has every stride^plane-th vertex. They are copied, and decoded for their statistics and
/// the planes above. Beyond the whole's last tiles it goes on level. Seeds, textures and residuals tell of finer tiles
/// and stay behind. 0: extract_tiles().
PartSummary extract_plane(const std::string& archive, const std::string& output, int plane, const TileRange& tiles,
                          const PartOptions& options = {}, const Job& job = {});

/// Joins archives that share a lattice; where several hold a tile, the last of them gives it. What they hold together
/// must be a rectangle of tiles. Parts cut from one archive, or shards of one plan, give its bytes again; of others the
/// tiles are decoded, their common edges compared, seeds and statistics made anew. Stages "check", "tiles".
/// Before anything is written, every archive is looked at, all of its bytes too: Error{kInvalidArgument, kCorrupt} names
/// each that is damaged, lies on another lattice or belongs to something else, and tiles that none holds; all of them
/// in one message, a line each.
PartSummary merge_archives(const std::vector<std::string>& archives, const std::string& output,
                           const PartOptions& options = {}, const Job& job = {});

/// What two archives have in another way.
struct ArchiveDifference {
  struct Member {
    std::string name;   ///< of the metadata: "/source/name", or a member of its own: "member \"note.txt\""
    std::string first;  ///< JSON text; empty where it isn't there
    std::string second;
  };
  std::vector<Member> metadata;
  std::string why_other_lattice;  ///< one clause; the rest is then not looked at
  TileRange compared;             ///< tiles that both are to hold
  std::int64_t tiles_same = 0;    ///< of them; void in both, too
  std::int64_t tiles_differing = 0;
  std::int64_t only_first = 0;  ///< of these, stored in one alone
  std::int64_t only_second = 0;
  TileRange bounds;                  ///< around the tiles that differ
  std::vector<TileIndex> first_few;  ///< of them, 1000 at most
  /// Over the stored vertices of tiles that differ, padding included.
  struct Surface {
    std::int64_t compared = 0;  ///< an elevation on both sides
    std::int64_t voids = 0;     ///< on one side alone
    double rms = 0.0;           ///< of second - first, vertical units
    double mean = 0.0;
    double max = 0.0;  ///< the largest absolute one
    TileIndex worst{};
  };
  std::optional<Surface> surface;  ///< where it was asked for

  [[nodiscard]] bool same_tiles() const { return why_other_lattice.empty() && tiles_differing == 0; }
};

/// Compares metadata, and tiles that both are to hold by their stored digests: none is decoded but those that have no digest
/// (repacked archives), and with `surface` those that differ. Stage "compare". Memory is bounded.
[[nodiscard]] ArchiveDifference diff_archives(const std::string& first, const std::string& second, bool surface = false,
                                              const Job& job = {});

/// Elevations of second - first, by the triangles, on natural_grid() of the first; NaN where one of them has none. As
/// RowReader::read_all(). Throws Error{kInvalidArgument} where they lie on two lattices. Stage "difference".
void subtract_archives(const std::string& first, const std::string& second, const RowReader::Take& take,
                       const Job& job = {});

}  // namespace isohf
