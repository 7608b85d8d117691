#pragma once

#include <string>

#include "isohf/projection/projected_extent.h"

namespace isohf {

/// Up to this scale error `auto` keeps degrees equirectangular (docs/decisions/0016).
inline constexpr double kEquirectangularError = 0.02;

/// A ground that is to lie on a map, metres.
struct ProjectionProblem {
  std::string path;  ///< of the source, for messages
  std::string body;  ///< "Earth", ...; empty where unknown
  Ellipsoid ellipsoid;
  GeoExtent ground;         ///< latitudes within [-90, 90]
  bool goes_round = false;  ///< its East side is its West side
  bool wraps_x = false;     ///< its rows stay rows: auto takes no other kind than equirectangular, others are refused
  bool in_degrees = true;   ///< else on a map, whose rows are no parallels: equirectangular is no choice
};

struct ProjectionChoice {
  ProjectionSpec spec;  ///< of kind none where degrees stay degrees
  ScaleError error;
  std::string why;  ///< one line
};

/// Fills in what the request leaves open from the ground: centre, zone, parallels, for auto the kind. Angles that are
/// chosen are whole multiples of 0.0001 degrees.
/// Throws Error{kInvalidArgument}, naming the kind that works, where the ground does not suit the kind: a pole outside
/// polar-stereographic, both hemispheres in it, a scale that errs by more than 100 %.
[[nodiscard]] ProjectionChoice choose_projection(const ProjectionRequest& request, const ProjectionProblem& problem);

}  // namespace isohf
