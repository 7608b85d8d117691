#include "formats/mosaic/mosaic_layout.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include "isohf/error.h"
#include "isohf/projection/projected_extent.h"

namespace isohf {
namespace {

/// Spacings that differ by less, relatively, are one resolution.
constexpr double kSameResolution = 1e-3;
/// The same across reference systems: maps of neighbouring zones differ in scale.
constexpr double kAboutAsFine = 1.05;
/// Rounding that moves samples by more than this is worth a word, and from the second on it is a place that is lost:
/// texts of six digits round by less.
constexpr double kWorthAWord = 1e-3;
constexpr double kPlaceLost = 1e-2;
/// Sides of more samples would overflow byte counts; far beyond what memory bounds.
constexpr double kMostSamples = 1e9;
/// Edges of coarser members that fall on samples are computed and may miss them by a little.
constexpr double kOnSample = 1e-6;

using Spacing = std::pair<double, double>;

struct Resolution {
  Spacing spacing;  ///< the commonest of its members'
  std::vector<PlacedMember> members;
};

bool is_same_resolution(const Spacing& a, const Spacing& b) {
  return std::abs(a.first / b.first - 1.0) <= kSameResolution && std::abs(a.second / b.second - 1.0) <= kSameResolution;
}

/// Of members in one reference system, finest columns first; independent of the members' order.
std::vector<Resolution> of_one_system(std::vector<PlacedMember> members) {
  std::map<Spacing, std::int64_t> counts;
  for (const PlacedMember& placed : members) ++counts[{placed.spacing_x, placed.spacing_y}];
  std::vector<Resolution> found;
  std::vector<std::int64_t> commonest;
  std::map<Spacing, std::size_t> where;
  for (const auto& [spacing, count] : counts) {
    std::size_t i = 0;
    while (i < found.size() && !is_same_resolution(found[i].spacing, spacing)) ++i;
    if (i == found.size()) {
      found.push_back({spacing, {}});
      commonest.push_back(0);
    }
    if (count > commonest[i]) {
      commonest[i] = count;
      found[i].spacing = spacing;
    }
    where[spacing] = i;
  }
  for (PlacedMember& placed : members) {
    found[where[{placed.spacing_x, placed.spacing_y}]].members.push_back(std::move(placed));
  }
  return found;
}

/// By reference system, then by resolution.
std::vector<Resolution> by_resolution(std::vector<PlacedMember> members) {
  std::vector<Resolution> found;
  while (!members.empty()) {
    const auto other =
        std::stable_partition(members.begin(), members.end(),
                              [way = members.front().way](const PlacedMember& placed) { return placed.way == way; });
    std::vector<PlacedMember> others(std::make_move_iterator(other), std::make_move_iterator(members.end()));
    members.erase(other, members.end());
    for (Resolution& resolution : of_one_system(std::move(members))) found.push_back(std::move(resolution));
    members = std::move(others);
  }
  return found;
}

/// A member's first sample on one axis of its layer's grid, and how far it or its last one lies off.
struct Snapped {
  std::int64_t first = 0;
  double off = 0.0;
};

Snapped snap(double distance, double spacing, double own_spacing, std::int64_t samples) {
  const double place = distance / spacing;
  const double first = std::round(place);
  const auto steps = static_cast<double>(samples - 1);
  const double last_off = (distance + steps * own_spacing) / spacing - (first + steps);
  const double off = place - first;
  return {static_cast<std::int64_t>(first), std::abs(last_off) > std::abs(off) ? last_off : off};
}

[[noreturn]] void refuse_misaligned(const std::string& path, const char* axis, double off) {
  throw Error(
      ErrorCode::kUnsupported,
      fmt::format("{}: lies {:.3g} of a sample off the grid of the other files of its resolution in {}, at most "
                  "{} is taken as rounding; resample it to their grid (gdalwarp -tap) or leave it out",
                  path, std::abs(off), axis, kSnapTolerance));
}

MosaicLayer lay_out(Resolution resolution, double& worst) {
  MosaicLayer layer;
  std::tie(layer.spacing_x, layer.spacing_y) = resolution.spacing;
  layer.way = resolution.members.front().way;
  const std::vector<PlacedMember>& placed = resolution.members;
  const auto west = [](const PlacedMember& a, const PlacedMember& b) { return a.origin_x < b.origin_x; };
  const auto south = [](const PlacedMember& a, const PlacedMember& b) { return a.origin_y < b.origin_y; };
  layer.origin_x = std::min_element(placed.begin(), placed.end(), west)->origin_x;
  layer.origin_y = std::max_element(placed.begin(), placed.end(), south)->origin_y;
  for (PlacedMember& each : resolution.members) {
    MosaicMember& member = each.member;
    const double x = each.origin_x - layer.origin_x;
    const double y = layer.origin_y - each.origin_y;
    if (!(x / layer.spacing_x < kMostSamples && y / layer.spacing_y < kMostSamples)) {
      throw Error(ErrorCode::kUnsupported,
                  fmt::format("{}: lies more than {:.0e} samples from other files of the mosaic; is its georeference "
                              "right? leave it out otherwise",
                              member.path, kMostSamples));
    }
    const Snapped column = snap(x, layer.spacing_x, each.spacing_x, member.width);
    const Snapped row = snap(y, layer.spacing_y, each.spacing_y, member.height);
    if (std::abs(column.off) > kSnapTolerance) refuse_misaligned(member.path, "x", column.off);
    if (std::abs(row.off) > kSnapTolerance) refuse_misaligned(member.path, "y", row.off);
    worst = std::max({worst, std::abs(column.off), std::abs(row.off)});
    member.column = column.first;
    member.row = row.first;
    layer.width = std::max(layer.width, member.column + member.width);
    layer.height = std::max(layer.height, member.row + member.height);
    layer.tallest = std::max(layer.tallest, member.height);
    layer.members.push_back(std::move(member));
  }
  std::sort(layer.members.begin(), layer.members.end(), [](const MosaicMember& a, const MosaicMember& b) {
    return std::tie(a.row, a.column, a.order) < std::tie(b.row, b.column, b.order);
  });
  return layer;
}

/// First and last whole numbers in [low, high].
std::pair<std::int64_t, std::int64_t> whole_numbers(double low, double high) {
  return {static_cast<std::int64_t>(std::ceil(low - kOnSample)),
          static_cast<std::int64_t>(std::floor(high + kOnSample))};
}

/// Of a coarser layer's samples first...last, those of the finer axis that lie in their reach.
std::pair<std::int64_t, std::int64_t> covered(double offset, double ratio, std::int64_t first, std::int64_t last,
                                              double reach) {
  return whole_numbers(offset + (static_cast<double>(first) - reach) * ratio,
                       offset + (static_cast<double>(last) + reach) * ratio);
}

/// The rectangle of the mosaic's coordinates that samples of a layer of another system stand for.
MapBounds bounds_of(const MosaicLayer& layer, const SampleRectangle& samples, double reach) {
  constexpr int kSteps = 32;
  const double west = layer.origin_x + (static_cast<double>(samples.column) - reach) * layer.spacing_x;
  const double north = layer.origin_y - (static_cast<double>(samples.row) - reach) * layer.spacing_y;
  const MapBounds own{west, north - (static_cast<double>(samples.rows - 1) + 2.0 * reach) * layer.spacing_y,
                      west + (static_cast<double>(samples.columns - 1) + 2.0 * reach) * layer.spacing_x, north};
  const MapBounds image = image_bounds(
      own, [&](const MapPoint& at) { return layer.way->mosaic_from_members(at); }, kSteps);
  if (std::isfinite(image.west)) return image;
  throw Error(ErrorCode::kInvalidArgument, layer.members.front().path +
                                               ": the map on which files are joined has no place for it; `projection` "
                                               "names another, or leave it out");
}

/// How far apart a layer's samples are in the mosaic's coordinates, in the middle.
void measure(MosaicLayer& layer) {
  layer.size_x = layer.spacing_x;
  layer.size_y = layer.spacing_y;
  if (!layer.way) return;
  const MapPoint middle{layer.origin_x + static_cast<double>(layer.width - 1) / 2.0 * layer.spacing_x,
                        layer.origin_y - static_cast<double>(layer.height - 1) / 2.0 * layer.spacing_y};
  const auto apart = [&](double x, double y) {
    const MapPoint a = layer.way->mosaic_from_members({middle.easting - x / 2.0, middle.northing - y / 2.0});
    const MapPoint b = layer.way->mosaic_from_members({middle.easting + x / 2.0, middle.northing + y / 2.0});
    return std::hypot(b.easting - a.easting, b.northing - a.northing);
  };
  layer.size_x = apart(layer.spacing_x, 0.0);
  layer.size_y = apart(0.0, layer.spacing_y);
}

/// A grid for layers of which none is in the mosaic's system, or none as fine as others: spacings of three digits, samples on
/// whole multiples of them.
void make_grid(const std::vector<MosaicLayer>& layers, Georeference& place) {
  const auto round_down = [](double spacing) {
    const double grain = std::pow(10.0, std::floor(std::log10(spacing)) - 2.0);
    return std::round(spacing / grain) * grain;
  };
  double finest = HUGE_VAL;
  MapBounds all{HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  const double reach = place.registration == Registration::kArea ? 0.5 : 0.0;
  for (const MosaicLayer& layer : layers) {
    finest = std::min({finest, layer.size_x, layer.size_y});
    const MapBounds bounds =
        layer.way ? bounds_of(layer, {0, 0, layer.width, layer.height}, reach)
                  : MapBounds{layer.origin_x - reach * layer.spacing_x,
                              layer.origin_y - (static_cast<double>(layer.height - 1) + reach) * layer.spacing_y,
                              layer.origin_x + (static_cast<double>(layer.width - 1) + reach) * layer.spacing_x,
                              layer.origin_y + reach * layer.spacing_y};
    all = {std::min(all.west, bounds.west), std::min(all.south, bounds.south), std::max(all.east, bounds.east),
           std::max(all.north, bounds.north)};
  }
  place.spacing_x = place.spacing_y = round_down(finest);
  place.origin_x = (std::floor(all.west / place.spacing_x) + reach) * place.spacing_x;
  place.origin_y = (std::ceil(all.north / place.spacing_y) - reach) * place.spacing_y;
}

struct Extent {
  std::int64_t first = 0;
  std::int64_t last = 0;

  void include(std::pair<std::int64_t, std::int64_t> range) {
    first = std::min(first, range.first);
    last = std::max(last, range.second);
  }
};

/// More places than this are not looked at one by one.
constexpr std::int64_t kMostPlaces = 10'000'000;

std::string grouped(std::int64_t number) {
  const std::string digits = std::to_string(number);
  std::string text;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) text += ',';
    text += digits[i];
  }
  return text;
}

std::vector<SampleRectangle> grounds(const MosaicPlan& plan, double reach) {
  std::vector<SampleRectangle> all;
  for (const MosaicLayer& layer : plan.layers) {
    for (const MosaicMember& member : layer.members) all.push_back(ground_of(plan, layer, member, reach));
  }
  return all;
}

/// "x 500000...510000, y 6740000...6750000"; a square degree of whole degrees as .hgt files name it.
std::string place_name(const MosaicPlan& plan, const SampleRectangle& at) {
  const Georeference& place = plan.info.georeference;
  const double reach = place.registration == Registration::kPoint ? 0.0 : 0.5;
  const double x0 = place.origin_x + (static_cast<double>(at.column) - reach) * place.spacing_x;
  const double y1 = place.origin_y - (static_cast<double>(at.row) - reach) * place.spacing_y;
  const double x1 = x0 + static_cast<double>(at.columns) * place.spacing_x;
  const double y0 = y1 - static_cast<double>(at.rows) * place.spacing_y;
  const double lon = std::round(x0);
  const double lat = std::round(y0);
  const auto is_near = [](double a, double b, double spacing) { return std::abs(a - b) < spacing / 2.0; };
  if (place.unit == HorizontalUnit::kDegree && is_near(x0, lon, place.spacing_x) &&
      is_near(x1, lon + 1.0, place.spacing_x) && is_near(y0, lat, place.spacing_y) &&
      is_near(y1, lat + 1.0, place.spacing_y)) {
    const auto longitude = static_cast<int>(lon - 360.0 * std::floor((lon + 180.0) / 360.0));
    return fmt::format("{}{:02}{}{:03}", lat < 0.0 ? 'S' : 'N', std::abs(static_cast<int>(lat)),
                       longitude < 0 ? 'W' : 'E', std::abs(longitude));
  }
  return fmt::format("x {:.10g}...{:.10g}, y {:.10g}...{:.10g}", x0, x1, y0, y1);
}

bool lies_in(const Window& region, const SampleRectangle& place) {
  return place.column < region.column + region.columns && region.column < place.column + place.columns &&
         place.row < region.row + region.rows && region.row < place.row + place.rows;
}

/// Distance of neighbouring places on one axis, where all members begin at multiples of it and most fill about one.
std::optional<std::int64_t> pitch_of(const std::set<std::int64_t>& begins, std::vector<std::int64_t> sizes) {
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  if (begins.size() == 1) return *std::max_element(sizes.begin(), sizes.end());
  const auto holds = [&](std::int64_t pitch) {
    return pitch > 0 && std::all_of(begins.begin(), begins.end(),
                                    [&](std::int64_t begin) { return (begin - *begins.begin()) % pitch == 0; });
  };
  std::int64_t nearest = *std::next(begins.begin()) - *begins.begin();
  for (auto at = begins.begin(); std::next(at) != begins.end(); ++at) nearest = std::min(nearest, *std::next(at) - *at);
  if (nearest <= *middle) return 2 * nearest >= *middle && holds(nearest) ? std::optional(nearest) : std::nullopt;
  // No two are neighbours: side by side, or with a post in common.
  for (const std::int64_t pitch : {*middle, *middle - 1}) {
    if (holds(pitch)) return pitch;
  }
  return std::nullopt;
}

void find_missing_places(const MosaicPlan& plan, MosaicHoles& holes) {
  const bool area = plan.info.georeference.registration != Registration::kPoint;
  const std::vector<SampleRectangle> members = grounds(plan, area ? 0.5 : 0.0);
  std::set<std::int64_t> columns;
  std::set<std::int64_t> rows;
  std::vector<std::int64_t> widths;
  std::vector<std::int64_t> heights;
  for (const SampleRectangle& member : members) {
    columns.insert(member.column);
    rows.insert(member.row);
    widths.push_back(member.columns);
    heights.push_back(member.rows);
  }
  const std::optional<std::int64_t> pitch_x = pitch_of(columns, widths);
  const std::optional<std::int64_t> pitch_y = pitch_of(rows, heights);
  if (!pitch_x || !pitch_y) return;
  // What a place shares with the next one, a row or column of posts, makes none of its own.
  const auto places = [](std::int64_t first, std::int64_t samples, std::int64_t pitch) {
    return std::max<std::int64_t>(1, (samples - first - pitch / 4 + pitch - 1) / pitch);
  };
  const std::int64_t across = places(*columns.begin(), plan.info.width, *pitch_x);
  const std::int64_t down = places(*rows.begin(), plan.info.height, *pitch_y);
  if (across > kMostPlaces / down) return;
  std::vector<bool> taken(static_cast<std::size_t>(across * down));
  for (const SampleRectangle& member : members) {
    // Places whose middles it covers.
    const auto range = [](std::int64_t begin, std::int64_t size, std::int64_t pitch, std::int64_t count) {
      const std::int64_t first = (begin + pitch - pitch / 2 - 1) / pitch;
      const std::int64_t end = (begin + size + pitch - pitch / 2 - 1) / pitch;
      return std::pair(first, std::min(std::max(end, begin / pitch + 1), count));
    };
    const auto [x0, x1] = range(member.column - *columns.begin(), member.columns, *pitch_x, across);
    const auto [y0, y1] = range(member.row - *rows.begin(), member.rows, *pitch_y, down);
    for (std::int64_t y = y0; y < y1; ++y) {
      for (std::int64_t x = x0; x < x1; ++x) taken[static_cast<std::size_t>(y * across + x)] = true;
    }
  }
  for (std::int64_t i = 0; i < across * down; ++i) {
    const SampleRectangle place{*columns.begin() + i % across * *pitch_x, *rows.begin() + i / across * *pitch_y,
                                *pitch_x, *pitch_y};
    if (!lies_in(plan.region, place)) continue;
    ++holes.tiles;
    if (taken[static_cast<std::size_t>(i)]) continue;
    ++holes.tiles_missing;
    if (holes.missing.size() < MosaicHoles::kMostNamed) holes.missing.push_back(place_name(plan, place));
  }
}

/// Counts the samples of the region in no rectangle and remembers the first stretch of them.
}  // namespace

