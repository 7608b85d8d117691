#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "isohf/raster.h"

namespace isohf {

/// Rows of a source, wherever they lie in memory.
struct VoidRows {
  std::int64_t first = 0;             ///< the source's row that entry 0 holds
  std::int64_t column = 0;            ///< and the column that rows begin with
  std::vector<const std::byte*> raw;  ///< [rows] samples of the source's type
  std::vector<const char*> voids;     ///< [rows] 1 where a sample is void; nullptr for a row without voids
  std::vector<std::byte> read;        ///< what they point into, where it was read for them
};

/// Some columns at least of some rows.
using ReadVoidRows =
    std::function<VoidRows(std::int64_t first, std::int64_t end, std::int64_t column, std::int64_t end_column)>;

/// Fills voids from what lies around them; filled_source.h says how and what can be relied on.
class VoidFiller {
 public:
  /// distance: samples, >= 1
  VoidFiller(const SourceInfo& info, std::int64_t distance);

  /// Fills the voids of the source's rows first to end - 1.
  /// read    gives those rows and reach() more on either side, as far as the source has them
  /// samples [(end - first) * width samples] those rows as the source has them; filled in place
  /// Returns how many were filled in each row. Works on the calling thread's task arena.
  std::vector<std::int64_t> fill(const ReadVoidRows& read, std::int64_t first, std::int64_t end,
                                 std::span<std::byte> samples) const;
  /// What it holds of so many rows, beside what it reads.
  [[nodiscard]] double memory_bytes(std::int64_t rows) const;

  [[nodiscard]] std::int64_t reach() const;
  /// Columns that are read together.
  [[nodiscard]] std::int64_t columns_at_once() const;
  /// How far the smoothing looks, beyond the distance.
  [[nodiscard]] static std::int64_t smoothing_reach();
  /// Rows that are worth filling at once.
  static constexpr std::int64_t kRowsAtOnce = 64;

 private:
  struct Box;

  [[nodiscard]] std::vector<Box> boxes(const ReadVoidRows& read, std::int64_t first, std::int64_t end) const;
  [[nodiscard]] std::int64_t box_columns() const;
  void look_for_ground(const VoidRows& rows, Box& box) const;
  void cast_rays(const VoidRows& rows, Box& box) const;
  void cast_row(const VoidRows& rows, Box& box, std::int64_t row) const;
  void smooth(Box& box) const;
  [[nodiscard]] double storable(double raw) const;

  SourceInfo info_;
  std::int64_t distance_;
};

}  // namespace isohf
