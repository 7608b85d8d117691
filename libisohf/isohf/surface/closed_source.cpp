#include "isohf/surface/closed_source.h"

#include <fmt/format.h>

namespace isohf {

ClosedSource::ClosedSource(std::unique_ptr<HeightSource> source) : source_(std::move(source)), info_(source_->info()) {
  --info_.width;
  if (info_.block_width > info_.width) info_.block_width = info_.width;
  info_.warnings.push_back(
      fmt::format("{}: column {} is the first one again, 360 degrees on, and is left out", info_.path, info_.width));
}

void ClosedSource::read_window(const Window& window, std::span<std::byte> samples) {
  source_->read_window(window, samples);
}

}  // namespace isohf
