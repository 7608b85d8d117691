#include "formats/mosaic/mosaic_source.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "isohf/base/assert.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

/// Rows of small members are put together to strips of about this size.
constexpr std::int64_t kLeastStripBytes = std::int64_t{4} << 20U;

/// Coordinates this close to a sample, in samples, are its place: they are computed from origins and spacings.
constexpr double kAtSample = 1e-6;

/// Between two reads of strips, all open readers together may keep this many times what one source would.
constexpr std::uint64_t kOpenReaders = 32;

std::uint64_t idle_bytes_within(std::uint64_t limit) {
  return limit < ReaderPool::kMostIdleBytes / kOpenReaders ? kOpenReaders * limit : ReaderPool::kMostIdleBytes;
}

/// The most members that begin in one row: as many are read for a strip of a regular grid.
std::uint64_t members_side_by_side(const MosaicLayer& layer) {
  std::uint64_t most = 1;
  std::uint64_t here = 1;
  for (std::size_t i = 1; i < layer.members.size(); ++i) {
    here = layer.members[i].row == layer.members[i - 1].row ? here + 1 : 1;
    most = std::max(most, here);
  }
  return most;
}

/// A place between the samples of a coarser layer, on one axis.
struct Between {
  std::int64_t first = 0;    ///< the sample at or before it; -1 and the last one have but one neighbour inside
  double fraction = 0.0;     ///< towards the next one, below 1
  std::int64_t nearest = 0;  ///< -1: beyond the layer
};

Between place_between(double position, std::int64_t samples, bool area) {
  const double nearest = std::floor(position + 0.5);
  if (std::abs(position - nearest) <= kAtSample) position = nearest;
  const double reach = area ? 0.5 + kAtSample : 0.0;
  Between place;
  place.nearest = -1;
  if (!(position >= -reach && position <= static_cast<double>(samples - 1) + reach)) return place;
  place.first = static_cast<std::int64_t>(std::floor(position));
  place.fraction = position - std::floor(position);
  place.nearest = std::clamp<std::int64_t>(static_cast<std::int64_t>(nearest), 0, samples - 1);
  return place;
}

/// Where samples first...first+count of the mosaic lie between those of a layer.
std::vector<Between> places_between(double offset, double ratio, std::int64_t first, std::int64_t count,
                                    std::int64_t samples, bool area) {
  std::vector<Between> places(static_cast<std::size_t>(count));
  for (std::int64_t i = 0; i < count; ++i) {
    const double position = offset + static_cast<double>(first + i) * ratio;
    places[static_cast<std::size_t>(i)] = place_between(position, samples, area);
  }
  return places;
}

/// The samples that interpolating at these places needs; {0, 0} where none.
std::pair<std::int64_t, std::int64_t> needed(const std::vector<Between>& places, std::int64_t samples) {
  std::int64_t low = samples;
  std::int64_t high = -1;
  for (const Between& place : places) {
    if (place.nearest < 0) continue;
    low = std::min(low, std::max<std::int64_t>(place.first, 0));
    high = std::max(high, std::min(place.first + 1, samples - 1));
  }
  return low <= high ? std::pair(low, high - low + 1) : std::pair<std::int64_t, std::int64_t>(0, 0);
}

/// Some samples of a layer as numbers, NaN where void or outside.
struct Numbers {
  Window window;
  std::vector<double> values;

  [[nodiscard]] double at(std::int64_t column, std::int64_t row) const {
    const std::int64_t c = column - window.column;
    const std::int64_t r = row - window.row;
    if (c < 0 || r < 0 || c >= window.columns || r >= window.rows) return std::numeric_limits<double>::quiet_NaN();
    return values[static_cast<std::size_t>(r * window.columns + c)];
  }
};

