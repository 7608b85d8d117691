#pragma once

#include <cstdint>
#include <string>

#include "isohf/surface/heightmap.h"

namespace isohf {

/// What surrounds the source: tiles reach past its last sample unless they were fitted to it.
enum class Outside {
  kCover,  ///< the surface goes on mirrored about the source's first and last samples
  kClamp,  ///< the edge value goes on
  kVoid,   ///< no elevation
};

[[nodiscard]] std::string to_string(Outside outside);                ///< "cover", "clamp", "void"
[[nodiscard]] Outside outside_from_string(const std::string& text);  ///< throws Error{kInvalidArgument}

/// One axis of the source: which of its samples a world coordinate falls on or between.
///
///   area    |-- 0 --|-- 1 --|  ...  |- n-1 -|      first_world is the place of sample 0, the middle of its pixel
///   point       0-------1---  ...  ---n-1          the source ends at its first and last posts
class SourceAxis {
 public:
  /// samples >= 1; first_world and spacing_world in world units, spacing > 0.
  SourceAxis(std::int64_t samples, double first_world, double spacing_world, Registration registration,
             Outside outside);

  [[nodiscard]] std::int64_t samples() const { return samples_; }

  /// Position in samples, 0 at the first and n-1 at the last. Beyond the covered ground the position goes on for
  /// Outside::kCover and stays at the edge sample for the others; half a pixel around an area-registered source always
  /// takes the edge value.
  [[nodiscard]] double position(double world) const;

  /// False where Outside::kVoid leaves no elevation at this place.
  [[nodiscard]] bool has_elevation(double world) const;

 private:
  [[nodiscard]] bool covers(double u) const;

  std::int64_t samples_;
  double first_world_;
  double spacing_world_;
  double reach_;  ///< how far the covered ground goes beyond the first and last samples, in samples
  Outside outside_;
};

}  // namespace isohf
