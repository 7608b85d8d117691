#include "isohf/fill/filled_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>

#include "isohf/base/handed_in.h"
#include "isohf/base/sample.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The smallest raw number whose elevation is at least `limit`, for a rising scale.
double first_raw_from(const SourceInfo& info, double limit) {
  const auto elevation = [&](double raw) { return raw * info.z_scale + info.z_offset; };
  double raw = (limit - info.z_offset) / info.z_scale;
  // Division and multiplication round; a few steps set that right.
  for (int i = 0; i < 8 && elevation(raw) < limit; ++i) raw = std::nextafter(raw, kInfinity);
  for (int i = 0; i < 8 && elevation(std::nextafter(raw, -kInfinity)) >= limit; ++i) {
    raw = std::nextafter(raw, -kInfinity);
  }
  return raw;
}

/// Raw limits of an elevation range. A falling scale is a rising one of negated raw numbers.
std::pair<double, double> raw_range(const SourceInfo& info, const std::pair<double, double>& elevations) {
  SourceInfo rising = info;
  rising.z_scale = std::abs(info.z_scale);
  SourceInfo negated = rising;
  negated.z_offset = -info.z_offset;
  const double low = first_raw_from(rising, elevations.first);
  const double high = -first_raw_from(negated, -elevations.second);
  return info.z_scale > 0.0 ? std::pair(low, high) : std::pair(-high, -low);
}

/// Rows that are read at once: about 8 MiB of whole blocks; parts of a block that is much higher.
std::int64_t chunk_rows(const SourceInfo& info) {
  constexpr std::int64_t kChunkBytes = std::int64_t{8} << 20;
  const std::int64_t row_bytes = static_cast<std::int64_t>(size_bytes(info.sample_type)) * info.width;
  const std::int64_t block_rows = std::clamp<std::int64_t>(info.block_height, 1, info.height);
  if (row_bytes * block_rows > 4 * kChunkBytes) return std::max<std::int64_t>(1, kChunkBytes / row_bytes);
  return std::min(info.height, std::max<std::int64_t>(1, kChunkBytes / (row_bytes * block_rows)) * block_rows);
}

/// Rows that are filled together where what they look at is in a file.
std::int64_t rows_together(const SourceInfo& info) {
  constexpr std::int64_t kBytes = std::int64_t{32} << 20;
  const std::int64_t row_bytes = static_cast<std::int64_t>(size_bytes(info.sample_type)) * info.width;
  return std::clamp<std::int64_t>(kBytes / row_bytes, 1, VoidFiller::kRowsAtOnce);
}

SourceInfo treated_info(const SourceInfo& info, const VoidTreatment& treatment) {
  SourceInfo treated = info;
  if (treatment.valid_range) {
    const auto [low, high] = *treatment.valid_range;
    if (!(std::isfinite(low) && std::isfinite(high) && low < high)) {
      throw Error(
          ErrorCode::kInvalidArgument,
          fmt::format("{}: the valid range is {}:{}, must be two numbers, the smaller first", info.path, low, high));
    }
    const auto [raw_low, raw_high] = raw_range(info, *treatment.valid_range);
    treated.valid_min = std::max(info.valid_min, raw_low);
    treated.valid_max = std::min(info.valid_max, raw_high);
    // What a reader takes for undeclared voids is in the range or it is not; a survey says so where it still is.
    std::erase_if(treated.warnings,
                  [](const Warning& warning) { return warning.kind == Warning::Kind::kUndeclaredNodata; });
  }
  treated.valid_range = treatment.valid_range;
  treated.fill_distance = treatment.distance();
  return treated;
}