std::int64_t overlap(std::int64_t& first, std::int64_t& begin, std::int64_t& count, std::int64_t samples,
                     std::int64_t window_first, std::int64_t window_count) {
  const std::int64_t low = std::max(first, window_first);
  const std::int64_t high = std::min(first + samples, window_first + window_count);
  begin = low - first;
  count = high - low;
  first = low - window_first;
  return count;
}

std::int64_t uncovered(std::vector<SampleRectangle> members, const Window& region,
                       std::optional<SampleRectangle>& first) {
  std::sort(members.begin(), members.end(),
            [](const SampleRectangle& a, const SampleRectangle& b) { return a.row < b.row; });
  const auto in_region = [&](std::int64_t row) { return std::clamp(row, region.row, region.row + region.rows); };
  std::set<std::int64_t> cuts = {region.row, region.row + region.rows};
  for (const SampleRectangle& member : members) {
    cuts.insert(in_region(member.row));
    cuts.insert(in_region(member.row + member.rows));
  }
  std::int64_t count = 0;
  std::vector<SampleRectangle> active;
  auto next = members.begin();
  for (auto cut = cuts.begin(); std::next(cut) != cuts.end(); ++cut) {
    const std::int64_t top = *cut;
    const std::int64_t rows = *std::next(cut) - top;
    active.erase(std::remove_if(active.begin(), active.end(),
                                [&](const SampleRectangle& member) { return member.row + member.rows <= top; }),
                 active.end());
    for (; next != members.end() && next->row <= top; ++next) {
      if (next->rows > 0 && next->columns > 0) active.push_back(*next);
    }
    std::sort(active.begin(), active.end(),
              [](const SampleRectangle& a, const SampleRectangle& b) { return a.column < b.column; });
    std::int64_t reached = region.column;
    const std::int64_t east = region.column + region.columns;
    const auto skip_to = [&](std::int64_t column) {
      column = std::min(column, east);
      if (column <= reached) return;
      count += (column - reached) * rows;
      if (!first) first = SampleRectangle{reached, top, column - reached, rows};
    };
    for (const SampleRectangle& member : active) {
      skip_to(member.column);
      reached = std::max(reached, member.column + member.columns);
    }
    skip_to(east);
  }
  return count;
}

