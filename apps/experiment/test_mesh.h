#pragma once

#include <array>
#include <cstdint>
#include <vector>

/// The flat meshes whose vertices section 2 of the paper lifts onto sine waves.

namespace isohf::experiment {

/// A place on the ground plane, in sample spacings (√ of the area of a vertex) from the patch's centre.
struct Place {
  double x;
  double z;
};

/// Where a triangle's second and third vertices lie seen from its first. Translates share one shape.
struct TriangleShape {
  Place second;
  Place third;

  [[nodiscard]] double doubled_area() const { return second.x * third.z - second.z * third.x; }
};

struct MeshTriangle {
  std::array<std::uint32_t, 3> vertices;
  std::uint32_t shape;
  bool is_measured;  ///< far enough from the patch's edge
};

enum class Diagonals {
  kConsistent,   ///< all from (0, 0) to (1, 1) of their squares
  kAlternating,  ///< as on a chessboard
  kBoth,         ///< four triangles a square: two of the consistent diagonal, then two of the other one
};

/// A square patch of a regular mesh. Every vertex stands for an area of 1, so meshes of equal triangle counts sample
/// equally densely. Looks the same after half a turn about its centre.
struct TestMesh {
  std::vector<Place> vertices;
  std::vector<TriangleShape> shapes;
  std::vector<MeshTriangle> triangles;
};

/// Triangles nearer to the patch's edge than this, in sample spacings, are fitted but not measured: a least-squares
/// height depends on what lies d samples away by about 0.3^d, so a cut edge is not seen from here.
inline constexpr double kUnmeasuredMargin = 4.0;

/// The full-detail mesh of the tile that is nearest to a square of `triangles`, stretched to equilateral triangles.
[[nodiscard]] TestMesh make_iso_mesh(std::int64_t triangles);

/// Squares cut along diagonals, as many as are nearest to `triangles`.
[[nodiscard]] TestMesh make_ortho_mesh(std::int64_t triangles, Diagonals diagonals);

}  // namespace isohf::experiment
