#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "paging/plane_choice.h"
#include "paging/tile_box.h"

namespace isohf::view {

/// A box of resident tiles for each plane of a source: the coarsest holds all of its tiles, each finer one those around
/// the eye that a picture may want. Without planes it is one box with all that is in reach. Lives on the GL thread.
class PlaneBoxes {
 public:
  /// Throws Error{kInvalidArgument} where limits.memory_bytes are too few.
  PlaneBoxes(const TileSource& source, const SharedGeometry& shared, const TileBoxLimits& limits, Workers& workers);

  void set_sun(const std::optional<CastingSun>& sun);
  /// Once a frame. reach  distance from the eye in which anything is wanted
  void update(const ViewState& view, double reach);
  /// Updates until all is resident that is wanted: for pictures, not for frames.
  void finish(const ViewState& view, double reach, const std::function<void()>& poll);

  [[nodiscard]] const TileSlot* resident(PlaneTile at) const {
    return boxes_[static_cast<std::size_t>(at.plane)]->resident(at.tile);
  }
  /// The tiles of the coarsest plane that are held, and those of the finest.
  [[nodiscard]] const TileRange& top() const { return boxes_.back()->range(); }
  [[nodiscard]] const TileRange& finest() const { return boxes_.front()->range(); }
  /// Of all boxes together; `radius` is the coarsest one's.
  [[nodiscard]] const TileBoxFigures& figures() const { return figures_; }
  [[nodiscard]] const std::optional<std::string>& error() const { return error_; }

 private:
  /// How far around the eye tiles of a plane are wanted; nullopt: none are.
  [[nodiscard]] std::optional<double> radius(int plane, const ViewState& view, double reach) const;
  void count();

  const TileSource& source_;
  Planes planes_;
  TileBounds whole_;
  std::vector<std::unique_ptr<TileBox>> boxes_;  ///< by plane
  TileBoxFigures figures_;
  std::optional<std::string> error_;
};

}  // namespace isohf::view