/// Bilinear interpolation. Points: void where a sample of some weight is. Areas: void where the nearest sample is, else
/// the weighted mean of those that are not, so that the outer half of a pixel has its elevation.
double interpolate_at(const Numbers& numbers, const Between& x, const Between& y, bool area) {
  constexpr double kVoid = std::numeric_limits<double>::quiet_NaN();
  if (x.nearest < 0 || y.nearest < 0) return kVoid;
  if (area && std::isnan(numbers.at(x.nearest, y.nearest))) return kVoid;
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
  return area && weights > 0.0 ? sum / weights : kVoid;
}

/// Where nothing is drawn yet.
constexpr std::int32_t kNoFile = -1;

/// The file that a drawn sample of a layer is of.
std::int32_t order_at(const std::vector<std::int32_t>& orders, const Window& window, std::int64_t column,
                      std::int64_t row) {
  if (column < window.column || row < window.row || column >= window.column + window.columns ||
      row >= window.row + window.rows) {
    return kNoFile;
  }
  return orders[static_cast<std::size_t>((row - window.row) * window.columns + column - window.column)];
}

/// Samples of the mosaic between two places that are computed: on a side of a cell, whose corners lie on multiples of it.
constexpr std::int64_t kCell = 16;
/// Where the middles of a cell's sides lie farther, in samples, from where its corners say, all its samples are computed.
constexpr double kStraight = 0.005;
/// Places are rounded to this, which hides last bits of libraries.
constexpr double kPlaceGrain = 4096.0;

/// Where a block of the mosaic's samples lies among those of a layer in another reference system.
class LayerPlaces {
 public:
  LayerPlaces(const MosaicLayer& layer, const Georeference& mosaic, const Window& block)
      : layer_(layer), mosaic_(mosaic), block_(block), places_(static_cast<std::size_t>(block.columns * block.rows)) {
    const std::int64_t first_x = block.column / kCell;
    const std::int64_t first_y = block.row / kCell;
    const std::int64_t across = (block.column + block.columns - 1) / kCell - first_x + 1;
    const std::int64_t down = (block.row + block.rows - 1) / kCell - first_y + 1;
    // Corners of cells and middles of their sides: every half cell but the middles of cells.
    const std::int64_t stride = 2 * across + 1;
    std::vector<MapPoint> nodes(static_cast<std::size_t>(stride * (2 * down + 1)));
    oneapi::tbb::parallel_for(std::int64_t{0}, 2 * down + 1, [&](std::int64_t j) {
      for (std::int64_t i = 0; i < stride; ++i) {
        if (i % 2 == 1 && j % 2 == 1) continue;
        nodes[static_cast<std::size_t>(j * stride + i)] =
            exact(first_x * kCell + i * (kCell / 2), first_y * kCell + j * (kCell / 2));
      }
    });
    oneapi::tbb::parallel_for(std::int64_t{0}, across * down, [&](std::int64_t cell) {
      const std::int64_t i = cell % across;
      const std::int64_t j = cell / across;
      fill((first_x + i) * kCell, (first_y + j) * kCell, nodes.data() + 2 * j * stride + 2 * i, stride);
    });
  }

  [[nodiscard]] const MapPoint& at(std::int64_t column, std::int64_t row) const {
    return places_[static_cast<std::size_t>((row - block_.row) * block_.columns + column - block_.column)];
  }
  /// The layer's samples that interpolating needs; empty where it has none there.
  [[nodiscard]] Window needed() const {
    double west = HUGE_VAL;
    double east = -HUGE_VAL;
    double north = HUGE_VAL;
    double south = -HUGE_VAL;
    for (const MapPoint& place : places_) {
      west = std::fmin(west, place.easting);
      east = std::fmax(east, place.easting);
      north = std::fmin(north, place.northing);
      south = std::fmax(south, place.northing);
    }
    const auto width = static_cast<double>(layer_.width);
    const auto height = static_cast<double>(layer_.height);
    if (!(west < width && east > -1.0 && north < height && south > -1.0)) return {};
    Window window;
    window.column = static_cast<std::int64_t>(std::clamp(std::floor(west), 0.0, width - 1.0));
    window.row = static_cast<std::int64_t>(std::clamp(std::floor(north), 0.0, height - 1.0));
    window.columns =
        static_cast<std::int64_t>(std::clamp(std::floor(east) + 1.0, 0.0, width - 1.0)) - window.column + 1;
    window.rows = static_cast<std::int64_t>(std::clamp(std::floor(south) + 1.0, 0.0, height - 1.0)) - window.row + 1;
    return window;
  }

