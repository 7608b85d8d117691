#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "camera.h"
#include "gl/offscreen.h"
#include "options.h"
#include "paging/plane_boxes.h"
#include "paging/texture_box.h"
#include "paging/texture_overview.h"
#include "reading/hud.h"
#include "renderer.h"

namespace isohf::view {

/// The sun that casts over true heights what this one casts over exaggerated ones: that of tan(elevation) /
/// exaggeration. nullopt: it casts nothing, as it is night, or overhead.
[[nodiscard]] std::optional<CastingSun> casting_sun(double azimuth_deg, double elevation_deg, double exaggeration);

/// An open heightfield with a camera: all that window and picture have in common. A GL context must be
/// current as long as it lives.
class Session {
 public:
  /// Throws Error{kInvalidArgument} where a level beyond the archive's is asked for, or textures that it hasn't.
  Session(const TileSource& source, const Options& options);

  /// Updates the tile box and draws a frame into the bound framebuffer; never waits for a tile.
  void frame();
  /// Waits for all tiles in reach first, and calls poll() meanwhile. Throws Error{kCorrupt} where one cannot be read.
  void complete_frame();
  /// Changes the far distance by a factor.
  void scale_far(double factor) { far_distance_ = view.far_distance * factor; }
  /// What a person reads over the frame. kLegend: scale bar, North arrow and colours; kPlace: what a person asks the
  /// ground too; kAll: how it is drawn as well
  enum class Figures { kNone, kLegend, kPlace, kAll };
  /// middle             of the picture, on the ground: where the scale bar holds; nullopt: there is none
  /// frames_per_second  for kAll
  [[nodiscard]] Reading reading(Figures figures, const std::optional<Vec3>& middle, double frames_per_second) const;
  void draw_overlay(const Reading& reading, double screen_scale) {
    hud_.draw(reading, view.width, view.height, screen_scale);
  }
  /// Writes a picture that was drawn, with the legend alone where it is wanted.
  void keep(const Offscreen& picture, const Options& options, const std::string& path);

  /// A place of the archive's world, y without exaggeration, as drawn; and the eye's, back.
  [[nodiscard]] Vec3 from_archive(Vec3 at) const;
  [[nodiscard]] Vec3 eye_in_archive() const;

  /// Follows the sun of a day from here on. Throws Error{kInvalidArgument} where its way is not known.
  void begin_day(const SolarTime& time);
  void set_hours(double hours);
  /// The sun stands where it is put: from here on, or where it stood before the day.
  void end_day() { time_.reset(); }
  void leave_day();
  [[nodiscard]] std::optional<double> hours() const { return time_ ? std::optional(time_->hours) : std::nullopt; }

  /// The colours of the ground that the source has.
  [[nodiscard]] std::vector<ColourMode> modes() const;

  std::function<void()> poll = [] {};  ///< may throw, as where the program was interrupted
  Camera camera;
  ViewState view;
  double sun_azimuth_deg;
  double sun_elevation_deg;
  bool shadows = true;  ///< wanted

  /// True where the next frame would show the same: nothing is on its way.
  [[nodiscard]] bool is_settled() const;
  /// True where memory ended the last frame before the far distance.
  [[nodiscard]] bool is_cut() const { return cut_; }
  [[nodiscard]] const FrameFigures& figures() const { return figures_; }
  [[nodiscard]] const PlaneBoxes& boxes() const { return boxes_; }
  /// nullptr where the source has no textures.
  [[nodiscard]] const TextureBox* textures() const { return textures_ ? &*textures_ : nullptr; }
  [[nodiscard]] const TileSource& source() const { return source_; }
  [[nodiscard]] Renderer& renderer() { return renderer_; }

 private:
  void prepare();
  void draw();
  /// The distance from the eye as long as it is on the body.
  [[nodiscard]] double true_distance(Vec3 at) const;
  [[nodiscard]] bool shows_textures() const { return textures_ && view.mode == ColourMode::kTexture; }

  const TileSource& source_;
  TileBounds whole_;
  SharedGeometry shared_;
  Renderer renderer_;
  Workers workers_;  ///< of all that follow
  PlaneBoxes boxes_;
  std::optional<TextureBox> textures_;
  std::optional<TextureOverview> texture_overview_;  ///< where there are planes
  Hud hud_;
  struct {
    std::vector<ColourStop> stops;
    double low, high;
  } legend_{};
  std::optional<DaySky> sky_;
  std::optional<SolarTime> time_;
  std::pair<double, double> sun_before_;  ///< the day: azimuth and elevation, degrees
  std::optional<double> far_distance_;
  FrameFigures figures_;
  double reach_wanted_ = 0.0;  ///< the far distance, or to the farthest corner where that is nearer
  bool cut_ = false;           ///< memory shortens the far distance
};

}  // namespace isohf::view
