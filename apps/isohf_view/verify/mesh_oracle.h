#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "isohf/lattice.h"
#include "paging/tile_source.h"

namespace isohf::view {

/// Pixels per object-space step of the top-down pictures. With 2 and 3 no pixel centre lies on a side of any triangle
/// of any level: sides have slopes of one step in x for one in z, and 3(2i+1) is odd where 2(2j+1) is even.
inline constexpr int kPixelsPerX = 2;
inline constexpr int kPixelsPerZ = 3;

/// A rectangle of the top-down picture of a tile; pixel (0, 0) touches the North-West corner.
struct PixelWindow {
  int x0 = 0;
  int z0 = 0;
  int width = 0;
  int height = 0;
  auto operator<=>(const PixelWindow&) const = default;
};

/// Calls visit(i, j, k, at) for column i and row j of a window: k counts its pixels row by row, `at` is the place of the
/// pixel's four floats in a picture `picture_width` wide whose rows begin in the South.
template <typename Visit>
void for_each_pixel(const PixelWindow& window, int picture_width, const Visit& visit) {
  std::size_t k = 0;
  for (int j = 0; j < window.height; ++j) {
    const auto first = static_cast<std::size_t>(window.height - 1 - j) * static_cast<std::size_t>(picture_width);
    for (int i = 0; i < window.width; ++i, ++k) visit(i, j, k, 4 * (first + static_cast<std::size_t>(i)));
  }
}

/// A pixel centre on the mesh of a level: three stored vertices, c + r*C, and their weights.
struct PixelSample {
  std::array<std::uint32_t, 3> vertices;
  std::array<float, 3> weights;
};

/// Where the mesh of each level has its triangles, by the library's barycentric lookup alone: level λ is a coarse copy
/// of the tile, one of (C-4)/2^λ columns and (R-3)/2^λ rows of cells (paper section 3.4).
class MeshOracle {
 public:
  explicit MeshOracle(const TileShape& shape) : shape_(shape) {}

  /// The samples of a window at a level, row by row; pixels outside the tile have all weights 0. Valid until the next
  /// call.
  [[nodiscard]] std::span<const PixelSample> samples(int level, const PixelWindow& window);

  /// Windows of at most 1024 x 1024 pixels that cover the tile and a rim of two pixels around it.
  [[nodiscard]] std::vector<PixelWindow> windows() const;

 private:
  [[nodiscard]] std::vector<PixelSample> compute(int level, const PixelWindow& window) const;

  TileShape shape_;
  std::map<std::pair<int, PixelWindow>, std::vector<PixelSample>> kept_;
  std::size_t kept_pixels_ = 0;
  std::vector<PixelSample> last_;
};

/// Weighted code of a sample, and the spread of its three codes; valid is false over voids and outside.
struct SampledCode {
  bool valid = false;
  double code = 0.0;
  double spread = 0.0;
};
[[nodiscard]] SampledCode sample_code(const PixelSample& sample, std::span<const std::uint16_t> codes);

}  // namespace isohf::view