 private:
  [[nodiscard]] MapPoint exact(std::int64_t column, std::int64_t row) const {
    const MapPoint there =
        layer_.way->members_from_mosaic({mosaic_.origin_x + static_cast<double>(column) * mosaic_.spacing_x,
                                         mosaic_.origin_y - static_cast<double>(row) * mosaic_.spacing_y});
    double columns = (there.easting - layer_.origin_x) / layer_.spacing_x;
    if (!layer_.way->members) {  // degrees: on the turn nearest to the layer's middle
      const double round = 360.0 / layer_.spacing_x;
      const double middle = static_cast<double>(layer_.width - 1) / 2.0;
      columns = middle + std::remainder(columns - middle, round);
    }
    return {columns, (layer_.origin_y - there.northing) / layer_.spacing_y};
  }
  static double apart(const MapPoint& a, const MapPoint& b, const MapPoint& middle) {
    return std::hypot((a.easting + b.easting) / 2.0 - middle.easting,
                      (a.northing + b.northing) / 2.0 - middle.northing);
  }
  void fill(std::int64_t column, std::int64_t row, const MapPoint* corner, std::int64_t stride) {
    const MapPoint& a = corner[0];
    const MapPoint& b = corner[2];
    const MapPoint& c = corner[2 * stride];
    const MapPoint& d = corner[2 * stride + 2];
    const double bend = std::max(apart(a, b, corner[1]), apart(c, d, corner[2 * stride + 1])) +
                        std::max(apart(a, c, corner[stride]), apart(b, d, corner[stride + 2]));
    const bool is_straight = bend <= kStraight;  // not where one of them is no place
    const std::int64_t end_column = std::min(column + kCell, block_.column + block_.columns);
    const std::int64_t end_row = std::min(row + kCell, block_.row + block_.rows);
    for (std::int64_t y = std::max(row, block_.row); y < end_row; ++y) {
      for (std::int64_t x = std::max(column, block_.column); x < end_column; ++x) {
        const double s = static_cast<double>(x - column) / kCell;
        const double t = static_cast<double>(y - row) / kCell;
        const auto blend = [&](double from_a, double from_b, double from_c, double from_d) {
          return (1.0 - t) * ((1.0 - s) * from_a + s * from_b) + t * ((1.0 - s) * from_c + s * from_d);
        };
        const MapPoint place = is_straight ? MapPoint{blend(a.easting, b.easting, c.easting, d.easting),
                                                      blend(a.northing, b.northing, c.northing, d.northing)}
                                           : exact(x, y);
        places_[static_cast<std::size_t>((y - block_.row) * block_.columns + x - block_.column)] = {
            std::round(place.easting * kPlaceGrain) / kPlaceGrain,
            std::round(place.northing * kPlaceGrain) / kPlaceGrain};
      }
    }
  }

