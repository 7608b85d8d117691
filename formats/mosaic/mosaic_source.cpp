#include "formats/mosaic/mosaic_source.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "formats/io/file_source.h"
#include "isohf/base/assert.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

/// Strips of whole rows of members, or whole blocks of theirs, have about this size. Rows of small members are put
/// together to strips of the first...
constexpr std::int64_t kLeastStripBytes = std::int64_t{4} << 20U;
constexpr std::int64_t kStripBytes = std::int64_t{16} << 20U;
/// ...and one row of blocks may have this one, so that no block is decoded twice.
constexpr std::int64_t kMostStripBytes = std::int64_t{256} << 20U;
/// Parts of members that are read side by side.
constexpr std::size_t kBatchBytes = std::size_t{8} << 20U;

/// Coordinates this close to a sample, in samples, are its position: they are computed from origins and spacings.
constexpr double kAtSample = 1e-6;

/// If layers of one resolution compete: no file is drawn yet.
constexpr std::int32_t kNoFile = -1;

constexpr double kVoid = std::numeric_limits<double>::quiet_NaN();

/// Rows of a strip: whole rows of members if these are not too large, else whole rows of their blocks.
std::int64_t strip_rows(const MosaicPlan& plan) {
  const MosaicLayer& finest = plan.layers.back();
  std::int64_t pitch = plan.info.height;  // from one row of members to the next
  for (std::size_t i = 1; i < finest.members.size(); ++i) {
    const std::int64_t distance = finest.members[i].row - finest.members[i - 1].row;
    if (distance > 0) pitch = std::min(pitch, distance);
  }
  if (2 * pitch < finest.tallest) pitch = finest.tallest;
  const std::int64_t row_bytes = plan.info.width * static_cast<std::int64_t>(size_bytes(plan.info.sample_type));
  const std::int64_t block = std::min(plan.block_height, pitch);
  std::int64_t rows = std::max<std::int64_t>(1, kMostStripBytes / row_bytes);
  if (pitch <= kStripBytes / row_bytes) {
    rows = pitch * std::max<std::int64_t>(1, kLeastStripBytes / row_bytes / pitch);
  } else if (block <= rows) {
    rows = block * std::max<std::int64_t>(1, kStripBytes / row_bytes / block);
  }
  return std::min(rows, plan.info.height);
}

/// A position between the samples of a layer, on one axis.
struct Between {
  std::int64_t first = 0;     ///< the sample at or before it; -1 and the last one have but one neighbour inside
  double fraction = 0.0;      ///< towards the next one, below 1
  std::int64_t nearest = -1;  ///< -1: beyond the layer
};

/// outer: positions up to half a sample beyond the outermost ones count.
Between between(double position, std::int64_t samples, bool outer) {
  const double nearest = std::floor(position + 0.5);
  if (std::abs(position - nearest) <= kAtSample) position = nearest;
  const double reach = outer ? 0.5 + kAtSample : 0.0;
  if (!(position >= -reach && position <= static_cast<double>(samples - 1) + reach)) return {};
  const double first = std::floor(position);
  return {static_cast<std::int64_t>(first), position - first,
          std::clamp<std::int64_t>(static_cast<std::int64_t>(nearest), 0, samples - 1)};
}

/// Some samples of a layer as numbers, NaN for voids and outside.
struct Numbers {
  Window window;
  std::vector<double> values;
  std::vector<std::int32_t> orders;  ///< of the files that show, if that matters

  [[nodiscard]] double at(std::int64_t column, std::int64_t row) const { return of(values, column, row, kVoid); }
  [[nodiscard]] std::int32_t order_at(std::int64_t column, std::int64_t row) const {
    return of(orders, column, row, kNoFile);
  }

 private:
  template <typename T>
  [[nodiscard]] T of(const std::vector<T>& all, std::int64_t column, std::int64_t row, T outside) const {
    const std::int64_t c = column - window.column;
    const std::int64_t r = row - window.row;
    if (c < 0 || r < 0 || c >= window.columns || r >= window.rows) return outside;
    return all[static_cast<std::size_t>(r * window.columns + c)];
  }
};

