#include "paging/tile_box.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <thread>

#include "isohf/error.h"

namespace isohf::view {
namespace {

/// What a tile takes on the CPU while it is decoded and waits, in arrays of its codes: the codes twice over, the
/// inflated payload, and room for what zlib needs.
constexpr std::uint64_t kCpuCopies = 4;
/// What light that is swept over a tile takes: heights and depths, floats.
constexpr std::uint64_t kSweptBytes = 8;

std::uint64_t vertices_of(const TileSource& source) {
  return static_cast<std::uint64_t>(source.grid().shape().stored_vertex_count());
}

LoadedTile load_tile(const TileSource& source, TileIndex tile) {
  LoadedTile loaded{tile, std::vector<std::uint16_t>(vertices_of(source)), {}};
  try {
    source.read(tile, loaded.codes);
  } catch (const std::exception& error) {
    loaded.error = error.what();
    loaded.codes.clear();
  }
  return loaded;
}

CastShadows cast(const TileSource& source, const ShadowRequest& request, const std::atomic<bool>& leaves) {
  CastShadows cast{{}, request.sun_number, {}};
  try {
    cast.shadows = cast_shadows(source, request.sun, request.tiles, request.limits, leaves, cast.error);
  } catch (const std::exception& error) {
    cast.error = error.what();
  }
  return cast;
}

}  // namespace

TileBox::TileBox(const TileSource& source, const SharedGeometry& shared, const TileBoxLimits& limits)
    : source_(source),
      shared_(shared),
      limits_(limits),
      slot_bytes_(TileSlot::bytes(shared.shape(), true)),
      on_the_way_bytes_(TileSlot::bytes(shared.shape()) * kCpuCopies),
      depth_bytes_(vertices_of(source) * sizeof(std::int16_t)),
      loader_([&source](TileIndex tile) { return load_tile(source, tile); }, limits.workers),
      caster_([this](const ShadowRequest& request) { return cast(source_, request, leaves_); }, 1) {
  const std::uint64_t per_frame = limits.upload_bytes_per_frame / slot_bytes_ + 1;
  // A quarter of the memory at most is for tiles on their way.
  in_flight_limit_ = static_cast<std::size_t>(
      std::max<std::uint64_t>(1, std::min<std::uint64_t>(per_frame + 2 * static_cast<std::uint64_t>(limits.workers),
                                                         limits.memory_bytes / 4 / on_the_way_bytes_)));
  const std::uint64_t on_the_way = in_flight_limit_ * on_the_way_bytes_;
  bytes_for_slots_ = limits.memory_bytes - std::min(limits.memory_bytes, on_the_way);
  if (!fits(2, 2)) {
    throw Error(
        ErrorCode::kInvalidArgument,
        fmt::format("--memory: {} MiB of it are left for tiles; four of them with their shadows, and those on their "
                    "way, take more: --memory {}M holds them",
                    limits.memory_bytes >> 20U, limits.enough_mib));
  }
}

std::uint64_t TileBox::bytes_of(std::int64_t columns, std::int64_t rows) const {
  const auto slots = static_cast<std::uint64_t>(columns * rows);
  const auto swept = static_cast<std::uint64_t>(swept_columns(columns));
  return slots * (slot_bytes_ + depth_bytes_) + swept * vertices_of(source_) * kSweptBytes;
}

void TileBox::set_sun(const std::optional<CastingSun>& sun) {
  if (sun == sun_) return;
  sun_ = sun;
  if (sun_) ++sun_number_;
}

std::size_t TileBox::cell_of(TileIndex tile) const {
  return static_cast<std::size_t>(tile.column % box_columns_ + tile.row % box_rows_ * box_columns_);
}

std::pair<std::int64_t, std::int64_t> TileBox::tiles_across(double radius) const {
  const TileGrid& grid = source_.grid();
  const auto count_for = [radius](double extent, std::int64_t all) {
    const double needed = std::floor(2.0 * radius / extent) + 2.0;
    return needed >= static_cast<double>(all) ? all : static_cast<std::int64_t>(needed);
  };
  return {count_for(grid.extent_x(), grid.tile_columns()), count_for(grid.extent_z(), grid.tile_rows())};
}

double TileBox::fitting_radius(double radius) const {
  const double least = 1e-6 * source_.grid().extent_x();
  for (;; radius *= 0.98) {
    const auto [columns, rows] = tiles_across(radius);
    if (fits(columns, rows) || radius < least) return radius;
  }
}

void TileBox::resize(WorldPoint centre, double radius) {
  const TileGrid& grid = source_.grid();
  // A box that memory does not hold shrinks to one that it does; figures say so.
  const double kept = fitting_radius(radius);
  const auto [columns, rows] = tiles_across(kept);
  figures_.radius = kept;
  if (columns != box_columns_ || rows != box_rows_) {
    // Rehouse what is resident and still fits.
    std::vector<Cell> old = std::move(cells_);
    box_columns_ = columns;
    box_rows_ = rows;
    cells_ = std::vector<Cell>(static_cast<std::size_t>(columns * rows));
    for (Cell& cell : old) {
      if (cell.state == State::kUnused) continue;
      Cell& home = cells_[cell_of(cell.tile)];
      if (home.state == State::kUnused) {
        home = std::move(cell);
      } else if (cell.slot) {
        spare_.push_back(std::move(cell.slot));
      }
    }
  }
  const auto first = [](double place, double r, double extent, std::int64_t count, std::int64_t all) {
    return static_cast<std::int64_t>(
        std::clamp(std::floor((place - r) / extent), 0.0, static_cast<double>(all - count)));
  };
  range_.first_column = first(centre.x, kept, grid.extent_x(), columns, grid.tile_columns());
  range_.first_row = first(centre.z, kept, grid.extent_z(), rows, grid.tile_rows());
  range_.last_column = range_.first_column + columns - 1;
  range_.last_row = range_.first_row + rows - 1;
}

void TileBox::enter(Cell& cell, TileIndex tile) {
  if (cell.slot) spare_.push_back(std::move(cell.slot));
  cell.tile = tile;
  cell.state = source_.bounds(tile).stored ? State::kMissing : State::kVoid;
}

void TileBox::update(WorldPoint centre, double radius, bool shades) {
  figures_.upload_bytes = 0;
  resize(centre, radius);
  for (std::int64_t row = range_.first_row; row <= range_.last_row; ++row) {
    for (std::int64_t column = range_.first_column; column <= range_.last_column; ++column) {
      Cell& cell = cells_[cell_of({column, row})];
      if (!(cell.tile == TileIndex{column, row})) enter(cell, {column, row});
    }
  }
  loader_.collect(waiting_);
  upload();
  request(centre);
  count();
  if (shades || figures_.missing_tiles == 0) request_shadows();
}

std::uint64_t TileBox::most_bytes_of_a_tile(const TileSource& source) {
  const TileShape& shape = source.grid().shape();
  // A quarter of the memory is for tiles on their way. Each may be a column that is swept.
  return (TileSlot::bytes(shape, true) + TileSlot::bytes(shape) * kCpuCopies +
          vertices_of(source) * (sizeof(std::int16_t) + 2 * kSweptBytes)) *
         4 / 3;
}

void TileBox::rest() {
  figures_.upload_bytes = 0;
  loader_.collect(waiting_);
  upload();
  count();
  figures_.missing_tiles = 0;
  figures_.shadows_to_come = 0;
}

void TileBox::upload() {
  for (; !waiting_.empty(); waiting_.pop_front()) {
    const std::uint64_t next = waiting_.front().codes.size() * sizeof(std::uint16_t);
    if (figures_.upload_bytes > 0 && figures_.upload_bytes + next > limits_.upload_bytes_per_frame) return;
    place(waiting_.front());
  }
  upload_shadows();
}

void TileBox::upload_shadows() {
  caster_.collect(cast_);
  for (; !cast_.empty(); cast_.pop_front()) {
    CastShadows& cast = cast_.front();
    if (!error_ && !cast.error.empty()) error_ = cast.error;
    for (; !cast.shadows.empty(); cast.shadows.pop_back()) {
      if (figures_.upload_bytes > 0 && figures_.upload_bytes + depth_bytes_ > limits_.upload_bytes_per_frame) return;
      const TileShadow& shadow = cast.shadows.back();
      if (!range_.contains(shadow.tile)) continue;  // the box has moved on
      Cell& cell = cells_[cell_of(shadow.tile)];
      if (!(cell.tile == shadow.tile) || cell.state != State::kResident) continue;
      cell.slot->upload_shadow(shadow.depths, shadow.gain);
      cell.sun_number = cast.sun_number;
      figures_.upload_bytes += depth_bytes_;
    }
  }
  if (caster_.in_flight() == 0) sweep_bytes_ = 0;
}

void TileBox::place(LoadedTile& loaded) {
  if (!range_.contains(loaded.tile)) return;  // the box has moved on
  Cell& cell = cells_[cell_of(loaded.tile)];
  if (!(cell.tile == loaded.tile)) return;
  if (!error_ && !loaded.error.empty()) error_ = loaded.error;
  if (cell.state != State::kRequested && cell.state != State::kMissing) return;
  if (loaded.codes.empty()) {
    cell.state = State::kBroken;
    return;
  }
  if (spare_.empty()) {
    cell.slot = std::make_unique<TileSlot>(shared_);
  } else {
    cell.slot = std::move(spare_.back());
    spare_.pop_back();
  }
  cell.slot->upload(loaded.codes);
  cell.sun_number = 0;
  cell.state = State::kResident;
  figures_.upload_bytes += loaded.codes.size() * sizeof(std::uint16_t);
}

double TileBox::distance_squared(const Cell& cell, WorldPoint centre) const {
  const TileGrid& grid = source_.grid();
  const double x = (static_cast<double>(cell.tile.column) + 0.5) * grid.extent_x() - centre.x;
  const double z = (static_cast<double>(cell.tile.row) + 0.5) * grid.extent_z() - centre.z;
  return x * x + z * z;
}

void TileBox::request(WorldPoint centre) {
  const std::size_t busy = loader_.in_flight() + waiting_.size();
  if (busy >= in_flight_limit_) return;
  std::vector<std::pair<double, Cell*>> missing;
  for (Cell& cell : cells_) {
    if (cell.state != State::kMissing) continue;
    missing.emplace_back(distance_squared(cell, centre), &cell);
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
  if (!sun_ || caster_.in_flight() > 0 || !cast_.empty()) return;
  ShadowRequest request{{}, *sun_, sun_number_, {}};
  for (const Cell& cell : cells_) {
    if (is_outdated(cell)) request.tiles.push_back(cell.tile);
  }
  if (request.tiles.empty()) return;
  request.limits.tiles += static_cast<std::int64_t>(cells_.size());
  request.limits.columns = swept_columns(box_columns_);
  sweep_bytes_ = request.tiles.size() * depth_bytes_ +
                 static_cast<std::uint64_t>(request.limits.columns) * vertices_of(source_) * kSweptBytes;
  caster_.request(request);
}

void TileBox::count() {
  figures_.resident_tiles = 0;
  figures_.missing_tiles = 0;
  figures_.shadows_to_come = 0;
  std::uint64_t slots = spare_.size();
  for (const Cell& cell : cells_) {
    if (cell.slot) ++slots;
    if (cell.state == State::kResident) ++figures_.resident_tiles;
    if (is_outdated(cell)) ++figures_.shadows_to_come;
    if (cell.state == State::kMissing || cell.state == State::kRequested) ++figures_.missing_tiles;
  }
  figures_.resident_bytes =
      slot_bytes_ * slots + on_the_way_bytes_ * (loader_.in_flight() + waiting_.size()) + sweep_bytes_;
}

void TileBox::finish(WorldPoint centre, double radius, const std::function<void()>& poll) {
  for (;;) {
    update(centre, radius, false);
    if (figures_.missing_tiles == 0 && figures_.shadows_to_come == 0) return;
    poll();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

const TileSlot* TileBox::resident(TileIndex tile) const {
  if (!range_.contains(tile)) return nullptr;
  const Cell& cell = cells_[cell_of(tile)];
  return cell.tile == tile && cell.state == State::kResident ? cell.slot.get() : nullptr;
}

}  // namespace isohf::view
