#pragma once

#include <limits>

#include "steering.h"

namespace isohf::test {

/// Ground, an eye over it, and a hand.
struct HandScene {
  HandScene(const view::TileSource& source, double exaggeration) : ground(source), tiles_(source) {
    state.exaggeration = exaggeration;
    camera = overview_camera(source, state);
  }
  view::Ground ground;
  view::ViewState state;
  view::Camera camera;

 private:
  const view::TileSource& tiles_;

 public:
  view::Steering hand{tiles_, ground, camera, state};

  /// How far the eye stands above the ground; infinite beside the data.
  [[nodiscard]] double height() {
    const auto below = ground.height({camera.eye.x, camera.eye.z});
    return below ? camera.eye.y - *below * state.exaggeration : std::numeric_limits<double>::infinity();
  }
  /// Where a point of the world lies in the picture.
  [[nodiscard]] view::PicturePoint project(view::Vec3 at) const { return view::project(camera, state, at).value(); }
  /// At one of 9 x 9 places of the picture.
  [[nodiscard]] bool sees_ground() {
    for (int place = 0; place < 81; ++place) {
      if (hand.pick({state.width * (place % 9 + 0.5) / 9.0, state.height * (place / 9 + 0.5) / 9.0})) return true;
    }
    return false;
  }
};

}  // namespace isohf::test