/// 1 where a sample is void.
void find_voids(const SourceInfo& info, std::span<const std::byte> raw, std::span<char> voids) {
  constexpr std::size_t kAtOnce = std::size_t{1} << 16U;
  std::vector<float> heights;
  const std::size_t size = size_bytes(info.sample_type);
  for (std::size_t from = 0; from < voids.size(); from += kAtOnce) {
    heights.resize(std::min(kAtOnce, voids.size() - from));
    heights_from_samples(info, 0.0, raw.subspan(from * size, heights.size() * size), heights);
    for (std::size_t i = 0; i < heights.size(); ++i) voids[from + i] = heights[i] != heights[i] ? 1 : 0;
  }
}

}  // namespace

/// Some rows as the other source has them. Samples and voids may be in the file instead, one behind the other.
struct FilledSource::Chunk {
  std::int64_t first_row = 0;
  std::int64_t rows = 0;
  std::vector<std::byte> raw;
  std::vector<char> voids;                 ///< 1 for each void sample
  std::vector<std::int64_t> voids_in_row;  ///< [rows]
};

FilledSource::FilledSource(std::unique_ptr<HeightSource> source, const VoidTreatment& treatment,
                           const ScratchFolder& scratch)
    : source_(std::move(source)),
      info_(treated_info(source_->info(), treatment)),
      filler_(info_, treatment.distance()),
      chunk_rows_(chunk_rows(info_)) {
  if (scratch) file_.emplace(static_cast<std::uint64_t>(info_.width) * (size_bytes(info_.sample_type) + 1), *scratch);
}

FilledSource::~FilledSource() = default;

std::unique_ptr<FilledSource::Chunk> FilledSource::read_chunk(std::int64_t index) {
  auto chunk = std::make_unique<Chunk>();
  chunk->first_row = index * chunk_rows_;
  chunk->rows = std::min(chunk_rows_, info_.height - chunk->first_row);
  const auto samples = static_cast<std::size_t>(chunk->rows * info_.width);
  chunk->raw.resize(samples * size_bytes(info_.sample_type));
  source_->read_window({0, chunk->first_row, info_.width, chunk->rows}, chunk->raw);
  chunk->voids.resize(samples);
  find_voids(info_, chunk->raw, chunk->voids);
  for (std::int64_t row = 0; row < chunk->rows; ++row) {
    const char* const voids = chunk->voids.data() + row * info_.width;
    chunk->voids_in_row.push_back(std::accumulate(voids, voids + info_.width, std::int64_t{0}));
  }
  if (!file_) return chunk;
  const auto width = static_cast<std::size_t>(info_.width);
  const std::size_t row_bytes = chunk->raw.size() / static_cast<std::size_t>(chunk->rows);
  for (std::size_t row = 0; row < chunk->voids_in_row.size(); ++row) {
    const std::int64_t at = chunk->first_row + static_cast<std::int64_t>(row);
    file_->add(at);
    file_->write(at, 0, std::span(chunk->raw).subspan(row * row_bytes, row_bytes));
    file_->write(at, row_bytes, std::as_bytes(std::span(chunk->voids).subspan(row * width, width)));
  }
  chunk->raw = std::vector<std::byte>();  // = {} would keep the memory
  chunk->voids = std::vector<char>();
  return chunk;
}

void FilledSource::drop_chunk(const Chunk& chunk) {
  for (std::int64_t row = chunk.first_row; file_ && row < chunk.first_row + chunk.rows; ++row) file_->drop(row);
}

/// Has the rows at hand, with whatever lies between them and those that are.
void FilledSource::have_rows(std::int64_t first, std::int64_t end) {
  const std::int64_t first_chunk = first / chunk_rows_;
  const std::int64_t last_chunk = (end - 1) / chunk_rows_;
  const auto index_of = [&](const std::unique_ptr<Chunk>& chunk) { return chunk->first_row / chunk_rows_; };
  if (chunks_.empty() || last_chunk < index_of(chunks_.front()) - 1 || first_chunk > index_of(chunks_.back()) + 1) {
    for (const std::unique_ptr<Chunk>& chunk : chunks_) drop_chunk(*chunk);
    chunks_.clear();
    chunks_.push_back(read_chunk(first_chunk));
  }
  while (index_of(chunks_.front()) > first_chunk) chunks_.push_front(read_chunk(index_of(chunks_.front()) - 1));
  while (index_of(chunks_.back()) < last_chunk) chunks_.push_back(read_chunk(index_of(chunks_.back()) + 1));
}

