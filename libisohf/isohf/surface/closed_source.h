#pragma once

#include <memory>

#include "isohf/surface/height_source.h"

namespace isohf {

/// A source without its last column: that of a grid all the way round a body whose last column is its first one again.
class ClosedSource final : public HeightSource {
 public:
  /// At least two columns.
  explicit ClosedSource(std::unique_ptr<HeightSource> source);

  [[nodiscard]] const SourceInfo& info() const override { return info_; }
  void read_window(const Window& window, std::span<std::byte> samples) override;

 private:
  std::unique_ptr<HeightSource> source_;
  SourceInfo info_;
};

}  // namespace isohf
