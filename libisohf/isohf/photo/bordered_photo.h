#pragma once

#include "isohf/picture.h"

namespace isohf {

/// A photo with a transparent pixel around it, so that nothing is shown beyond it: where a picture is read beyond its
/// border, the border's pixels go on.
class BorderedPhoto : public PhotoSource {
 public:
  /// The photo has a georeference, and must outlive it.
  explicit BorderedPhoto(PhotoSource& photo);
  [[nodiscard]] const PhotoInfo& info() const override { return info_; }
  void set_cache_bytes(std::uint64_t bytes) override { photo_.set_cache_bytes(bytes); }
  void read_window(const Window& window, std::span<std::uint8_t> samples) override;

 private:
  PhotoSource& photo_;
  PhotoInfo info_;
};

}  // namespace isohf