void FilledSource::drop_rows_before(std::int64_t row) {
  while (!chunks_.empty() && chunks_.front()->first_row + chunks_.front()->rows <= row) {
    drop_chunk(*chunks_.front());
    chunks_.pop_front();
  }
}

const FilledSource::Chunk& FilledSource::chunk_of(std::int64_t row) const {
  return *chunks_[static_cast<std::size_t>((row - chunks_.front()->first_row) / chunk_rows_)];
}

std::int64_t FilledSource::voids_in(std::int64_t row) const {
  const Chunk& chunk = chunk_of(row);
  return chunk.voids_in_row[static_cast<std::size_t>(row - chunk.first_row)];
}

VoidRows FilledSource::rows_at(std::int64_t first, std::int64_t end, std::int64_t column,
                               std::int64_t end_column) const {
  VoidRows rows;
  rows.first = first;
  if (file_) {
    const std::size_t size = size_bytes(info_.sample_type);
    const auto columns = static_cast<std::size_t>(end_column - column);
    rows.column = column;
    rows.read.resize(columns * (size + 1) * static_cast<std::size_t>(end - first));
    for (std::int64_t row = first; row < end; ++row) {
      const auto all = std::span(rows.read).subspan(columns * (size + 1) * static_cast<std::size_t>(row - first));
      const std::span<std::byte> raw = all.first(columns * size);
      const std::span<std::byte> voids = all.subspan(columns * size, columns);
      const auto from = static_cast<std::uint64_t>(column);
      file_->read(row, from * size, raw);
      if (voids_in(row) > 0) file_->read(row, static_cast<std::uint64_t>(info_.width) * size + from, voids);
      rows.raw.push_back(raw.data());
      rows.voids.push_back(voids_in(row) > 0 ? reinterpret_cast<const char*>(voids.data()) : nullptr);
    }
    return rows;
  }
  for (std::int64_t row = first; row < end; ++row) {
    const Chunk& chunk = chunk_of(row);
    const auto samples = static_cast<std::size_t>((row - chunk.first_row) * info_.width);
    rows.raw.push_back(chunk.raw.data() + samples * size_bytes(info_.sample_type));
    rows.voids.push_back(voids_in(row) > 0 ? chunk.voids.data() + samples : nullptr);
  }
  return rows;
}

void FilledSource::read_window(const Window& window, std::span<std::byte> samples) {
  const std::size_t size = size_bytes(info_.sample_type);
  require_window(info_.path, info_.width, info_.height, window, size, samples.size());
  if (samples.empty()) return;
  if (window.columns == info_.width) return read_rows(window.row, window.row + window.rows, samples);
  // Whole rows are filled at once, a few of them at a time: of a --bbox all windows are narrower.
  const auto row_bytes = static_cast<std::size_t>(info_.width) * size;
  const std::size_t out_bytes = static_cast<std::size_t>(window.columns) * size;
  const std::int64_t at_once = std::min(VoidFiller::kRowsAtOnce, chunk_rows_);
  std::vector<std::byte> rows(static_cast<std::size_t>(std::min(window.rows, at_once)) * row_bytes);
  for (std::int64_t first = 0; first < window.rows; first += at_once) {
    const auto count = static_cast<std::size_t>(std::min(window.rows - first, at_once));
    read_rows(window.row + first, window.row + first + static_cast<std::int64_t>(count),
              std::span(rows).first(count * row_bytes));
    for (std::size_t row = 0; row < count; ++row) {
      std::memcpy(samples.data() + (static_cast<std::size_t>(first) + row) * out_bytes,
                  rows.data() + row * row_bytes + static_cast<std::size_t>(window.column) * size, out_bytes);
    }
  }
}

