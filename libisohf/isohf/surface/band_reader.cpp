#include "isohf/surface/band_reader.h"

#include <algorithm>
#include <cstring>

#include "isohf/surface/source_scan.h"

namespace isohf {

std::shared_ptr<const Band> BandReader::read(const RowRange& rows) {
  auto band = std::make_shared<Band>();
  band->columns = source_.info().width;
  band->rows = rows;
  const auto columns = static_cast<std::size_t>(band->columns);
  band->heights.resize(columns * static_cast<std::size_t>(rows.last - rows.first + 1));
  std::int64_t next = rows.first;
  if (last_ && last_->rows.first <= rows.first && last_->rows.last >= rows.first) {
    const std::int64_t kept = std::min(last_->rows.last, rows.last) - rows.first + 1;
    std::memcpy(band->heights.data(),
                last_->heights.data() + static_cast<std::size_t>(rows.first - last_->rows.first) * columns,
                static_cast<std::size_t>(kept) * columns * sizeof(float));
    next += kept;
  }
  last_.reset();  // its memory goes as soon as the tiles that are cut from it are done
  const std::int64_t step = rows_per_read(source_.info());
  while (next <= rows.last) {
    // Reads end on multiples of the step, so that blocks are not asked for in two halves.
    const std::int64_t count = std::min(rows.last + 1, (next / step + 1) * step) - next;
    read_rows(next, count, band->heights.data() + static_cast<std::size_t>(next - rows.first) * columns);
    next += count;
  }
  last_ = band;
  return band;
}

void BandReader::read_rows(std::int64_t first, std::int64_t count, float* heights) {
  const SourceInfo& info = source_.info();
  const auto samples = static_cast<std::size_t>(count) * static_cast<std::size_t>(info.width);
  raw_.resize(samples * size_bytes(info.sample_type));
  source_.read_window({0, first, info.width, count}, raw_);
  heights_from_samples(info, datum_, raw_, {heights, samples});
}

}  // namespace isohf
