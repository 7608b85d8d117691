// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "isohf/error.h"
#include "isohf/job.h"
#include "isohf/lattice.h"
#include "isohf/metadata.h"
#include "isohf/picture.h"
#include "isohf/projection.h"
#include "isohf/raster.h"
#include "isohf/resampling.h"
#include "isohf/verify.h"

namespace isohf {

/// Whether a source's East edge is joined to its West edge.
enum class Wrap {
  kAuto,    ///< if it goes all the way round and its rows stay rows
  kNever,   ///< never
  kAlways,  ///< as kAuto, and refuse any other; a source without a place is joined as a pattern
};

/// How a source is laid out on the ground plane.
struct GroundRequest {
  /// Of degrees, auto by default; of a source on a map of its own only where the user gives one.
  ProjectionRequest projection;
  Wrap wrap = Wrap::kAuto;
  std::shared_ptr<const ReferenceMap> source_map = nullptr;  ///< of a source on a map of its own, where understood
  std::string why_no_map;                                    ///< in one line, where there is a system and no map
};

/// Looks up the map of a source that lies on one of its own, for the scales of its lengths and for other projections;
/// request.why_no_map says why where that cannot be. Without it such a source keeps its map, unexamined.
void understand_ground(const SourceInfo& info, GroundRequest& request);

/// What is asked of the lattice and its tiles. At most one of density and spacing is given; at most one of shape and
/// budget.
struct PlanRequest {
  std::optional<std::pair<int, int>> shape;  ///< C, R; nullopt: chosen
  std::optional<int> levels;                 ///< Λ; nullopt: 4, or fewer for small sources
  std::optional<ShapeBudget> budget;         ///< of one tile
  std::optional<double> density;             ///< lattice samples for one source sample, > 0; nullopt: about 1
  std::optional<double> spacing;             ///< lattice column step, world units, > 0
  /// Instead: a column for each of the source's and two rows for each, so that every sample is a vertex: twice as many
  /// vertices as samples. Not for sources that are projected, or joined with columns that no tiles divide.
  bool through_samples = false;
  bool fit = false;  ///< stretch tiles by an eighth at most so that they end on the source's edge; else they are square
  GroundRequest ground;
};

/// Which shadow seeds an archive gets (docs/archive_format.md).
struct ShadowSeedRequest {
  double sun_min_deg = 2.0;  ///< they serve every sun elevation from here on, degrees, 0.01 to below 90
};

/// Which textures an archive gets (docs/decisions/0015).
struct TextureRequest {
  PhotoSource* photo = nullptr;         ///< must outlive the conversion
  std::optional<TextureFormat> format;  ///< nullopt: JPEG; PNG where the photo has alpha or is a part
  int max_size = 1024;                  ///< texels on a side at most: a power of two, 64...4096
  /// Whether the photo's reference system is the source's, if the caller understands both; nullopt: as their texts say.
  std::optional<bool> same_system = std::nullopt;
};

/// What an archive says of its source beyond what the source itself says.
struct SourceNote {
  std::string name;                    ///< instead of the file's; empty: the file's
  std::optional<MosaicRecord> mosaic;  ///< nullopt: a single file, or not to be said
  std::optional<std::vector<std::pair<std::string, std::string>>> options;  ///< as SourceRecord has them
  std::string fingerprint;  ///< what `resume` compares beside the file's own size and time
};

/// What a conversion does, beyond its input and output.
struct ConvertOptions {
  PlanRequest plan;
  CodeType code_type = CodeType::kU16;
  /// Nothing stored lies beyond; the lower end is the first code, the upper end another one. nullopt: taken from the
  /// data in a first pass.
  std::optional<std::pair<double, double>> z_range;
  /// Elevation step of one code; nullopt: chosen (docs/decisions/0011). 0 asks for the finest that the code type holds.
  std::optional<double> step;
  /// Every vertex is stored to within that (LERC's MAX_Z_ERROR), or convert() refuses: by steps of twice that, or with a
  /// finer `step` by those codes within reach that vary least (docs/decisions/0067).
  std::optional<double> max_rounding;
  /// What to do with elevations outside z_range: false refuses, true moves them to its end and counts them.
  bool clamp_range = false;
  std::optional<Filter> filter;  ///< nullopt: kDefaultFilter, or with max_error what takes fewer vertices
  Acquisition acquisition;
  std::optional<ShadowSeedRequest> shadow_seeds;  ///< nullopt: none
  std::optional<TextureRequest> texture;          ///< nullopt: none
  bool overwrite = false;
  bool resume = false;  ///< go on with what an interrupted run left in NAME.part
  bool strict = false;  ///< a warning is an Error{kWarning}, and nothing is written
  Effort effort = Effort::kDefault;
  bool planes = true;     ///< write coarse planes, by which the archive is looked at from afar
  bool lossless = false;  ///< write residuals beside the tiles, so that the source's samples come back bit for bit
  /// Hold the surface, as drawn, to within that of every source sample that it has an elevation for. The smallest
  /// density that does is looked for, unless `plan` gives one; the step is chosen where none is asked for. Archives are
  /// made and measured up to eight times, and the metadata state what was found. Throws Error{kInvalidArgument} with the smallest error that was reached.
  std::optional<double> max_error;
  std::string producer;  ///< for the record; empty: "isohf" and the library's version
  SourceNote source_note;
};

/// What a conversion did.
struct ConvertSummary {
  explicit ConvertSummary(const TileGrid& grid) : metadata(grid) {}

