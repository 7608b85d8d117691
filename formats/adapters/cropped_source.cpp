#include "formats/adapters/cropped_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <functional>
#include <utility>
#include <vector>

#include "formats/adapters/windowed_source.h"
#include "isohf/error.h"
#include "isohf/projection/crs/crs.h"
#include "isohf/projection/crs/source_system.h"
#include "isohf/projection/other_reading.h"

namespace isohf {
namespace {

constexpr double kTurn = 360.0;
/// Edges this close to a sample, in samples, lie on it: coordinates are written in few digits.
constexpr double kOnSample = 1e-6;

[[noreturn]] void refuse(const std::string& why) {
  throw Error(ErrorCode::kInvalidArgument, why);
}

/// First and last of n samples in low...high, and whether the range went beyond the samples' own reach.
struct Stretch {
  std::int64_t first = 0;
  std::int64_t last = -1;
  bool cut = false;
};

Stretch stretch(double low, double high, std::int64_t samples, double reach) {
  const double last = static_cast<double>(samples - 1);
  const double from = std::clamp(std::ceil(low - kOnSample), 0.0, last + 1.0);
  const double to = std::clamp(std::floor(high + kOnSample), -1.0, last);
  // Half a sample more than it has is how people write the outline of a raster of points.
  const double slack = std::max(reach, 0.5) + kOnSample;
  return {static_cast<std::int64_t>(from), static_cast<std::int64_t>(to), low < -slack || high > last + slack};
}

struct Part {
  Window window;
  bool cut = false;
  /// Of a globe that the box leaves on the East side and enters again on the West side: the columns there that belong
  /// to it as well, from the raster's `again_from` on.
  std::int64_t again_from = 0;
  std::int64_t again = 0;
};

std::string text_of(const MapBounds& box) {
  return fmt::format("{:.10g},{:.10g},{:.10g},{:.10g}", box.west, box.south, box.east, box.north);
}

std::string text_of(const BoundingBox& box) {
  return fmt::format("`bbox` {},{},{},{}", box.west, box.south, box.east, box.north);
}

/// What else a box that names no ground of a raster may be; empty, or what a sentence ends with.
std::string other_box(const BoundingBox& box, const Georeference& place, const MapBounds& covered) {
  std::vector<PairReading> readings = {own_reading(covered, place.unit == HorizontalUnit::kDegree)};
  const auto take = [&](GeoPoint middle, const std::function<MapPoint(GeoPoint)>& in_own) {
    add_geographic_readings(readings, place.system.body, middle, in_own);
  };
  if (place.unit == HorizontalUnit::kDegree) {
    take({covered.middle().easting, covered.middle().northing}, [](GeoPoint at) {
      return MapPoint{at.longitude, at.latitude};
    });
  } else if (const std::string system = system_text(place.system); !system.empty()) {
    try {
      const auto map = understand_map(system, place.metres_per_unit);
      take(map->geo_from_map(covered.middle()), [map](GeoPoint at) { return map->map_from_geo(at); });
    } catch (const Error&) {  // then the box may still be swapped
    }
  }
  const auto other = other_reading({box.west, box.south, box.east, box.north}, covered, readings);
  return other ? fmt::format("; read as {} it is `bbox` {}", other->words, text_of(other->bounds)) : std::string();
}

/// Where the columns of a box lie: at both ends of a raster of a whole turn they are one piece.
void find_columns(const BoundingBox& box, const SourceInfo& info, double reach, Part& part) {
  const Georeference& place = info.georeference;
  const bool degrees = place.unit == HorizontalUnit::kDegree;
  double east = box.east;
  if (degrees && east <= box.west) east += kTurn;
  if (!(box.west < east)) refuse(fmt::format("`bbox`: West is {}, which must be less than East, {}", box.west, east));
  const auto at = [&](double turn) {
    return stretch((box.west + turn - place.origin_x) / place.spacing_x,
                   (east + turn - place.origin_x) / place.spacing_x, info.width, reach);
  };
  const auto take = [&](const Stretch& columns) {
    part.window.column = columns.first;
    part.window.columns = columns.last - columns.first + 1;
    part.cut = columns.cut;
  };
  if (!degrees) return take(at(0.0));
  std::vector<Stretch> found;
  for (const double turn : {2.0 * kTurn, kTurn, 0.0, -kTurn, -2.0 * kTurn}) {
    if (const Stretch columns = at(turn); columns.last >= columns.first) found.push_back(columns);
  }
  if (found.empty()) return;
  // One column alone is an edge that the box touches, or too few.
  const Stretch widest =
      *std::ranges::max_element(found, {}, [](const Stretch& columns) { return columns.last - columns.first; });
  const bool is_split =
      std::ranges::count_if(found, [](const Stretch& columns) { return columns.last > columns.first; }) > 1;
  if (!is_split) return take(widest);
  std::erase_if(found, [](const Stretch& columns) { return columns.last == columns.first; });
  const auto turn_columns = static_cast<std::int64_t>(std::llround(kTurn / place.spacing_x));
  const bool goes_round = std::abs(static_cast<double>(turn_columns) * place.spacing_x - kTurn) < kOnSample * kTurn &&
                          (info.width == turn_columns || info.width == turn_columns + 1);
  const Stretch& west = found.front();  // of the box: what the raster ends with
  const Stretch& other = found[1];
  if (!goes_round) {
    refuse(
        fmt::format("{}: {} lies at both of its ends, columns {} to {} and {} to {}, and it does not go all the way "
                    "round; take the two parts one after the other",
                    info.path, text_of(box), west.first, west.last, other.first, other.last));
  }
  take(west);
  part.cut = false;
  part.again_from = west.last + 1 - turn_columns;  // 0, or 1 where the last column is the first once more
  part.again = std::max<std::int64_t>(std::min(other.last + 1, west.first) - part.again_from, 0);
}

Part part_in(const BoundingBox& box, const SourceInfo& info) {
  const Georeference& place = info.georeference;
  if (!place.has_origin) refuse(info.path + ": does not say where it lies, which `bbox` needs");
  const double reach = place.registration == Registration::kPoint ? 0.0 : 0.5;
  const Stretch rows = stretch((place.origin_y - box.north) / place.spacing_y,
                               (place.origin_y - box.south) / place.spacing_y, info.height, reach);
  Part part;
  find_columns(box, info, reach, part);
  if (part.window.columns + part.again < 2 || rows.last <= rows.first) {
    const MapBounds covered{place.origin_x - reach * place.spacing_x,
                            place.origin_y - (static_cast<double>(info.height - 1) + reach) * place.spacing_y,
                            place.origin_x + (static_cast<double>(info.width - 1) + reach) * place.spacing_x,
                            place.origin_y + reach * place.spacing_y};
    refuse(fmt::format("{}: fewer than 2x2 samples lie in {}; its own ground is {} in {}{}", info.path, text_of(box),
                       text_of(covered), name_of(place), other_box(box, place, covered)));
  }
  part.window.row = rows.first;
  part.window.rows = rows.last - rows.first + 1;
  part.cut = part.cut || rows.cut;
  return part;
}

class CroppedSource final : public WindowedSource {
 public:
  CroppedSource(std::unique_ptr<HeightSource> source, const Part& part)
      : WindowedSource(std::move(source), part.window) {
    if (!part.cut) return;
    mutable_info().warnings.push_back(
        fmt::format("`bbox` reaches beyond {}; what lies in both is taken, {} x {} samples", info().path, info().width,
                    info().height));
  }
};

/// A part of a globe that goes on at its other end.
class JoinedSource final : public HeightSource {
 public:
  JoinedSource(std::unique_ptr<HeightSource> source, const Part& part) : JoinedSource(*source, part) {
    own_ = std::move(source);
    HeightSource& stored = source_.as_stored();
    if (&stored != &source_) stored_.reset(new JoinedSource(stored, part));
  }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    const std::int64_t from_first = std::clamp<std::int64_t>(part_.window.columns - window.column, 0, window.columns);
    const std::int64_t row = part_.window.row + window.row;
    const Window first = {part_.window.column + window.column, row, from_first, window.rows};
    const Window second = {part_.again_from + window.column + from_first - part_.window.columns, row,
                           window.columns - from_first, window.rows};
    if (second.columns == 0) return source_.read_window(first, samples);
    if (first.columns == 0) return source_.read_window(second, samples);
    // A row of blocks at a time, so that the source decodes none of them twice.
    const std::size_t row_bytes = static_cast<std::size_t>(window.columns) * size_bytes(info_.sample_type);
    const std::int64_t step = std::max<std::int64_t>(info_.block_height, 1);
    for (std::int64_t done = 0; done < window.rows; done += step) {
      const std::int64_t rows = std::min(step, window.rows - done);
      std::byte* at = samples.data() + static_cast<std::size_t>(done) * row_bytes;
      for (const Window& half : {first, second}) {
        const std::size_t half_bytes = static_cast<std::size_t>(half.columns) * size_bytes(info_.sample_type);
        piece_.resize(half_bytes * static_cast<std::size_t>(rows));
        source_.read_window({half.column, half.row + done, half.columns, rows}, piece_);
        for (std::size_t r = 0; r < static_cast<std::size_t>(rows); ++r) {
          std::memcpy(at + r * row_bytes, piece_.data() + r * half_bytes, half_bytes);
        }
        at += half_bytes;
      }
    }
  }

