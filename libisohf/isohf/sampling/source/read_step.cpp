#include "isohf/sampling/source/read_step.h"

#include <algorithm>

#include "isohf/base/sample.h"

namespace isohf {
ReadStep ReadStep::make(const SourceInfo& info, std::uint64_t bytes) {
  const auto wanted = static_cast<std::int64_t>(std::max<std::uint64_t>(bytes, 1));
  const auto sample = static_cast<std::int64_t>(size_bytes(info.sample_type));
  const std::int64_t row = sample * info.width;
  const std::int64_t block_rows = std::clamp<std::int64_t>(info.block_height, 1, info.height);
  const bool is_tiled = info.block_width > 0 && info.block_width < info.width;
  if (row * block_rows <= wanted) return {std::min(info.height, wanted / (row * block_rows) * block_rows), info.width};
  if (!is_tiled) return {std::clamp<std::int64_t>(wanted / row, 1, block_rows), info.width};
  const std::int64_t blocks = std::max<std::int64_t>(1, wanted / (sample * block_rows * info.block_width));
  return {block_rows, std::min(info.width, blocks * info.block_width)};
}

std::uint64_t ReadStep::most_bytes(const SourceInfo& info) const {
  // The last window takes up to one more: see windows().
  const std::int64_t widest = columns >= info.width ? info.width : std::min(info.width, 2 * columns - 1);
  return static_cast<std::uint64_t>(rows) * static_cast<std::uint64_t>(widest) * size_bytes(info.sample_type);
}

std::vector<Window> ReadStep::windows(const SourceInfo& info, std::int64_t first) const {
  std::vector<Window> found;
  const std::int64_t count = std::min(rows, info.height - first);
  for (std::int64_t column = 0; column < info.width;) {
    const bool is_last = info.width - column < 2 * columns;  // what is left would be narrow
    const std::int64_t width = is_last ? info.width - column : columns;
    found.push_back({column, first, width, count});
    column += width;
  }
  return found;
}

SourceSurvey survey_whole(HeightSource& source, const Job& job) {
  const SourceInfo& info = source.info();
  constexpr std::uint64_t kReadBytes = std::uint64_t{8} << 20U;
  const ReadStep step = ReadStep::make(info, kReadBytes);
  SourceSurvey survey(info, true);
  std::vector<std::byte> raw;
  for (std::int64_t row = 0; row < info.height; row += step.rows) {
    for (const Window& window : step.windows(info, row)) {
      job.throw_if_cancelled();
      if (source.is_gap(window)) {
        survey.add_voids(window.columns * window.rows);
        continue;
      }
      raw.resize(static_cast<std::size_t>(window.columns * window.rows) * size_bytes(info.sample_type));
      source.read_window(window, raw);
      survey.add(raw);
    }
    job.report({"statistics", "rows", std::min(row + step.rows, info.height), info.height});
  }
  return survey;
}

}  // namespace isohf
