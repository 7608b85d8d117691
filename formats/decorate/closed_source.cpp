#include "formats/decorate/closed_source.h"

#include <fmt/format.h>

#include <utility>

namespace isohf {
namespace {

Window all_but_the_last_column(const SourceInfo& info) {
  return {0, 0, info.width - 1, info.height};
}

}  // namespace

ClosedSource::ClosedSource(std::unique_ptr<HeightSource> source)
    : ClosedSource(all_but_the_last_column(source->info()), std::move(source)) {}

ClosedSource::ClosedSource(const Window& window, std::unique_ptr<HeightSource>&& source)
    : WindowedSource(std::move(source), window) {
  mutable_info().warnings.push_back(
      fmt::format("{}: column {} is the first one again, 360 degrees on, and is left out", info().path, info().width));
}

}  // namespace isohf
