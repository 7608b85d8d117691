#include "formats/adapters/windowed_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "isohf/base/assert.h"
#include "isohf/base/sample.h"

namespace isohf {
namespace {

Window all_but_the_last_column(const SourceInfo& info) {
  return {0, 0, info.width - 1, info.height};
}

/// A row, of some between the first and the last, in which the last column does not hold what the first does.
std::optional<std::int64_t> row_that_differs(HeightSource& source) {
  constexpr std::int64_t kRows = 16;
  const SourceInfo& info = source.info();
  std::vector<std::byte> first(size_bytes(info.sample_type));
  std::vector<std::byte> last(first.size());
  for (std::int64_t i = 0; i < kRows; ++i) {
    const std::int64_t row = (info.height - 1) * i / (kRows - 1);
    source.read_window({0, row, 1, 1}, first);
    source.read_window({info.width - 1, row, 1, 1}, last);
    if (first != last) return row;
  }
  return std::nullopt;
}

}  // namespace

WindowedSource::WindowedSource(HeightSource& source, const Window& window)
    : source_(source), window_(window), info_(source.info()) {
  ISOHF_ASSERT(window.column >= 0 && window.columns >= 1 && window.column + window.columns <= info_.width);
  ISOHF_ASSERT(window.row >= 0 && window.rows >= 1 && window.row + window.rows <= info_.height);
  info_.width = window.columns;
  info_.height = window.rows;
  info_.block_width = std::min(info_.block_width, info_.width);
  Georeference& place = info_.georeference;
  place.origin_x += static_cast<double>(window.column) * place.spacing_x;
  place.origin_y -= static_cast<double>(window.row) * place.spacing_y;
}

WindowedSource::WindowedSource(std::unique_ptr<HeightSource> source, const Window& window)
    : WindowedSource(*source, window) {
  own_ = std::move(source);
  HeightSource& stored = source_.as_stored();
  if (&stored != &source_) stored_.reset(new WindowedSource(stored, window));
}

WindowedSource::~WindowedSource() = default;

void WindowedSource::read_window(const Window& window, std::span<std::byte> samples) {
  ISOHF_ASSERT(window.column >= 0 && window.row >= 0);
  ISOHF_ASSERT(window.column + window.columns <= info_.width && window.row + window.rows <= info_.height);
  source_.read_window({window_.column + window.column, window_.row + window.row, window.columns, window.rows}, samples);
}

ClosedSource::ClosedSource(std::unique_ptr<HeightSource> source)
    : ClosedSource(all_but_the_last_column(source->info()), std::move(source)) {}

ClosedSource::ClosedSource(const Window& window, std::unique_ptr<HeightSource>&& source)
    : ClosedSource(window, std::move(source), row_that_differs(*source)) {}

ClosedSource::ClosedSource(const Window& window, std::unique_ptr<HeightSource>&& source,
                           std::optional<std::int64_t> other_row)
    : WindowedSource(std::move(source), window) {
  mutable_info().repeats_column = true;
  if (!other_row) return;
  mutable_info().warnings.push_back(loss(
      fmt::format("{}: column {} is the first one again, 360 degrees on, and is left out, although its samples are "
                  "others: in row {}, for one",
                  info().path, info().width, *other_row)));
}

}  // namespace isohf
