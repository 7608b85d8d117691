#include "commands/export_tiles.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <utility>

#include "formats/mosaic/tile_name.h"
#include "isohf/error.h"

namespace isohf::cli {
namespace {

/// Tiles open at a time take a file or two each, and a few megabytes.
constexpr std::int64_t kColumnsAtOnce = 64;

}  // namespace

ExportTiles::ExportTiles(const std::string& output, const TileCut& cut, std::int64_t width)
    : output_(output), cut_(cut), width_(width) {}

ExportTiles::~ExportTiles() {
  for (const auto& [column, row] : parts_) drop_raster(name(column, row));
}

std::string ExportTiles::name(std::int64_t column, std::int64_t row) const {
  if (!cut_.asked) return output_;
  const std::filesystem::path path(output_);
  return TileName{(path.parent_path() / path.stem()).string(), column, row, path.extension().string()}.path();
}

std::vector<std::string> ExportTiles::names() const {
  std::vector<std::string> all;
  for (std::int64_t row = 0; row < cut_.down; ++row) {
    for (std::int64_t column = 0; column < cut_.across; ++column) all.push_back(name(column, row));
  }
  return all;
}

std::vector<std::string> ExportTiles::others() const {
  std::vector<std::string> found;
  if (!cut_.asked) return found;
  const auto ours = TileName::of(name(0, 0));
  std::filesystem::path folder = std::filesystem::path(output_).parent_path();
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(folder.empty() ? "." : folder, none)) {
    const std::string file = (folder / entry.path().filename()).string();
    const auto tile = TileName::of(file);
    if (!tile || tile->stem != ours->stem || tile->extension != ours->extension) continue;
    if ((tile->column < cut_.across && tile->row < cut_.down) ||
        !std::filesystem::is_regular_file(entry.symlink_status(none)))
      continue;
    try {
      check_raster_target(file, true);
      found.push_back(file);
    } catch (const Error&) {  // another kind of file
    }
  }
  std::ranges::sort(found);
  return found;
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
  if (end == top + cut_.rows) complete(tiles);
}

void ExportTiles::complete(TileRow& tiles) {
  for (std::size_t at = 0; at < tiles.sinks.size(); ++at) {
    for (std::string& file : tiles.sinks[at]->files()) written_.push_back(std::move(file));
    if (!first_) {
      tiles.sinks[at]->close();
      first_ = std::move(tiles.sinks[at]);
      continue;
    }
    tiles.sinks[at]->complete();
    parts_.emplace_back(first_column_ + static_cast<std::int64_t>(at), tiles.row);
  }
}

void ExportTiles::finish() {
  while (!parts_.empty()) {
    const auto [column, row] = parts_.back();
    parts_.pop_back();
    name_raster(name(column, row), spec_of_(column, row));
  }
  first_->finish();
  removed_ = others();
  for (const std::string& tile : removed_) remove_raster(tile);
}

}  // namespace isohf::cli
