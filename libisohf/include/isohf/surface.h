// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "isohf/archive.h"
#include "isohf/job.h"
#include "isohf/projection.h"
#include "isohf/raster.h"

/// What an archive's surface holds: elevation and normal at any point, rows of any grid, and the source's own samples.
///
///     const isohf::ArchiveReader archive("dem.isohf");
///     isohf::Surface surface(archive);
///     const isohf::SurfaceSample sample = surface.at(isohf::WorldPoint{1200.5, 340.0});
///     if (sample.state == isohf::SurfaceState::kSurface) use(sample.elevation, sample.normal);

namespace isohf {

/// Where the world of an archive lies: world points <-> longitude and latitude, and <-> coordinates of the archive's
/// source. Of a source in degrees these two are the same. Immutable, cheap to copy, thread-safe.
///
/// Longitudes and latitudes are degrees on the source's own datum. Of a source on a map they are known once the map is
/// understood: understand_source().
class WorldGeoreference {
 public:
  /// Throws Error{kCorrupt} where the metadata name a projection without the source's origin.
  explicit WorldGeoreference(const Metadata& metadata);

  [[nodiscard]] bool has_geo() const;     ///< world <-> longitude and latitude
  [[nodiscard]] bool has_source() const;  ///< world <-> coordinates of the source

  /// Longitudes are taken modulo 360, nearest to the source's middle. NaN where the map has no position for it.
  /// The four need has_geo() or has_source().
  [[nodiscard]] WorldPoint world_from_geo(GeoPoint point) const;
  /// longitude in [-180, 180]. NaN where the map shows no ground.
  [[nodiscard]] GeoPoint geo_from_world(WorldPoint point) const;
  [[nodiscard]] WorldPoint world_from_source(MapPoint point) const;
  [[nodiscard]] MapPoint source_from_world(WorldPoint point) const;

 private:
  struct State;
  std::shared_ptr<const State> state_;
};

/// Has the reference system understood that the archive's source lies on, where that is a map of its own: longitudes
/// and latitudes are known from then on. Loads PROJ unless the map is a UTM zone.
/// Throws Error, naming the archive, where it names no system, or one that is not understood.
void understand_source(ArchiveReader& archive);

/// The same of the map on which the archive's world lies, where that is a reference system (`projection` EPSG:3035):
/// nothing of it finds a place before that. Loads PROJ for such archives alone.
/// Throws Error, naming the archive, where it is not understood.
void understand_world(ArchiveReader& archive);

struct GridSystem;
/// The reference system `text` ("EPSG:3035", WKT, a PROJ string) for grids of an archive, whose source is understood
/// first. Throws Error{kInvalidArgument, kUnsupported}, in one line, where that or the system is not understood, or PROJ
/// knows no way. A warning says where datums are taken for one.
[[nodiscard]] std::shared_ptr<const GridSystem> understand_grid_system(ArchiveReader& archive, const std::string& text,
                                                                       std::vector<Warning>& warnings);

/// Whether the surface has an elevation at a point.
enum class SurfaceState : std::uint8_t { kSurface, kNodata, kOutside };

/// The surface at one point.
struct SurfaceSample {
  SurfaceState state = SurfaceState::kOutside;
  TileIndex tile{-1, -1};  ///< under the point; (-1, -1) outside
  double elevation = 0.0;  ///< of the triangle there, as it is drawn; kSurface alone
  /// x East, y up, z South, of length 1: vertex normals, blended. Heights and lengths are metres if their units are known.
  std::array<double, 3> normal = {0.0, 1.0, 0.0};
};

/// A sun so far away that its light comes from one direction everywhere.
struct Sun {
  double azimuth_deg = 270.0;   ///< clockwise from the North of the archive's map
  double elevation_deg = 15.0;  ///< above the horizon; above 0 and below 90
  /// One size k of the sun at all distances, elevation units, > 0 (paper Eq. 16); nullopt: its disc, as wide as it is
  /// seen from the archive's body.
  std::optional<double> softness;
};

/// How the sun shines at a point of the surface, or above it. NaN where the surface has no elevation.
struct SunSample {
  double shadow_height;  ///< S: the elevation up to which the surface's shadow reaches; never below the surface
  double share;          ///< I: of the sun that is seen, 0 to 1
};

/// The surface of an archive at any number of points in any order.
///
/// Each tile under the points of a call is decoded once, several at a time on all threads. Tiles used last are kept. What
/// is found depends on neither.
class Surface {
 public:
  /// Keeps at most job.memory_bytes of decoded tiles (0: 256 MiB), one at least; works on job.threads (0: those of the
  /// caller's oneTBB arena), looks at job.cancel before each call. The archive must outlive it.
  explicit Surface(const ArchiveReader& archive, const Job& job = {});
  ~Surface();
  Surface(const Surface&) = delete;
  Surface& operator=(const Surface&) = delete;

