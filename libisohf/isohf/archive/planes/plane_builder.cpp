#include "isohf/archive/planes/plane_builder.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>

#include "isohf/archive/container/member_tables.h"
#include "isohf/base/assert.h"

namespace isohf {
namespace {

/// Tiles of a plane that are encoded side by side.
constexpr std::int64_t kBatch = 16;

std::size_t width_of(CodeType type) {
  return type == CodeType::kF32 ? sizeof(float) : sizeof(std::uint16_t);
}

/// Columns and rows of samples that a tile brings along, those that neighbours share included.
std::int64_t sample_columns(const Planes& planes) {
  return 2 * planes.grid(0).shape().cell_columns() / planes.stride() + 1;
}
std::int64_t sample_rows(const Planes& planes) {
  return planes.grid(0).shape().cell_rows() / planes.stride() + 1;
}

/// Samples that are kept for a tile of a plane's row: its own, a row of padding North of them, and South of them what
/// the tiles there bring, as far as there are tiles. Its East edge is the next one's.
std::int64_t kept_columns(const Planes& planes) {
  return 2 * planes.grid(0).shape().cell_columns();
}
std::int64_t kept_rows(const Planes& planes, int plane) {
  return 1 + std::min(planes.grid(0).shape().cell_rows() + sample_rows(planes),
                      planes.grid(plane - 1).tile_rows() * (sample_rows(planes) - 1) + 1);
}

/// Of all tiles below one.
struct Range {
  bool is_void = true;
  std::uint32_t min = 0;
  std::uint32_t max = 0;

  void add(const PlaneSample& sample) {
    if (sample.is_void) return;
    if (is_void || code_less(sample.code_min, min)) min = sample.code_min;
    if (is_void || code_less(max, sample.code_max)) max = sample.code_max;
    is_void = false;
  }
};

template <typename T>
T void_value(CodeType type) {
  if constexpr (std::is_same_v<T, float>) return std::numeric_limits<float>::quiet_NaN();
  return static_cast<T>(Quantisation{type, 0.0, 1.0}.void_code());
}

/// Columns of even and of odd rows and rows of a plane's tile before those that lie beyond the tiles of plane 0: of a
/// whole tile all.
struct Inside {
  std::array<int, 2> columns;
  int rows;
};

Inside inside_of(const Planes& planes, int plane, TileIndex tile) {
  const TileGrid& grid = planes.grid(plane);
  const auto is_beyond = [&](GridVertex vertex) { return planes.is_beyond(plane, grid.lattice_vertex(tile, vertex)); };
  Inside inside{{grid.shape().columns(), grid.shape().columns()}, grid.shape().rows()};
  while (is_beyond({0, inside.rows - 1})) --inside.rows;
  for (int parity = 0; parity < 2; ++parity) {
    int& columns = inside.columns[static_cast<std::size_t>(parity)];
    while (is_beyond({columns - 1, parity})) --columns;
  }
  return inside;
}

template <typename T>
void forget_beyond(const TileShape& shape, const Inside& inside, T none, std::vector<T>& codes) {
  const auto width = static_cast<std::ptrdiff_t>(shape.columns());
  for (int r = 0; r < inside.rows; ++r) {
    const auto row = codes.begin() + r * width;
    std::fill(row + inside.columns[static_cast<std::size_t>(r % 2)], row + width, none);
  }
  std::fill(codes.begin() + inside.rows * width, codes.end(), none);
}

/// What forget_beyond() forgot: the elevation at the edge, of a column of even or of odd rows as it may be.
template <typename T>
void recall_beyond(const TileShape& shape, const Inside& inside, std::vector<T>& codes) {
  const auto width = static_cast<std::ptrdiff_t>(shape.columns());
  for (int r = 0; r < inside.rows; ++r) {
    const auto row = codes.begin() + r * width;
    const auto beyond = row + inside.columns[static_cast<std::size_t>(r % 2)];
    std::fill(beyond, row + width, *(beyond - 1));
  }
  // Rows beyond stand for the edge as well, and only odd ones are sampled.
  const auto last = codes.begin() + (inside.rows - 1 - inside.rows % 2) * width;
  for (int r = inside.rows; r < shape.rows(); ++r) std::copy_n(last, width, codes.begin() + r * width);
}

void forget_beyond(const Planes& planes, int plane, TileIndex tile, TileCodes& codes) {
  const Inside inside = inside_of(planes, plane, tile);
  const TileShape& shape = planes.grid(0).shape();
  if (codes.type == CodeType::kF32) forget_beyond(shape, inside, void_value<float>(codes.type), codes.heights);
  if (codes.type != CodeType::kF32) forget_beyond(shape, inside, void_value<std::uint16_t>(codes.type), codes.codes);
}

void recall_beyond(const Planes& planes, int plane, TileIndex tile, TileCodes& codes) {
  const Inside inside = inside_of(planes, plane, tile);
  const TileShape& shape = planes.grid(0).shape();
  codes.type == CodeType::kF32 ? recall_beyond(shape, inside, codes.heights)
                               : recall_beyond(shape, inside, codes.codes);
}

/// Where a tile's column of samples stands in the row that is kept, by the tile's column, for its even rows and its odd
/// ones.
using Places = std::array<std::vector<std::int64_t>, 2>;

}  // namespace

/// A plane in the making: the row of its tiles that is not finished yet.
class PlaneBuilder::Level {
 public:
  Level(const Planes& planes, int plane, CodeType type, const ScratchFolder& scratch)
      : planes_(planes),
        plane_(plane),
        type_(type),
        row_bytes_(static_cast<std::size_t>(kept_columns(planes)) * width_of(type)),
        blocks_(static_cast<std::size_t>(planes.grid(plane).tile_columns() + 1)) {
    if (scratch) file_.emplace(blocks_ * row_bytes_, *scratch);
    if (!scratch) kept_.resize(blocks_);
    begin_at(0);
  }

