#pragma once

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
  std::int64_t order = 0;  ///< its place among the paths
  FileStamp stamp;         ///< of the file when it was opened first
};

/// Where places of the mosaic lie in another reference system, that of some members.
struct MosaicWay {
  std::shared_ptr<const ReferenceMap> mosaic;   ///< the mosaic's coordinates <-> degrees on the members' datum
  std::shared_ptr<const ReferenceMap> members;  ///< the members' coordinates <-> the same; nullptr: they are these

  [[nodiscard]] MapPoint members_from_mosaic(MapPoint place) const;
  [[nodiscard]] MapPoint mosaic_from_members(MapPoint place) const;
};

/// Members of one resolution, in one reference system, on one grid.
struct MosaicLayer {
  double spacing_x = 1.0;  ///< units of the mosaic's coordinates, or of the members' where there is a way
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
  std::int64_t rank = 0;  ///< its resolution's: among layers of one, the order of the files decides
};

/// Ground of a mosaic that no member covers.
struct MosaicHoles {
  std::int64_t samples = 0;          ///< of the mosaic, without a member of any resolution
  std::int64_t tiles = 0;            ///< places of the members' regular grid; 0 where they form none
  std::int64_t tiles_missing = 0;    ///< of these, without a member and not covered by others
  std::vector<std::string> missing;  ///< where, at most kMostNamed: "N45E006", or "x 500000...510000, y 0...10000"
  static constexpr std::size_t kMostNamed = 20;

  /// One line: how much is missing and where, `named` places at most; empty where nothing is.
  [[nodiscard]] std::string describe(std::size_t named) const;
};

/// Many rasters as one: where each lies, and what samples the whole has.
struct MosaicPlan {
  SourceInfo info;  ///< of the whole; path and block_height are left to the source
  std::vector<SampleKind> kinds;
  MosaicSamples samples;
  /// From the coarsest to the finest, and that is the order in which they are laid over each other. A layer that has
  /// the mosaic's spacing is on its grid; others are interpolated.
  std::vector<MosaicLayer> layers;
  Window region;                   ///< the samples that matter: all, or those of a box
  MosaicHoles holes;               ///< in the region
  std::int64_t block_height = 1;   ///< the members' largest
  std::uint64_t reader_bytes = 0;  ///< that a member's reader keeps at most
  int readers_at_once = 1;         ///< as many threads read, each a member of its own
  bool is_reprojected = false;     ///< some members are brought to the mosaic's reference system

  [[nodiscard]] bool has_resolutions() const { return layers.front().rank != layers.back().rank; }
  /// Another layer is of its resolution.
  [[nodiscard]] bool is_tied(std::size_t layer) const {
    return (layer > 0 && layers[layer - 1].rank == layers[layer].rank) ||
           (layer + 1 < layers.size() && layers[layer + 1].rank == layers[layer].rank);
  }
  [[nodiscard]] bool is_on_grid(const MosaicLayer& layer) const {
    return !layer.way && layer.spacing_x == info.georeference.spacing_x &&
           layer.spacing_y == info.georeference.spacing_y;
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

/// A rectangle of the mosaic's samples.
struct SampleRectangle {
  std::int64_t column = 0;
  std::int64_t row = 0;
  std::int64_t columns = 0;
  std::int64_t rows = 0;
};

/// Refuses tiles NAME_xCOLUMN_yROW that different cuts of one name left in a folder: those that overlap and do not lie as
/// their names count, and those whose .json states another scale. Throws Error{kUnsupported} naming two.
void refuse_mixed_cuts(const std::vector<PlacedMember>& members, const std::vector<SampleKind>& kinds);

/// Moves members by whole turns so that those on both sides of the 180th meridian lie side by side: where more than
/// half a turn lies empty between them, all West of the gap go East of the others. Nothing else moves.
void join_antimeridian(std::vector<PlacedMember>& members);

/// Puts members on grids: fills plan.layers and size, spacing and origin of plan.info, whose georeference says unit and
/// registration. plan.info.warnings gains a line where rounding was taken away that is worth a word.
/// Throws Error{kInvalidArgument} naming a member that lies off the grid of its resolution.
void place_members(std::vector<PlacedMember> members, MosaicPlan& plan);

/// The samples of the mosaic that a member of `layer` stands for; `reach`: how far its outermost samples do, in samples
/// of the layer's own, 0 or 0.5.
[[nodiscard]] SampleRectangle ground_of(const MosaicPlan& plan, const MosaicLayer& layer, const MosaicMember& member,
                                        double reach);

/// Along one axis: what a window takes of a member of so many `samples`, 0 or fewer where they do not meet.
/// first  the member's place in the raster; out: that of the part, in the window   begin  out: that of the part in the member
std::int64_t overlap(std::int64_t& first, std::int64_t& begin, std::int64_t& count, std::int64_t samples,
                     std::int64_t window_first, std::int64_t window_count);

/// How many samples of `region` lie in none of `members`, and the first rectangle of them.
[[nodiscard]] std::int64_t uncovered(std::vector<SampleRectangle> members, const Window& region,
                                     std::optional<SampleRectangle>& first);

/// What lies in no member.
[[nodiscard]] MosaicHoles find_holes(const MosaicPlan& plan);

/// Opens every file once, in parallel, and places it by its georeference. Its grid is the finest among the members';
/// coordinates, registration, reference system and units must agree. Members on both sides of the 180th meridian are
/// joined the shorter way.
/// Throws Error naming the file at fault: as open_raster does; kInvalidArgument for a file that is named twice, does
/// not say where it lies, lies off the grid of others of its resolution by more than kSnapTolerance, or disagrees.
/// box: the part that will be read; holes elsewhere do not matter.
/// onto: the map on which files of different reference systems are joined, by bilinear interpolation; those that are in
/// it already keep their samples, and give the grid where none is finer. Where all are in one system it is left alone.
[[nodiscard]] MosaicPlan plan_mosaic(const std::vector<std::string>& paths, const OpenOptions& options,
                                     const std::optional<BoundingBox>& box = std::nullopt,
                                     const ProjectionRequest& onto = {});

}  // namespace isohf
