#include "commands/export_tiles.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <utility>

namespace isohf::cli {
namespace {

/// Tiles open at a time take a file or two each, and a few megabytes.
constexpr std::int64_t kColumnsAtOnce = 64;

}  // namespace

ExportTiles::ExportTiles(const std::string& output, const TileCut& cut, std::int64_t width)
    : output_(output), cut_(cut), width_(width) {}

ExportTiles::~ExportTiles() {
  open_.clear();
  std::error_code ignored;
  for (const std::string& file : new_) std::filesystem::remove(file, ignored);
}

std::string ExportTiles::name(std::int64_t column, std::int64_t row) const {
  if (!cut_.asked) return output_;
  const std::filesystem::path path(output_);
  return (path.parent_path() /
          fmt::format("{}_x{}_y{}{}", path.stem().string(), column, row, path.extension().string()))
      .string();
}

std::vector<std::string> ExportTiles::names() const {
  std::vector<std::string> all;
  for (std::int64_t row = 0; row < cut_.down; ++row) {
    for (std::int64_t column = 0; column < cut_.across; ++column) all.push_back(name(column, row));
  }
  return all;
}

std::int64_t ExportTiles::groups() const {
  return (cut_.across + kColumnsAtOnce - 1) / kColumnsAtOnce;
}

void ExportTiles::begin_group(std::int64_t group, SpecOf spec_of) {
  spec_of_ = std::move(spec_of);
  first_column_ = group * kColumnsAtOnce;
  columns_ = std::min(kColumnsAtOnce, cut_.across - first_column_);
  next_row_ = 0;
}

void ExportTiles::open_row(std::int64_t row) {
  TileRow tiles{row, {}};
  for (std::int64_t column = first_column_; column < first_column_ + columns_; ++column) {
    tiles.sinks.push_back(create_raster(name(column, row), spec_of_(column, row)));
  }
  open_.push_back(std::move(tiles));
}

void ExportTiles::write(std::int64_t row, std::span<const std::byte> rows) {
  // Samples follow without gaps: their size is what is left.
  const std::int64_t step = cut_.rows - cut_.overlap;
  for (; next_row_ < cut_.down && next_row_ * step <= row; ++next_row_) open_row(next_row_);
  const std::size_t sample_bytes = size_bytes(open_.front().sinks.front()->spec().sample_type);
  const auto count = static_cast<std::int64_t>(rows.size() / (static_cast<std::size_t>(width_) * sample_bytes));
  for (; next_row_ < cut_.down && next_row_ * step < row + count; ++next_row_) open_row(next_row_);
  for (TileRow& tiles : open_) write_part(tiles, row, rows, sample_bytes);
  std::erase_if(open_, [&](const TileRow& tiles) { return tiles.row * step + cut_.rows <= row + count; });
}

/// What of the rows from `first` on belongs to a row of tiles; finishes it after its last row.
void ExportTiles::write_part(TileRow& tiles, std::int64_t first, std::span<const std::byte> rows,
                             std::size_t sample_bytes) {
  const std::size_t row_bytes = static_cast<std::size_t>(width_) * sample_bytes;
  const auto count = static_cast<std::int64_t>(rows.size() / row_bytes);
  const std::int64_t top = tiles.row * (cut_.rows - cut_.overlap);
  const std::int64_t begin = std::max(first, top);
  const std::int64_t end = std::min(first + count, top + cut_.rows);
  if (begin >= end) return;
  const std::size_t run = static_cast<std::size_t>(cut_.columns) * sample_bytes;
  oneapi::tbb::parallel_for(std::size_t{0}, tiles.sinks.size(), [&](std::size_t at) {
    const std::int64_t column = (first_column_ + static_cast<std::int64_t>(at)) * (cut_.columns - cut_.overlap);
    std::vector<std::byte> part(static_cast<std::size_t>(end - begin) * run);
    for (std::int64_t row = begin; row < end; ++row) {
      std::memcpy(part.data() + static_cast<std::size_t>(row - begin) * run,
                  rows.data() + static_cast<std::size_t>(row - first) * row_bytes +
                      static_cast<std::size_t>(column) * sample_bytes,
                  run);
    }
    tiles.sinks[at]->write_rows(part);
  });
  if (end < top + cut_.rows) return;
  for (const auto& sink : tiles.sinks) {
    const bool is_new = !std::filesystem::exists(sink->files().front());
    sink->finish();
    for (std::string& file : sink->files()) {
      if (is_new) new_.push_back(file);
      written_.push_back(std::move(file));
    }
    if (++finished_ == files()) new_.clear();  // all is written, whoever interrupts what is left
  }
}

}  // namespace isohf::cli