  const MosaicLayer& layer_;
  const Georeference& mosaic_;
  Window block_;
  std::vector<MapPoint> places_;  ///< columns and rows of the layer
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

MosaicSource::MosaicSource(std::string path, MosaicPlan plan, const OpenOptions& options, OverlapRule rule)
    : plan_(std::move(plan)),
      rule_(rule),
      unpacked_bytes_(options.unpacked_bytes),
      pool_(options),
      strips_(plan_.info, [this](const Window& window, std::span<std::byte> samples) { compose(window, samples); }) {
  plan_.info.path = std::move(path);
  choose_strips();
  share_memory(ReaderPool::kMostIdleBytes);
}

void MosaicSource::choose_strips() {
  SourceInfo& info = plan_.info;
  const MosaicLayer& finest = plan_.layers.back();
  // Rows from one row of members to the next.
  std::int64_t pitch = info.height;
  for (std::size_t i = 1; i < finest.members.size(); ++i) {
    const std::int64_t distance = finest.members[i].row - finest.members[i - 1].row;
    if (distance > 0) pitch = std::min(pitch, distance);
  }
  if (2 * pitch < finest.tallest) pitch = finest.tallest;
  const std::int64_t row_bytes = info.width * static_cast<std::int64_t>(size_bytes(info.sample_type));
  const std::int64_t block = std::min(plan_.block_height, pitch);
  std::int64_t rows = 0;
  if (pitch <= kStripBytes / row_bytes) {
    rows = pitch * std::max<std::int64_t>(1, kLeastStripBytes / row_bytes / pitch);
  } else if (block <= kMostStripBytes / row_bytes) {
    rows = block * std::max<std::int64_t>(1, kStripBytes / row_bytes / block);
  } else {
    rows = std::max<std::int64_t>(1, kMostStripBytes / row_bytes);
  }
  info.block_height = std::min(rows, info.height);
  strips_.set_rows(info.block_height);
}

/// Packed members are held only where all those of a strip can be: opening one anew for each strip costs more than
/// going on from where it was. Where they are more than may be open, they are opened anew anyhow.
void MosaicSource::share_memory(std::uint64_t idle_bytes) {
  pool_.limit_idle(idle_bytes);
  std::uint64_t each = unpacked_bytes_ / static_cast<std::uint64_t>(plan_.readers_at_once);
  const std::uint64_t members = members_side_by_side(plan_.layers.back());
  if (members <= pool_.most_open()) each = std::min(each, std::min(idle_bytes, unpacked_bytes_) / members);
  pool_.limit_unpacked(each);
}

void MosaicSource::limit_buffers(std::uint64_t bytes) {
  share_memory(idle_bytes_within(bytes));
}

std::uint64_t MosaicSource::buffer_bytes(std::uint64_t limit) const {
  bool has_orders = false;
  for (std::size_t layer = 0; layer < plan_.layers.size(); ++layer) has_orders = has_orders || plan_.is_tied(layer);
  const std::uint64_t strip = static_cast<std::uint64_t>(plan_.info.block_height) *
                              static_cast<std::uint64_t>(plan_.info.width) *
                              (size_bytes(plan_.info.sample_type) + (has_orders ? sizeof(std::int32_t) : 0));
  std::uint64_t members = 0;
  for (const MosaicLayer& layer : plan_.layers) members += layer.members.size();
  const std::uint64_t reading = static_cast<std::uint64_t>(plan_.readers_at_once) * plan_.reader_bytes;
  const std::uint64_t open = std::min<std::uint64_t>(members, pool_.most_open()) * plan_.reader_bytes;
  std::int64_t widest = 0;
  for (const MosaicMember& member : plan_.layers.back().members) widest = std::max(widest, member.width);
  const std::size_t part = bytes_of({0, 0, widest, plan_.info.block_height});
  const std::uint64_t parts = std::min<std::uint64_t>(strip, std::max(part, kBatchBytes));
  return strip + parts + std::min(open, reading + idle_bytes_within(limit));
}

std::size_t MosaicSource::bytes_of(const Window& window) const {
  return static_cast<std::size_t>(window.columns * window.rows) * size_bytes(plan_.info.sample_type);
}

void MosaicSource::read_window(const Window& window, std::span<std::byte> samples) {
  const SourceInfo& info = plan_.info;
  ISOHF_ASSERT(window.column >= 0 && window.row >= 0 && window.columns >= 0 && window.rows >= 0);
  ISOHF_ASSERT(window.column + window.columns <= info.width && window.row + window.rows <= info.height);
  ISOHF_ASSERT(samples.size() == bytes_of(window));
  strips_.read(window, samples);
}

void MosaicSource::compose(const Window& window, std::span<std::byte> out) {
  fill_with(plan_.samples.gap, out);
  Orders orders;
  for (std::size_t layer = 0; layer < plan_.layers.size(); ++layer) {
    if (layer == 0 || plan_.layers[layer].rank != plan_.layers[layer - 1].rank) orders = orders_for(layer, window);
    if (plan_.is_on_grid(plan_.layers[layer])) {
      draw(layer, window, out, orders);
    } else if (plan_.layers[layer].way) {
      reproject(layer, false, window, out, orders);
    } else {
      interpolate(layer, window, out, orders);
    }
  }
  if (plan_.info.georeference.registration == Registration::kPoint) return;
  for (std::size_t layer = plan_.layers.size(); layer-- > 0;) {
    Orders none;
    if (plan_.layers[layer].way) reproject(layer, true, window, out, none);
  }
}

MosaicSource::Orders MosaicSource::orders_for(std::size_t layer, const Window& window) const {
  if (!plan_.is_tied(layer)) return {};
  return Orders(static_cast<std::size_t>(window.columns * window.rows), kNoFile);
}

void MosaicSource::lay_by_order(std::span<const std::byte> upper, std::span<const std::int32_t> upper_orders,
                                std::span<std::byte> lower, std::span<std::int32_t> lower_orders) const {
  const std::size_t sample_bytes = size_bytes(plan_.info.sample_type);
  std::vector<double> numbers(upper_orders.size());
  numbers_from_samples(plan_.samples.kind, upper, numbers);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const std::int32_t above = upper_orders[i];
    const std::int32_t below = lower_orders[i];
    if (std::isnan(numbers[i]) || (below != kNoFile && (rule_ == OverlapRule::kLast ? above < below : above > below)))
      continue;
    std::memcpy(lower.data() + i * sample_bytes, upper.data() + i * sample_bytes, sample_bytes);
    lower_orders[i] = above;
  }
}