  // Both ends of a row of blocks are needed at once.
  [[nodiscard]] std::uint64_t buffer_bytes() const override {
    return source_.buffer_bytes() + static_cast<std::uint64_t>(info_.width) *
                                        static_cast<std::uint64_t>(std::max<std::int64_t>(info_.block_height, 1)) *
                                        size_bytes(info_.sample_type);
  }
  [[nodiscard]] HeightSource& as_stored() override { return stored_ ? *stored_ : *this; }

 private:
  JoinedSource(HeightSource& source, const Part& part) : source_(source), part_(part), info_(source.info()) {
    info_.width = part.window.columns + part.again;
    info_.height = part.window.rows;
    info_.block_width = std::min(info_.block_width, info_.width);
    info_.georeference.origin_x += static_cast<double>(part.window.column) * info_.georeference.spacing_x;
    info_.georeference.origin_y -= static_cast<double>(part.window.row) * info_.georeference.spacing_y;
  }

  std::unique_ptr<HeightSource> own_;  ///< source_, where this is its only user
  HeightSource& source_;
  Part part_;
  SourceInfo info_;
  std::vector<std::byte> piece_;
  std::unique_ptr<JoinedSource> stored_;  ///< null: source_ is as stored
};

}  // namespace

BoundingBox bounding_box_from_string(const std::string& text) {
  const auto fail = [&] {
    refuse("found '" + text + "', must be WEST,SOUTH,EAST,NORTH in the input's coordinates, South below North");
  };
  double values[4] = {};
  const char* at = text.data();
  const char* const end = text.data() + text.size();
  for (int i = 0; i < 4; ++i) {
    const auto [rest, error] = std::from_chars(at, end, values[i]);
    if (error != std::errc() || !std::isfinite(values[i])) fail();
    at = rest;
    if (i == 3) break;
    if (at == end || *at != ',') fail();
    ++at;
  }
  if (at != end || !(values[1] < values[3]) || values[0] == values[2]) fail();
  return {values[0], values[1], values[2], values[3]};
}

Window samples_in(const BoundingBox& box, const SourceInfo& info) {
  const Part part = part_in(box, info);
  if (part.again == 0) return part.window;
  return {0, part.window.row, info.width, part.window.rows};
}

std::unique_ptr<HeightSource> crop(std::unique_ptr<HeightSource> source, const BoundingBox& box) {
  const Part part = part_in(box, source->info());
  if (part.again > 0) return std::make_unique<JoinedSource>(std::move(source), part);
  return std::make_unique<CroppedSource>(std::move(source), part);
}

}  // namespace isohf
