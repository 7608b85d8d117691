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

/// Archives that are cut and compared without coding a tile again.

namespace isohf {

/// The tiles that a rectangle of the world touches. Throws Error{kInvalidArgument} where there are none.
[[nodiscard]] TileRange tiles_touching(const TileGrid& grid, const WorldBounds& bounds);

/// What may become of an output that exists, and of warnings.
struct PartOptions {
  bool overwrite = false;
  bool strict = false;  ///< a warning is an Error{kWarning}, and nothing is written
};

/// What extract_tiles() or merge_shards() wrote.
struct PartSummary {
  std::int64_t tiles_stored = 0;
  std::uint64_t archive_bytes = 0;
  std::string content_sha256;
  std::vector<Warning> warnings;
};

/// All tiles of plane 0, or of a coarse plane, 1 to metadata().planes.count. Throws Error{kInvalidArgument} if there is no
/// such plane.
[[nodiscard]] TileRange plane_tiles_of(const ArchiveReader& archive, int plane);

/// Writes tiles of a plane as an archive of their own: `tiles` of plane 0, or of a coarse plane, which has every
/// stride^plane-th vertex. The world of the new archive begins at the first tile, and every place in a reference system
/// keeps its elevation. Tiles and textures are copied byte for byte; coarse planes, shadow seeds and statistics are made
/// from them. A coarse plane has no textures and seeds. Residuals are left out, with a warning. Stage "tiles".
/// Throws Error{kInvalidArgument} if `tiles` reach beyond the plane, if the archive was repacked by
/// another tool, and if `output` exists without overwrite; Error{kCorrupt} for damage.
PartSummary extract_tiles(const std::string& archive, const std::string& output, int plane, const TileRange& tiles,
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

/// Compares metadata, and tiles by their stored digests. Decodes tiles without a digest (repacked archives), with `surface`
/// those that differ, and all of them if the archives code elevations by another type, offset or scale. Stage "compare".
/// Memory is bounded.
[[nodiscard]] ArchiveDifference diff_archives(const std::string& first, const std::string& second, bool surface = false,
                                              const Job& job = {});

/// Elevations of second - first, by the triangles, on natural_grid() of the first; NaN where one of them has none. As
/// RowReader::read_all(). Throws Error{kInvalidArgument} where they lie on two lattices. Stage "difference".
void subtract_archives(const std::string& first, const std::string& second, const RowReader::Take& take,
                       const Job& job = {});

}  // namespace isohf