  [[nodiscard]] std::int64_t row() const { return row_; }
  [[nodiscard]] std::int64_t next_tile() const { return next_; }
  [[nodiscard]] const TileGrid& grid() const { return planes_.grid(plane_); }
  [[nodiscard]] const TileGrid& fine() const { return planes_.grid(plane_ - 1); }

  /// Whether a row can be finished once so many tiles of the plane below are in: the row of tiles South of it too.
  [[nodiscard]] bool is_ready(std::int64_t row, std::int64_t tiles) const {
    return row < grid().tile_rows() &&
           tiles >= std::min((row + 1) * planes_.stride() + 1, fine().tile_rows()) * fine().tile_columns();
  }
  [[nodiscard]] bool is_ready() const { return is_ready(row_, next_); }

  /// Expects the first tile that a row sees.
  void begin_at(std::int64_t row) {
    row_ = row;
    next_ = std::max(row * planes_.stride() - 1, std::int64_t{0}) * fine().tile_columns();
    for (std::vector<std::byte>& kept : kept_) kept.clear();
    for (std::vector<Range>& ranges : ranges_) ranges.assign(static_cast<std::size_t>(grid().tile_columns()), {});
  }

  void add(const PlaneSample& sample) {
    const TileIndex tile = fine().tile_at(next_++);
    const TileIndex above = planes_.above(tile);
    if (above.row >= row_) {
      ranges_[static_cast<std::size_t>(above.row - row_)][static_cast<std::size_t>(above.column)].add(sample);
    }
    if (sample.codes.empty()) return;
    const std::int64_t columns = sample_columns(planes_) - 1;
    keep(sample.codes, tile, 0, columns);
    // The East edge comes with the neighbour; one that isn't stored holds no elevation there either.
    if (tile.column + 1 == fine().tile_columns()) keep(sample.codes, tile, columns, columns + 1);
  }

