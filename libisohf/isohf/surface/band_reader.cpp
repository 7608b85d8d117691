#include "isohf/surface/band_reader.h"

#include <algorithm>
#include <cstring>
#include <mutex>

namespace isohf {

std::int64_t rows_per_read(const SourceInfo& info) {
  constexpr std::int64_t kReadBytes = std::int64_t{8} << 20;
  const auto row_bytes = static_cast<std::int64_t>(size_bytes(info.sample_type)) * info.width;
  const std::int64_t block_rows = std::clamp<std::int64_t>(info.block_height, 1, info.height);
  const std::int64_t blocks = std::max<std::int64_t>(1, kReadBytes / (row_bytes * block_rows));
  // A strip may be as high as the picture; it is read in parts then.
  if (row_bytes * block_rows > 4 * kReadBytes) return std::max<std::int64_t>(1, kReadBytes / row_bytes);
  return std::min(info.height, blocks * block_rows);
}

namespace {

/// Bands differ by a row or two: room is made for these, and nothing is copied into new memory.
template <typename T>
void resize(std::vector<T>& values, std::size_t samples, std::size_t columns) {
  constexpr std::size_t kSpareRows = 4;
  if (values.capacity() < samples) {
    values = {};
    values.reserve(samples + kSpareRows * columns);
  }
  values.resize(samples);
}

}  // namespace

/// Takes bands back on whatever thread drops them last.
class BandReader::Pool {
 public:
  [[nodiscard]] std::unique_ptr<Band> take() {
    const std::lock_guard lock(mutex_);
    if (bands_.empty()) return std::make_unique<Band>();
    std::unique_ptr<Band> band = std::move(bands_.back());
    bands_.pop_back();
    return band;
  }
  void give_back(std::unique_ptr<Band> band) {
    const std::lock_guard lock(mutex_);
    bands_.push_back(std::move(band));
  }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<Band>> bands_;
};

BandReader::BandReader(HeightSource& source, double datum, const Prefilter& prefilter)
    : source_(source), datum_(datum), prefilter_(prefilter), pool_(std::make_shared<Pool>()) {}

std::shared_ptr<Band> BandReader::make_band(const RowRange& rows, bool with_voids) const {
  std::shared_ptr<Band> band(pool_->take().release(),
                             [pool = pool_](Band* dropped) { pool->give_back(std::unique_ptr<Band>(dropped)); });
  band->columns = source_.info().width;
  band->rows = rows;
  const auto columns = static_cast<std::size_t>(band->columns);
  const std::size_t samples = columns * static_cast<std::size_t>(rows.last - rows.first + 1);
  resize(band->heights, samples, columns);
  resize(band->voids, with_voids ? samples : 0, columns);
  return band;
}

std::shared_ptr<const Band> BandReader::read(const RowRange& rows) {
  if (prefilter_.is_identity()) return read_heights(rows);
  const std::int64_t halo = prefilter_.halo();
  const auto heights = read_heights(
      {std::max<std::int64_t>(rows.first - halo, 0), std::min(rows.last + halo, source_.info().height - 1)});
  const auto band = make_band(rows, false);
  const std::int64_t count = rows.last - rows.first + 1;
  const auto voids = heights->voids.begin() + (rows.first - heights->rows.first) * band->columns;
  if (std::find(voids, voids + count * band->columns, 1) != voids + count * band->columns) {
    band->voids.assign(voids, voids + count * band->columns);
  }
  prefilter_.filter_columns(heights->view().heights, rows.first - heights->rows.first,
                            {band->heights.data(), band->columns, count});
  return band;
}

std::shared_ptr<const Band> BandReader::read_heights(const RowRange& rows) {
  const auto band = make_band(rows, !prefilter_.is_identity());
  const auto columns = static_cast<std::size_t>(band->columns);
  std::int64_t next = rows.first;
  if (last_ && last_->rows.first <= rows.first && last_->rows.last >= rows.first) {
    const std::int64_t kept = std::min(last_->rows.last, rows.last) - rows.first + 1;
    const std::size_t skipped = static_cast<std::size_t>(rows.first - last_->rows.first) * columns;
    const std::size_t samples = static_cast<std::size_t>(kept) * columns;
    std::memcpy(band->heights.data(), last_->heights.data() + skipped, samples * sizeof(float));
    if (!band->voids.empty()) std::memcpy(band->voids.data(), last_->voids.data() + skipped, samples);
    next += kept;
  }
  last_.reset();  // its memory goes as soon as the tiles that are cut from it are done
  const std::int64_t step = rows_per_read(source_.info());
  while (next <= rows.last) {
    // Reads end on multiples of the step, so that blocks are not asked for in two halves.
    const std::int64_t count = std::min(rows.last + 1, (next / step + 1) * step) - next;
    const std::size_t at = static_cast<std::size_t>(next - rows.first) * columns;
    read_rows(next, count, band->heights.data() + at, band->voids.empty() ? nullptr : band->voids.data() + at);
    next += count;
  }
  last_ = band;
  return band;
}

void BandReader::read_rows(std::int64_t first, std::int64_t count, float* heights, char* voids) {
  const SourceInfo& info = source_.info();
  const auto samples = static_cast<std::size_t>(count) * static_cast<std::size_t>(info.width);
  raw_.resize(samples * size_bytes(info.sample_type));
  source_.read_window({0, first, info.width, count}, raw_);
  heights_from_samples(info, datum_, raw_, {heights, samples});
  if (prefilter_.is_identity()) return;
  for (std::size_t i = 0; i < samples; ++i) voids[i] = heights[i] != heights[i] ? 1 : 0;
  prefilter_.filter_rows({heights, info.width, count});
}

}  // namespace isohf