MapPoint MosaicWay::members_from_mosaic(MapPoint place) const {
  const GeoPoint geo = mosaic->geo_from_map(place);
  return members ? members->map_from_geo(geo) : MapPoint{geo.longitude, geo.latitude};
}

MapPoint MosaicWay::mosaic_from_members(MapPoint place) const {
  return mosaic->map_from_geo(members ? members->geo_from_map(place) : GeoPoint{place.easting, place.northing});
}

void join_antimeridian(std::vector<PlacedMember>& members) {
  constexpr double kTurn = 360.0;
  const auto end_of = [](const PlacedMember& placed) {
    return placed.origin_x + static_cast<double>(placed.member.width) * placed.spacing_x;
  };
  std::vector<std::size_t> order(members.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto sort_by_west = [&] {
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return members[a].origin_x < members[b].origin_x; });
  };
  const auto east = [&] {
    double most = end_of(members.front());
    for (const PlacedMember& placed : members) most = std::max(most, end_of(placed));
    return most;
  };
  sort_by_west();
  // Some files count longitudes from 0 to 360, others from -180 to 180.
  if (east() - members[order.front()].origin_x > kTurn + 2.0 * members.front().spacing_x) {
    for (PlacedMember& placed : members) placed.origin_x -= kTurn * std::floor((placed.origin_x + 180.0) / kTurn);
    sort_by_west();
  }
  double reach = end_of(members[order.front()]);
  for (const std::size_t i : order) {
    const double start = members[i].origin_x;
    if (start - reach > kTurn / 2.0) {
      for (PlacedMember& placed : members) {
        if (placed.origin_x < start) placed.origin_x += kTurn;
      }
      return;
    }
    reach = std::max(reach, end_of(members[i]));
  }
}