  /// The codes of a tile of the current row, also those of places beyond, and the range of what lies below it.
  [[nodiscard]] TileCodes cut(std::int64_t column) const {
    Places places;
    for (std::size_t parity = 0; parity < places.size(); ++parity) {
      for (int c = 0; c < grid().shape().columns(); ++c) {
        const std::int64_t x = grid().lattice_vertex({column, row_}, {c, static_cast<int>(parity)}).x;
        places[parity].push_back(planes_.x_below(plane_ - 1, plane_, x) / planes_.stride());
      }
    }
    TileCodes tile;
    tile.type = type_;
    type_ == CodeType::kF32 ? cut(places, tile.heights) : cut(places, tile.codes);
    return tile;
  }
  [[nodiscard]] const Range& range(std::int64_t column) const { return ranges_[0][static_cast<std::size_t>(column)]; }

  void next_row() {
    const std::int64_t dropped = std::min<std::int64_t>(grid().shape().cell_rows(), kept_rows(planes_, plane_));
    for (std::int64_t z = first_z(); file_ && z < first_z() + dropped; ++z) {
      if (file_->has(z)) file_->drop(z);
    }
    const std::size_t stays = row_bytes_ * static_cast<std::size_t>(kept_rows(planes_, plane_) - dropped);
    for (std::vector<std::byte>& kept : kept_) {
      if (kept.empty()) continue;
      std::memmove(kept.data(), kept.data() + static_cast<std::size_t>(dropped) * row_bytes_, stays);
      make_void(std::span(kept).subspan(stays));
    }
    ++row_;
    ranges_[0].swap(ranges_[1]);
    std::fill(ranges_[1].begin(), ranges_[1].end(), Range{});
  }

 private:
  /// z of the first row that is kept, counted as the plane's own rows are.
  [[nodiscard]] std::int64_t first_z() const { return row_ * grid().shape().cell_rows() - 1; }

  /// Keeps columns of a tile's samples, all in one tile of the plane.
  void keep(std::span<const std::byte> samples, TileIndex tile, std::int64_t begin, std::int64_t end) {
    const std::int64_t x = tile.column * (sample_columns(planes_) - 1) + begin;
    const std::size_t width = width_of(type_);
    const std::int64_t first = tile.row * (sample_rows(planes_) - 1) - first_z();
    for (std::int64_t j = std::max(std::int64_t{0}, -first); j < sample_rows(planes_); ++j) {
      const auto part = samples.subspan(static_cast<std::size_t>(j * sample_columns(planes_) + begin) * width,
                                        static_cast<std::size_t>(end - begin) * width);
      if (file_) {
        const std::int64_t z = first_z() + first + j;
        if (!file_->has(z)) begin_row(z);
        file_->write(z, static_cast<std::size_t>(x) * width, part);
        continue;
      }
      std::vector<std::byte>& kept = kept_[static_cast<std::size_t>(x / kept_columns(planes_))];
      if (kept.empty()) {
        kept.resize(row_bytes_ * static_cast<std::size_t>(kept_rows(planes_, plane_)));
        make_void(kept);
      }
      std::memcpy(kept.data() + static_cast<std::size_t>(first + j) * row_bytes_ +
                      static_cast<std::size_t>(x % kept_columns(planes_)) * width,
                  part.data(), part.size());
    }
  }

  /// Of the file.
  void begin_row(std::int64_t z) {
    file_->add(z);
    std::vector<std::byte> none(blocks_ * row_bytes_);
    make_void(none);
    file_->write(z, 0, none);
  }

