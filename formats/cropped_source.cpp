#include "formats/cropped_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

#include "formats/windowed_source.h"
#include "isohf/base/error.h"

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
};

Part part_in(const BoundingBox& box, const SourceInfo& info) {
  const Georeference& place = info.georeference;
  if (!place.has_origin) refuse(info.path + ": does not say where it lies, which --bbox needs");
  const double reach = place.registration == Registration::kPoint ? 0.0 : 0.5;
  Stretch rows = stretch((place.origin_y - box.north) / place.spacing_y, (place.origin_y - box.south) / place.spacing_y,
                         info.height, reach);
  double west = box.west;
  double east = box.east;
  const bool degrees = place.unit == HorizontalUnit::kDegree;
  if (degrees && east <= west) east += kTurn;
  if (!(west < east)) refuse(fmt::format("--bbox: West is {}, which must be less than East, {}", west, east));
  Stretch columns;
  for (const double turn : {0.0, kTurn, -kTurn}) {
    columns = stretch((west + turn - place.origin_x) / place.spacing_x,
                      (east + turn - place.origin_x) / place.spacing_x, info.width, reach);
    if (!degrees || columns.last > columns.first) break;
  }
  if (columns.last <= columns.first || rows.last <= rows.first) {
    refuse(
        fmt::format("{}: fewer than 2x2 samples lie in --bbox {},{},{},{}; its own ground is {:.10g},{:.10g},{:.10g},"
                    "{:.10g} (West, South, East, North)",
                    info.path, box.west, box.south, box.east, box.north, place.origin_x - reach * place.spacing_x,
                    place.origin_y - (static_cast<double>(info.height - 1) + reach) * place.spacing_y,
                    place.origin_x + (static_cast<double>(info.width - 1) + reach) * place.spacing_x,
                    place.origin_y + reach * place.spacing_y));
  }
  return {{columns.first, rows.first, columns.last - columns.first + 1, rows.last - rows.first + 1},
          columns.cut || rows.cut};
}

class CroppedSource final : public WindowedSource {
 public:
  CroppedSource(std::unique_ptr<HeightSource> source, const Part& part)
      : WindowedSource(std::move(source), part.window) {
    if (!part.cut) return;
    mutable_info().warnings.push_back(
        fmt::format("--bbox reaches beyond {}; what lies in both is taken, {} x {} samples", info().path, info().width,
                    info().height));
  }
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
  return part_in(box, info).window;
}

std::unique_ptr<HeightSource> crop(std::unique_ptr<HeightSource> source, const BoundingBox& box) {
  const Part part = part_in(box, source->info());
  return std::make_unique<CroppedSource>(std::move(source), part);
}

}  // namespace isohf
