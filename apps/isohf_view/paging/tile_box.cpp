#include "paging/tile_box.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <iterator>
#include <utility>

#include "isohf/error.h"

namespace isohf::view {
namespace {

/// Bytes of a vertex on the CPU: while its tile is decoded and waits (codes twice over, the inflated payload and room
/// for zlib), or while light is swept over it (its height and what is hidden).
constexpr std::uint64_t kAtWork = 8;

std::uint64_t vertices_of(const TileSource& source) {
  return static_cast<std::uint64_t>(source.grid().shape().stored_vertex_count());
}

}  // namespace

TileBox::Loaded TileBox::load(const TileSource& source, TileIndex tile) {
  Loaded loaded{tile, std::vector<std::uint16_t>(vertices_of(source)), {}};
  try {
    source.read(tile, loaded.codes);
  } catch (const std::exception& error) {
    loaded.error = error.what();
    loaded.codes.clear();
  }
  return loaded;
}

TileBox::Sweep TileBox::cast(Sweep sweep) const {
  try {
    sweep.shadows = cast_shadows(source_, sweep.sun, sweep.tiles, sweep.limits, leaves_, sweep.error);
  } catch (const std::exception& error) {
    sweep.error = error.what();
  }
  return sweep;
}

TileBox::TileBox(const TileSource& source, const SharedGeometry& shared, const TileBoxLimits& limits, Workers& workers)
    : source_(source),
      shared_(shared),
      limits_(limits),
      slot_bytes_(TileSlot::bytes(shared.shape(), true)),
      depth_bytes_(vertices_of(source) * sizeof(std::int16_t)),
      at_work_bytes_(vertices_of(source) * kAtWork),
      loader_([&source](TileIndex tile) { return load(source, tile); }, workers),
      caster_([this](const Sweep& sweep) { return cast(sweep); }, workers) {
  // A quarter of the memory at most is for tiles on their way.
  const std::uint64_t per_frame = limits.upload_bytes_per_frame / slot_bytes_ + 1;
  in_flight_limit_ = static_cast<std::size_t>(std::clamp<std::uint64_t>(
      per_frame + 2 * workers.count(), 1, std::max<std::uint64_t>(1, limits.memory_bytes / 4 / at_work_bytes_)));
  if (!fits({2, 2})) {
    throw Error(
        ErrorCode::kInvalidArgument,
        fmt::format("--memory: {} MiB of it are left for tiles; four of them with their shadows, and those on their "
                    "way, take more: --memory {}M holds them",
                    limits.memory_bytes >> 20U, limits.enough_mib));
  }
}

bool TileBox::fits(TileIndex across) const {
  const auto slots = static_cast<std::uint64_t>(across.column * across.row);
  const std::uint64_t at_work = static_cast<std::uint64_t>(swept_columns(across.column)) + in_flight_limit_;
  return slots * (slot_bytes_ + depth_bytes_) + at_work * at_work_bytes_ <= limits_.memory_bytes;
}

std::uint64_t TileBox::most_bytes_of_a_tile(const TileSource& source) {
  // Each may be a column that is swept. A quarter of the memory is for tiles on their way.
  return (TileSlot::bytes(source.grid().shape(), true) + vertices_of(source) * (sizeof(std::int16_t) + 3 * kAtWork)) *
         4 / 3;
}

void TileBox::set_sun(const std::optional<CastingSun>& sun) {
  if (sun == sun_) return;
  sun_ = sun;
  if (sun_) ++sun_number_;
}

TileIndex TileBox::tiles_across(double radius) const {
  const TileGrid& grid = source_.grid();
  const auto count_for = [radius](double extent, std::int64_t all) {
    const double needed = std::floor(2.0 * radius / extent) + 2.0;
    return needed >= static_cast<double>(all) ? all : static_cast<std::int64_t>(needed);
  };
  return {count_for(grid.extent_x(), grid.tile_columns()), count_for(grid.extent_z(), grid.tile_rows())};
}

/// A box that memory does not hold shrinks to one that it does; figures say so.
void TileBox::move(WorldPoint centre, double radius) {
  const TileGrid& grid = source_.grid();
  while (!fits(tiles_across(radius)) && radius >= 1e-6 * grid.extent_x()) radius *= 0.98;
  figures_.radius = radius;
  const TileIndex across = tiles_across(figures_.radius);
  const auto first = [&](double place, double extent, std::int64_t count, std::int64_t all) {
    return static_cast<std::int64_t>(
        std::clamp(std::floor((place - figures_.radius) / extent), 0.0, static_cast<double>(all - count)));
  };
  range_.first = {first(centre.x, grid.extent_x(), across.column, grid.tile_columns()),
                  first(centre.z, grid.extent_z(), across.row, grid.tile_rows())};
  range_.end = {range_.first.column + across.column, range_.first.row + across.row};
  for (auto at = cells_.begin(); at != cells_.end();) {
    Cell& cell = at->second;
    const bool stays = range_.contains(cell.tile);
    if (!stays && cell.slot) spare_.push_back(std::move(cell.slot));
    at = stays ? std::next(at) : cells_.erase(at);
  }
  for_each_tile(range_, [&](TileIndex tile) {
    if (cells_.contains(grid.flat_index(tile))) return;
    const State state = source_.bounds(tile).stored ? State::kMissing : State::kVoid;
    cells_.emplace(grid.flat_index(tile), Cell{tile, state, nullptr, 0});
  });
  // A smaller box gives buffers back.
  std::size_t free = cells_.size();
  for (const auto& [flat, cell] : cells_) free -= cell.slot ? 1 : 0;
  if (spare_.size() > free) spare_.resize(free);
}

TileBox::Cell* TileBox::find(TileIndex tile) {
  const auto found = range_.contains(tile) ? cells_.find(source_.grid().flat_index(tile)) : cells_.end();
  return found != cells_.end() ? &found->second : nullptr;
}

void TileBox::update(WorldPoint centre, double radius, bool shades) {
  figures_.upload_bytes = 0;
  move(centre, radius);
  upload();
  request(centre);
  count();
  if (shades || figures_.missing_tiles == 0) request_shadows();
}

void TileBox::rest() {
  figures_.upload_bytes = 0;
  upload();
  count();
  figures_.missing_tiles = 0;
  figures_.shadows_to_come = 0;
}

void TileBox::upload() {
  loader_.collect(waiting_);
  for (; !waiting_.empty(); waiting_.pop_front()) {
    if (!has_room(waiting_.front().codes.size() * sizeof(std::uint16_t))) return;
    place(waiting_.front());
  }
  caster_.collect(swept_);
  for (; !swept_.empty(); swept_.pop_front()) {
    Sweep& sweep = swept_.front();
    if (!error_ && !sweep.error.empty()) error_ = sweep.error;
    for (; !sweep.shadows.empty(); sweep.shadows.pop_back()) {
      if (!has_room(depth_bytes_)) return;
      place(sweep.shadows.back(), sweep.sun_number);
    }
  }
  if (caster_.in_flight() == 0) sweep_bytes_ = 0;
}

void TileBox::place(const TileShadow& shadow, std::uint64_t sun_number) {
  Cell* const cell = find(shadow.tile);
  if (cell == nullptr || cell->state != State::kResident) return;  // the box has moved on
  cell->slot->upload_shadow(shadow.depths, shadow.gain);
  cell->sun_number = sun_number;
  figures_.upload_bytes += depth_bytes_;
}

void TileBox::place(Loaded& loaded) {
  Cell* const cell = find(loaded.tile);
  if (cell == nullptr) return;  // the box has moved on
  if (!error_ && !loaded.error.empty()) error_ = loaded.error;
  if (cell->state != State::kRequested && cell->state != State::kMissing) return;
  if (loaded.codes.empty()) {
    cell->state = State::kBroken;
    return;
  }
  if (spare_.empty()) {
    cell->slot = std::make_unique<TileSlot>(shared_);
  } else {
    cell->slot = std::move(spare_.back());
    spare_.pop_back();
  }
  cell->slot->upload(loaded.codes);
  cell->sun_number = 0;
  cell->state = State::kResident;
  figures_.upload_bytes += loaded.codes.size() * sizeof(std::uint16_t);
}

void TileBox::request(WorldPoint centre) {
  const std::size_t busy = loader_.in_flight() + waiting_.size();
  if (busy >= in_flight_limit_) return;
  const TileGrid& grid = source_.grid();
  std::vector<std::pair<double, Cell*>> missing;  // by the square of their distance
  for (auto& [flat, cell] : cells_) {
    if (cell.state != State::kMissing) continue;
    const double x = (static_cast<double>(cell.tile.column) + 0.5) * grid.extent_x() - centre.x;
    const double z = (static_cast<double>(cell.tile.row) + 0.5) * grid.extent_z() - centre.z;
    missing.emplace_back(x * x + z * z, &cell);
  }
  const std::size_t wanted = std::min(missing.size(), in_flight_limit_ - busy);
  std::partial_sort(missing.begin(), missing.begin() + static_cast<std::ptrdiff_t>(wanted), missing.end(),
                    [](const auto& a, const auto& b) { return a.first < b.first; });
  for (std::size_t i = 0; i < wanted; ++i) {
    missing[i].second->state = State::kRequested;
    loader_.request(missing[i].second->tile);
  }
}

void TileBox::request_shadows() {
  if (!sun_ || caster_.in_flight() > 0 || !swept_.empty()) return;
  Sweep sweep{{}, *sun_, sun_number_, {}, {}, {}};
  for (const auto& [flat, cell] : cells_) {
    if (is_outdated(cell)) sweep.tiles.push_back(cell.tile);
  }
  if (sweep.tiles.empty()) return;
  sweep.limits.tiles += range_.count();
  sweep.limits.columns = swept_columns(range_.end.column - range_.first.column);
  sweep_bytes_ = sweep.tiles.size() * depth_bytes_ + static_cast<std::uint64_t>(sweep.limits.columns) * at_work_bytes_;
  caster_.request(sweep);
}

void TileBox::count() {
  figures_.resident_tiles = 0;
  figures_.missing_tiles = 0;
  figures_.shadows_to_come = 0;
  std::uint64_t slots = spare_.size();
  for (const auto& [flat, cell] : cells_) {
    if (cell.slot) ++slots;
    if (cell.state == State::kResident) ++figures_.resident_tiles;
    if (is_outdated(cell)) ++figures_.shadows_to_come;
    if (cell.state == State::kMissing || cell.state == State::kRequested) ++figures_.missing_tiles;
  }
  figures_.resident_bytes =
      slot_bytes_ * slots + at_work_bytes_ * (loader_.in_flight() + waiting_.size()) + sweep_bytes_;
}

void TileBox::finish(WorldPoint centre, double radius, const std::function<void()>& poll) {
  const auto is_complete = [&] {
    update(centre, radius, false);
    return figures_.missing_tiles == 0 && figures_.shadows_to_come == 0;
  };
  update_until_complete(is_complete, poll);
}

const TileSlot* TileBox::resident(TileIndex tile) const {
  const auto found = range_.contains(tile) ? cells_.find(source_.grid().flat_index(tile)) : cells_.end();
  return found != cells_.end() && found->second.state == State::kResident ? found->second.slot.get() : nullptr;
}

}  // namespace isohf::view
