#include "paging/plane_boxes.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "camera.h"
#include "isohf/lattice/lod.h"

namespace isohf::view {

PlaneBoxes::PlaneBoxes(const TileSource& source, const SharedGeometry& shared, const TileBoxLimits& limits,
                       Workers& workers)
    : source_(source), planes_(planes_of(source)), whole_(whole_bounds(source)) {
  boxes_.resize(static_cast<std::size_t>(planes_.count()) + 1);
  const std::uint64_t share = limits.memory_bytes / boxes_.size();
  TileBoxLimits own = limits;
  own.upload_bytes_per_frame = limits.upload_bytes_per_frame / boxes_.size();
  std::uint64_t left = limits.memory_bytes;
  for (int plane = planes_.count(); plane >= 0; --plane) {
    // What a small plane doesn't take is the finest one's.
    const auto tiles = static_cast<std::uint64_t>(planes_.grid(plane).tile_count());
    const std::uint64_t all = (std::min<std::uint64_t>(tiles, share) + 16) * TileBox::most_bytes_of_a_tile(source);
    own.memory_bytes = plane == 0 ? left : std::min(share, all);
    left -= own.memory_bytes;
    boxes_[static_cast<std::size_t>(plane)] = std::make_unique<TileBox>(source.plane(plane), shared, own, workers);
  }
}

std::optional<double> PlaneBoxes::radius(int plane, const ViewState& view, double reach) const {
  if (plane == planes_.count()) return reach;
  const int step = std::countr_zero(static_cast<unsigned>(planes_.scale(1)));
  const double level = step * (plane + 1.0);
  double distance = 0.0;  // nearer than that a tile of the next plane gives way
  if (view.fixed_level) {
    distance = *view.fixed_level < level ? reach : 0.0;
  } else {
    distance = view.focal_px() * std::exp2(level) * std::sqrt(triangle_area(source_.grid(), 1.0) / view.triangle_px);
  }
  const double above = std::max(0.0, view.eye.y - whole_.high * view.exaggeration);
  if (!(distance > above)) return std::nullopt;
  const auto across = [this](int of) { return std::hypot(planes_.grid(of).extent_x(), planes_.grid(of).extent_z()); };
  // A tile gives way where all below it are resident and none beside it is coarser, so that what gives way within reach
  // asks for tiles beyond it, of coarser planes the more.
  double limit = reach;
  for (int finer = 1; finer <= plane; ++finer) limit += across(finer);
  const double around = std::min(limit, std::sqrt(distance * distance - above * above));
  const double whole = farthest_corner(planes_.grid(0), whole_, view.eye, view.exaggeration);
  return std::min(whole, around + across(plane + 1));
}

void PlaneBoxes::set_sun(const std::optional<CastingSun>& sun) {
  for (const auto& box : boxes_) box->set_sun(sun);
}

void PlaneBoxes::update(const ViewState& view, double reach) {
  for (int plane = planes_.count(); plane >= 0; --plane) {
    if (const auto wanted = radius(plane, view, reach)) {
      boxes_[static_cast<std::size_t>(plane)]->update({view.eye.x, view.eye.z}, *wanted);
    } else {
      boxes_[static_cast<std::size_t>(plane)]->rest();
    }
  }
  count();
}

void PlaneBoxes::finish(const ViewState& view, double reach, const std::function<void()>& poll) {
  for (int plane = planes_.count(); plane >= 0; --plane) {
    if (const auto wanted = radius(plane, view, reach)) {
      boxes_[static_cast<std::size_t>(plane)]->finish({view.eye.x, view.eye.z}, *wanted, poll);
    }
  }
  count();
}

void PlaneBoxes::count() {
  figures_ = {};
  for (const auto& box : boxes_) {
    const TileBoxFigures& one = box->figures();
    figures_.upload_bytes += one.upload_bytes;
    figures_.resident_tiles += one.resident_tiles;
    figures_.missing_tiles += one.missing_tiles;
    figures_.resident_bytes += one.resident_bytes;
    figures_.shadows_to_come += one.shadows_to_come;
    figures_.radius = one.radius;
    if (!error_) error_ = box->error();
  }
}

}  // namespace isohf::view
