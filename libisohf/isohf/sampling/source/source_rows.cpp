#include "isohf/sampling/source/source_rows.h"

#include <algorithm>
#include <cstring>

#include "isohf/base/assert.h"
#include "isohf/error.h"

namespace isohf {
namespace {

std::size_t row_bytes_of(const SourceInfo& info) {
  return static_cast<std::size_t>(info.width) * size_bytes(info.sample_type);
}

}  // namespace

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

struct SourceRows::Slab {
  std::int64_t first = 0;
  std::int64_t rows = 0;
  std::unique_ptr<std::byte[]> raw;
};

class SourceRows::SlabRows final : public RawRows {
 public:
  SlabRows(std::vector<std::shared_ptr<const Slab>> slabs, std::int64_t slab_rows, const SourceInfo& info)
      : slabs_(std::move(slabs)),
        slab_rows_(slab_rows),
        row_bytes_(row_bytes_of(info)),
        sample_bytes_(size_bytes(info.sample_type)) {}

  [[nodiscard]] std::span<const std::byte> part(std::int64_t row, std::int64_t column, std::int64_t count,
                                                std::vector<std::byte>& /*buffer*/) const override {
    const Slab& slab = *slabs_[static_cast<std::size_t>((row - slabs_.front()->first) / slab_rows_)];
    return {slab.raw.get() + static_cast<std::size_t>(row - slab.first) * row_bytes_ +
                static_cast<std::size_t>(column) * sample_bytes_,
            static_cast<std::size_t>(count) * sample_bytes_};
  }

 private:
  std::vector<std::shared_ptr<const Slab>> slabs_;
  std::int64_t slab_rows_;
  std::size_t row_bytes_;
  std::size_t sample_bytes_;
};

class SourceRows::ScratchRows final : public RawRows {
 public:
  ScratchRows(std::shared_ptr<const File> file, std::int64_t kept_rows, const SourceInfo& info)
      : file_(std::move(file)),
        kept_rows_(kept_rows),
        row_bytes_(row_bytes_of(info)),
        sample_bytes_(size_bytes(info.sample_type)) {}

  [[nodiscard]] std::span<const std::byte> part(std::int64_t row, std::int64_t column, std::int64_t count,
                                                std::vector<std::byte>& buffer) const override {
    buffer.resize(static_cast<std::size_t>(count) * sample_bytes_);
    const std::uint64_t at =
        static_cast<std::uint64_t>(row % kept_rows_) * row_bytes_ + static_cast<std::uint64_t>(column) * sample_bytes_;
    if (file_->read_at(at, buffer) != buffer.size()) {
      throw Error(ErrorCode::kIo, file_->path() + ": the scratch file there lost what was written to it");
    }
    return buffer;
  }

 private:
  std::shared_ptr<const File> file_;
  std::int64_t kept_rows_;
  std::size_t row_bytes_;
  std::size_t sample_bytes_;
};

SourceRows::SourceRows(HeightSource& source, const ReadStep& step) : source_(source), step_(step) {}

SourceRows::SourceRows(HeightSource& source, const ReadStep& step, const std::string& folder, std::int64_t kept_rows)
    : source_(source), step_(step), kept_rows_(std::min(kept_rows, source.info().height)) {
  scratch_ = std::make_shared<File>(
      File::scratch(folder, static_cast<std::uint64_t>(kept_rows_) * row_bytes_of(source.info())));
}

std::shared_ptr<const RawRows> SourceRows::rows(const RowRange& range) {
  const SourceInfo& info = source_.info();
  ISOHF_ASSERT(range.first >= 0 && range.first <= range.last && range.last < info.height);
  if (next_ == 0) next_ = range.first / step_.rows * step_.rows;
  if (scratch_) {
    while (next_ <= range.last) read_to_scratch();
    return std::make_shared<ScratchRows>(scratch_, kept_rows_, info);
  }
  while (!slabs_.empty() && slabs_.front()->first + slabs_.front()->rows <= range.first) slabs_.pop_front();
  while (next_ <= range.last) read_slab();
  return std::make_shared<SlabRows>(std::vector(slabs_.begin(), slabs_.end()), step_.rows, info);
}

void SourceRows::read_slab() {
  const SourceInfo& info = source_.info();
  const std::size_t row_bytes = row_bytes_of(info);
  const std::vector<Window> windows = step_.windows(info, next_);
  const std::shared_ptr<Slab> slab = recycled_.take([&] {
    const std::size_t most = static_cast<std::size_t>(step_.rows) * row_bytes;
    return std::make_unique<Slab>(Slab{0, 0, std::make_unique_for_overwrite<std::byte[]>(most)});
  });
  slab->first = next_;
  slab->rows = windows.front().rows;
  for (const Window& window : windows) {
    const std::size_t bytes = static_cast<std::size_t>(window.columns) * size_bytes(info.sample_type);
    const auto rows = static_cast<std::size_t>(window.rows);
    if (window.columns == info.width) {
      source_.read_window(window, {slab->raw.get(), rows * bytes});
      continue;
    }
    raw_.resize(rows * bytes);
    source_.read_window(window, raw_);
    std::byte* to = slab->raw.get() + static_cast<std::size_t>(window.column) * size_bytes(info.sample_type);
    for (std::size_t r = 0; r < rows; ++r) std::memcpy(to + r * row_bytes, raw_.data() + r * bytes, bytes);
  }
  next_ += slab->rows;
  slabs_.push_back(slab);
}

void SourceRows::read_to_scratch() {
  const SourceInfo& info = source_.info();
  const std::size_t row_bytes = row_bytes_of(info);
  std::int64_t rows = 0;
  for (const Window& window : step_.windows(info, next_)) {
    const std::size_t bytes = static_cast<std::size_t>(window.columns) * size_bytes(info.sample_type);
    raw_.resize(static_cast<std::size_t>(window.rows) * bytes);
    source_.read_window(window, raw_);
    for (std::int64_t r = 0; r < window.rows; ++r) {
      const std::uint64_t at = static_cast<std::uint64_t>((next_ + r) % kept_rows_) * row_bytes +
                               static_cast<std::uint64_t>(window.column) * size_bytes(info.sample_type);
      scratch_->write_at(at, std::span(raw_).subspan(static_cast<std::size_t>(r) * bytes, bytes));
    }
    rows = window.rows;
  }
  next_ += rows;
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
      raw.resize(static_cast<std::size_t>(window.columns * window.rows) * size_bytes(info.sample_type));
      source.read_window(window, raw);
      survey.add(raw);
    }
    job.report({"statistics", "rows", std::min(row + step.rows, info.height), info.height});
  }
  return survey;
}

}  // namespace isohf