std::vector<MosaicSource::Part> MosaicSource::parts_in(std::size_t layer, const Window& window) const {
  const MosaicLayer& members = plan_.layers[layer];
  std::vector<Part> parts;
  auto next = std::lower_bound(members.members.begin(), members.members.end(), window.row - members.tallest + 1,
                               [](const MosaicMember& member, std::int64_t row) { return member.row < row; });
  for (; next != members.members.end() && next->row < window.row + window.rows; ++next) {
    Part part;
    part.member = &*next;
    part.column = next->column;
    part.row = next->row;
    if (overlap(part.column, part.own.column, part.own.columns, next->width, window.column, window.columns) > 0 &&
        overlap(part.row, part.own.row, part.own.rows, next->height, window.row, window.rows) > 0) {
      parts.push_back(part);
    }
  }
  std::sort(parts.begin(), parts.end(), [&](const Part& a, const Part& b) {
    return rule_ == OverlapRule::kLast ? a.member->order < b.member->order : a.member->order > b.member->order;
  });
  return parts;
}

void MosaicSource::read_part(Part& part) {
  const MosaicMember& member = *part.member;
  const SampleKind& kind = plan_.kinds[member.kind];
  std::unique_ptr<HeightSource> reader = pool_.take(member.order, member);
  const auto read = [&](std::span<std::byte> raw) {
    try {
      reader->read_window(part.own, raw);
    } catch (...) {
      pool_.give_back(member.order, std::move(reader));
      throw;
    }
    pool_.give_back(member.order, std::move(reader));
  };
  if (kind == plan_.samples.kind) return read(part.samples);
  std::vector<std::byte> raw(static_cast<std::size_t>(part.own.columns * part.own.rows) * size_bytes(kind.type));
  read(raw);
  convert_samples(kind, raw, plan_.samples, part.samples);
}

