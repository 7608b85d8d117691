#pragma once

#include <optional>

#include "camera.h"
#include "ground.h"

namespace isohf::view {

/// What a hand on mouse and keys does to a camera: the ground sticks to the cursor, the wheel never passes what is under
/// it, a turn ends at the horizon, and the eye stays above ground. Knows nothing of windows.
class Steering {
 public:
  /// All three outlive it; `view` says how large the picture is and how high heights are drawn.
  Steering(const TileSource& source, Ground& ground, Camera& camera, const ViewState& view);

  enum class Drag { kPan, kOrbit };
  void press(Drag kind, PicturePoint at);
  void move(PicturePoint at);
  void release() { drag_.reset(); }
  [[nodiscard]] bool is_dragging() const { return drag_.has_value(); }

  /// Nearer to what is under the cursor (steps > 0), or away from it.
  void wheel(double steps, PicturePoint at);
  /// Two thirds of the way to what is under the cursor; nothing where there is no ground.
  void approach(PicturePoint at);
  /// Flies there.
  void go_to(const Camera& target);

  /// Shares of the speed to the right, up and ahead, each from -1 to 1; `hurry` times as fast. The speed follows the
  /// height above ground. Goes on with what approach() and its like began.
  void update(double seconds, Vec3 walk, double hurry);
  [[nodiscard]] bool is_flying() const { return flight_.has_value(); }

  /// What the hand would take hold of under the cursor: the ground there, else that which is seen nearest below it.
  [[nodiscard]] Vec3 hold(PicturePoint at);
  /// The ground under the cursor alone.
  [[nodiscard]] std::optional<Vec3> pick(PicturePoint at);
  /// Where lengths are those of the scale bar: the ground in the middle of the picture, else nearest below it; nullopt where
  /// none is in sight.
  [[nodiscard]] std::optional<Vec3> middle();
  /// Height of the eye above the ground under it, or the edge nearest to it; above the lowest ground in voids.
  [[nodiscard]] double height_above_ground();
  /// What the eye keeps from the ground.
  [[nodiscard]] double clearance() const { return clearance_; }

 private:
  struct Held {
    Drag kind;
    PicturePoint last;
    Vec3 ground;
    Camera start;
    bool level;  ///< pan: over the level plane through `ground`, else in that of the picture
  };
  struct Flight {
    Camera from;
    Camera to;
    double share;
  };
  [[nodiscard]] Vec3 ray(PicturePoint at) const;
  [[nodiscard]] double ground_under_eye();
  void pan(PicturePoint at);
  void orbit(double heading_change_rad, double pitch_change_rad);
  void stay_above();

  const TileSource& source_;
  Ground& ground_;
  Camera& camera_;
  const ViewState& view_;
  double clearance_;
  std::optional<Held> drag_;
  std::optional<Flight> flight_;
};

}  // namespace isohf::view