/// Bilinear interpolation. Void if a sample of some weight is; outer: only if the nearest sample is, else the weighted
/// mean of those that are not, so that the outer half of a pixel has its elevation.
double interpolated(const Numbers& numbers, const Between& x, const Between& y, bool outer) {
  if (x.nearest < 0 || y.nearest < 0) return kVoid;
  if (outer && std::isnan(numbers.at(x.nearest, y.nearest))) return kVoid;
  double sum = 0.0;
  double weights = 0.0;
  bool all = true;
  for (int r = 0; r < 2; ++r) {
    for (int c = 0; c < 2; ++c) {
      const double weight = (c == 0 ? 1.0 - x.fraction : x.fraction) * (r == 0 ? 1.0 - y.fraction : y.fraction);
      if (weight == 0.0) continue;
      const double value = numbers.at(x.first + c, y.first + r);
      if (std::isnan(value)) {
        all = false;
        continue;
      }
      sum += weight * value;
      weights += weight;
    }
  }
  if (all) return sum;
  return outer && weights > 0.0 ? sum / weights : kVoid;
}

/// Positions are computed in the corners of cells of so many samples, on multiples of it.
constexpr std::int64_t kCell = 16;
/// If the middles of a cell's sides lie farther, in samples, from where its corners say, all its samples are computed.
constexpr double kStraight = 0.005;
/// Positions are rounded to this, which hides last bits of libraries.
constexpr double kPlaceGrain = 4096.0;

/// Where a block of the mosaic's samples lies among those of a layer, in columns and rows of the layer.
class LayerPlaces {
 public:
  LayerPlaces(const MosaicLayer& layer, const Georeference& mosaic, const Window& block)
      : layer_(layer), mosaic_(mosaic), block_(block) {
    if (!layer.way) return;
    places_.resize(static_cast<std::size_t>(block.columns * block.rows));
    const std::int64_t first_x = block.column / kCell;
    const std::int64_t first_y = block.row / kCell;
    const std::int64_t across = (block.column + block.columns - 1) / kCell - first_x + 1;
    const std::int64_t down = (block.row + block.rows - 1) / kCell - first_y + 1;
    oneapi::tbb::parallel_for(std::int64_t{0}, across * down, [&](std::int64_t cell) {
      fill((first_x + cell % across) * kCell, (first_y + cell / across) * kCell);
    });
  }

  [[nodiscard]] MapPoint at(std::int64_t column, std::int64_t row) const {
    if (layer_.way) return places_[index(column, row)];
    return {(mosaic_.origin_x - layer_.origin_x) / layer_.spacing_x +
                static_cast<double>(column) * (mosaic_.spacing_x / layer_.spacing_x),
            (layer_.origin_y - mosaic_.origin_y) / layer_.spacing_y +
                static_cast<double>(row) * (mosaic_.spacing_y / layer_.spacing_y)};
  }

  /// The layer's samples that interpolating needs; empty if it has none there.
  [[nodiscard]] Window needed() const {
    MapPoint low = at(block_.column, block_.row);
    MapPoint high = at(block_.column + block_.columns - 1, block_.row + block_.rows - 1);
    for (const MapPoint& place : places_) {
      low = {std::fmin(low.easting, place.easting), std::fmin(low.northing, place.northing)};
      high = {std::fmax(high.easting, place.easting), std::fmax(high.northing, place.northing)};
    }
    const auto width = static_cast<double>(layer_.width);
    const auto height = static_cast<double>(layer_.height);
    if (!(low.easting < width && high.easting > -1.0 && low.northing < height && high.northing > -1.0)) return {};
    const auto sample = [](double at, double samples) {
      return static_cast<std::int64_t>(std::clamp(std::floor(at), 0.0, samples - 1.0));
    };
    const std::int64_t column = sample(low.easting, width);
    const std::int64_t row = sample(low.northing, height);
    return {column, row, sample(high.easting + 1.0, width) - column + 1, sample(high.northing + 1.0, height) - row + 1};
  }

 private:
  [[nodiscard]] std::size_t index(std::int64_t column, std::int64_t row) const {
    return static_cast<std::size_t>((row - block_.row) * block_.columns + column - block_.column);
  }

