#pragma once

#include <cstdint>

#include "isohf/raster.h"
#include "isohf/sampling/resample/kernels.h"

namespace isohf {

/// Lattice steps for which slopes go on beyond the source's edge: the triangles across the edge need one, and the normals
/// of their vertices another.
inline constexpr double kContinuedSteps = 2.0;

/// One axis of the source: which of its samples a world coordinate falls on or between.
///
///   area    |-- 0 --|-- 1 --|  ...  |- n-1 -|      first_world is the place of sample 0, the middle of its pixel
///   point       0-------1---  ...  ---n-1          the source ends at its first and last posts
class SourceAxis {
 public:
  /// Where a world coordinate reads the source. Beyond the first or last sample by d, a continued surface has the
  /// elevation 2 F(edge) - F(position), with the position mirrored: as far inside as the coordinate lies outside.
  struct Place {
    double position;    ///< in samples, within [0, n-1]; in [0, n) on an axis that wraps
    double edge = 0.0;  ///< 0 or n-1, where continued
    bool continued = false;
    bool has_elevation = true;  ///< false beyond the continuation of positions
  };

  /// samples >= 1; first_world, spacing_world and continued_world in world units, spacing > 0. Slopes go on for
  /// continued_world; beyond that the surface is level.
  SourceAxis(std::int64_t samples, double first_world, double spacing_world, Registration registration,
             double continued_world);

  /// An axis that goes all the way round: the sample behind the last one is the first.
  [[nodiscard]] static SourceAxis wrapping(std::int64_t samples, double first_world, double spacing_world);
  /// An axis whose world coordinates are positions, in samples, of a source that was projected. Where the slope has
  /// gone on for `continued` samples, the surface ends.
  [[nodiscard]] static SourceAxis of_positions(std::int64_t samples, Registration registration, double continued);

  [[nodiscard]] std::int64_t samples() const { return samples_; }
  [[nodiscard]] double spacing_world() const { return spacing_world_; }
  [[nodiscard]] bool wraps() const { return wraps_; }
  /// Where the covered ground ends: at the last post, or half a pixel beyond the last sample.
  [[nodiscard]] double end_world() const {
    return first_world_ + (static_cast<double>(samples_ - 1) + reach_) * spacing_world_;
  }
  /// The sample that stands in for sample k, any k: mirrored at the ends (mirror_index), or counted round.
  [[nodiscard]] std::int64_t index(std::int64_t k) const {
    if (k >= 0 && k < samples_) return k;
    return wraps_ ? ((k % samples_) + samples_) % samples_ : mirror_index(k, samples_);
  }
  /// The same with weights, for heights (continue_row).
  template <typename Use>
  void stand_ins(std::int64_t k, Use use) const {
    if (wraps_ || (k >= 0 && k < samples_)) return use(index(k), 1);
    continue_row(k, samples_, use);
  }
  /// Whole samples inside the edge that a continued place may read.
  [[nodiscard]] std::int64_t continued_samples() const;

  /// Pure function of the coordinate. Half a pixel around an area-registered source is covered ground: the slope goes on.
  [[nodiscard]] Place place(double world) const;

 private:
  std::int64_t samples_;
  double first_world_;
  double spacing_world_;
  double reach_;      ///< how far the covered ground goes beyond the first and last samples, in samples
  double continued_;  ///< in samples
  bool wraps_ = false;
  bool ends_ = false;  ///< nothing lies beyond the continuation
};

}  // namespace isohf
