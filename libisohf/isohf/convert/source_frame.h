#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "isohf/archive/metadata.h"
#include "isohf/projection/choose_projection.h"
#include "isohf/surface/source_geometry.h"

namespace isohf {

/// How a source is laid out on the ground plane.
struct GroundRequest {
  ProjectionRequest projection;  ///< of degrees; auto by default
  bool wrap_x = false;           ///< join the East edge to the West edge
  /// What needs the source's rows to stay rows of the world, as in "--lossless"; empty where nothing does.
  std::string keeps_rows;
};

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
  std::optional<ProjectionRecord> projection;  ///< of degrees that became metres
  std::optional<WarpPlace> warp;               ///< where rows of the source are no rows of the world
  bool samples_wrap = false;                   ///< the source itself goes all the way round
  double size_x = 0.0;                         ///< of the covered part of the world, where projected
  double size_z = 0.0;

  /// The part of the world that the source covers: pixel areas, or posts; a rectangle around it where projected.
  [[nodiscard]] WorldBounds bounds() const;
  [[nodiscard]] SourceGeometry geometry(Outside outside) const;
};

/// Degrees become metres on the declared ellipsoid (WGS 84 where none is declared) by the projection asked for; linear
/// units by their length. Unknown registration counts as point where the source has no georeference, else as area.
/// Throws Error{kInvalidArgument} where a projection does not suit the source, or is asked for without degrees.
[[nodiscard]] SourceFrame make_source_frame(const SourceInfo& info, const GroundRequest& request);
/// Equirectangular where in degrees.
[[nodiscard]] SourceFrame make_source_frame(const SourceInfo& info);

/// How the columns of a source in degrees close round the body.
enum class Closure {
  kOpen,      ///< they don't
  kClosed,    ///< columns * spacing = 360 degrees, within a hundredth of a spacing
  kRepeated,  ///< the last column is the first one again
};
[[nodiscard]] Closure closure_of(const SourceInfo& info);

}  // namespace isohf