  [[nodiscard]] MapPoint projected(std::int64_t column, std::int64_t row) const {
    const MapPoint there =
        layer_.way->members_from_mosaic({mosaic_.origin_x + static_cast<double>(column) * mosaic_.spacing_x,
                                         mosaic_.origin_y - static_cast<double>(row) * mosaic_.spacing_y});
    double columns = (there.easting - layer_.origin_x) / layer_.spacing_x;
    if (!layer_.way->members) {  // degrees: on the turn nearest to the layer's middle
      const double middle = static_cast<double>(layer_.width - 1) / 2.0;
      columns = middle + std::remainder(columns - middle, 360.0 / layer_.spacing_x);
    }
    return {columns, (layer_.origin_y - there.northing) / layer_.spacing_y};
  }

  /// The cell whose first sample is that one, as far as it lies in the block.
  void fill(std::int64_t column, std::int64_t row) {
    const MapPoint a = projected(column, row);
    const MapPoint b = projected(column + kCell, row);
    const MapPoint c = projected(column, row + kCell);
    const MapPoint d = projected(column + kCell, row + kCell);
    const auto blend = [&](double s, double t) {
      const auto of = [&](double MapPoint::*axis) {
        return (1.0 - t) * ((1.0 - s) * a.*axis + s * b.*axis) + t * ((1.0 - s) * c.*axis + s * d.*axis);
      };
      return MapPoint{of(&MapPoint::easting), of(&MapPoint::northing)};
    };
    // How far the middle of a side lies from where its ends say. The middle of the cell would not do: on conformal maps
    // its sides bend both ways.
    const auto sag = [&](const MapPoint& from, const MapPoint& to, std::int64_t x, std::int64_t y) {
      const MapPoint middle = projected(column + x, row + y);
      return std::hypot((from.easting + to.easting) / 2.0 - middle.easting,
                        (from.northing + to.northing) / 2.0 - middle.northing);
    };
    const double bend = std::max(sag(a, b, kCell / 2, 0), sag(c, d, kCell / 2, kCell)) +
                        std::max(sag(a, c, 0, kCell / 2), sag(b, d, kCell, kCell / 2));
    const bool is_straight = bend <= kStraight;  // false if one of them has no position
    const std::int64_t end_column = std::min(column + kCell, block_.column + block_.columns);
    const std::int64_t end_row = std::min(row + kCell, block_.row + block_.rows);
    for (std::int64_t y = std::max(row, block_.row); y < end_row; ++y) {
      for (std::int64_t x = std::max(column, block_.column); x < end_column; ++x) {
        const MapPoint place =
            is_straight ? blend(static_cast<double>(x - column) / kCell, static_cast<double>(y - row) / kCell)
                        : projected(x, y);
        places_[index(x, y)] = {std::round(place.easting * kPlaceGrain) / kPlaceGrain,
                                std::round(place.northing * kPlaceGrain) / kPlaceGrain};
      }
    }
  }

  const MosaicLayer& layer_;
  const Georeference& mosaic_;
  Window block_;
  std::vector<MapPoint> places_;  ///< of each sample, if the layer is of another reference system
};

}  // namespace

/// What a window takes from one member.
struct MosaicSource::Part {
  const MosaicMember* member = nullptr;
  Window own;               ///< in the member
  std::int64_t column = 0;  ///< of its first sample in the window
  std::int64_t row = 0;
  std::span<std::byte> samples;  ///< of the mosaic's kind
};

/// Samples of a window, on which layers are laid.
struct MosaicSource::Canvas {
  Window window;
  std::span<std::byte> samples;
  std::vector<std::int32_t> orders = {};  ///< of each sample the file that shows; empty if no layers compete

  void expect_files(bool several) {
    orders.assign(several ? static_cast<std::size_t>(window.columns * window.rows) : 0, kNoFile);
  }
};

MosaicSource::MosaicSource(std::string path, MosaicPlan plan, const OpenOptions& options, OverlapRule rule)
    : plan_(std::move(plan)),
      rule_(rule),
      idle_bytes_(options.buffer_bytes),
      pool_(share_of(options, plan_), options.buffer_bytes) {
  plan_.info.path = std::move(path);
  plan_.info.block_height = strip_rows(plan_);
}