void MosaicSource::draw(std::size_t layer, const Window& window, std::span<std::byte> out, Orders& orders) {
  std::vector<Part> parts = parts_in(layer, window);
  const std::size_t sample_bytes = size_bytes(plan_.info.sample_type);
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
    oneapi::tbb::parallel_for(std::int64_t{0}, window.rows, [&](std::int64_t row) {
      for (std::size_t i = from; i < end; ++i) {
        const Part& part = parts[i];
        if (row < part.row || row >= part.row + part.own.rows) continue;
        const auto columns = static_cast<std::size_t>(part.own.columns);
        const std::size_t part_bytes = columns * sample_bytes;
        const auto first = static_cast<std::size_t>(row * window.columns + part.column);
        const auto upper = part.samples.subspan(static_cast<std::size_t>(row - part.row) * part_bytes, part_bytes);
        const auto lower = out.subspan(first * sample_bytes, part_bytes);
        if (orders.empty()) {
          lay_over(plan_.samples.kind, upper, lower);
        } else {
          const Orders own(columns, static_cast<std::int32_t>(part.member->order));
          lay_by_order(upper, own, lower, std::span(orders).subspan(first, columns));
        }
      }
    });
    from = end;
  }
}

void MosaicSource::interpolate(std::size_t layer, const Window& window, std::span<std::byte> out, Orders& orders) {
  const MosaicLayer& coarse = plan_.layers[layer];
  const Georeference& place = plan_.info.georeference;
  const bool area = place.registration != Registration::kPoint;
  const std::vector<Between> x =
      places_between((place.origin_x - coarse.origin_x) / coarse.spacing_x, place.spacing_x / coarse.spacing_x,
                     window.column, window.columns, coarse.width, area);
  const std::vector<Between> y =
      places_between((coarse.origin_y - place.origin_y) / coarse.spacing_y, place.spacing_y / coarse.spacing_y,
                     window.row, window.rows, coarse.height, area);
  Numbers numbers;
  std::tie(numbers.window.column, numbers.window.columns) = needed(x, coarse.width);
  std::tie(numbers.window.row, numbers.window.rows) = needed(y, coarse.height);
  if (numbers.window.columns == 0 || numbers.window.rows == 0) return;
  Orders drawn_orders = orders.empty() ? Orders() : orders_for(layer, numbers.window);
  {
    std::vector<std::byte> samples(bytes_of(numbers.window));
    fill_with(plan_.samples.gap, samples);
    draw(layer, numbers.window, samples, drawn_orders);
    numbers.values.resize(static_cast<std::size_t>(numbers.window.columns * numbers.window.rows));
    numbers_from_samples(plan_.samples.kind, samples, numbers.values);
  }
  const std::size_t row_bytes = static_cast<std::size_t>(window.columns) * size_bytes(plan_.info.sample_type);
  oneapi::tbb::parallel_for(std::int64_t{0}, window.rows, [&](std::int64_t row) {
    std::vector<double> values(x.size());
    for (std::size_t i = 0; i < x.size(); ++i) {
      values[i] = interpolate_at(numbers, x[i], y[static_cast<std::size_t>(row)], area);
    }
    std::vector<std::byte> samples(row_bytes);
    samples_from_numbers(plan_.info.sample_type, values, samples);
    const auto lower = out.subspan(static_cast<std::size_t>(row) * row_bytes, row_bytes);
    if (orders.empty()) return lay_over(plan_.samples.kind, samples, lower);
    Orders own(x.size(), kNoFile);
    for (std::size_t i = 0; i < x.size(); ++i) {
      own[i] = order_at(drawn_orders, numbers.window, x[i].nearest, y[static_cast<std::size_t>(row)].nearest);
    }
    lay_by_order(samples, own, lower, std::span(orders).subspan(static_cast<std::size_t>(row) * x.size(), x.size()));
  });
}