void FilledSource::read_rows(std::int64_t first, std::int64_t end, std::span<std::byte> samples) {
  if (!file_) return make_rows(first, end, samples);
  const auto row_bytes = static_cast<std::size_t>(info_.width) * size_bytes(info_.sample_type);
  const std::int64_t together = rows_together(info_);
  for (std::int64_t row = first; row < end; ++row) {
    const std::int64_t begin = row / together * together;
    if (made_.empty() || begin != first_made_) {
      made_ = std::vector<std::byte>();
      const std::int64_t stop = std::min(begin + together, info_.height);
      std::vector<std::byte> rows(static_cast<std::size_t>(stop - begin) * row_bytes);
      make_rows(begin, stop, rows);
      made_ = std::move(rows);
      first_made_ = begin;
    }
    std::copy_n(made_.begin() + (row - begin) * static_cast<std::ptrdiff_t>(row_bytes), row_bytes,
                samples.begin() + (row - first) * static_cast<std::ptrdiff_t>(row_bytes));
  }
}

void FilledSource::make_rows(std::int64_t first, std::int64_t end, std::span<std::byte> samples) {
  const auto row_bytes = static_cast<std::size_t>(info_.width) * size_bytes(info_.sample_type);
  const std::int64_t reach = info_.fill_distance > 0 ? filler_.reach() : 0;
  for (std::int64_t row = first; row < end;) {
    const std::int64_t stop = file_ ? end : std::min(end, (row / chunk_rows_ + 1) * chunk_rows_);
    drop_rows_before(row - reach);
    have_rows(row, stop);
    const auto out = samples.subspan(static_cast<std::size_t>(row - first) * row_bytes,
                                     static_cast<std::size_t>(stop - row) * row_bytes);
    for (std::int64_t at = row; at < stop; ++at) {
      const auto to = out.subspan(static_cast<std::size_t>(at - row) * row_bytes).first(row_bytes);
      const Chunk& chunk = chunk_of(at);
      if (file_) {
        file_->read(at, 0, to);
      } else {
        std::copy_n(chunk.raw.begin() + (at - chunk.first_row) * static_cast<std::ptrdiff_t>(row_bytes), row_bytes,
                    to.begin());
      }
    }
    treat_rows(row, stop, out);
    row = stop;
  }
}

/// Fills what is void in rows that have been copied out, and counts.
void FilledSource::treat_rows(std::int64_t first, std::int64_t end, std::span<std::byte> samples) {
  const auto row_bytes = static_cast<std::size_t>(info_.width) * size_bytes(info_.sample_type);
  for (std::int64_t row = first; row < end;) {
    const std::int64_t stop = std::min(end, row + VoidFiller::kRowsAtOnce);
    std::vector<std::int64_t> filled(static_cast<std::size_t>(stop - row), 0);
    std::vector<std::int64_t> found;
    for (std::int64_t at = row; at < stop; ++at) found.push_back(voids_in(at));
    const bool any = std::any_of(found.begin(), found.end(), [](std::int64_t voids) { return voids > 0; });
    if (any) count_out_of_range(row, stop);
    if (any && info_.fill_distance > 0) {
      const std::int64_t from = std::max<std::int64_t>(row - filler_.reach(), 0);
      const std::int64_t to = std::min(stop + filler_.reach(), info_.height);
      have_rows(from, to);
      const auto read = [this](auto... place) { return rows_at(place...); };
      filled = filler_.fill(read, row, stop,
                            samples.subspan(static_cast<std::size_t>(row - first) * row_bytes,
                                            static_cast<std::size_t>(stop - row) * row_bytes));
    }
    for (std::int64_t at = row; at < stop; ++at) {
      if (at != counts_.rows) continue;
      const auto i = static_cast<std::size_t>(at - row);
      ++counts_.rows;
      counts_.found += found[i];
      counts_.filled += filled[i];
      counts_.left += found[i] - filled[i];
    }
    row = stop;
  }
}