std::uint64_t MosaicSource::buffer_bytes() const {
  bool has_orders = false;
  std::uint64_t members = 0;
  for (std::size_t layer = 0; layer < plan_.layers.size(); ++layer) {
    has_orders = has_orders || plan_.is_tied(layer);
    members += plan_.layers[layer].members.size();
  }
  const std::uint64_t strip = static_cast<std::uint64_t>(plan_.info.block_height * plan_.info.width) *
                              (size_bytes(plan_.info.sample_type) + (has_orders ? sizeof(std::int32_t) : 0));
  const std::uint64_t reading = static_cast<std::uint64_t>(plan_.readers_at_once) * plan_.reader_bytes;
  const std::uint64_t open = std::min<std::uint64_t>(members, pool_.most_open()) * plan_.reader_bytes;
  const std::int64_t widest = std::ranges::max(plan_.layers.back().members, {}, &MosaicMember::width).width;
  const std::size_t part = bytes_of({0, 0, widest, plan_.info.block_height});
  const std::uint64_t parts = std::min<std::uint64_t>(strip, std::max(part, kBatchBytes));
  return strip + parts + std::min(open, reading + idle_bytes_);
}

std::size_t MosaicSource::bytes_of(const Window& window) const {
  return static_cast<std::size_t>(window.columns * window.rows) * size_bytes(plan_.info.sample_type);
}

void MosaicSource::read_window(const Window& window, std::span<std::byte> samples) {
  const SourceInfo& info = plan_.info;
  ISOHF_ASSERT(is_window_of(info, window, samples.size()));
  // Passes read the same columns again and again; the first window of others is read as it is.
  const bool is_first_of_whole = strip_.columns == 0 && window.columns == info.width;
  const bool follows = is_first_of_whole || (window.column == strip_.column && window.columns == strip_.columns);
  if (!follows) strip_.rows = 0;
  strip_.column = window.column;
  strip_.columns = window.columns;
  const std::size_t row_bytes = bytes_of({0, 0, window.columns, 1});
  const std::int64_t end = window.row + window.rows;
  for (std::int64_t row = window.row; row < end;) {
    Window strip = window;
    strip.row = row - row % info.block_height;
    strip.rows = std::min(info.block_height, info.height - strip.row);
    const std::int64_t rows = std::min(end, strip.row + strip.rows) - row;
    const auto out = samples.subspan(static_cast<std::size_t>(row - window.row) * row_bytes,
                                     static_cast<std::size_t>(rows) * row_bytes);
    const bool is_kept = strip_.rows > 0 && strip_.row == strip.row;
    if (!is_kept && (!follows || rows == strip.rows)) {
      compose({window.column, row, window.columns, rows}, out);
    } else {
      if (!is_kept) {
        strip_.rows = 0;
        strip_samples_.resize(bytes_of(strip));
        compose(strip, strip_samples_);
        strip_ = strip;
      }
      std::memcpy(out.data(), strip_samples_.data() + static_cast<std::size_t>(row - strip.row) * row_bytes,
                  out.size());
    }
    row += rows;
  }
}

void MosaicSource::compose(const Window& window, std::span<std::byte> out) {
  fill_with(plan_.samples.gap, out);
  const bool is_area = plan_.info.georeference.registration != Registration::kPoint;
  Canvas canvas{window, out};
  for (std::size_t i = 0; i < plan_.layers.size(); ++i) {
    const MosaicLayer& layer = plan_.layers[i];
    if (i == 0 || layer.rank != plan_.layers[i - 1].rank) canvas.expect_files(plan_.is_tied(i));
    // Of other reference systems at first between samples alone, so that none is continued next to a layer that knows
    // better.
    plan_.is_on_grid(layer) ? draw(i, canvas) : interpolate(i, is_area && !layer.way, false, canvas);
  }
  // Then, where nothing else is, outermost samples as far as their areas reach.
  canvas.expect_files(false);
  for (std::size_t i = plan_.layers.size(); is_area && i-- > 0;) {
    if (plan_.layers[i].way) interpolate(i, true, true, canvas);
  }
}

bool MosaicSource::is_gap(const Window& window) const {
  for (std::size_t layer = 0; layer < plan_.layers.size(); ++layer) {
    const MosaicLayer& members = plan_.layers[layer];
    if (members.way) return false;  // where they lie takes its time
    const Window needed =
        plan_.is_on_grid(members) ? window : LayerPlaces(members, plan_.info.georeference, window).needed();
    if (needed.columns > 0 && needed.rows > 0 && !parts_in(layer, needed).empty()) return false;
  }
  return true;
}

