/// The first minutes of a person with archives of every kind: wheel, drags and half a minute of flight, without a window.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <random>

#include "hand_scene.h"
#include "support/real_files.h"
#include "support/run_program.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

using view::PicturePoint;
using view::Steering;
using view::Vec3;

struct Kind {
  std::string name;
  std::string source;
  std::vector<std::string> options;
  friend void PrintTo(const Kind& kind, std::ostream* out) { *out << kind.name; }
};

class Hand : public testing::TestWithParam<Kind> {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(GetParam().source)) GTEST_SKIP() << kNoRealFiles;
    std::vector<std::string> command{"convert", GetParam().source, folder_ / "a.isohf", "-q"};
    command.insert(command.end(), GetParam().options.begin(), GetParam().options.end());
    const RunResult converted = run_isohf(command);
    ASSERT_EQ(converted.exit_code, 0) << converted.err;
    tiles_ = view::open_archive(folder_ / "a.isohf");
  }
  [[nodiscard]] HandScene scene() const { return {*tiles_, view::default_exaggeration(*tiles_)}; }

 private:
  const TemporaryFolder folder_;
  std::unique_ptr<view::TileSource> tiles_;
};

TEST_P(Hand, WheelsAtNinePlacesEndAboveGroundWithGroundInView) {
  for (const double x : {0.05, 0.5, 0.95}) {
    for (const double y : {0.05, 0.5, 0.95}) {
      HandScene it = scene();
      for (int notch = 0; notch < 60; ++notch) {
        it.hand.wheel(1.0, {x * it.state.width, y * it.state.height});
        ASSERT_GE(it.height(), it.hand.clearance() * 0.999) << x << " " << y << " notch " << notch;
      }
      EXPECT_TRUE(it.sees_ground()) << x << " " << y;
    }
  }
}

TEST_P(Hand, DragsKeepThePickedPointUnderTheCursor) {
  HandScene it = scene();
  std::mt19937 random(7);
  std::uniform_real_distribution<double> step(-25.0, 25.0);
  for (const double notches : {0.0, 8.0, 16.0}) {
    PicturePoint at{0.5 * it.state.width, 0.55 * it.state.height};
    it.hand.wheel(notches, at);
    const auto held = it.hand.pick(at);
    if (!held) continue;  // a void
    it.hand.press(Steering::Drag::kPan, at);
    for (int i = 0; i < 30; ++i) {
      at = {std::clamp(at.x + step(random), 300.0, 900.0), std::clamp(at.y + step(random), 300.0, 600.0)};
      it.hand.move(at);
      const PicturePoint now = it.project(*held);
      // Where a hill comes in between, the eye rises over it.
      if (it.height() <= it.hand.clearance() * 1.001) break;
      ASSERT_LT(std::hypot(now.x - at.x, now.y - at.y), 2.0) << notches << " notches, move " << i;
    }
    it.hand.release();
    const view::Camera still = it.camera;
    it.hand.move({10.0, 10.0});
    EXPECT_EQ(it.camera, still);
  }
}

TEST_P(Hand, TurnsNeverLookAtTheGroundFromBelow) {
  for (const double x : {0.05, 0.5, 0.95}) {
    for (const double y : {0.05, 0.5, 0.95}) {
      HandScene it = scene();
      for (int drag = 0; drag < 8; ++drag) {
        const PicturePoint at{x * it.state.width, y * it.state.height};
        it.hand.press(Steering::Drag::kOrbit, at);
        it.hand.move({at.x + 40.0, at.y - 100.0});
        ASSERT_LE(it.camera.pitch_rad, 1e-12) << x << " " << y << " drag " << drag;
        ASSERT_GE(it.height(), it.hand.clearance() * 0.999) << x << " " << y << " drag " << drag;
        ASSERT_GE(it.camera.eye.y, it.ground.whole().low * it.state.exaggeration) << x << " " << y << " drag " << drag;
      }
    }
  }
}

TEST_P(Hand, HalfAMinuteAheadNeverEntersTheGround) {
  HandScene it = scene();
  const auto middle = it.hand.hold({0.5 * it.state.width, 0.5 * it.state.height});
  it.hand.wheel(14.0, {0.5 * it.state.width, 0.5 * it.state.height});
  it.camera.look_at(it.camera.eye, {middle.x, it.camera.eye.y - 0.1 * length(middle - it.camera.eye), middle.z});
  for (int frame = 0; frame < 30 * 30; ++frame) {
    it.hand.update(1.0 / 30.0, {0.0, 0.0, 1.0}, frame % 200 < 60 ? 4.0 : 1.0);
    ASSERT_GE(it.height(), it.hand.clearance() * 0.999) << frame;
  }
}

std::vector<Kind> kinds() {
  const std::string own = ISOHF_SOURCE_DIR "/testdata/";
  return {{"Coast", own + "coast_512x384_int16.tif", {}},
          {"UnitlessBytes", own + "peaks_256x256_uint16.png", {"--type", "u8"}},
          {"UnitlessFloats", own + "ridges_161x161_float.exr", {"--type", "f32"}},
          {"Voids", own + "voids_200x150_int16.tif", {}},
          {"Alps", real_data() / "N44E006.hgt", {}},
          {"Degrees", real_data() / "N44E006.hgt", {"--to-crs", "none", "--density", "0.2"}},
          {"Globe", real_data() / "ETOPO1_1deg.tif", {}},
          {"Mars", real_data() / "megt90n000cb.lbl", {"--density", "0.2"}},
          {"Heightmap", real_data() / "t3d_mountain1.exr", {}}};
}

INSTANTIATE_TEST_SUITE_P(Archives, Hand, testing::ValuesIn(kinds()), [](const auto& kind) { return kind.param.name; });

}  // namespace
}  // namespace isohf::test