void place_members(std::vector<PlacedMember> members, MosaicPlan& plan) {
  double worst = 0.0;
  for (Resolution& resolution : by_resolution(std::move(members))) {
    plan.layers.push_back(lay_out(std::move(resolution), worst));
    measure(plan.layers.back());
  }
  if (worst > kWorthAWord) {
    plan.info.warnings.push_back(fmt::format(
        "places of files are rounded: they lie up to {:.2g} of a sample off their common grid and are put on it",
        worst));
    if (worst >= kPlaceLost) plan.info.warnings.back().kind = Warning::Kind::kLoss;
  }
  // Coarsest first; of two of one area, the one with the wider columns.
  std::stable_sort(plan.layers.begin(), plan.layers.end(), [](const MosaicLayer& a, const MosaicLayer& b) {
    const double area_a = a.size_x * a.size_y;
    const double area_b = b.size_x * b.size_y;
    return area_a != area_b ? area_a > area_b : a.size_x > b.size_x;
  });
  const auto is_as_fine = [](double a, double b) { return std::max(a / b, b / a) <= kAboutAsFine; };
  for (std::size_t i = 1, first = 0; i < plan.layers.size(); ++i) {
    const MosaicLayer& coarsest = plan.layers[first];
    MosaicLayer& layer = plan.layers[i];
    const bool is_same =
        plan.is_reprojected && is_as_fine(coarsest.size_x, layer.size_x) && is_as_fine(coarsest.size_y, layer.size_y);
    layer.rank = coarsest.rank + (is_same ? 0 : 1);
    if (!is_same) first = i;
  }
  Georeference& place = plan.info.georeference;
  const double reach = place.registration == Registration::kArea ? 0.5 : 0.0;
  // The finest of the mosaic's own system; of equally fine layers the last, the finest in the other direction as well.
  const MosaicLayer* x_from = nullptr;
  const MosaicLayer* y_from = nullptr;
  double finest = HUGE_VAL;
  for (auto layer = plan.layers.rbegin(); layer != plan.layers.rend(); ++layer) {
    finest = std::min({finest, layer->size_x, layer->size_y});
    if (layer->way) continue;
    if (x_from == nullptr || layer->spacing_x < x_from->spacing_x) x_from = &*layer;
    if (y_from == nullptr || layer->spacing_y < y_from->spacing_y) y_from = &*layer;
  }
  const bool has_grid = x_from != nullptr && std::min(x_from->spacing_x, y_from->spacing_y) <= kAboutAsFine * finest;
  Extent columns{0, 0};
  Extent rows{0, 0};
  if (has_grid) {
    place.spacing_x = x_from->spacing_x;
    place.spacing_y = y_from->spacing_y;
    place.origin_x = x_from->origin_x;
    place.origin_y = y_from->origin_y;
    columns.last = x_from->width - 1;
    rows.last = y_from->height - 1;
  } else {
    make_grid(plan.layers, place);
  }
  for (const MosaicLayer& layer : plan.layers) {
    if (plan.is_on_grid(layer)) continue;
    if (layer.way) {
      const MapBounds bounds = bounds_of(layer, {0, 0, layer.width, layer.height}, reach);
      columns.include(whole_numbers((bounds.west - place.origin_x) / place.spacing_x,
                                    (bounds.east - place.origin_x) / place.spacing_x));
      rows.include(whole_numbers((place.origin_y - bounds.north) / place.spacing_y,
                                 (place.origin_y - bounds.south) / place.spacing_y));
      continue;
    }
    columns.include(covered((layer.origin_x - place.origin_x) / place.spacing_x, layer.spacing_x / place.spacing_x, 0,
                            layer.width - 1, reach));
    rows.include(covered((place.origin_y - layer.origin_y) / place.spacing_y, layer.spacing_y / place.spacing_y, 0,
                         layer.height - 1, reach));
  }
  plan.info.width = columns.last - columns.first + 1;
  plan.info.height = rows.last - rows.first + 1;
  if (!(static_cast<double>(plan.info.width) < kMostSamples && static_cast<double>(plan.info.height) < kMostSamples)) {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("{} files make a mosaic of {} x {} samples; are their georeferences right?",
                            plan.layers.size(), plan.info.width, plan.info.height));
  }
  // Not touched where the finest members reach as far as any: the whole has the very origin of its pieces then.
  if (columns.first != 0) place.origin_x += static_cast<double>(columns.first) * place.spacing_x;
  if (rows.first != 0) place.origin_y -= static_cast<double>(rows.first) * place.spacing_y;
  for (MosaicLayer& layer : plan.layers) {
    if (!plan.is_on_grid(layer)) continue;
    for (MosaicMember& member : layer.members) {
      member.column -= columns.first;
      member.row -= rows.first;
    }
    layer.origin_x = place.origin_x;
    layer.origin_y = place.origin_y;
    layer.width = plan.info.width;
    layer.height = plan.info.height;
  }
}