std::vector<MosaicSource::Part> MosaicSource::parts_in(std::size_t layer, const Window& window) const {
  const MosaicLayer& members = plan_.layers[layer];
  std::vector<Part> parts;
  auto next = std::ranges::lower_bound(members.members, window.row - members.tallest + 1, {}, &MosaicMember::row);
  for (; next != members.members.end() && next->row < window.row + window.rows; ++next) {
    const Span columns = intersection({next->column, next->width}, {window.column, window.columns});
    const Span rows = intersection({next->row, next->height}, {window.row, window.rows});
    if (columns.count <= 0 || rows.count <= 0) continue;
    const Window own{columns.first - next->column, rows.first - next->row, columns.count, rows.count};
    parts.push_back({&*next, own, columns.first - window.column, rows.first - window.row, {}});
  }
  std::ranges::sort(parts, [&](const Part& a, const Part& b) {
    return rule_ == OverlapRule::kLast ? a.member->order < b.member->order : a.member->order > b.member->order;
  });
  return parts;
}

void MosaicSource::read_part(const Part& part) {
  const MosaicMember& member = *part.member;
  const SampleKind& kind = plan_.kinds[member.kind];
  const bool is_alike = kind == plan_.samples.kind;
  std::vector<std::byte> raw;
  if (!is_alike) raw.resize(static_cast<std::size_t>(part.own.columns * part.own.rows) * size_bytes(kind.type));
  std::unique_ptr<HeightSource> reader = pool_.take(member);
  try {
    reader->read_window(part.own, is_alike ? part.samples : std::span(raw));
  } catch (...) {
    pool_.give_back(member, std::move(reader));
    throw;
  }
  pool_.give_back(member, std::move(reader));
  if (!is_alike) convert_samples(kind, raw, plan_.samples, part.samples);
}

/// A row of samples onto others: where their file is to be seen, void ones nowhere. column, row  in the window
void MosaicSource::lay(std::span<const std::byte> upper, std::span<const std::int32_t> orders, std::int64_t row,
                       std::int64_t column, Canvas& canvas) const {
  const std::size_t sample_bytes = size_bytes(plan_.info.sample_type);
  const auto first = static_cast<std::size_t>(row * canvas.window.columns + column);
  const std::span<std::byte> lower = canvas.samples.subspan(first * sample_bytes, upper.size());
  if (canvas.orders.empty()) return lay_over(plan_.samples.kind, upper, lower);
  std::vector<double> numbers(orders.size());
  numbers_from_samples(plan_.samples.kind, upper, numbers);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    std::int32_t& below = canvas.orders[first + i];
    const bool is_hidden = below != kNoFile && (rule_ == OverlapRule::kLast ? orders[i] < below : orders[i] > below);
    if (is_hidden || std::isnan(numbers[i])) continue;
    std::memcpy(lower.data() + i * sample_bytes, upper.data() + i * sample_bytes, sample_bytes);
    below = orders[i];
  }
}

void MosaicSource::draw(std::size_t layer, Canvas& canvas) {
  std::vector<Part> parts = parts_in(layer, canvas.window);
  for (std::size_t from = 0; from < parts.size();) {
    std::size_t end = from;
    std::size_t bytes = 0;
    do {
      bytes += bytes_of(parts[end].own);
      ++end;
    } while (end < parts.size() && end - from < pool_.most_open() && bytes + bytes_of(parts[end].own) <= kBatchBytes);
    if (parts_.size() < bytes) parts_ = std::vector<std::byte>(bytes);
    std::size_t begin = 0;
    for (std::size_t i = from; i < end; ++i) {
      parts[i].samples = std::span(parts_).subspan(begin, bytes_of(parts[i].own));
      begin += parts[i].samples.size();
    }
    oneapi::tbb::parallel_for(from, end, [&](std::size_t i) { read_part(parts[i]); });
    // Rows are laid over each other side by side, the parts of each in their order.
    oneapi::tbb::parallel_for(std::int64_t{0}, canvas.window.rows, [&](std::int64_t row) {
      for (std::size_t i = from; i < end; ++i) {
        const Part& part = parts[i];
        if (row < part.row || row >= part.row + part.own.rows) continue;
        const std::size_t part_bytes = bytes_of({0, 0, part.own.columns, 1});
        const std::vector<std::int32_t> orders(canvas.orders.empty() ? 0 : static_cast<std::size_t>(part.own.columns),
                                               static_cast<std::int32_t>(part.member->order));
        lay(part.samples.subspan(static_cast<std::size_t>(row - part.row) * part_bytes, part_bytes), orders, row,
            part.column, canvas);
      }
    });
    from = end;
  }
}