  /// A row of one tile's samples, perhaps in `buffer`; nullptr where they are void.
  [[nodiscard]] const std::byte* kept_row(std::int64_t z, std::int64_t block, std::vector<std::byte>& buffer) const {
    const auto at = static_cast<std::size_t>(block);
    if (file_) {
      if (!file_->has(z)) return nullptr;
      buffer.resize(row_bytes_);
      file_->read(z, at * row_bytes_, buffer);
      return buffer.data();
    }
    const std::size_t row = static_cast<std::size_t>(z - first_z()) * row_bytes_;
    return row < kept_[at].size() ? kept_[at].data() + row : nullptr;
  }

  void make_void(std::span<std::byte> rows) const {
    const auto fill = [&](auto none) {
      for (std::size_t at = 0; at < rows.size(); at += sizeof none) std::memcpy(rows.data() + at, &none, sizeof none);
    };
    type_ == CodeType::kF32 ? fill(void_value<float>(type_)) : fill(void_value<std::uint16_t>(type_));
  }

  template <typename T>
  void cut(const Places& places, std::vector<T>& codes) const {
    const TileShape& shape = grid().shape();
    codes.assign(static_cast<std::size_t>(shape.stored_vertex_count()), void_value<T>(type_));
    auto to = codes.begin();
    std::vector<std::byte> buffer;
    for (int r = 0; r < shape.rows(); ++r) {
      const std::int64_t z = planes_.z_below(plane_ - 1, plane_, row_ * shape.cell_rows() + r - 1) / planes_.stride();
      std::int64_t block = -1;
      const std::byte* row = nullptr;
      for (const std::int64_t x : places[static_cast<std::size_t>(r % 2)]) {
        if (x / kept_columns(planes_) != block) row = kept_row(z, block = x / kept_columns(planes_), buffer);
        if (row != nullptr) {
          std::memcpy(&*to, row + static_cast<std::size_t>(x % kept_columns(planes_)) * sizeof(T), sizeof(T));
        }
        ++to;
      }
    }
  }