  Metadata metadata;
  std::int64_t tiles_expected = 0;
  std::int64_t tiles_written = 0;  ///< stored and void ones together: always tiles_expected on return
  std::int64_t tiles_void = 0;
  std::uint64_t archive_bytes = 0;
  std::uint64_t residual_bytes = 0;  ///< of these, residuals; 0 where not lossless
  std::uint64_t source_samples = 0;
  std::optional<std::int64_t> source_voids;  ///< of these, void; nullopt where the first pass was spared (z_range)
  std::uint64_t lattice_samples = 0;         ///< C*R for every tile
  double step = 0.0;                         ///< elevation of one code
  double worst_rounding = 0.0;
  std::uint64_t tile_bytes = 0;   ///< of all tiles, compressed
  std::uint64_t plane_bytes = 0;  ///< of all coarse planes' tiles, compressed
  std::uint64_t seed_bytes = 0;   ///< of shadow seeds, compressed
  std::uint64_t texture_bytes = 0;
  double pixels_per_texel = 0.0;  ///< photo pixels under the side of a texel; above 1 where max_size is in the way
  double seconds = 0.0;
  std::vector<Warning> warnings;
};

/// source -> tiles -> archive. Two passes over the source at most (the first only finds the range; lossless takes one
/// more for the residuals), bounded memory, all cores; the same bytes for any job. Stages: "range", "tiles",
/// "residuals", "compare".
/// A conversion that is cancelled leaves NAME.part and its journal for `resume`, and nothing under the final name.
/// Throws Error{kInvalidArgument} naming the setting at fault, kOutOfMemory where job.memory_bytes are too few, and as
/// reading the source and writing do.
ConvertSummary convert(HeightSource& source, const std::string& output, const ConvertOptions& options = {},
                       const Job& job = {});

/// How far a surface will lie from the source's samples, by some of them.
struct ErrorEstimate {
  double rms = 0.0;
  double largest = 0.0;      ///< of those looked at: most often there are larger ones
  std::int64_t samples = 0;  ///< that it stands on; 0: there is no estimate
  std::int64_t lost = 0;     ///< elevations looked at that have no surface: void vertices beside them
  std::string why_none;      ///< a clause, where there is none
};

/// The error that such a conversion will have, by all samples of a source of up to a million, and by about a tenth of a
/// larger one, 64 windows of 64 x 64 at most: resampled, rounded and compared on the triangles as the archive will be.
/// Deterministic. `codes` are those of the archive, where it is made; without them the range of what is looked at tells
/// them. There is no estimate where a large source would have to be unpacked or filled as a whole for it.
[[nodiscard]] ErrorEstimate estimate_error(HeightSource& source, const ConvertOptions& options, const Job& job = {},
                                           std::optional<Quantisation> codes = std::nullopt);

}  // namespace isohf
