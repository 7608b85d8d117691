#include "isohf/restore/shade/hillshade.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "isohf/light/relief.h"
#include "isohf/restore/ground_scale.h"

namespace isohf {
namespace {

/// Shades the rows that arrive, all but the last: its neighbours in the South come with the next ones.
class Hillshade {
 public:
  Hillshade(const Metadata& metadata, const ShadeOptions& options, const SampleGrid& grid)
      : floats_(options.floats),
        width_(static_cast<std::size_t>(grid.width)),
        height_(grid.height),
        datum_(metadata.statistics.min.value_or(0.0)),
        sun_(towards_sun(options.sun_azimuth_deg, options.sun_elevation_deg)) {
    const GroundScale scale = ground_scale(metadata);
    pixel_ = {grid.spacing_x * scale.x, grid.spacing_z * scale.z};
    metres_ = scale.elevation * options.exaggeration;
  }

  /// Some whole rows, from North to South; what can be shaded then.
  [[nodiscard]] std::vector<std::byte> add(std::span<const double> elevations) {
    const std::size_t held = heights_.size() / stride();
    const std::size_t added = elevations.size() / width_;
    heights_.resize((held + added) * stride());
    oneapi::tbb::parallel_for(std::size_t{0}, added, [&](std::size_t row) {
      add_row(elevations.subspan(row * width_, width_), heights_.data() + (held + row) * stride());
    });
    next_ += static_cast<std::int64_t>(added);
    const std::int64_t end = next_ == height_ ? next_ : next_ - 1;
    const std::size_t row_bytes = width_ * (floats_ ? sizeof(float) : 1);
    std::vector<std::byte> shaded(row_bytes * static_cast<std::size_t>(end - shaded_));
    oneapi::tbb::parallel_for(shaded_, end, [&](std::int64_t row) {
      shade_row(row, shaded.data() + row_bytes * static_cast<std::size_t>(row - shaded_));
    });
    shaded_ = end;
    const std::size_t kept = std::min<std::size_t>(held + added, 2);
    heights_.erase(heights_.begin(), heights_.end() - static_cast<std::ptrdiff_t>(kept * stride()));
    return shaded;
  }

 private:
  [[nodiscard]] std::size_t stride() const { return width_ + 2; }

  /// Beyond both ends the slope goes on.
  void add_row(std::span<const double> elevations, float* out) const {
    for (std::size_t i = 0; i < width_; ++i) out[1 + i] = static_cast<float>((elevations[i] - datum_) * metres_);
    out[0] = width_ > 1 ? 2.0F * out[1] - out[2] : out[1];
    out[width_ + 1] = width_ > 1 ? 2.0F * out[width_] - out[width_ - 1] : out[1];
  }

  /// One of the rows that are held.
  [[nodiscard]] const float* row_of(std::int64_t row) const {
    const auto from_last = static_cast<std::size_t>(next_ - row);
    return heights_.data() + heights_.size() - from_last * stride();
  }

  void shade_row(std::int64_t row, std::byte* out) const {
    const float* const here = row_of(row);
    std::vector<float> beyond(stride());
    const auto neighbour = [&](std::int64_t other) {
      if (other >= 0 && other < height_) return row_of(other);
      const std::int64_t opposite = 2 * row - other;
      const float* const inner = opposite >= 0 && opposite < height_ ? row_of(opposite) : here;
      for (std::size_t i = 0; i < beyond.size(); ++i) beyond[i] = 2.0F * here[i] - inner[i];
      return static_cast<const float*>(beyond.data());
    };
    std::vector<float> shares(width_);
    relief_hillshade({neighbour(row - 1) + 1, here + 1, neighbour(row + 1) + 1}, pixel_, sun_, shares);
    // A slope is known by a pixel's neighbours alone.
    for (std::size_t i = 0; i < width_; ++i) {
      if (std::isnan(here[1 + i])) shares[i] = std::numeric_limits<float>::quiet_NaN();
    }
    if (floats_) {
      std::copy(shares.begin(), shares.end(), static_cast<float*>(static_cast<void*>(out)));
    } else {
      bytes_from_shares(shares, {reinterpret_cast<std::uint8_t*>(out), width_});
    }
  }

  bool floats_;
  std::size_t width_;
  std::int64_t height_;
  double datum_;
  Normal sun_;
  PixelSize pixel_{};
  double metres_ = 1.0;  ///< as drawn, in one elevation unit
  std::int64_t next_ = 0;
  std::int64_t shaded_ = 0;
  std::vector<float> heights_;  ///< rows [-1...width], the last of which is next_ - 1
};

}  // namespace

void hillshade_rows(const ArchiveReader& archive, const ShadeOptions& options, const GridSize& size,
                    const TakeShadedRows& take, const Job& job) {
  const SampleGrid grid = grid_over(archive.metadata().valid, true, size, {});
  Hillshade hillshade(archive.metadata(), options, grid);
  RowReader(archive, grid, RestoreMethod::kBarycentric, job)
      .read_all(
          [&](std::int64_t /*first_row*/, std::span<const double> elevations) { take(hillshade.add(elevations)); },
          job);
}

}  // namespace isohf
