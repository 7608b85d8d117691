#pragma once

#include <functional>
#include <vector>

#include "isohf/projection/projection.h"
#include "isohf/projection/reference_map.h"

namespace isohf {

/// Bounds, metres, of a ground's image, found by walking along its four sides in many short steps. The curve between
/// two of these places is allowed for: the bounds hold it, and exceed the image by less than 1e-5 of its size. NaN
/// where a place on the way has no image, or the map is cut open between two.
[[nodiscard]] MapBounds projected_bounds(const Projection& projection, const GeoExtent& ground);

/// The same of the image of a rectangle of another map.
[[nodiscard]] MapBounds projected_bounds(const Projection& projection, const ReferenceMap& map,
                                         const MapBounds& rectangle);

/// The same of what `image` makes of a rectangle, in so many steps a side.
[[nodiscard]] MapBounds image_bounds(const MapBounds& rectangle, const std::function<MapPoint(const MapPoint&)>& image,
                                     int steps_per_side);

/// Whether an image's bounds hold what lies within its rectangle: those of the border do not where that is a globe's cut
/// and its poles, which may all fall on one line.
[[nodiscard]] bool surrounds(const MapBounds& bounds, const MapBounds& rectangle,
                             const std::function<MapPoint(const MapPoint&)>& image);

/// Of a globe's image, whatever meridian the ground begins at and the map is cut open at. NaN where a part has none.
[[nodiscard]] MapBounds globe_bounds(const Projection& projection, const GeoExtent& ground);

/// What a map shows of a rectangle.
struct ShownImage {
  MapBounds bounds;      ///< NaN: nothing
  double stretch = 1.0;  ///< the image's area for the rectangle's, where it is shown in one piece
};

/// The same where the map ends on the rectangle, or is cut open there. Looks at 129 x 129 places, and between two on
/// either side of such an end for the end.
/// more  places besides, such as poles
[[nodiscard]] ShownImage shown_image(const MapBounds& rectangle, const std::function<MapPoint(const MapPoint&)>& image,
                                     const std::vector<MapPoint>& more);

/// The worst scale on a ground, and where.
struct ScaleError {
  double worst = 0.0;  ///< deviation from 1: 0.01 for 1 %; infinite where a length has no bound
  GeoPoint place;
};

/// Looks at 33 x 33 places, the sides included: on these kinds of map the worst lies on a side, in a corner or on the
/// central meridian or parallel.
[[nodiscard]] ScaleError worst_scale_error(const Projection& projection, const GeoExtent& ground);

}  // namespace isohf
