#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "isohf/convert.h"
#include "isohf/metadata.h"
#include "isohf/projection/choose_projection.h"
#include "isohf/sampling/resample/tile_resampler.h"

namespace isohf {

/// Where the source's samples lie in world space.
struct SourceFrame {
  std::int64_t width = 0;
  std::int64_t height = 0;
  Registration registration = Registration::kPoint;  ///< as used, never kUnknown
  double first_sample_x = 0.0;                       ///< world place of sample (0, 0)
  double first_sample_z = 0.0;
  double spacing_x = 1.0;  ///< world units between neighbouring columns and rows; in the middle, where projected
  double spacing_z = 1.0;
  bool in_metres = false;                      ///< world units are metres; else the source's own units
  bool wraps_x = false;                        ///< the world's East edge is its West edge
  std::optional<ProjectionRecord> projection;  ///< of degrees, or of another map, that became metres
  std::optional<MapGround> ground;             ///< under a source on a map of its own that was understood
  std::optional<WarpPlace> warp;               ///< where rows of the source are no rows of the world
  bool samples_wrap = false;                   ///< the source itself goes all the way round
  double size_x = 0.0;                         ///< of the covered part of the world, where projected
  double size_z = 0.0;

  /// The part of the world that the source covers: pixel areas, or posts; a rectangle around it where projected.
  [[nodiscard]] WorldBounds bounds() const;
  [[nodiscard]] SourceGeometry geometry() const;
};

/// Degrees become metres on the declared ellipsoid (WGS 84 where none is declared) by the projection asked for; linear
/// units by their length, or as degrees do where a projection is asked for. Unknown registration counts as point where
/// the source has no georeference, else as area. Throws Error{kInvalidArgument} where a projection does not suit the
/// source, or is asked for without degrees and a map that is understood.
[[nodiscard]] SourceFrame make_source_frame(const SourceInfo& info, const GroundRequest& request);
/// Equirectangular where in degrees.
[[nodiscard]] SourceFrame make_source_frame(const SourceInfo& info);

/// What a user must hear of the lengths of a source that keeps its own map: one line; empty where they are true to
/// MapGround::kTrueEnough, or projection none says that it is known.
[[nodiscard]] std::string scale_warning(const SourceInfo& info, const SourceFrame& frame,
                                        const ProjectionRequest& request);

/// How the columns of a source in degrees, or on a map on which a turn is a length, close round the body.
enum class Closure {
  kOpen,      ///< they don't
  kClosed,    ///< columns * spacing = a turn, within a hundredth of a spacing
  kRepeated,  ///< the last column is the first one again
};
/// map  that of a source that is not in degrees, where it is understood
[[nodiscard]] Closure closure_of(const SourceInfo& info, const ReferenceMap* map = nullptr);

}  // namespace isohf
