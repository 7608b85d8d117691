#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "isohf/photo/texture_cutter.h"
#include "isohf/picture.h"
#include "isohf/sampling/resample/source_warp.h"

namespace isohf {

/// A photo in degrees as pixels of a projected world.
///
/// A pixel of the world is the photo's mean, in light and weighted by alpha, over a box around the pixel's place in the
/// photo: as wide and as high as the pixel is there, and linearly interpolated where it is smaller than the photo's
/// pixels. Beyond the photo its border pixels go on; a photo all the way round has no border in the East and West.
/// Where the map shows no place all channels are 0.
///
/// Places come from the inverse projection at the corners of blocks of 64 x 64 pixels, linearly in between, which is
/// checked at 21 places of the block; where one is off by more than half of kTolerance the block is cut in four. Each
/// pixel is a pure function of its own place, whatever the window.
class ProjectedPhoto final : public PhotoSource {
 public:
  static constexpr double kTolerance = 1.0 / 32.0;  ///< of a place, in the photo's pixels, along either axis

  /// `place` says where `photo` lies, `frame`, `width` and `height` the pixels to make. `photo` must outlive this.
  ProjectedPhoto(PhotoSource& photo, const WarpPlace& place, const PhotoFrame& frame, std::int64_t width,
                 std::int64_t height);

  [[nodiscard]] const PhotoInfo& info() const override { return info_; }
  /// The photo's cache: of its own pixels.
  void set_cache_bytes(std::uint64_t bytes) override { photo_.set_cache_bytes(bytes); }

  /// O(pixels of the window and of the photo below it). Memory: kWindowBytes beside the window's places, 16 bytes each.
  void read_window(const Window& window, std::span<std::uint8_t> samples) override;

  /// True where the middle of any of the window's pixels lies on the photo.
  [[nodiscard]] bool shows(const Window& window) const;

  static constexpr std::uint64_t kWindowBytes = std::uint64_t{8} << 20U;

 private:
  struct Places;
  struct Footprint;
  class Loaded;

  [[nodiscard]] SourcePosition at(double column, double row) const;
  [[nodiscard]] SourcePosition at(double column, double row, double near_u) const;
  [[nodiscard]] Places places_of(const Window& window) const;
  void fill(const Window& block, Places& places) const;
  [[nodiscard]] Footprint footprint(const Places& places, std::int64_t column, std::int64_t row) const;
  void average(const Window& part, const Places& places, std::vector<double>& sums);

  PhotoSource& photo_;
  ExactWarp warp_;
  PhotoFrame frame_;
  PhotoInfo info_;
  double round_;     ///< photo columns all the way round
  bool goes_round_;  ///< the photo has that many
};

}  // namespace isohf
