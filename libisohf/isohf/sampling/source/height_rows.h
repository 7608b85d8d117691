#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "isohf/base/file.h"
#include "isohf/raster.h"
#include "isohf/sampling/resample/prefilter.h"
#include "isohf/sampling/source/read_step.h"
#include "isohf/sampling/source/source_band.h"

namespace isohf {

/// How HeightRows reads a source and keeps its samples. None of it changes a height.
struct CellStore {
  ReadStep step;
  /// Columns that are kept and dropped together: those of a read, or fewer of one of whole rows.
  std::int64_t cell_columns = 1;
  /// Beyond so many bytes the samples that were used longest ago go to a scratch file; those in use count as well.
  std::uint64_t most_bytes = UINT64_MAX;
  std::string scratch_folder = "";

  /// Rows from North to South, each read once: no more are kept than are in use.
  [[nodiscard]] static CellStore of_rows(const SourceInfo& info, std::uint64_t read_bytes);
  /// Windows anywhere, within most_bytes.
  [[nodiscard]] static CellStore of_windows(const SourceInfo& info, std::uint64_t most_bytes,
                                            const std::string& folder);

  [[nodiscard]] std::uint64_t cell_bytes(const SourceInfo& info) const;
};

/// A window of a source as heights.
struct Band {
  Window window;
  std::vector<float> heights;
  std::vector<char> voids;  ///< as SourceBand::voids; empty where it has no data, or there are none

  [[nodiscard]] SourceBand view() const {
    return {{heights.data(), window.columns, window.rows},
            window.row,
            {voids.empty() ? nullptr : voids.data(), window.columns, window.rows},
            window.column};
  }
};

/// Windows of a source as heights or coefficients, through one cache of raw samples. Each sample is read once, unless
/// rows are used again after drop_before(). The bytes of a window depend on nothing but its place. Any thread.
class HeightRows {
 public:
  /// `datum` as in heights_from_samples. `wraps`: the column behind the last one is the first. The source outlives it.
  HeightRows(HeightSource& source, double datum, bool wraps, CellStore store);
  ~HeightRows();

  /// Some of the source's samples, kept while this is. Empty windows are allowed.
  class Held;
  [[nodiscard]] Held hold(const Window& window);
  /// What the coefficients of a window depend on.
  [[nodiscard]] Window with_halo(const Window& window, const Prefilter& prefilter) const;
  /// Coefficients of a window, heights where the prefilter is the identity. False where no sample that they depend on has
  /// an elevation.
  ///   held  with_halo() of the window or more, to save holding it
  bool read(const Window& window, const Prefilter& prefilter, Band& band, const Held* held = nullptr);
  /// Rows before this one are not used any more.
  void drop_before(std::int64_t row);
  [[nodiscard]] const HeightSource& source() const { return source_; }

 private:
  struct Cell;
  struct Kept;
  struct Idle;

  [[nodiscard]] std::shared_ptr<const Cell> cell_at(std::int64_t row, std::int64_t column);
  [[nodiscard]] Window window_of_cell(std::int64_t row, std::int64_t column) const;
  [[nodiscard]] std::int64_t cell_column(std::int64_t column) const;
  [[nodiscard]] std::shared_ptr<Cell> new_cell(const Window& window);
  void read_cells(std::int64_t row, std::int64_t column);
  void keep(std::int64_t key, std::shared_ptr<const Cell> cell);
  void make_room();
  void copy_heights(const Held& held, const Window& window, float* heights) const;

  HeightSource& source_;
  double datum_;
  bool wraps_;
  CellStore store_;
  std::int64_t across_;  ///< cells of a row
  std::shared_ptr<Idle> idle_;
  std::mutex mutex_;  ///< of the source and of all that follows
  std::unordered_map<std::int64_t, Kept> cells_;
  std::list<std::int64_t> used_;  ///< cells in memory, the one used last in front
  std::uint64_t bytes_ = 0;       ///< of these
  File scratch_;
  std::uint64_t scratch_end_ = 0;
  std::vector<std::uint64_t> scratch_free_;
  std::vector<std::byte> raw_;
};

class HeightRows::Held {
 public:
  [[nodiscard]] bool holds(const Window& window) const {
    return window.column >= window_.column && window.row >= window_.row &&
           window.column + window.columns <= window_.column + window_.columns &&
           window.row + window.rows <= window_.row + window_.rows;
  }

 private:
  friend class HeightRows;
  Window window_;
  std::int64_t across_ = 0;
  std::vector<std::shared_ptr<const Cell>> cells_;  ///< row by row; null: no elevation there
};

}  // namespace isohf
