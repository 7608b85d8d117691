#include "formats/write/raster_tiles.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cstring>
#include <filesystem>

#include "formats/write/tile_name.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// Tiles open at a time take a file or two each, and a few megabytes.
constexpr std::int64_t kColumnsAtOnce = 64;

/// One axis of the cut: how many tiles of so many samples.
std::int64_t cut_axis(std::int64_t& size, bool free, std::int64_t samples, std::int64_t overlap, const char* axis) {
  if (samples <= overlap || samples < 2 * overlap) {
    throw Error(
        ErrorCode::kInvalidArgument,
        fmt::format("tiles of {} {} with an overlap of {}: a tile must have at least twice the overlap, and one "
                    "sample of its own",
                    samples, axis, overlap));
  }
  const std::int64_t step = samples - overlap;
  const auto count = std::max<std::int64_t>((size - overlap + step / 2) / step, 1);
  const std::int64_t whole = count * step + overlap;
  if (free) size = whole;
  if (size != whole) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("{} {} do not make {} whole tiles of {} that share {}; {} do",
                                                         size, axis, count, samples, overlap, whole));
  }
  return count;
}

}  // namespace

TileCut cut_into_tiles(std::pair<std::int64_t, std::int64_t>& size, bool free,
                       const std::optional<std::pair<std::int64_t, std::int64_t>>& tile_size, std::int64_t overlap) {
  if (!tile_size) return {1, 1, size.first, size.second};
  const std::int64_t across = cut_axis(size.first, free, tile_size->first, overlap, "columns");
  const std::int64_t down = cut_axis(size.second, free, tile_size->second, overlap, "rows");
  return {across, down, tile_size->first, tile_size->second, overlap, true};
}

RasterTiles::~RasterTiles() {
  for (const auto& [column, row] : parts_) drop_raster(name(column, row));
}

std::string RasterTiles::name(std::int64_t column, std::int64_t row) const {
  if (!cut_.is_cut) return path_;
  const std::filesystem::path path(path_);
  return TileName{(path.parent_path() / path.stem()).string(), column, row, path.extension().string()}.path();
}

std::vector<std::string> RasterTiles::names() const {
  std::vector<std::string> all;
  for (std::int64_t row = 0; row < cut_.down; ++row) {
    for (std::int64_t column = 0; column < cut_.across; ++column) all.push_back(name(column, row));
  }
  return all;
}

std::vector<std::string> RasterTiles::others() const {
  std::vector<std::string> found;
  if (!cut_.is_cut) return found;
  const auto ours = TileName::of(name(0, 0));
  const std::filesystem::path folder = std::filesystem::path(path_).parent_path();
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(folder.empty() ? "." : folder, none)) {
    const std::string file = (folder / entry.path().filename()).string();
    const auto tile = TileName::of(file);
    if (!tile || tile->stem != ours->stem || tile->extension != ours->extension) continue;
    const bool is_ours = tile->column < cut_.across && tile->row < cut_.down;
    if (is_ours || !std::filesystem::is_regular_file(entry.symlink_status(none))) continue;
    try {
      check_raster_target(file, true);
      found.push_back(file);
    } catch (const Error&) {  // another kind of file
    }
  }
  std::ranges::sort(found);
  return found;
}

std::int64_t RasterTiles::groups() const {
  return (cut_.across + kColumnsAtOnce - 1) / kColumnsAtOnce;
}

void RasterTiles::begin_group(std::int64_t group, SpecOf spec_of) {
  spec_of_ = std::move(spec_of);
  first_column_ = group * kColumnsAtOnce;
  columns_ = std::min(kColumnsAtOnce, cut_.across - first_column_);
  sample_bytes_ = size_bytes(spec_of_(first_column_, 0).sample_type);
  next_row_ = 0;
}

void RasterTiles::open_row(std::int64_t row) {
  TileRow tiles{row, {}};
  for (std::int64_t column = first_column_; column < first_column_ + columns_; ++column)
    tiles.sinks.push_back(create_raster(name(column, row), spec_of_(column, row)));
  open_.push_back(std::move(tiles));
}

void RasterTiles::write(std::int64_t row, std::span<const std::byte> rows) {
  const std::int64_t step = cut_.rows - cut_.overlap;
  const std::int64_t width = cut_.across * (cut_.columns - cut_.overlap) + cut_.overlap;
  const std::int64_t end =
      row + static_cast<std::int64_t>(rows.size() / (static_cast<std::size_t>(width) * sample_bytes_));
  for (; next_row_ < cut_.down && next_row_ * step < end; ++next_row_) open_row(next_row_);
  for (TileRow& tiles : open_) write_part(tiles, row, rows);
  std::erase_if(open_, [&](const TileRow& tiles) { return tiles.row * step + cut_.rows <= end; });
}

/// Writes what belongs to a row of tiles of the rows from `first` on; completes it after its last row.
void RasterTiles::write_part(TileRow& tiles, std::int64_t first, std::span<const std::byte> rows) {
  const std::int64_t step = cut_.columns - cut_.overlap;
  const std::size_t row_bytes = static_cast<std::size_t>(cut_.across * step + cut_.overlap) * sample_bytes_;
  const std::int64_t top = tiles.row * (cut_.rows - cut_.overlap);
  const std::int64_t begin = std::max(first, top);
  const std::int64_t end = std::min(first + static_cast<std::int64_t>(rows.size() / row_bytes), top + cut_.rows);
  if (begin >= end) return;
  const std::span<const std::byte> ours = rows.subspan(static_cast<std::size_t>(begin - first) * row_bytes,
                                                       static_cast<std::size_t>(end - begin) * row_bytes);
  const std::size_t run = static_cast<std::size_t>(cut_.columns) * sample_bytes_;
  oneapi::tbb::parallel_for(std::size_t{0}, tiles.sinks.size(), [&](std::size_t at) {
    if (run == row_bytes) return tiles.sinks[at]->write_rows(ours);
    const std::int64_t column = (first_column_ + static_cast<std::int64_t>(at)) * step;
    std::vector<std::byte> part(static_cast<std::size_t>(end - begin) * run);
    for (std::size_t row = 0; row * run < part.size(); ++row) {
      std::memcpy(part.data() + row * run,
                  ours.data() + row * row_bytes + static_cast<std::size_t>(column) * sample_bytes_, run);
    }
    tiles.sinks[at]->write_rows(part);
  });
  if (end == top + cut_.rows) complete(tiles);
}

void RasterTiles::complete(TileRow& tiles) {
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

std::vector<std::string> RasterTiles::finish() {
  while (!parts_.empty()) {
    const auto [column, row] = parts_.back();
    parts_.pop_back();
    name_raster(name(column, row), spec_of_(column, row));
  }
  first_->finish();
  const std::vector<std::string> removed = others();
  for (const std::string& tile : removed) remove_raster(tile);
  return removed;
}

}  // namespace isohf