/// outer: outermost samples count as far as their areas reach. below: under what is there already.
void MosaicSource::interpolate(std::size_t layer, bool outer, bool below, Canvas& canvas) {
  const Window& window = canvas.window;
  // What blocks as wide as high need of a layer that lies askew is little more than they have themselves.
  constexpr std::int64_t kBlock = 512;
  const std::int64_t side = plan_.layers[layer].way ? kBlock : std::max(window.columns, window.rows);
  for (std::int64_t row = window.row; row < window.row + window.rows; row += side) {
    for (std::int64_t column = window.column; column < window.column + window.columns; column += side) {
      const Window block{column, row, std::min(side, window.column + window.columns - column),
                         std::min(side, window.row + window.rows - row)};
      if (!below || has_void(block, canvas)) interpolate_block(layer, outer, below, block, canvas);
    }
  }
}

bool MosaicSource::has_void(const Window& block, const Canvas& canvas) const {
  std::vector<double> numbers(static_cast<std::size_t>(block.columns));
  for (std::int64_t row = block.row; row < block.row + block.rows; ++row) {
    const Window before{0, 0, (row - canvas.window.row) * canvas.window.columns + block.column - canvas.window.column,
                        1};
    numbers_from_samples(plan_.samples.kind,
                         canvas.samples.subspan(bytes_of(before), bytes_of({0, 0, block.columns, 1})), numbers);
    if (std::ranges::any_of(numbers, [](double number) { return std::isnan(number); })) return true;
  }
  return false;
}

void MosaicSource::interpolate_block(std::size_t layer, bool outer, bool below, const Window& block, Canvas& canvas) {
  const MosaicLayer& other = plan_.layers[layer];
  const LayerPlaces places(other, plan_.info.georeference, block);
  Numbers numbers{places.needed(), {}, {}};
  if (numbers.window.columns <= 0 || numbers.window.rows <= 0) return;
  {
    std::vector<std::byte> samples(bytes_of(numbers.window));
    fill_with(plan_.samples.gap, samples);
    Canvas drawn{numbers.window, samples};
    drawn.expect_files(!canvas.orders.empty());
    draw(layer, drawn);
    numbers.values.resize(static_cast<std::size_t>(numbers.window.columns * numbers.window.rows));
    numbers_from_samples(plan_.samples.kind, samples, numbers.values);
    numbers.orders = std::move(drawn.orders);
  }
  std::vector<Between> columns;  // the same in all rows of a layer that lies straight
  for (std::int64_t i = 0; !other.way && i < block.columns; ++i)
    columns.push_back(between(places.at(block.column + i, block.row).easting, other.width, outer));
  oneapi::tbb::parallel_for(block.row, block.row + block.rows, [&](std::int64_t row) {
    std::vector<double> values(static_cast<std::size_t>(block.columns));
    std::vector<std::int32_t> orders(numbers.orders.empty() ? 0 : values.size(), kNoFile);
    Between y = between(places.at(block.column, row).northing, other.height, outer);
    for (std::size_t i = 0; i < values.size(); ++i) {
      Between x;
      if (other.way) {
        const MapPoint place = places.at(block.column + static_cast<std::int64_t>(i), row);
        x = between(place.easting, other.width, outer);
        y = between(place.northing, other.height, outer);
      } else {
        x = columns[i];
      }
      values[i] = interpolated(numbers, x, y, outer);
      if (!orders.empty()) orders[i] = numbers.order_at(x.nearest, y.nearest);
    }
    std::vector<std::byte> samples(bytes_of({0, 0, block.columns, 1}));
    samples_from_numbers(plan_.info.sample_type, values, samples);
    const std::int64_t canvas_row = row - canvas.window.row;
    const std::int64_t canvas_column = block.column - canvas.window.column;
    if (below) {
      const Window before{0, 0, canvas_row * canvas.window.columns + canvas_column, 1};
      lay_over(plan_.samples.kind, canvas.samples.subspan(bytes_of(before), samples.size()), samples);
    }
    lay(samples, orders, canvas_row, canvas_column, canvas);
  });
}

}  // namespace isohf
