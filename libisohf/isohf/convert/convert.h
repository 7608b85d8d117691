#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "isohf/archive/codec/tile_codes.h"
#include "isohf/archive/metadata/accuracy_info.h"
#include "isohf/archive/textures/texture_info.h"
#include "isohf/convert/frame/plan.h"
#include "isohf/raster.h"
#include "isohf/resampling.h"
#include "isohf/surface/photo/photo_source.h"

namespace isohf {

/// Which shadow seeds an archive gets (docs/archive_format.md).
struct ShadowSeedRequest {
  double sun_min_deg = 2.0;     ///< hulls for every sun elevation from here on, degrees, 0.01 to below 90
  std::vector<double> sun_deg;  ///< instead: shadow heights for these sun elevations, ascending
};

/// Which textures an archive gets (docs/decisions/0015).
struct TextureRequest {
  PhotoSource* photo = nullptr;         ///< must outlive the conversion
  std::optional<TextureFormat> format;  ///< nullopt: JPEG, or PNG where the photo has alpha
  int max_size = 1024;                  ///< texels on a side at most: a power of two, 64...4096
  int jpeg_quality = 90;                ///< 1...100
};

/// What an archive says of its source beyond what the source itself says.
struct SourceNote {
  std::string name;                    ///< instead of the file's; empty: the file's
  std::optional<MosaicRecord> mosaic;  ///< nullopt: a single file, or not to be said
  std::optional<std::vector<std::pair<std::string, std::string>>> options;  ///< as SourceRecord has them
  std::string fingerprint;  ///< what --resume compares beside the file's own size and time
};

/// What was found by reading an archive that is complete but for its name.
struct MeasuredError {
  AccuracyInfo info;
  std::vector<Window> worst;  ///< single samples where the surface errs most, worst first
};

/// What a conversion does, beyond its input and output.
struct ConvertOptions {
  PlanRequest plan;
  CodeType code_type = CodeType::kU16;
  /// Nothing stored lies beyond; the lower end is the first code, the upper end another one. nullopt: taken from the
  /// data in a first pass.
  std::optional<std::pair<double, double>> z_range;
  /// Elevation step of one code; nullopt: chosen (docs/decisions). 0 asks for the finest that the code type holds.
  std::optional<double> step;
  /// Instead of a step: every vertex is stored to within that (LERC's MAX_Z_ERROR), or convert() refuses.
  std::optional<double> max_rounding;
  /// What to do with elevations outside z_range: false refuses, true moves them to its end and counts them.
  bool clamp_range = false;
  Filter filter = kDefaultFilter;
  Acquisition acquisition;
  std::optional<ShadowSeedRequest> shadow_seeds;  ///< nullopt: none
  std::optional<TextureRequest> texture;          ///< nullopt: none
  int threads = 0;                                ///< 0: all cores
  /// Peak of the resident set, which is held to it within a tenth; a limit below what the most frugal way needs is
  /// refused (memory_plan.h). 0: none. The archive does not depend on it.
  std::uint64_t memory_bytes = 0;
  std::string scratch_folder = ".";  ///< where rows go that memory has no room for, in a file without a name
  bool overwrite = false;
  bool resume = false;
  bool strict = false;        ///< a warning is an Error{kWarning}, and nothing is written
  int level = kDefaultLevel;  ///< kMinLevel to kMaxLevel: the higher, the fewer bytes and the slower
  bool lossless = false;      ///< write residuals beside the tiles, so that the source's samples come back bit for bit
  /// Measures the part file once it is a whole archive, before it gets its name; the metadata then say what was found.
  std::function<MeasuredError(const std::string& archive)> measure;
  /// The largest error that the surface may have at the source's samples; needs measure. convert() gives an archive no
  /// name that exceeds it; convert_within() looks for one that does not. Chooses the step where none is asked for.
  std::optional<double> max_error;
  bool is_retry = false;  ///< an interrupt leaves no part file behind, which --resume could not use
  std::string producer;   ///< "isohf 0.1.0"
  SourceNote source_note;
};

/// What a conversion reports while it runs. Called from one thread at a time, a few times a second at most.
struct ConvertProgress {
  enum class Pass { kRange, kTiles, kResiduals };
  Pass pass = Pass::kRange;
  std::int64_t done = 0;  ///< source rows; tiles in kTiles
  std::int64_t total = 0;
  std::uint64_t bytes_written = 0;
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
  std::uint64_t tile_bytes = 0;  ///< of all tiles, compressed
  std::uint64_t seed_bytes = 0;  ///< of shadow seeds, compressed
  std::uint64_t texture_bytes = 0;
  std::optional<TextureInfo> texture;  ///< as in the metadata
  double pixels_per_texel =
      0.0;  ///< photo pixels under the side of a texel; above 1 where --texture-size is in the way
  std::optional<MeasuredError> measured;  ///< by ConvertOptions::measure
  bool is_finished = true;                ///< false: the surface errs by more than max_error, nothing was left
  double seconds = 0.0;
  std::vector<Warning> warnings;
};

/// source -> tiles -> archive. Two passes over the source at most (the first only finds the range; lossless takes one
/// more for the residuals), bounded memory, all cores; the same bytes for any thread count and any bound.
/// `cancel` is polled between tiles: set, the conversion stops within a fraction of a second with Error{kCancelled},
/// leaving NAME.part and its journal for --resume and nothing under the final name.
/// Throws Error as the source, the plan and the writer do.
ConvertSummary convert(HeightSource& source, const std::string& output, const ConvertOptions& options,
                       const std::function<void(const ConvertProgress&)>& progress, const std::atomic<bool>& cancel);
/// The same by a plan that make_plan() has made of this source and options.plan.
ConvertSummary convert(HeightSource& source, const Plan& plan, const std::string& output, const ConvertOptions& options,
                       const std::function<void(const ConvertProgress&)>& progress, const std::atomic<bool>& cancel);

}  // namespace isohf