  /// A point that is NaN lies outside. Throws as ArchiveReader::read_tile does. One call at a time.
  [[nodiscard]] SurfaceSample at(WorldPoint point);
  /// Throws Error{kInvalidArgument} where the archive's longitudes and latitudes are not known.
  [[nodiscard]] SurfaceSample at(GeoPoint point);
  /// In coordinates of the source. Throws Error{kInvalidArgument} where these are not known.
  [[nodiscard]] SurfaceSample at(MapPoint point);

  /// points [n]   samples [n] out. Throws Error{kInvalidArgument} where these are not as many, as the others do.
  void sample(std::span<const WorldPoint> points, std::span<SurfaceSample> samples);
  /// Elevations alone, which is quicker: elevations [n] out, vertical units, NaN where there is none.
  void sample(std::span<const WorldPoint> points, std::span<double> elevations);

  /// How the sun shines on the surface, or on what stands `above` it, elevation units, >= 0. S is the greatest elevation
  /// of the triangles between the point and the sun, less what the shadow falls from there: to rounding, no sweep.
  /// Ground beyond what the source covered casts none. The share is that of the sun's disc, or with a softness that
  /// of Eq. 16 (docs/paper.md, E16); on the surface itself, where S is at least its elevation, twice that, at most 1 (A10).
  /// points [n]   samples [n] out. Throws Error{kInvalidArgument} where the sun, or `above`, is out of range.
  void sample(std::span<const WorldPoint> points, const Sun& sun, double above, std::span<SunSample> samples);

  [[nodiscard]] const WorldGeoreference& georeference() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// How an elevation between lattice vertices is found.
enum class RestoreMethod {
  kBarycentric,  ///< on the triangles, as the renderer draws them
  kHex,          ///< by quintic B-splines along the rows and then down the columns; on the triangles beside nodata
  kPlane,        ///< as kAverage, on the triangles of a coarse plane
  kAverage,  ///< the mean over the area that a sample stands for: of places on the triangles in its middle and around
             ///< it, no farther apart than vertices; those without an elevation do not count
};

[[nodiscard]] std::string to_string(RestoreMethod method);  ///< "barycentric", "hex", "plane", "average"
[[nodiscard]] RestoreMethod restore_method_from_string(
    const std::string& text);  ///< all but "plane"; throws Error{kInvalidArgument}

/// A reference system in which a raster is to lie, whatever the archive's.
struct GridSystem {
  /// Its coordinates <-> longitudes and latitudes of the archive.
  std::shared_ptr<const ReferenceMap> map;
  Georeference place;  ///< unit and system; where these are the archive's own, also its source's spacing and origin
};

/// The samples of a raster on the ground: evenly spaced columns from West to East and rows from North to South, in world
/// units, in degrees or in coordinates of a reference system.
struct SampleGrid {
  std::int64_t width = 0;   ///< columns, >= 1
  std::int64_t height = 0;  ///< rows, >= 1
  double first_x = 0.0;     ///< of sample (0, 0): world x, or longitude, or easting
  double first_z = 0.0;     ///< world z, or latitude, or northing
  double spacing_x = 1.0;   ///< between columns, > 0
  double spacing_z = 1.0;   ///< between rows, > 0: southwards, also in degrees
  bool in_degrees = false;
  Registration registration = Registration::kArea;     ///< in degrees; in world units it is samples_are_areas()
  std::shared_ptr<const GridSystem> system = nullptr;  ///< of coordinates that are neither

