#include "isohf/sampling/source/height_rows.h"

#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>

#include "isohf/base/sample.h"
#include "isohf/error.h"

namespace isohf {
namespace {

std::size_t samples_of(const Window& window) {
  return static_cast<std::size_t>(window.columns) * static_cast<std::size_t>(window.rows);
}

std::size_t bytes_of(const SourceInfo& info, const Window& window) {
  return samples_of(window) * size_bytes(info.sample_type);
}

}  // namespace

CellStore CellStore::of_rows(const SourceInfo& info, std::uint64_t read_bytes) {
  const ReadStep step = ReadStep::make(info, read_bytes);
  return {.step = step, .cell_columns = step.columns};
}

CellStore CellStore::of_windows(const SourceInfo& info, std::uint64_t most_bytes, const std::string& folder) {
  constexpr std::uint64_t kTilesBytes = std::uint64_t{1} << 20U;
  constexpr std::uint64_t kRowsBytes = std::uint64_t{8} << 20U;
  constexpr std::uint64_t kMostRows = 256;
  constexpr std::int64_t kCellColumns = 2048;
  const bool is_tiled = info.block_width > 0 && info.block_width < info.width;
  const std::uint64_t row_bytes = size_bytes(info.sample_type) * static_cast<std::uint64_t>(info.width);
  const ReadStep step =
      ReadStep::make(info, is_tiled ? kTilesBytes : std::min({kRowsBytes, kMostRows * row_bytes, most_bytes / 8}));
  return {step, std::min(step.columns, is_tiled ? info.width : kCellColumns), most_bytes, folder};
}

std::uint64_t CellStore::cell_bytes(const SourceInfo& info) const {
  return ReadStep{step.rows, cell_columns}.most_bytes(info);
}

struct HeightRows::Cell {
  Window window;
  std::unique_ptr<std::byte[]> memory;
  std::span<std::byte> raw;
};

/// Memory of cells that were dropped, on any thread: fresh memory would be cleared page by page.
struct HeightRows::Idle {
  std::mutex mutex;
  std::vector<std::unique_ptr<std::byte[]>> memory;
};

struct HeightRows::Kept {
  std::shared_ptr<const Cell> cell;  ///< null: in the file alone
  std::list<std::int64_t>::iterator used;
  std::optional<std::uint64_t> place;  ///< in the file
};

HeightRows::HeightRows(HeightSource& source, double datum, bool wraps, CellStore store)
    : source_(source),
      datum_(datum),
      wraps_(wraps),
      store_(std::move(store)),
      across_(std::max<std::int64_t>(1, source.info().width / store_.cell_columns)),
      idle_(std::make_shared<Idle>()) {}

HeightRows::~HeightRows() = default;

std::int64_t HeightRows::cell_column(std::int64_t column) const {
  return std::min(column / store_.cell_columns, across_ - 1);
}

Window HeightRows::window_of_cell(std::int64_t row, std::int64_t column) const {
  const SourceInfo& info = source_.info();
  const Window from{column * store_.cell_columns, row * store_.step.rows};
  return {from.column, from.row, column + 1 == across_ ? info.width - from.column : store_.cell_columns,
          std::min(store_.step.rows, info.height - from.row)};
}

HeightRows::Held HeightRows::hold(const Window& window) {
  Held held;
  held.window_ = window;
  if (window.columns == 0) return held;
  const std::lock_guard lock(mutex_);
  const std::int64_t first = cell_column(window.column);
  const std::int64_t last = cell_column(window.column + window.columns - 1);
  held.across_ = last - first + 1;
  for (std::int64_t row = window.row / store_.step.rows; row * store_.step.rows < window.row + window.rows; ++row) {
    for (std::int64_t column = first; column <= last; ++column) held.cells_.push_back(cell_at(row, column));
  }
  return held;
}

std::shared_ptr<const HeightRows::Cell> HeightRows::cell_at(std::int64_t row, std::int64_t column) {
  const std::int64_t key = row * across_ + column;
  auto found = cells_.find(key);
  if (found != cells_.end() && found->second.cell) {
    used_.splice(used_.begin(), used_, found->second.used);
    return found->second.cell;
  }
  const Window window = window_of_cell(row, column);
  if (found != cells_.end()) {
    const auto cell = new_cell(window);
    if (scratch_.read_at(*found->second.place, cell->raw) != cell->raw.size())
      throw Error(ErrorCode::kIo, scratch_.path() + ": the scratch file there lost what was written to it");
    keep(key, cell);
  } else {
    if (source_.is_gap(window)) return nullptr;
    read_cells(row, column);
    found = cells_.find(key);
  }
  std::shared_ptr<const Cell> cell = found->second.cell;
  make_room();
  return cell;
}

std::shared_ptr<HeightRows::Cell> HeightRows::new_cell(const Window& window) {
  std::unique_ptr<std::byte[]> memory;
  if (const std::lock_guard lock(idle_->mutex); !idle_->memory.empty()) {
    memory = std::move(idle_->memory.back());
    idle_->memory.pop_back();
  }
  if (!memory) memory = std::make_unique_for_overwrite<std::byte[]>(store_.cell_bytes(source_.info()));
  const std::span<std::byte> raw(memory.get(), bytes_of(source_.info(), window));
  return {new Cell{window, std::move(memory), raw}, [idle = idle_](Cell* cell) {
            const std::unique_ptr<Cell> dropped(cell);
            const std::lock_guard lock(idle->mutex);
            idle->memory.push_back(std::move(dropped->memory));
          }};
}

/// Reads a cell that is not kept, and with it those beside it in the same rows of a source that has whole rows.
void HeightRows::read_cells(std::int64_t row, std::int64_t column) {
  const SourceInfo& info = source_.info();
  const bool in_rows = store_.step.columns >= info.width && across_ > 1;
  Window window = window_of_cell(row, column);
  const std::shared_ptr<Cell> cell = in_rows ? nullptr : new_cell(window);
  if (in_rows) {
    window = {0, window.row, info.width, window.rows};
    raw_.resize(bytes_of(info, window));
  }
  // Isolated: a thread that waits here must not take up a tile, which may want to read as well.
  oneapi::tbb::this_task_arena::isolate([&] { source_.read_window(window, in_rows ? std::span(raw_) : cell->raw); });
  if (!in_rows) return keep(row * across_ + column, cell);
  const std::size_t bytes = size_bytes(info.sample_type);
  for (std::int64_t k = 0; k < across_; ++k) {
    const Window part = window_of_cell(row, k);
    if (cells_.contains(row * across_ + k) || source_.is_gap(part)) continue;
    const auto copy = new_cell(part);
    const std::size_t part_bytes = static_cast<std::size_t>(part.columns) * bytes;
    for (std::int64_t r = 0; r < part.rows; ++r) {
      std::memcpy(copy->raw.data() + static_cast<std::size_t>(r) * part_bytes,
                  raw_.data() + static_cast<std::size_t>(r * info.width + part.column) * bytes, part_bytes);
    }
    keep(row * across_ + k, copy);
  }
}

void HeightRows::keep(std::int64_t key, std::shared_ptr<const Cell> cell) {
  bytes_ += cell->raw.size();
  used_.push_front(key);
  Kept& kept = cells_[key];
  kept.cell = std::move(cell);
  kept.used = used_.begin();
}

void HeightRows::make_room() {
  for (auto at = used_.end(); bytes_ > store_.most_bytes && at != used_.begin();) {
    Kept& kept = cells_.find(*--at)->second;
    if (kept.cell.use_count() > 1) continue;
    if (!kept.place) {
      if (!scratch_.is_open()) scratch_ = File::scratch(store_.scratch_folder, 0);
      kept.place = scratch_end_;
      if (scratch_free_.empty()) {
        scratch_end_ += store_.cell_bytes(source_.info());
      } else {
        kept.place = scratch_free_.back();
        scratch_free_.pop_back();
      }
      scratch_.write_at(*kept.place, kept.cell->raw);
    }
    bytes_ -= kept.cell->raw.size();
    kept.cell.reset();
    at = used_.erase(at);
  }
}

void HeightRows::drop_before(std::int64_t row) {
  const std::lock_guard lock(mutex_);
  std::erase_if(cells_, [&](const auto& entry) {
    const auto& [key, kept] = entry;
    if ((key / across_ + 1) * store_.step.rows > row) return false;
    if (kept.cell) {
      bytes_ -= kept.cell->raw.size();
      used_.erase(kept.used);
    }
    if (kept.place) scratch_free_.push_back(*kept.place);
    return true;
  });
}

Window HeightRows::with_halo(const Window& window, const Prefilter& prefilter) const {
  const std::int64_t halo = prefilter.is_identity() || window.columns == 0 ? 0 : prefilter.halo();
  if (halo == 0) return window;
  const SourceInfo& info = source_.info();
  Window wide;
  wide.column = std::max<std::int64_t>(window.column - halo, 0);
  wide.row = std::max<std::int64_t>(window.row - halo, 0);
  wide.columns = std::min(window.column + window.columns + halo, info.width) - wide.column;
  wide.rows = std::min(window.row + window.rows + halo, info.height) - wide.row;
  const bool is_across = window.column < halo || window.column + window.columns + halo > info.width;
  if (wraps_ && is_across) {
    wide.column = 0;
    wide.columns = info.width;
  }
  return wide;
}

void HeightRows::copy_heights(const Held& held, const Window& window, float* heights) const {
  const SourceInfo& info = source_.info();
  const std::size_t bytes = size_bytes(info.sample_type);
  const std::int64_t first_row = held.window_.row / store_.step.rows;
  const std::int64_t first_column = cell_column(held.window_.column);
  for (std::int64_t row = window.row; row < window.row + window.rows; ++row) {
    for (std::int64_t column = window.column; column < window.column + window.columns;) {
      const std::int64_t k = cell_column(column);
      const std::int64_t end =
          std::min(k + 1 == across_ ? info.width : (k + 1) * store_.cell_columns, window.column + window.columns);
      const auto count = static_cast<std::size_t>(end - column);
      const Cell* const cell =
          held.cells_[static_cast<std::size_t>((row / store_.step.rows - first_row) * held.across_ + k - first_column)]
              .get();
      if (cell == nullptr) {
        std::fill_n(heights, count, std::numeric_limits<float>::quiet_NaN());
      } else {
        const Window& whole = cell->window;
        const auto at = static_cast<std::size_t>((row - whole.row) * whole.columns + column - whole.column);
        heights_from_samples(info, datum_, cell->raw.subspan(at * bytes, count * bytes), {heights, count});
      }
      heights += count;
      column = end;
    }
  }
}

bool HeightRows::read(const Window& window, const Prefilter& prefilter, Band& band, const Held* held) {
  const Window wide = with_halo(window, prefilter);
  Held own;
  if (held == nullptr || !held->holds(wide)) {
    own = hold(wide);
    held = &own;
  }
  const auto is_void = [](float height) { return std::isnan(height); };
  band.window = window;
  band.heights.resize(samples_of(window));
  band.voids.clear();
  if (prefilter.is_identity()) {
    copy_heights(*held, window, band.heights.data());
    return !std::ranges::all_of(band.heights, is_void);
  }
  std::vector<float> heights(samples_of(wide));
  copy_heights(*held, wide, heights.data());
  if (std::ranges::all_of(heights, is_void)) {
    std::ranges::fill(band.heights, std::numeric_limits<float>::quiet_NaN());
    return false;
  }
  const std::int64_t left = window.column - wide.column;
  const std::int64_t first = window.row - wide.row;
  const View2D<float> all(heights.data(), wide.columns, wide.rows);
  std::vector<char> voids(band.heights.size());
  bool any = false;
  for (std::int64_t r = 0; r < window.rows; ++r) {
    const float* const row = all.row(first + r) + left;
    char* const to = voids.data() + r * window.columns;
    for (std::int64_t c = 0; c < window.columns; ++c) {
      to[c] = is_void(row[c]) ? 1 : 0;
      any = any || to[c] != 0;
    }
  }
  if (any) band.voids = std::move(voids);
  prefilter.filter_rows(all, wraps_ && wide.columns == source_.info().width);
  prefilter.filter_columns({heights.data() + left, window.columns, wide.rows, wide.columns}, first,
                           {band.heights.data(), window.columns, window.rows});
  return true;
}

}  // namespace isohf
