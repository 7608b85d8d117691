// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "isohf/lattice.h"
#include "isohf/projection.h"
#include "isohf/raster.h"
#include "isohf/resampling.h"

namespace isohf {

/// Metadata of more bytes than this are refused.
inline constexpr std::uint32_t kMaxMetadataBytes = 64U << 20U;

/// How a tile stores one elevation: a 16- or 8-bit code, or a 32-bit float.
enum class CodeType { kU16, kU8, kF32 };

[[nodiscard]] std::string to_string(CodeType type);                     ///< "u16", "u8", "f32"
[[nodiscard]] CodeType code_type_from_string(const std::string& text);  ///< throws Error{kInvalidArgument}

/// How hard the encoder tries for few bytes: a hundredth more than by default, or a hundredth fewer for four times the
/// time. Readers need not know.
enum class Effort { kFast, kDefault, kBest };

[[nodiscard]] int level_of(Effort effort);  ///< the metadata's number: 2, 5, 6

/// One scale and offset for the whole dataset: elevation = offset + scale * code. Codes run from 0 to max_code(); the
/// next one means void. For kF32 the float is the elevation itself, offset 0, scale 1, NaN is void.
struct Quantisation {
  CodeType type = CodeType::kU16;
  double offset = 0.0;  ///< elevation of code 0, vertical units (metres where known)
  double scale = 1.0;   ///< elevation step of one code, > 0

  [[nodiscard]] std::uint32_t max_code() const { return type == CodeType::kU8 ? 254U : 65534U; }
  [[nodiscard]] std::uint32_t void_code() const { return type == CodeType::kU8 ? 255U : 65535U; }
};

/// A rectangle of world space.
struct WorldBounds {
  double x0 = 0.0;
  double z0 = 0.0;
  double x1 = 0.0;
  double z1 = 0.0;
};

/// Elevation statistics over the stored vertices on the source's ground, each shared vertex counted once.
struct Statistics {
  std::optional<double> min;  ///< vertical units; absent where every vertex is void
  std::optional<double> max;
  std::optional<double> mean;
  std::int64_t vertices = 0;    ///< that count
  std::int64_t voids = 0;       ///< of these, void
  std::int64_t clamped = 0;     ///< elevations outside the range asked for that were moved to its end
  double worst_rounding = 0.0;  ///< largest |stored - computed| elevation, vertical units
};

/// What a source of several files was joined from.
struct MosaicRecord {
  std::int64_t files = 0;
  std::vector<std::string> first_names;  ///< without folders, some of them
  std::string names_sha256;              ///< over all names, a line feed after each
  std::string overlap;                   ///< which showed where several overlapped: "last" or "first" named
};

/// What the surface was made from, as found in the source.
struct SourceRecord {
  std::string name;  ///< file name without its folder
  std::string format;
  std::int64_t width = 0;
  std::int64_t height = 0;
  bool repeats_column = false;  ///< had one more column, the first again a turn on
  std::string sample_type;
  std::string channel;
  double z_scale = 1;  ///< elevation = raw sample * z_scale + z_offset, in vertical units
  double z_offset = 0;
  std::vector<double> void_values;                       ///< raw values that meant "no elevation"
  std::optional<std::pair<double, double>> raw_range;    ///< raw values outside meant it as well; infinite: unbounded
  std::optional<std::pair<double, double>> valid_range;  ///< elevations outside were void, by the user's choice
  std::int64_t fill_distance = 0;  ///< voids up to so many samples from an elevation were filled; 0: none
  Registration registration = Registration::kUnknown;  ///< as used; unknown: a name that this build does not know
  double first_sample_x = 0;                           ///< world place of sample (0, 0)
  double first_sample_z = 0;
  double spacing_x = 1;  ///< world units between neighbouring columns and rows
  double spacing_z = 1;
  std::optional<double> origin_x;  ///< CRS coordinates of sample (0, 0), as found
  std::optional<double> origin_y;
  double crs_spacing_x = 0;  ///< CRS units between neighbouring columns and rows, as found; 0 where unknown
  double crs_spacing_y = 0;
  std::string crs_unit;          ///< "metre", "degree", "unknown"
  double metres_per_unit = 1.0;  ///< of a linear unit: "metre" is feet as well
  std::string crs_name;
  std::optional<int> crs_epsg;
  std::string crs_wkt;
  std::string body;
  std::optional<double> semi_major_axis_m;
  std::optional<double> inverse_flattening;
  std::string vertical_datum;
  std::optional<int> vertical_epsg;
  std::optional<MosaicRecord> mosaic;  ///< nullopt: a single file
  std::optional<MapGround> ground;     ///< under a source on a map that was understood
  /// Its reference system, where who reads the archive has understood it; never stored.
  std::shared_ptr<const ReferenceMap> map;
  /// How it was read: options of `isohf convert` by name, without dashes, with their text; nullopt: not recorded.
  std::optional<std::vector<std::pair<std::string, std::string>>> options;
};

/// The map on which world space lies, metres, where it is another one than the source's.
struct ProjectionRecord {
  ProjectionSpec spec;
  MapPoint origin;                 ///< map place of world (0, 0); x goes East from there, z South
  double worst_scale_error = 0.0;  ///< over the source's ground: 0.01 for 1 %; may be infinite
  GeoPoint worst_place;            ///< where that is
  std::string why;                 ///< why this one
};

/// Coarse planes above the tiles, by which an archive is looked at from afar: a tile of plane p holds every
/// stride^p-th elevation of as many tiles in each direction (docs/archive_format.md, "Planes").
struct PlaneInfo {
  int stride = 8;  ///< from each plane to the next
  int count = 0;   ///< coarse planes; the tiles themselves are plane 0 and do not count

