#include "verify/mesh_oracle.h"

#include <algorithm>

#include "isohf/lattice.h"
#include "isohf/lattice/barycentric.h"

namespace isohf::view {
namespace {

constexpr int kRim = 2;
constexpr int kLargestWindow = 1024;
constexpr std::size_t kMostKept = std::size_t{4} << 20;  ///< samples, 24 bytes each

}  // namespace

std::vector<PixelWindow> MeshOracle::windows() const {
  const int width = 2 * shape_.cell_columns() * kPixelsPerX + kRim;
  const int height = shape_.cell_rows() * kPixelsPerZ + kRim;
  std::vector<PixelWindow> all;
  for (int z = -kRim; z < height; z += kLargestWindow) {
    for (int x = -kRim; x < width; x += kLargestWindow) {
      all.push_back({x, z, std::min(kLargestWindow, width - x), std::min(kLargestWindow, height - z)});
    }
  }
  return all;
}

std::vector<PixelSample> MeshOracle::compute(int level, const PixelWindow& window) const {
  const int stride = 1 << level;
  const TileShape coarse = TileShape::make(shape_.cell_columns() / stride + 4, shape_.cell_rows() / stride + 3, 1);
  const double width = 2.0 * shape_.cell_columns();
  const double height = shape_.cell_rows();
  std::vector<PixelSample> out;
  out.reserve(static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height));
  for (int j = 0; j < window.height; ++j) {
    const double z = (window.z0 + j + 0.5) / kPixelsPerZ;
    for (int i = 0; i < window.width; ++i) {
      const double x = (window.x0 + i + 0.5) / kPixelsPerX;
      PixelSample sample{};
      if (x > 0.0 && x < width && z > 0.0 && z < height) {
        const Barycentric at = barycentric(coarse, {x / stride, z / stride});
        for (std::size_t k = 0; k < 3; ++k) {
          const ObjectVertex place = object_from_grid(coarse, at.vertices[k]);
          // Level 0 keeps its columns; coarser levels only meet odd rows, where column = x/2 + 1.
          const int column = level == 0 ? at.vertices[k].column : place.x * stride / 2 + 1;
          const int row = place.z * stride + 1;
          sample.vertices[k] = static_cast<std::uint32_t>(column + row * shape_.columns());
          sample.weights[k] = static_cast<float>(at.weights[k]);
        }
      }
      out.push_back(sample);
    }
  }
  return out;
}

std::span<const PixelSample> MeshOracle::samples(int level, const PixelWindow& window) {
  const auto found = kept_.find({level, window});
  if (found != kept_.end()) return found->second;
  std::vector<PixelSample> made = compute(level, window);
  if (kept_pixels_ + made.size() > kMostKept) {
    last_ = std::move(made);
    return last_;
  }
  kept_pixels_ += made.size();
  return kept_.emplace(std::pair{level, window}, std::move(made)).first->second;
}

SampledCode sample_code(const PixelSample& sample, std::span<const std::uint16_t> codes) {
  SampledCode out;
  if (sample.weights[0] + sample.weights[1] + sample.weights[2] < 0.5F) return out;
  double low = kVoidCode;
  double high = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint16_t code = codes[sample.vertices[k]];
    if (code == kVoidCode) return out;
    out.code += static_cast<double>(sample.weights[k]) * code;
    low = std::min<double>(low, code);
    high = std::max<double>(high, code);
  }
  out.valid = true;
  out.spread = high - low;
  return out;
}

}  // namespace isohf::view
