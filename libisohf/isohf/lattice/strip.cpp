#include "isohf/lattice/strip.h"

#include "isohf/base/assert.h"

namespace isohf {
namespace {

/// The coarse copy of the tile that one level of detail draws.
class CoarseRows {
 public:
  CoarseRows(const TileShape& shape, int level) : tile_columns_(shape.columns()), level_(level), stride_(1 << level) {}

  [[nodiscard]] int cells() const { return (tile_columns_ - 4) / stride_; }
  [[nodiscard]] int stride() const { return stride_; }

  /// Vertex j of a flush row, 0 <= j <= cells().
  [[nodiscard]] std::uint32_t flush(int j, int row) const { return index(1 + j * stride_, row); }

  /// Vertex j of a shifted row, 0 <= j <= cells() + 1.
  [[nodiscard]] std::uint32_t shifted(int j, int row) const {
    if (level_ == 0) return index(1 + j, row);
    if (j == 0) return index(1, row);
    if (j == cells() + 1) return index(tile_columns_ - 3, row);
    return index(1 + stride_ / 2 + (j - 1) * stride_, row);
  }

 private:
  [[nodiscard]] std::uint32_t index(int column, int row) const {
    return static_cast<std::uint32_t>(column + row * tile_columns_);
  }

  int tile_columns_;
  int level_;
  int stride_;
};

}  // namespace

std::vector<std::uint32_t> strip_indices(const TileShape& shape, int level) {
  ISOHF_ASSERT(level >= 0 && level < shape.levels());
  const CoarseRows rows(shape, level);
  const int last = rows.cells();
  const int south = shape.rows() - 2;
  std::vector<std::uint32_t> strip;
  strip.reserve(static_cast<std::size_t>(shape.strip_index_count(level)));
  for (int top = 1; top < south; top += 2 * rows.stride()) {
    const int middle = top + rows.stride();
    const int bottom = middle + rows.stride();
    if (top > 1) {
      // From the end of the blue row above: repeat where the strip is, go to the start, repeat that. Five triangles
      // without area, an even number of indices.
      const std::uint32_t start = rows.shifted(last + 1, middle);
      strip.insert(strip.end(), {strip.back(), start, start});
    }
    strip.push_back(rows.shifted(last + 1, middle));
    for (int j = last; j >= 0; --j) strip.insert(strip.end(), {rows.flush(j, top), rows.shifted(j, middle)});
    strip.insert(strip.end(), 2, rows.shifted(0, middle));
    for (int j = 0; j <= last; ++j) strip.insert(strip.end(), {rows.flush(j, bottom), rows.shifted(j + 1, middle)});
  }
  return strip;
}

}  // namespace isohf
