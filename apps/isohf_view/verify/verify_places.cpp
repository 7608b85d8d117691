#include "verify/verify_places.h"

#include <fmt/format.h>

namespace isohf::view {

std::string vertex_name(GridVertex vertex) {
  return fmt::format("vertex (c {}, r {})", vertex.column, vertex.row);
}

std::string pixel_name(const TileShape& shape, const PixelWindow& window, int i, int j, const PixelSample& sample) {
  std::string text = fmt::format("object space ({:.2f}, {:.2f})", (window.x0 + i + 0.5) / kPixelsPerX,
                                 (window.z0 + j + 0.5) / kPixelsPerZ);
  if (sample.weights[0] + sample.weights[1] + sample.weights[2] < 0.5F) return text + ", outside the tile";
  text += ", triangle";
  for (const std::uint32_t vertex : sample.vertices) {
    const auto columns = static_cast<std::uint32_t>(shape.columns());
    text += fmt::format(" (c {}, r {})", vertex % columns, vertex / columns);
  }
  return text;
}

}  // namespace isohf::view