SampleRectangle ground_of(const MosaicPlan& plan, const MosaicLayer& layer, const MosaicMember& member, double reach) {
  if (plan.is_on_grid(layer)) return {member.column, member.row, member.width, member.height};
  const Georeference& place = plan.info.georeference;
  if (layer.way) {
    const MapBounds bounds = bounds_of(layer, {member.column, member.row, member.width, member.height}, reach);
    const auto columns = whole_numbers((bounds.west - place.origin_x) / place.spacing_x,
                                       (bounds.east - place.origin_x) / place.spacing_x);
    const auto rows = whole_numbers((place.origin_y - bounds.north) / place.spacing_y,
                                    (place.origin_y - bounds.south) / place.spacing_y);
    const std::int64_t column = std::max<std::int64_t>(columns.first, 0);
    const std::int64_t row = std::max<std::int64_t>(rows.first, 0);
    return {column, row, std::max<std::int64_t>(std::min(columns.second, plan.info.width - 1) - column + 1, 0),
            std::max<std::int64_t>(std::min(rows.second, plan.info.height - 1) - row + 1, 0)};
  }
  auto [west, east] = covered((layer.origin_x - place.origin_x) / place.spacing_x, layer.spacing_x / place.spacing_x,
                              member.column, member.column + member.width - 1, reach);
  auto [north, south] = covered((place.origin_y - layer.origin_y) / place.spacing_y, layer.spacing_y / place.spacing_y,
                                member.row, member.row + member.height - 1, reach);
  west = std::max<std::int64_t>(west, 0);
  north = std::max<std::int64_t>(north, 0);
  east = std::min(east, plan.info.width - 1);
  south = std::min(south, plan.info.height - 1);
  return {west, north, std::max<std::int64_t>(east - west + 1, 0), std::max<std::int64_t>(south - north + 1, 0)};
}

std::string MosaicHoles::describe(std::size_t named) const {
  if (samples == 0 && tiles_missing == 0) return {};
  const std::size_t shown = std::min(named, missing.size());
  std::string where =
      fmt::format("{}", fmt::join(missing.begin(), missing.begin() + static_cast<std::ptrdiff_t>(shown), "; "));
  if (tiles_missing == 0) return fmt::format("{} samples lie in no file, the first at {}", grouped(samples), where);
  const std::int64_t more = tiles_missing - static_cast<std::int64_t>(shown);
  if (more > 0) where += fmt::format(" and {} more", grouped(more));
  return fmt::format("{} of {} tiles are missing ({} samples): {}", grouped(tiles_missing), grouped(tiles),
                     grouped(samples), where);
}

MosaicHoles find_holes(const MosaicPlan& plan) {
  MosaicHoles holes;
  std::optional<SampleRectangle> first;
  holes.samples = uncovered(grounds(plan, 0.5), plan.region, first);
  if (holes.samples == 0) return holes;
  find_missing_places(plan, holes);
  if (holes.tiles_missing == 0 && first) holes.missing = {place_name(plan, *first)};
  return holes;
}

}  // namespace isohf
