#include "isohf/light/shadow.h"

#include <array>
#include <cmath>

namespace isohf {
namespace {

/// Rows that are computed side by side: two vectors of doubles with AVX2, four with SSE2.
constexpr int kLanes = 8;
/// Columns that are transposed together: as much as fits a few cache lines of each row.
constexpr int kChunk = 16;

/// max that keeps `held` where the other is NaN; one instruction.
inline double higher(double value, double held) {
  return value > held ? value : held;
}

/// Along a row S falls by distance times fall, so U = S + distance * fall never falls: it is the running maximum of
/// elevation + distance * fall. Taken in this form errors do not add up (every S is one sum and one difference away).
class RowPass {
 public:
  RowPass(const TileGrid& grid, View2D<const float> elevations, const ShadowLight& light, View2D<float> shadow)
      : shape_(grid.shape()), elevations_(elevations), shadow_(shadow), light_(light) {
    fall_per_half_step_ = light.fall * grid.sigma_x();
  }

  /// Rows row, row + 2, ... row + 2 (lanes - 1).
  void run(int row, int lanes, std::span<const double> entering, std::span<double> leaving) {
    lanes_ = lanes;
    row_ = row;
    for (int k = 0; k < kLanes; ++k) {
      const auto at = static_cast<std::size_t>(row - 1 + 2 * std::min(k, lanes - 1));
      highest_[static_cast<std::size_t>(k)] = entering.empty() ? kNoShadow : entering[at];
    }
    const bool east = light_.travel == LightTravel::kEastward;
    const int count = last_visible_column(shape_, row);
    for (int done = 0; done < count; done += kChunk) {
      const int width = std::min(kChunk, count - done);
      chunk(east ? 1 + done : count - done - width + 1, width, east);
    }
    if (leaving.empty()) return;
    const double across = half_steps_across(shape_) * fall_per_half_step_;
    for (int k = 0; k < lanes; ++k) {
      leaving[static_cast<std::size_t>(row - 1 + 2 * k)] = highest_[static_cast<std::size_t>(k)] - across;
    }
  }

 private:
  using Lanes = std::array<double, kLanes>;

  [[nodiscard]] double fallen(int column, bool east) const {
    const int x = object_x(shape_.columns(), column, row_);
    return (east ? x : half_steps_across(shape_) - x) * fall_per_half_step_;
  }

  /// Columns first to first + width - 1, in the light's order.
  void chunk(int first, int width, bool east) {
    alignas(64) std::array<Lanes, kChunk> block;
    for (int k = 0; k < kLanes; ++k) {
      const float* const from = elevations_.row(row_ + 2 * std::min(k, lanes_ - 1)) + first;
      for (int c = 0; c < width; ++c) {
        // An infinity is void like a NaN.
        const double height = static_cast<double>(from[c]);
        block[static_cast<std::size_t>(c)][static_cast<std::size_t>(k)] =
            std::abs(height) <= std::numeric_limits<double>::max() ? height : kNoShadow;
      }
    }
    Lanes highest = highest_;
    for (int i = 0; i < width; ++i) {
      const int c = east ? i : width - 1 - i;
      const double fall = fallen(first + c, east);
      Lanes& lanes = block[static_cast<std::size_t>(c)];
      for (std::size_t k = 0; k < kLanes; ++k) {
        const double raised = lanes[k] + fall;
        const double held = highest[k];
        // At a caster S is its elevation, without a rounding.
        lanes[k] = raised >= held ? lanes[k] : held - fall;
        highest[k] = higher(raised, held);
      }
    }
    highest_ = highest;
    if (shadow_.data() == nullptr) return;
    for (int k = 0; k < lanes_; ++k) {
      float* const to = shadow_.row(row_ + 2 * k) + first;
      for (int c = 0; c < width; ++c) {
        to[c] = static_cast<float>(block[static_cast<std::size_t>(c)][static_cast<std::size_t>(k)]);
      }
    }
  }

  const TileShape& shape_;
  View2D<const float> elevations_;
  View2D<float> shadow_;
  ShadowLight light_;
  double fall_per_half_step_ = 0.0;
  int row_ = 0;
  int lanes_ = 0;
  Lanes highest_{};
};

}  // namespace

void tile_shadow(const TileGrid& grid, View2D<const float> elevations, const ShadowLight& light,
                 std::span<const double> entering, View2D<float> shadow, std::span<double> leaving) {
  const TileShape& shape = grid.shape();
  if (shadow.data() != nullptr) {
    const auto dark = static_cast<float>(kNoShadow);
    for (int r = 0; r < shape.rows(); ++r) {
      const bool padding = r == 0 || r == shape.rows() - 1;
      float* const row = shadow.row(r);
      if (padding) std::fill(row, row + shape.columns(), dark);
      row[0] = dark;
      std::fill(row + last_visible_column(shape, r) + 1, row + shape.columns(), dark);
    }
  }
  RowPass pass(grid, elevations, light, shadow);
  for (const int parity : {1, 2}) {
    for (int row = parity; row <= shape.rows() - 2; row += 2 * kLanes) {
      const int lanes = std::min(kLanes, (shape.rows() - 2 - row) / 2 + 1);
      pass.run(row, lanes, entering, leaving);
    }
  }
}

}  // namespace isohf
