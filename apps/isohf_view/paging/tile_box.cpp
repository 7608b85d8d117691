#include "paging/tile_box.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <thread>
#include <tuple>

#include "isohf/error.h"

namespace isohf::view {
namespace {

/// What a tile takes on the CPU while it is decoded and waits, in arrays of its codes: the codes twice over, the
/// inflated payload, and room for what zlib and the seeds need. Shadows take two arrays of floats, and one of codes.
constexpr std::uint64_t kCpuCopies = 4;
constexpr std::uint64_t kCpuCopiesLit = 9;

LoadedTile load_tile(const TileSource& source, const TileRequest& request) {
  LoadedTile loaded;
  loaded.request = request;
  const auto vertices = static_cast<std::size_t>(source.grid().shape().stored_vertex_count());
  const auto attempt = [&](auto&& read) {
    try {
      loaded.codes.resize(vertices);
      read();
      return true;
    } catch (const std::exception& error) {
      if (loaded.error.empty()) loaded.error = error.what();
      loaded.codes.clear();
      loaded.shadow.clear();
      return false;
    }
  };
  const bool lit = request.sun && attempt([&] {
                     loaded.shadow.resize(vertices);
                     source.read_lit(request.tile, *request.sun, loaded.codes, loaded.shadow);
                   });
  // Broken seeds take nothing but the shadow away.
  if (!lit && request.codes) attempt([&] { source.read(request.tile, loaded.codes); });
  if (!request.codes) loaded.codes = {};
  return loaded;
}

}  // namespace

TileBox::TileBox(const TileSource& source, const SharedGeometry& shared, const TileBoxLimits& limits)
    : source_(source),
      shared_(shared),
      limits_(limits),
      slot_bytes_(TileSlot::bytes(shared.shape(), source.shadow_seeds() != nullptr)),
      on_the_way_bytes_(TileSlot::bytes(shared.shape()) *
                        (source.shadow_seeds() == nullptr ? kCpuCopies : kCpuCopiesLit)),
      loader_([&source](const TileRequest& request) { return load_tile(source, request); }, limits.workers) {
  const std::uint64_t per_frame = limits.upload_bytes_per_frame / slot_bytes_ + 1;
  // A quarter of the memory at most is for tiles on their way.
  in_flight_limit_ = static_cast<std::size_t>(
      std::max<std::uint64_t>(1, std::min<std::uint64_t>(per_frame + 2 * static_cast<std::uint64_t>(limits.workers),
                                                         limits.memory_bytes / 4 / on_the_way_bytes_)));
  const std::uint64_t on_the_way = in_flight_limit_ * on_the_way_bytes_;
  if (limits.memory_bytes < on_the_way + 4 * slot_bytes_) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("memory for tiles: {} bytes hold fewer than four tiles of {} bytes and those on their way; "
                            "{} are required",
                            limits.memory_bytes, slot_bytes_, on_the_way + 4 * slot_bytes_));
  }
  max_slots_ = static_cast<std::int64_t>((limits.memory_bytes - on_the_way) / slot_bytes_);
}

void TileBox::set_sun(const std::optional<RowSun>& sun) {
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
    if (columns * rows <= max_slots_ || radius < least) return radius;
  }
}

void TileBox::resize(WorldPoint centre, double radius) {
  const TileGrid& grid = source_.grid();
  // A box that memory does not hold shrinks to one that it does; figures say so.
  const double kept = fitting_radius(radius);
  auto [columns, rows] = tiles_across(kept);
  columns = std::min(columns, max_slots_);
  rows = std::min(rows, std::max<std::int64_t>(1, max_slots_ / columns));
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
  cell.shadow_requested = false;
  cell.shadow_broken = false;
}

void TileBox::update(WorldPoint centre, double radius) {
  const auto begin = std::chrono::steady_clock::now();
  figures_.uploads = 0;
  figures_.upload_bytes = 0;
  figures_.shadow_uploads = 0;
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
  figures_.update_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
}