/// Voids that are none for the other source.
void FilledSource::count_out_of_range(std::int64_t first, std::int64_t end) {
  if (!info_.valid_range || first > counts_.rows) return;
  const std::size_t row_bytes = static_cast<std::size_t>(info_.width) * size_bytes(info_.sample_type);
  std::vector<char> voids(static_cast<std::size_t>(info_.width));
  for (std::int64_t row = std::max(first, counts_.rows); row < end; ++row) {
    if (voids_in(row) == 0) continue;
    const VoidRows here = rows_at(row, row + 1, 0, info_.width);
    find_voids(source_->info(), {here.raw.front(), row_bytes}, voids);
    counts_.by_valid_range += voids_in(row) - std::accumulate(voids.begin(), voids.end(), std::int64_t{0});
  }
}

std::uint64_t fill_memory_bytes(const SourceInfo& info, bool in_scratch) {
  if (!info.valid_range && info.fill_distance == 0) return 0;
  const bool fills = info.fill_distance > 0;
  const auto width = static_cast<double>(info.width);
  const auto height = static_cast<double>(info.height);
  const auto step = static_cast<double>(chunk_rows(info));
  const double sample = static_cast<double>(size_bytes(info.sample_type)) + 1.0;  // a byte tells voids
  const VoidFiller filler(info, info.fill_distance);
  const double reach = fills ? static_cast<double>(filler.reach()) : 0.0;
  const double rows = in_scratch ? step : std::ceil(2.0 * reach / step + 2.0) * step;
  const double held = std::min(rows, height) * width * sample;
  // Rows of which only a part is wanted.
  const auto most = static_cast<double>(VoidFiller::kRowsAtOnce);
  const double at_once = in_scratch ? static_cast<double>(rows_together(info)) : std::min(most, step);
  const double narrow = std::min(at_once + (in_scratch ? step : 0.0), height) * width * sample;
  if (!fills) return static_cast<std::uint64_t>(held + narrow);
  const double read =
      in_scratch ? (at_once + 2.0 * reach) * static_cast<double>(filler.columns_at_once()) * sample : 0.0;
  // Boxes of changing sizes leave gaps in the heap (measured).
  const double boxes = 1.5 * (read + filler.memory_bytes(static_cast<std::int64_t>(at_once)));
  return static_cast<std::uint64_t>(held + narrow + boxes);
}

std::uint64_t FilledSource::buffer_bytes() const {
  return source_->buffer_bytes() + fill_memory_bytes(info_, file_.has_value());
}

std::optional<VoidCounts> void_counts(const HeightSource& source, std::optional<std::int64_t> voids) {
  const std::int64_t rows = source.info().height;
  if (const auto* filled = dynamic_cast<const FilledSource*>(&source))
    return filled->counts().rows == rows ? std::optional(filled->counts()) : std::nullopt;
  if (!voids) return std::nullopt;
  VoidCounts counts;
  counts.rows = rows;
  counts.found = counts.left = *voids;
  return counts;
}

std::unique_ptr<HeightSource> with_voids_treated(std::unique_ptr<HeightSource> source, const VoidTreatment& treatment,
                                                 const Job& job) {
  if (!source) throw Error(ErrorCode::kInvalidArgument, "there is no source whose voids could be treated");
  const std::string& path = source->info().path;
  const std::int64_t distance = treatment.fill_distance.value_or(0);
  if (distance < 0 || distance > kMaxFillDistance) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: the fill distance is {} samples, must be 0 to {}", path, distance, kMaxFillDistance));
  }
  if (!treatment.does_anything()) return source;
  require_source(source->info());
  const std::uint64_t in_memory = fill_memory_bytes(treated_info(source->info(), treatment), false);
  const bool in_scratch = job.bound_bytes() != 0 && in_memory > job.bound_bytes() / 3;
  return std::make_unique<FilledSource>(std::move(source), treatment,
                                        in_scratch ? ScratchFolder(job.scratch_folder) : std::nullopt);
}

}  // namespace isohf
