#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace isohf {

/// The most stored columns a tile may have: object-space x reaches 2(C-4)+4, a signed 16-bit integer (errata E4).
inline constexpr int kMaxTileColumns = 1 << 14;
/// The most stored rows: object-space z reaches R-2 and grid indices stay in 16 bits.
inline constexpr int kMaxTileRows = (1 << 15) - 1;
/// The most levels: C-4 and (R-3)/2 hold a multiple of 2^13 within the limits above, none of 2^14.
inline constexpr int kMaxTileLevels = 14;

/// The validated shape of every tile of a heightfield: C columns and R rows of stored elevations, a one-vertex border
/// included, and Λ levels of detail (paper section 3, errata E1-E4).
///
/// Constraints: C >= 5, R >= 5, R odd, C-4 and (R-3)/2 integer multiples of 2^(Λ-1), C <= 2^14, R < 2^15, 1 <= Λ <= 14.
/// A function that is given a TileShape is total. Immutable, cheap to copy.
class TileShape {
 public:
  /// Throws Error{kInvalidArgument} that names the broken constraint and the nearest valid shape.
  static TileShape make(int columns, int rows, int levels);

  /// Why (columns, rows, levels) is no valid shape, one clause; empty where it is one.
  static std::string why_invalid(int columns, int rows, int levels);

  /// The valid shape nearest to the one asked for: levels are kept where they lie in 1..14, then columns and rows are
  /// rounded to the nearest that satisfy the constraints (ties upwards).
  static TileShape nearest(int columns, int rows, int levels);

  [[nodiscard]] int columns() const { return columns_; }  ///< C, padding included
  [[nodiscard]] int rows() const { return rows_; }        ///< R, padding included
  [[nodiscard]] int levels() const { return levels_; }    ///< Λ

  [[nodiscard]] int cell_columns() const { return columns_ - 4; }  ///< visible lattice steps from West to East
  [[nodiscard]] int cell_rows() const { return rows_ - 3; }        ///< visible rows of triangles

  /// C*R, the elevations stored for one tile.
  [[nodiscard]] std::int64_t stored_vertex_count() const { return std::int64_t{columns_} * rows_; }
  /// Vertices on visible triangles: C-3 on each of the (R-1)/2 odd rows, C-2 on each of the (R-3)/2 even rows.
  [[nodiscard]] std::int64_t visible_vertex_count() const;

  /// Visible triangles of the full-detail mesh, (2C-7)(R-3) (section 3); Eq. 4 at level 0.
  [[nodiscard]] std::int64_t triangle_count() const;
  /// Eq. 3 and Eq. 4: strip indices and its visible triangles at level 0 <= level < levels().
  [[nodiscard]] std::int64_t strip_index_count(int level) const;
  [[nodiscard]] std::int64_t strip_triangle_count(int level) const;
  /// Eq. 5 and Eq. 6: stitch triangles and indices that join level to the full-detail border; 0 at level 0.
  [[nodiscard]] std::int64_t stitch_triangle_count(int level) const;
  [[nodiscard]] std::int64_t stitch_index_count(int level) const;

  /// True aspect of the drawn triangles, (R-3)·sin60°/(C-4); 1 is equilateral (errata E3).
  [[nodiscard]] double aspect() const;
  /// The aspect that the paper prints in Table 1, R·sin60°/C. For comparison with the table only.
  [[nodiscard]] double printed_aspect() const;

  friend bool operator==(const TileShape&, const TileShape&) = default;

 private:
  TileShape(int columns, int rows, int levels) : columns_(columns), rows_(rows), levels_(levels) {}

  int columns_;
  int rows_;
  int levels_;
};

/// What a search for tile shapes is to keep near: triangles of the full-detail mesh, or stored vertices.
struct ShapeBudget {
  enum class Kind { kTriangles, kVertices };
  Kind kind = Kind::kTriangles;
  std::int64_t count = 10000;
};

/// The search behind Table 1 with the true aspect (errata E2, E3): shapes of `levels` levels whose count lies within
/// `tolerance` (a fraction, >= 0) of the budget, best |aspect - 1| first, ties by nearness to the budget, then fewer
/// columns; at most `limit`, all where it is negative. For each number of columns the two row counts within the budget
/// that are nearest to equilateral are considered. May be empty. O(2^14 / 2^levels) shapes.
/// Throws Error{kInvalidArgument} for levels outside 1..14, a budget below 1, or a negative or NaN tolerance.
std::vector<TileShape> find_shapes(int levels, const ShapeBudget& budget, double tolerance, int limit);

/// A row of the paper's Table 1, as printed.
struct Table1Row {
  int levels;
  int columns;
  int rows;
  double printed_aspect;
  bool valid;  ///< false for (48, 55) with Λ=3 (errata E1)
};

/// Table 1 of the paper, in its order.
const std::vector<Table1Row>& table1();

}  // namespace isohf