std::uint64_t TileBox::most_bytes_of_a_tile(const TileSource& source) {
  const bool lit = source.shadow_seeds() != nullptr;
  const TileShape& shape = source.grid().shape();
  // A quarter of the memory is for tiles on their way.
  return (TileSlot::bytes(shape, lit) + TileSlot::bytes(shape) * (lit ? kCpuCopiesLit : kCpuCopies)) * 4 / 3;
}

void TileBox::rest() {
  figures_.uploads = 0;
  figures_.upload_bytes = 0;
  figures_.shadow_uploads = 0;
  figures_.update_ms = 0.0;
  loader_.collect(waiting_);
  upload();
  count();
  figures_.missing_tiles = 0;
  figures_.shadows_to_come = 0;
}

void TileBox::upload() {
  for (; !waiting_.empty(); waiting_.pop_front()) {
    const std::uint64_t next = waiting_.front().bytes();
    if (figures_.upload_bytes > 0 && figures_.upload_bytes + next > limits_.upload_bytes_per_frame) return;
    place(waiting_.front());
  }
}

void TileBox::place(LoadedTile& loaded) {
  if (!range_.contains(loaded.request.tile)) return;  // the box has moved on
  Cell& cell = cells_[cell_of(loaded.request.tile)];
  if (!(cell.tile == loaded.request.tile)) return;
  if (!error_ && !loaded.error.empty()) error_ = loaded.error;
  if (!loaded.request.codes) {
    if (cell.state == State::kResident) place_shadow(cell, loaded);
    if (cell.state == State::kResident && !loaded.shadow.empty()) ++figures_.shadow_uploads;
    return;
  }
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
  cell.state = State::kResident;
  ++figures_.uploads;
  figures_.upload_bytes += loaded.codes.size() * sizeof(std::uint16_t);
  place_shadow(cell, loaded);
}

void TileBox::place_shadow(Cell& cell, const LoadedTile& loaded) {
  cell.shadow_requested = false;
  cell.shadow_broken = loaded.request.sun && loaded.shadow.empty();
  cell.slot->upload_shadow(loaded.shadow);
  cell.sun_number = loaded.shadow.empty() ? 0 : loaded.request.sun_number;
  figures_.upload_bytes += loaded.shadow.size() * sizeof(std::uint16_t);
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
    loader_.request({missing[i].second->tile, true, sun_, sun_number_});
  }
  if (sun_) request_shadows(centre, in_flight_limit_ - busy - wanted);
}

void TileBox::request_shadows(WorldPoint centre, std::size_t most) {
  if (most == 0) return;
  std::vector<std::tuple<std::uint64_t, double, Cell*>> outdated;
  for (Cell& cell : cells_) {
    if (!is_outdated(cell) || cell.shadow_requested) continue;
    outdated.emplace_back(cell.sun_number, distance_squared(cell, centre), &cell);
  }
  const std::size_t wanted = std::min(outdated.size(), most);
  std::partial_sort(outdated.begin(), outdated.begin() + static_cast<std::ptrdiff_t>(wanted), outdated.end());
  for (std::size_t i = 0; i < wanted; ++i) {
    Cell& cell = *std::get<Cell*>(outdated[i]);
    cell.shadow_requested = true;
    loader_.request({cell.tile, false, sun_, sun_number_});
  }
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
  figures_.resident_bytes = slot_bytes_ * slots + on_the_way_bytes_ * (loader_.in_flight() + waiting_.size());
}

void TileBox::finish(WorldPoint centre, double radius) {
  for (;;) {
    update(centre, radius);
    if (figures_.missing_tiles == 0 && figures_.shadows_to_come == 0) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

const TileSlot* TileBox::resident(TileIndex tile) const {
  if (!range_.contains(tile)) return nullptr;
  const Cell& cell = cells_[cell_of(tile)];
  return cell.tile == tile && cell.state == State::kResident ? cell.slot.get() : nullptr;
}

}  // namespace isohf::view