  friend bool operator==(const PlaneInfo&, const PlaneInfo&) = default;
};

/// The version of the format that this build reads and writes.
inline constexpr int kFormatVersion = 1;

/// Everything about an archive but its elevations; its member isohf.json (docs/archive_format.md).
struct Metadata {
  explicit Metadata(const TileGrid& tile_grid) : grid(tile_grid) {}

  /// The tiles of a plane: plane 0 is `grid`; those of a coarser one are fewer and wider. 0 <= plane <= planes.count.
  [[nodiscard]] TileGrid plane_grid(int plane) const;

  TileGrid grid;
  PlaneInfo planes;
  Quantisation quantisation;
  /// Elevations that nothing stored lies beyond, by the user's choice: offset and a whole number of steps more.
  std::optional<std::pair<double, double>> z_range;
  /// How far a stored elevation may lie from what was computed; nullopt for half a step. Vertical units.
  std::optional<double> rounding;
  std::string horizontal_unit = "unknown";  ///< world units: "metre" or "unknown"
  std::string vertical_unit = "unknown";    ///< "metre", "foot", ... or "unknown"
  WorldBounds valid;  ///< the part of the world that the source covers; a rectangle around it where it was projected
  std::optional<ProjectionRecord> projection;  ///< absent where world space is the source's own plane
  bool wraps_x = false;                        ///< the East edge of the last tiles is the West edge of the first
  // nullopt: a name that this build does not know; the surface can be read all the same.
  std::optional<Filter> filter = Filter::kBilinear;
  std::optional<Edges> edges = Edges::kOdd;  ///< how samples went on beyond the source's ends
  std::optional<Acquisition> acquisition = Acquisition{};
  std::optional<Effort> effort;  ///< that the tiles were coded with; tells readers nothing
  SourceRecord source;
  Statistics statistics;
  std::vector<std::string> textures;
  std::int64_t tiles_stored = 0;  ///< tiles that hold at least one elevation; the others are wholly void and absent
  std::string content_sha256;     ///< see docs/archive_format.md; independent of threads, level and codec
  /// Over content_sha256 and what says where on which ground it lies: lattice, units, projection, reference systems.
  std::string ground_sha256;
  std::string producer;  ///< "isohf 0.1.0"
  /// JSON members that this build does not know or that a later section adds (shadow seeds, residuals, accuracy), as
  /// JSON text by name; of one inside another object by its place, "/source/crs/datum".
  std::vector<std::pair<std::string, std::string>> extensions;
};

/// The name of what metadata say; "unknown" where this build does not know it.
template <typename T>
[[nodiscard]] std::string name_of(const std::optional<T>& value) {
  return value ? to_string(*value) : "unknown";
}

/// The metadata as JSON text (UTF-8, no trailing newline), in the version of the format that is written now, and back.
/// parse_metadata throws Error{kCorrupt} naming the member at fault, and Error{kUnsupported} for a format version that
/// this build does not know or where the archive requires what it does not know.
[[nodiscard]] std::string format_metadata(const Metadata& metadata);
/// The projection alone, as metadata have it: JSON text.
[[nodiscard]] std::string format_projection(const ProjectionRecord& record);
/// The ground under a source on a map alone, in the same way.
[[nodiscard]] std::string format_ground(const MapGround& ground);
[[nodiscard]] Metadata parse_metadata(const std::string& json);

/// How far an archive's surface, as it is drawn, lies from the samples of its source: the metadata's member "accuracy",
/// which is there where the writer measured it.
struct AccuracyInfo {
  std::int64_t compared = 0;  ///< samples with elevations on both sides
  std::int64_t lost = 0;      ///< elevations of the source in voids of the surface: beside voids
  double rms = 0.0;           ///< vertical units
  double max = 0.0;
  std::optional<double> max_error;  ///< that was asked for; max is at most that
  double rounding = 0.0;            ///< the bound on a stored vertex's: half a step; of f32 the largest there was
};

/// The record of an archive's metadata; nullopt where it was not measured. Throws Error{kCorrupt} naming the member at
/// fault, and where the figures contradict each other or the source's size.
[[nodiscard]] std::optional<AccuracyInfo> accuracy_info(const Metadata& metadata);

}  // namespace isohf