/// outer: where nothing else is, outermost samples as far as their areas reach; else between samples alone, so that
/// none is continued beside a layer that knows better.
void MosaicSource::reproject(std::size_t layer, bool outer, const Window& window, std::span<std::byte> out,
                             Orders& orders) {
  // Blocks as wide as high: what they need of a layer that lies askew is little more than they have themselves.
  constexpr std::int64_t kBlock = 512;
  for (std::int64_t row = window.row; row < window.row + window.rows; row += kBlock) {
    for (std::int64_t column = window.column; column < window.column + window.columns; column += kBlock) {
      const Window block{column, row, std::min(kBlock, window.column + window.columns - column),
                         std::min(kBlock, window.row + window.rows - row)};
      if (!outer || has_void(block, window, out)) reproject_block(layer, outer, block, window, out, orders);
    }
  }
}

bool MosaicSource::has_void(const Window& block, const Window& window, std::span<const std::byte> out) const {
  const std::size_t sample_bytes = size_bytes(plan_.info.sample_type);
  std::vector<double> numbers(static_cast<std::size_t>(block.columns));
  for (std::int64_t row = block.row; row < block.row + block.rows; ++row) {
    const std::int64_t first = (row - window.row) * window.columns + block.column - window.column;
    numbers_from_samples(plan_.samples.kind,
                         out.subspan(static_cast<std::size_t>(first) * sample_bytes, numbers.size() * sample_bytes),
                         numbers);
    if (std::any_of(numbers.begin(), numbers.end(), [](double number) { return std::isnan(number); })) return true;
  }
  return false;
}

void MosaicSource::reproject_block(std::size_t layer, bool outer, const Window& block, const Window& window,
                                   std::span<std::byte> out, Orders& orders) {
  const MosaicLayer& other = plan_.layers[layer];
  const LayerPlaces places(other, plan_.info.georeference, block);
  Numbers numbers;
  numbers.window = places.needed();
  if (numbers.window.columns <= 0 || numbers.window.rows <= 0) return;
  std::vector<std::byte> drawn(bytes_of(numbers.window));
  fill_with(plan_.samples.gap, drawn);
  Orders drawn_orders = orders.empty() ? Orders() : orders_for(layer, numbers.window);
  draw(layer, numbers.window, drawn, drawn_orders);
  numbers.values.resize(static_cast<std::size_t>(numbers.window.columns * numbers.window.rows));
  numbers_from_samples(plan_.samples.kind, drawn, numbers.values);
  const std::size_t sample_bytes = size_bytes(plan_.info.sample_type);
  oneapi::tbb::parallel_for(block.row, block.row + block.rows, [&](std::int64_t row) {
    std::vector<double> values(static_cast<std::size_t>(block.columns));
    Orders own(orders.empty() ? 0 : values.size(), kNoFile);
    for (std::int64_t i = 0; i < block.columns; ++i) {
      const MapPoint& place = places.at(block.column + i, row);
      const Between x = place_between(place.easting, other.width, outer);
      const Between y = place_between(place.northing, other.height, outer);
      values[static_cast<std::size_t>(i)] = interpolate_at(numbers, x, y, outer);
      if (!own.empty()) own[static_cast<std::size_t>(i)] = order_at(drawn_orders, numbers.window, x.nearest, y.nearest);
    }
    std::vector<std::byte> samples(values.size() * sample_bytes);
    samples_from_numbers(plan_.info.sample_type, values, samples);
    const std::int64_t first = (row - window.row) * window.columns + block.column - window.column;
    const auto there = out.subspan(static_cast<std::size_t>(first) * sample_bytes, samples.size());
    if (!own.empty())
      return lay_by_order(samples, own, there, std::span(orders).subspan(static_cast<std::size_t>(first), own.size()));
    if (!outer) return lay_over(plan_.samples.kind, samples, there);
    lay_over(plan_.samples.kind, there, samples);
    std::copy(samples.begin(), samples.end(), there.begin());
  });
}

}  // namespace isohf
