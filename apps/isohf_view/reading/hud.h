#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gl/overlay.h"
#include "isohf/shade.h"
#include "view_state.h"

namespace isohf::view {

/// Heights along a straight way over the ground.
struct Profile {
  std::vector<double> heights;  ///< evenly spaced, elevation units; NaN where there is no ground
  double length = 0.0;          ///< between its ends: metres along the body, or world units
};

/// What a person reads over a picture.
struct Reading {
  std::vector<std::string> figures;  ///< top left
  std::vector<std::string> help;     ///< in their place
  std::vector<ColourStop> colours;   ///< of the legend, by elevation; none: no legend
  double low = 0.0;                  ///< the legend's range
  double high = 0.0;
  std::string height_unit;            ///< "metre"; empty where it is not known
  std::string ground_unit;            ///< of world units
  double world_per_px = 0.0;          ///< at the middle of the picture; 0: no scale bar
  std::optional<double> heading_rad;  ///< nullopt: no North arrow
  std::optional<double> hours;        ///< of the day, on the slider
  std::optional<Profile> profile;
  std::vector<std::optional<PicturePoint>> way;  ///< what is measured, in the picture; nullopt behind the eye
};

/// The colour at an elevation, sRGB; linear between stops.
[[nodiscard]] OverlayColour colour_at(const std::vector<ColourStop>& stops, double elevation);

/// The largest of 1, 2, 5, 10, ... that is not above `most`, > 0.
[[nodiscard]] double round_length(double most);

/// "m" for "metre"; others as they are.
[[nodiscard]] std::string short_unit(const std::string& unit);

/// A length as people write it: "500 m", "20 km", "3 world units".
[[nodiscard]] std::string describe_length(double length, const std::string& unit);

/// Scale bar, North arrow, legend, slider, profile and figures.
class Hud {
 public:
  /// scale  of the screen: 2 where points are twice as fine
  void draw(const Reading& reading, int width, int height, double scale);
  /// Hours of the day at a place on the slider; nullopt beside it.
  [[nodiscard]] static std::optional<double> slider_hours(double x, double y, int width, int height, double scale);

 private:
  void draw_legend(const Reading& reading, float width, float height);
  void draw_scale(const Reading& reading, float height);
  void draw_north(double heading_rad, float width, float height);
  void draw_slider(double hours, int width, int height, double scale);
  void draw_way(const std::vector<std::optional<PicturePoint>>& way);
  void draw_profile(const Profile& profile, const Reading& reading, float width, float height);

  Overlay overlay_;
};

}  // namespace isohf::view
