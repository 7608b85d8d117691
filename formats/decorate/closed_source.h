#pragma once

#include <memory>

#include "formats/decorate/windowed_source.h"

namespace isohf {

/// A source without its last column: that of a grid all the way round a body whose last column is its first one again.
class ClosedSource final : public WindowedSource {
 public:
  /// At least two columns.
  explicit ClosedSource(std::unique_ptr<HeightSource> source);

 private:
  ClosedSource(const Window& window, std::unique_ptr<HeightSource>&& source);
};

}  // namespace isohf
