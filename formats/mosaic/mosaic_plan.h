#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "formats/adapters/cropped_source.h"
#include "formats/io/file_stamp.h"
#include "formats/mosaic/mosaic_samples.h"
#include "isohf/projection/reference_map.h"
#include "isohf/raster.h"

namespace isohf {

/// Members' samples may lie this far from the mosaic's grid, in samples: the rounding of origins and spacings that are
/// written in few digits. They count as lying on it.
inline constexpr double kSnapTolerance = 0.05;

/// One file of a mosaic: what is kept of it while it is closed.
struct MosaicMember {
  std::string path;
  std::int64_t width = 0;
  std::int64_t height = 0;
  std::int64_t column = 0;  ///< of its first sample in its layer's grid, >= 0
  std::int64_t row = 0;
  std::size_t kind = 0;    ///< MosaicPlan::kinds
  std::int64_t order = 0;  ///< its position among the paths
  FileStamp stamp;         ///< of the file when it was opened first

  [[nodiscard]] Window window() const { return {column, row, width, height}; }
};

/// Positions in the mosaic's reference system <-> those in another one, which some members have.
struct MosaicWay {
  std::shared_ptr<const ReferenceMap> mosaic;   ///< the mosaic's coordinates <-> degrees on the members' datum
  std::shared_ptr<const ReferenceMap> members;  ///< the members' coordinates <-> the same; nullptr: they are these

  [[nodiscard]] MapPoint members_from_mosaic(MapPoint place) const;
  [[nodiscard]] MapPoint mosaic_from_members(MapPoint place) const;
};

/// Members of one resolution, in one reference system, on one grid.
struct MosaicLayer {
  double spacing_x = 1.0;  ///< units of the mosaic's coordinates; of the members' if there is a way
  double spacing_y = 1.0;
  double origin_x = 0.0;  ///< of sample (0, 0)
  double origin_y = 0.0;
  std::int64_t width = 0;
  std::int64_t height = 0;
  std::vector<MosaicMember> members;     ///< by row, then column, then order
  std::int64_t tallest = 0;              ///< height of the highest member
  std::shared_ptr<const MosaicWay> way;  ///< nullptr: the members are in the mosaic's reference system
  double size_x = 1.0;                   ///< the spacings in units of the mosaic's coordinates
  double size_y = 1.0;
  std::int64_t rank = 0;  ///< of its resolution: among layers of equal rank, the order of the files decides
};

/// Many rasters as one: where each lies, and what samples the whole has.
struct MosaicPlan {
  SourceInfo info;  ///< of the whole; the path for messages, block_height not yet
  std::vector<SampleKind> kinds;
  MosaicSamples samples;
  /// From the coarsest to the finest, the order in which they are laid over each other. A layer that has the mosaic's
  /// spacing is on its grid; others are interpolated.
  std::vector<MosaicLayer> layers;
  std::int64_t samples_missing = 0;  ///< without a member of any resolution, in the part that will be read
  std::int64_t block_height = 1;     ///< the members' largest
  std::uint64_t reader_bytes = 0;    ///< that a member's reader keeps at most
  int readers_at_once = 1;           ///< as many threads read, each a member of its own
  std::vector<std::shared_ptr<const void>> unpacked;  ///< of packed members, which are not unpacked again
  bool is_reprojected = false;                        ///< some members are brought to the mosaic's reference system

  [[nodiscard]] bool is_on_grid(const MosaicLayer& layer) const {
    return !layer.way && layer.spacing_x == info.georeference.spacing_x &&
           layer.spacing_y == info.georeference.spacing_y;
  }
  /// Another layer is of its resolution.
  [[nodiscard]] bool is_tied(std::size_t layer) const {
    return (layer > 0 && layers[layer - 1].rank == layers[layer].rank) ||
           (layer + 1 < layers.size() && layers[layer + 1].rank == layers[layer].rank);
  }
};

/// A member and where its own file puts it.
struct PlacedMember {
  MosaicMember member;
  double origin_x = 0.0;  ///< coordinates of its sample (0, 0)
  double origin_y = 0.0;
  double spacing_x = 1.0;
  double spacing_y = 1.0;
  std::shared_ptr<const MosaicWay> way;  ///< nullptr: in the mosaic's reference system
};

/// A raster that somebody else's list (a VRT) puts into a mosaic.
struct ListedRaster {
  std::string path;
  Window window;  ///< in the whole; as large as the raster
};

/// A whole that somebody else describes.
struct ListedMosaic {
  std::int64_t width = 0;
  std::int64_t height = 0;
  Georeference place;                 ///< has_origin: rasters that state where they lie must agree
  std::vector<ListedRaster> rasters;  ///< later ones on top
  std::string remedy;                 ///< for what cannot be read so, as the end of a message
};

/// Moves members by whole turns so that those on both sides of the 180th meridian lie side by side: if more than half a
/// turn is empty between them, all West of the gap go East of the others. Nothing else moves.
void join_antimeridian(std::vector<PlacedMember>& members);

/// Puts members on grids: fills plan.layers and size, spacing and origin of plan.info, whose georeference states unit
/// and registration. plan.info.warnings gains a line if the rounding that was removed is worth one.
/// Throws Error{kUnsupported} naming a member that lies off the grid of its resolution.
void place_members(std::vector<PlacedMember> members, MosaicPlan& plan);

/// Counts samples of `region` without a member; warns of them, and of members that lie over exactly the same ground.
void check_coverage(MosaicPlan& plan, const Window& region);

/// Samples [first, first + count) along one axis.
struct Span {
  std::int64_t first = 0;
  std::int64_t count = 0;
};
/// What lies in both.
[[nodiscard]] Span intersection(Span a, Span b);

/// Opens every file once, in parallel, and places it by its georeference. The grid is the finest among the members';
/// coordinates, registration, reference system and units must agree. Members on both sides of the 180th meridian are
/// joined the shorter way. Companions of elevations (companions.h) are left out, which info.warnings state.
/// Throws Error naming the file at fault: as open_raster does; kInvalidArgument for a file that is named twice;
/// kUnsupported for one that does not state where it lies, lies off the grid of others of its resolution by more than
/// kSnapTolerance, or disagrees.
/// box: the part that will be read; samples that are missing elsewhere do not matter.
/// onto: the map on which files of different reference systems are joined, by bilinear interpolation; those that are in
/// it already keep their samples, and give the grid if none is finer. It is left alone if all are in one system.
[[nodiscard]] MosaicPlan plan_mosaic(const std::vector<std::string>& paths, const OpenOptions& options,
                                     const std::optional<BoundingBox>& box = std::nullopt,
                                     const ProjectionRequest& onto = {});

/// The same of rasters whose positions `list` states.
[[nodiscard]] MosaicPlan plan_mosaic(const ListedMosaic& list, const OpenOptions& options);

/// As the members' readers are opened: as many as threads read, each with its share of the buffers.
[[nodiscard]] OpenOptions share_of(OpenOptions options, const MosaicPlan& plan);

/// How many rasters may be open at once: 64, or fewer if the system allows the process few open files.
[[nodiscard]] std::size_t most_open_rasters();

}  // namespace isohf