  /// Each sample is looked up by its longitude and latitude: rows are none of the world.
  [[nodiscard]] bool goes_by_places() const { return in_degrees || system; }
};

/// Columns and rows.
using GridSize = std::pair<std::int64_t, std::int64_t>;

/// The grid of an archive's source in the world; not of one that was projected, whose rows are no rows there.
[[nodiscard]] SampleGrid source_grid(const SourceRecord& source);
/// The same; of a source that was projected square areas as large as its own, over the rectangle around its ground.
[[nodiscard]] SampleGrid natural_grid(const Metadata& metadata);
/// Samples over a part of the world: in the middle of areas, or on posts from its first edge to its last.
/// size  so many; nullopt: as many as `spacing` gives, which is also their distance where both are given. One of the
/// two is needed.
[[nodiscard]] SampleGrid grid_over(const WorldBounds& ground, bool areas, const std::optional<GridSize>& size,
                                   const std::optional<double>& spacing);
/// A grid over a part of the world in a reference system, its rectangle around that ground, on whole multiples of its
/// spacing where no size is given. spacing  units of the system; nullopt: as far apart as the archive's own samples.
/// Throws Error{kInvalidArgument} where the system has no place for a part of the ground.
[[nodiscard]] SampleGrid grid_in_system(const Metadata& metadata, const WorldBounds& ground,
                                        std::shared_ptr<const GridSystem> system, const std::optional<GridSize>& size,
                                        const std::optional<double>& spacing);
/// True where samples of rasters made of the archive stand for areas: as the source's do, or on a map.
[[nodiscard]] bool samples_are_areas(const Metadata& metadata);
/// True where the surface may have no elevation at a sample of the grid.
[[nodiscard]] bool may_have_nodata(const Metadata& metadata, const SampleGrid& grid);

/// How a grid is read where nobody says. Samples 1.5 times as far apart as the source's or farther, along either axis,
/// are means: by kPlane if the archive has a coarse plane with 32 vertices or more between samples along both axes, so
/// that its tiles suffice; else by kAverage. Others are points, by kHex, and by kBarycentric where the grid goes by
/// places.
[[nodiscard]] RestoreMethod usual_method(const Metadata& metadata, const SampleGrid& grid);

/// True where the archive's source was projected, so that its rows are no rows of the world.
[[nodiscard]] bool is_warped(const Metadata& metadata);
/// Where the source's samples lie, as its file said.
[[nodiscard]] Georeference source_georeference(const SourceRecord& source);
/// Where a grid lies: in the source's reference system, in its degrees, or on the map that it was projected to. nullopt
/// where nothing is known.
[[nodiscard]] std::optional<Georeference> grid_georeference(const Metadata& metadata, const SampleGrid& grid);

/// The surface of an archive at the samples of a grid, from the first row to the last.
///
/// Memory grows with the width, not with the height, as far as the job lets it: what it has no room for is in a scratch
/// file. The bits depend on archive and grid alone.
class RowReader {
 public:
  /// A grid that goes by places is read on the triangles, each sample at its own. kPlane reads the tiles of the
  /// coarsest plane that suffices, and no other; it is for grids of which usual_method() says so. The archive must
  /// outlive the reader. Throws Error{kInvalidArgument} for a grid without samples or far beyond the surface, and for one in
  /// degrees where the archive's are not known; kOutOfMemory where job.memory_bytes are too few for read_all().
  RowReader(const ArchiveReader& archive, const SampleGrid& grid, RestoreMethod method = RestoreMethod::kHex,
            const Job& job = {});
  ~RowReader();
  RowReader(const RowReader&) = delete;
  RowReader& operator=(const RowReader&) = delete;

  /// Rows `first` to `first + rows - 1`, on the caller's oneTBB arena; calls come in increasing order.
  /// elevations [rows * width] out, vertical units; NaN where the surface has none.
  void read(std::int64_t first, std::int64_t rows, std::span<double> elevations);

  /// Some whole rows from `first_row` on.
  using Take = std::function<void(std::int64_t first_row, std::span<const double> elevations)>;
  /// All rows, about a million samples at a time. Throws Error{kCancelled}.
  void read_all(const Take& take, const Job& job = {});

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// How raw samples and elevations go together: elevation = raw * z_scale + z_offset.
struct SampleMapping {
  SampleType type = SampleType::kFloat32;
  double z_scale = 1.0;
  double z_offset = 0.0;
};

/// How an archive made without loss predicts its source's samples (docs/archive_format.md, section 7).
enum class SamplePrediction : std::uint8_t { kSpline, kTriangles };

/// What an archive made without loss says of its source's samples.
struct LosslessRecord {
  SampleMapping mapping;
  std::int64_t width = 0;
  std::int64_t height = 0;
  SamplePrediction prediction = SamplePrediction::kSpline;
  int fraction_bits = 0;  ///< of the integers that predictions count with
  std::int64_t rows_per_member = 0;
  std::vector<double> void_values;  ///< as SourceInfo has them
  /// Raw values outside are void as well.
  std::pair<double, double> valid = {-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  std::uint64_t residual_bytes = 0;  ///< of all residual members, compressed
  std::string sha256;                ///< over all raw samples, little-endian, row by row

  /// Whether a raw sample means "no elevation".
  [[nodiscard]] bool is_void(double raw) const;
};

/// nullopt where the archive keeps no residuals. Throws Error{kCorrupt}.
[[nodiscard]] std::optional<LosslessRecord> lossless_record(const Metadata& metadata);

/// The source's own samples out of an archive made without loss, bit for bit, from the first row to the last.
class SourceRowReader {
 public:
  /// Throws Error{kInvalidArgument} where the archive keeps no residuals; kCorrupt. The archive must outlive it.
  explicit SourceRowReader(const ArchiveReader& archive, Job job = {});
  ~SourceRowReader();
  SourceRowReader(const SourceRowReader&) = delete;
  SourceRowReader& operator=(const SourceRowReader&) = delete;

  [[nodiscard]] const LosslessRecord& record() const;
  [[nodiscard]] bool at_end() const;
  /// Some further rows, in the source's sample type; tells the job. Throws Error{kCorrupt} naming the member, and at the
  /// last row where all of them don't have the SHA-256 that the metadata state; kCancelled.
  [[nodiscard]] std::vector<std::byte> read_next();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace isohf