  const Planes& planes_;
  int plane_;
  CodeType type_;
  std::size_t row_bytes_;                     ///< of a tile
  std::size_t blocks_;                        ///< tiles of a row, and the East edge of the last
  std::vector<std::vector<std::byte>> kept_;  ///< rows of samples from first_z() on, by the plane's tiles; empty: void
  std::optional<RowFile> file_;               ///< or here, a row of all tiles each
  std::int64_t row_ = 0;
  std::int64_t next_ = 0;                     ///< tile of the plane below
  std::array<std::vector<Range>, 2> ranges_;  ///< of the tiles of the current row and of the next
};

std::uint64_t plane_builder_memory_bytes(const Planes& planes, CodeType type, bool in_scratch) {
  std::int64_t samples = kBatch * planes.grid(0).shape().stored_vertex_count();
  for (int plane = 1; plane <= planes.count(); ++plane) {
    samples += planes.grid(plane).tile_columns() * kept_columns(planes) * (in_scratch ? 1 : kept_rows(planes, plane));
  }
  return planes.count() == 0 ? 0 : static_cast<std::uint64_t>(samples) * width_of(type);
}

PlaneBuilder::PlaneBuilder(const Planes& planes, CodeType type, Encode encode, Take take, const ScratchFolder& scratch)
    : planes_(planes), type_(type), encode_(std::move(encode)), take_(std::move(take)) {
  for (int plane = 1; plane <= planes.count(); ++plane) {
    levels_.push_back(std::make_unique<Level>(planes_, plane, type, scratch));
  }
}

PlaneBuilder::~PlaneBuilder() = default;

PlaneSample PlaneBuilder::sample(const TileCodes& codes, std::uint32_t code_min, std::uint32_t code_max) const {
  PlaneSample sample;
  sample.code_min = code_min;
  sample.code_max = code_max;
  sample.is_void = false;
  const std::size_t width = width_of(type_);
  const auto columns = static_cast<std::size_t>(planes_.grid(0).shape().columns());
  const auto stride = static_cast<std::size_t>(planes_.stride());
  const auto* const from = type_ == CodeType::kF32 ? reinterpret_cast<const std::byte*>(codes.heights.data())
                                                   : reinterpret_cast<const std::byte*>(codes.codes.data());
  sample.codes.resize(static_cast<std::size_t>(sample_columns(planes_) * sample_rows(planes_)) * width);
  std::byte* to = sample.codes.data();
  for (std::size_t j = 0; j < static_cast<std::size_t>(sample_rows(planes_)); ++j) {
    // Object places (S·i, S·j): columns 1 + S·i/2 of the odd rows 1 + S·j.
    const std::byte* const row = from + ((1 + j * stride) * columns + 1) * width;
    for (std::size_t i = 0; i < static_cast<std::size_t>(sample_columns(planes_)); ++i, to += width) {
      std::memcpy(to, row + i * stride / 2 * width, width);
    }
  }
  return sample;
}

void PlaneBuilder::add(const PlaneSample& sample) {
  add(1, sample);
}

void PlaneBuilder::add(int plane, const PlaneSample& sample) {
  if (plane > planes_.count()) return;
  Level& level = *levels_[static_cast<std::size_t>(plane - 1)];
  level.add(sample);
  while (level.is_ready()) finish_row(plane);
}

void PlaneBuilder::finish_row(int plane) {
  Level& level = *levels_[static_cast<std::size_t>(plane - 1)];
  const std::int64_t columns = level.grid().tile_columns();
  for (std::int64_t first = 0; first < columns; first += kBatch) {
    const auto count = static_cast<std::size_t>(std::min(kBatch, columns - first));
    std::vector<EncodedTile> encoded(count);
    std::vector<PlaneSample> samples(count);
    const auto make = [&](std::size_t i) {
      const std::int64_t column = first + static_cast<std::int64_t>(i);
      const Range& range = level.range(column);
      encoded[i].is_empty = true;
      if (range.is_void) return;
      TileCodes codes = level.cut(column);
      samples[i] = sample(codes, range.min, range.max);
      forget_beyond(planes_, plane, {column, level.row()}, codes);
      encoded[i] = encode_(codes);
      encoded[i].code_min = range.min;
      encoded[i].code_max = range.max;
    };
    // All of it, also while the pipeline around has failed elsewhere.
    oneapi::tbb::task_group_context whole(oneapi::tbb::task_group_context::isolated);
    oneapi::tbb::parallel_for(std::size_t{0}, count, make, whole);
    for (std::size_t i = 0; i < count; ++i) {
      take_(plane, {first + static_cast<std::int64_t>(i), level.row()}, encoded[i]);
      add(plane + 1, samples[i]);
    }
  }
  level.next_row();
}

PlaneSample PlaneBuilder::sample_of(int plane, TileIndex tile, const Read& read) const {
  Stored stored = read(plane, tile);
  if (!stored.entry.is_empty) {
    recall_beyond(planes_, plane, tile, stored.codes);
    return sample(stored.codes, stored.entry.code_min, stored.entry.code_max);
  }
  PlaneSample none;
  if (plane == 0) return none;
  Range range;
  const TileRange below = planes_.below(plane, tile);
  for (TileIndex at = below.first; at.row < below.end.row; ++at.row) {
    for (at.column = below.first.column; at.column < below.end.column; ++at.column) {
      range.add(sample_of(plane - 1, at, read));
    }
  }
  none.is_void = range.is_void;
  none.code_min = range.min;
  none.code_max = range.max;
  return none;
}

void PlaneBuilder::resume_after(std::int64_t tiles, const Read& read) {
  int plane = 0;
  for (const std::unique_ptr<Level>& level : levels_) {
    std::int64_t row = 0;
    while (level->is_ready(row, tiles)) ++row;
    level->begin_at(row);
    while (level->next_tile() < tiles) level->add(sample_of(plane, level->fine().tile_at(level->next_tile()), read));
    tiles = row * level->grid().tile_columns();
    ++plane;
  }
}

}  // namespace isohf
