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

/// Strips of whole rows of members, or whole blocks of theirs, up to about this size...
constexpr std::int64_t kStripBytes = std::int64_t{16} << 20U;
/// ...and one row of blocks up to this size, so that no block is decoded twice.
constexpr std::int64_t kMostStripBytes = std::int64_t{256} << 20U;
/// Rows of small members are put together to strips of about this size.
constexpr std::int64_t kLeastStripBytes = std::int64_t{4} << 20U;
/// Parts of members that are read side by side.
constexpr std::size_t kBatchBytes = std::size_t{8} << 20U;

/// Coordinates this close to a sample, in samples, are its place: they are computed from origins and spacings.
constexpr double kOnSample = 1e-6;

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
  if (std::abs(position - nearest) <= kOnSample) position = nearest;
  const double reach = area ? 0.5 + kOnSample : 0.0;
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

std::int64_t overlap(std::int64_t& first, std::int64_t& begin, std::int64_t& count, std::int64_t samples,
                     std::int64_t window_first, std::int64_t window_count) {
  // first: the member's place in the layer; begin: of the part in the member.
  const std::int64_t low = std::max(first, window_first);
  const std::int64_t high = std::min(first + samples, window_first + window_count);
  begin = low - first;
  count = high - low;
  first = low - window_first;
  return count;
}

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
    : plan_(std::move(plan)), rule_(rule), unpacked_bytes_(options.unpacked_bytes), pool_(options) {
  plan_.info.path = std::move(path);
  choose_strips();
  share_memory(ReaderPool::kMostIdleBytes);
  strip_columns_ = plan_.info.width;
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
  const std::uint64_t strip = static_cast<std::uint64_t>(plan_.info.block_height) *
                              static_cast<std::uint64_t>(plan_.info.width) * size_bytes(plan_.info.sample_type);
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
  // Passes read the same columns again and again; the first window of others is read as it is.
  const bool follows = window.column == strip_column_ && window.columns == strip_columns_;
  if (!follows) {
    strip_number_ = -1;
    strip_column_ = window.column;
    strip_columns_ = window.columns;
  }
  const std::size_t row_bytes = static_cast<std::size_t>(window.columns) * size_bytes(info.sample_type);
  const std::int64_t end = window.row + window.rows;
  for (std::int64_t row = window.row; row < end;) {
    const std::int64_t strip = row / info.block_height;
    const std::int64_t top = strip * info.block_height;
    const std::int64_t bottom = std::min(top + info.block_height, info.height);
    const std::int64_t rows = std::min(end, bottom) - row;
    const auto out = samples.subspan(static_cast<std::size_t>(row - window.row) * row_bytes,
                                     static_cast<std::size_t>(rows) * row_bytes);
    const bool in_one_go = !follows || (row == top && row + rows == bottom);
    if (strip != strip_number_ && in_one_go) {
      compose({window.column, row, window.columns, rows}, out);
    } else {
      read_strip(strip);
      std::memcpy(out.data(), strip_.data() + static_cast<std::size_t>(row - top) * row_bytes, out.size());
    }
    row += rows;
  }
}

void MosaicSource::read_strip(std::int64_t strip) {
  if (strip == strip_number_) return;
  const std::int64_t top = strip * plan_.info.block_height;
  const Window window{strip_column_, top, strip_columns_, std::min(plan_.info.block_height, plan_.info.height - top)};
  strip_number_ = -1;
  strip_.resize(bytes_of(window));
  compose(window, strip_);
  strip_number_ = strip;
}

void MosaicSource::compose(const Window& window, std::span<std::byte> out) {
  fill_with(plan_.samples.gap, out);
  for (std::size_t layer = 0; layer < plan_.layers.size(); ++layer) {
    if (plan_.is_on_grid(plan_.layers[layer])) {
      draw(layer, window, out);
    } else {
      interpolate(layer, window, out);
    }
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

void MosaicSource::draw(std::size_t layer, const Window& window, std::span<std::byte> out) {
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
        const std::size_t part_bytes = static_cast<std::size_t>(part.own.columns) * sample_bytes;
        lay_over(plan_.samples.kind,
                 part.samples.subspan(static_cast<std::size_t>(row - part.row) * part_bytes, part_bytes),
                 out.subspan(static_cast<std::size_t>(row * window.columns + part.column) * sample_bytes, part_bytes));
      }
    });
    from = end;
  }
}

void MosaicSource::interpolate(std::size_t layer, const Window& window, std::span<std::byte> out) {
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
  {
    std::vector<std::byte> samples(bytes_of(numbers.window));
    fill_with(plan_.samples.gap, samples);
    draw(layer, numbers.window, samples);
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
    lay_over(plan_.samples.kind, samples, out.subspan(static_cast<std::size_t>(row) * row_bytes, row_bytes));
  });
}

}  // namespace isohf
