#include "isohf/sampling/source/band_reader.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <cstring>
#include <type_traits>

#include "isohf/base/assert.h"
#include "isohf/base/sample.h"

namespace isohf {
namespace {

constexpr std::uint64_t kReadBytes = std::uint64_t{8} << 20U;

std::size_t count_of(const RowRange& range) {
  return static_cast<std::size_t>(range.last - range.first + 1);
}

RowRange widened(const RowRange& range, std::int64_t by, std::int64_t size) {
  return {std::max<std::int64_t>(range.first - by, 0), std::min(range.last + by, size - 1)};
}

/// Bands differ by a row or two: room is made for these, and nothing is copied into new memory.
template <typename T>
void resize(std::vector<T>& values, std::size_t samples, std::size_t columns) {
  constexpr std::size_t kSpareRows = 4;
  if (values.capacity() < samples) {
    values = std::vector<T>();  // {} would keep the memory
    values.reserve(samples + kSpareRows * columns);
  }
  values.resize(samples);
}

}  // namespace

BandReader::BandReader(HeightSource& source, double datum, const Prefilter& prefilter, bool wraps)
    : own_rows_(std::make_unique<SourceRows>(source, ReadStep::make(source.info(), kReadBytes))),
      rows_(*own_rows_),
      datum_(datum),
      prefilter_(prefilter),
      wraps_(wraps) {}

BandReader::BandReader(SourceRows& rows, double datum, const Prefilter& prefilter, bool wraps)
    : rows_(rows), datum_(datum), prefilter_(prefilter), wraps_(wraps) {}

std::uint64_t BandReader::memory_bytes(const Prefilter& prefilter, std::int64_t bands, std::int64_t rows,
                                       std::int64_t columns, const SourceInfo& info) {
  const std::int64_t halo = prefilter.halo();
  const auto area = [&](std::int64_t r, std::int64_t c) {
    return static_cast<std::uint64_t>(std::min(r, info.height)) * static_cast<std::uint64_t>(std::min(c, info.width));
  };
  const std::uint64_t in_use = static_cast<std::uint64_t>(bands) * area(rows + 4, columns) * sizeof(float);
  if (prefilter.is_identity()) return in_use;
  return in_use + area(rows + 8 + 2 * halo, columns + 2 * halo) * (sizeof(float) + 1);
}

std::shared_ptr<Band> BandReader::make_band(const RowRange& rows, const RowRange& columns) const {
  std::shared_ptr<Band> band = recycled_.take([] { return std::make_unique<Band>(); });
  band->columns = static_cast<std::int64_t>(count_of(columns));
  band->first_column = columns.first;
  band->rows = rows;
  resize(band->heights, count_of(columns) * count_of(rows), count_of(columns));
  band->voids.clear();
  return band;
}

std::shared_ptr<const Band> BandReader::read(const RowRange& rows) {
  return read(rows, {0, rows_.info().width - 1});
}

std::shared_ptr<const Band> BandReader::read(const RowRange& rows, const RowRange& columns) {
  const auto band = make_band(rows, columns);
  if (prefilter_.is_identity()) {
    std::int64_t next = rows.first;
    if (last_ && last_->first_column == columns.first && last_->columns == band->columns &&
        last_->rows.first <= rows.first && last_->rows.last >= rows.first) {
      const std::int64_t kept = std::min(last_->rows.last, rows.last) - rows.first + 1;
      const auto skipped = static_cast<std::size_t>((rows.first - last_->rows.first) * band->columns);
      std::memcpy(band->heights.data(), last_->heights.data() + skipped,
                  static_cast<std::size_t>(kept * band->columns) * sizeof(float));
      next += kept;
    }
    last_.reset();  // its memory goes as soon as the tiles that are cut from it are done
    if (next <= rows.last) read_rows({next, rows.last}, *band);
    last_ = band;
    return band;
  }
  const SourceInfo& info = rows_.info();
  ISOHF_ASSERT(!wraps_ || count_of(columns) == static_cast<std::size_t>(info.width));
  const std::int64_t halo = prefilter_.halo();
  move_heights_to(widened(rows, halo, info.height), widened(columns, halo, info.width));
  const std::int64_t first = rows.first - filtered_.rows.first;
  const std::int64_t left = columns.first - filtered_.first_column;
  const View2D<const float> heights(filtered_.heights.data() + left, band->columns,
                                    static_cast<std::int64_t>(count_of(filtered_.rows)), filtered_.columns);
  const auto count = static_cast<std::int64_t>(count_of(rows));
  prefilter_.filter_columns(heights, first, {band->heights.data(), band->columns, count});
  const char* voids = filtered_.voids.data() + first * filtered_.columns + left;
  const auto width = static_cast<std::size_t>(band->columns);
  bool any = false;
  for (std::int64_t r = 0; r < count && !any; ++r) {
    any = std::memchr(voids + r * filtered_.columns, 1, width) != nullptr;
  }
  if (any) resize(band->voids, count_of(rows) * width, width);
  for (std::int64_t r = 0; r < count && any; ++r) {
    std::memcpy(band->voids.data() + static_cast<std::size_t>(r) * width, voids + r * filtered_.columns, width);
  }
  return band;
}

void BandReader::move_heights_to(const RowRange& rows, const RowRange& columns) {
  Band& band = filtered_;
  const std::size_t width = count_of(columns);
  const bool goes_on = band.first_column == columns.first && band.columns == static_cast<std::int64_t>(width) &&
                       band.rows.first <= rows.first && band.rows.last >= rows.first;
  const std::size_t kept = goes_on ? count_of({rows.first, std::min(band.rows.last, rows.last)}) : 0;
  const std::size_t skipped = goes_on ? static_cast<std::size_t>(rows.first - band.rows.first) * width : 0;
  const auto go_on = [&](auto& values) {
    // Not by resize(): what is kept must stay. The first band lacks the halo North of it.
    const auto spare = static_cast<std::size_t>(8 + (rows.first == 0 ? prefilter_.halo() : 0));
    if (values.capacity() < count_of(rows) * width) {
      if (kept == 0) values = std::decay_t<decltype(values)>();  // or both would be there for a while
      values.reserve((count_of(rows) + spare) * width);
    }
    if (kept > 0) std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(skipped), kept * width, values.begin());
    values.resize(count_of(rows) * width);
  };
  go_on(band.heights);
  go_on(band.voids);
  band.columns = static_cast<std::int64_t>(width);
  band.first_column = columns.first;
  band.rows = rows;
  const RowRange missing{rows.first + static_cast<std::int64_t>(kept), rows.last};
  if (missing.first > missing.last) return;
  try {
    read_rows(missing, band);
  } catch (...) {
    band.rows = {0, -1};
    throw;
  }
  float* heights = band.heights.data() + kept * width;
  char* voids = band.voids.data() + kept * width;
  const std::size_t samples = count_of(missing) * width;
  for (std::size_t i = 0; i < samples; ++i) voids[i] = heights[i] != heights[i] ? 1 : 0;
  prefilter_.filter_rows({heights, band.columns, static_cast<std::int64_t>(count_of(missing))}, wraps_);
}

void BandReader::read_rows(const RowRange& rows, Band& band) {
  const SourceInfo& info = rows_.info();
  const std::shared_ptr<const RawRows> raw = rows_.rows(rows);
  // Isolated: a thread that waits here must not take a tile of a pipeline in hand and come back late.
  oneapi::tbb::this_task_arena::isolate([&] {
    oneapi::tbb::parallel_for(
        oneapi::tbb::blocked_range<std::int64_t>(rows.first, rows.last + 1, 8), [&](const auto& part) {
          std::vector<std::byte> buffer;
          for (std::int64_t row = part.begin(); row < part.end(); ++row) {
            float* heights = band.heights.data() + (row - band.rows.first) * band.columns;
            heights_from_samples(info, datum_, raw->part(row, band.first_column, band.columns, buffer),
                                 {heights, static_cast<std::size_t>(band.columns)});
          }
        });
  });
}

}  // namespace isohf
