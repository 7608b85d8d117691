#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "formats/mosaic/mosaic_plan.h"
#include "isohf/error.h"
#include "isohf/projection/projected_extent.h"

namespace isohf {
namespace {

/// Spacings that differ by less, relatively, are one resolution.
constexpr double kSameResolution = 1e-3;
/// The same across reference systems: maps of neighbouring zones differ in scale.
constexpr double kAboutAsFine = 1.05;
/// Rounding that moves samples by more than this is worth a note, and from the second on it is a position that is lost:
/// texts of six digits round by less.
constexpr double kWorthANote = 1e-3;
constexpr double kPlaceLost = 1e-2;
/// Sides of more samples would overflow byte counts; far beyond what memory bounds.
constexpr double kMostSamples = 1e9;
/// Edges of coarser members that fall on samples are computed and may miss them by a little.
constexpr double kOnSample = 1e-6;

bool is_same_resolution(const PlacedMember& a, const PlacedMember& b) {
  return std::abs(a.spacing_x / b.spacing_x - 1.0) <= kSameResolution &&
         std::abs(a.spacing_y / b.spacing_y - 1.0) <= kSameResolution;
}

/// Members of one reference system and resolution. The first of a group has the commonest spacing.
std::vector<std::vector<PlacedMember>> by_resolution(std::vector<PlacedMember> members) {
  const auto spacing = [](const PlacedMember& placed) { return std::pair(placed.spacing_x, placed.spacing_y); };
  std::map<std::pair<double, double>, std::int64_t> count;
  for (const PlacedMember& placed : members) ++count[spacing(placed)];
  std::ranges::stable_sort(
      members, {}, [&](const PlacedMember& placed) { return std::pair(-count[spacing(placed)], spacing(placed)); });
  std::vector<std::vector<PlacedMember>> groups;
  for (PlacedMember& placed : members) {
    const auto group = std::ranges::find_if(groups, [&](const std::vector<PlacedMember>& others) {
      return others.front().way == placed.way && is_same_resolution(others.front(), placed);
    });
    (group == groups.end() ? groups.emplace_back() : *group).push_back(std::move(placed));
  }
  return groups;
}

/// The position of a member's first sample on one axis of its layer's grid. `worst` grows to how far it or the last
/// one lies off.
std::int64_t snap(const std::string& path, const char* axis, double distance, double spacing, double own_spacing,
                  std::int64_t samples, double& worst) {
  const double first = std::round(distance / spacing);
  const auto steps = static_cast<double>(samples - 1);
  const double off = std::abs(distance / spacing - first);
  const double last_off = std::abs((distance + steps * own_spacing) / spacing - (first + steps));
  worst = std::max({worst, off, last_off});
  if (std::max(off, last_off) <= kSnapTolerance) return static_cast<std::int64_t>(first);
  throw Error(
      ErrorCode::kUnsupported,
      fmt::format("{}: lies {:.3g} of a sample off the grid of the other files of its resolution in {}, at most "
                  "{} is taken as rounding; resample it to their grid (gdalwarp -tap) or leave it out",
                  path, std::max(off, last_off), axis, kSnapTolerance));
}

MosaicLayer lay_out(std::vector<PlacedMember> placed, double& worst) {
  MosaicLayer layer;
  layer.spacing_x = placed.front().spacing_x;
  layer.spacing_y = placed.front().spacing_y;
  layer.way = placed.front().way;
  layer.origin_x = std::ranges::min(placed, {}, &PlacedMember::origin_x).origin_x;
  layer.origin_y = std::ranges::max(placed, {}, &PlacedMember::origin_y).origin_y;
  for (PlacedMember& each : placed) {
    MosaicMember& member = each.member;
    const double x = each.origin_x - layer.origin_x;
    const double y = layer.origin_y - each.origin_y;
    if (!(x / layer.spacing_x < kMostSamples && y / layer.spacing_y < kMostSamples)) {
      throw Error(ErrorCode::kUnsupported,
                  fmt::format("{}: lies more than {:.0e} samples from other files of the mosaic; is its georeference "
                              "right? leave it out otherwise",
                              member.path, kMostSamples));
    }
    member.column = snap(member.path, "x", x, layer.spacing_x, each.spacing_x, member.width, worst);
    member.row = snap(member.path, "y", y, layer.spacing_y, each.spacing_y, member.height, worst);
    layer.width = std::max(layer.width, member.column + member.width);
    layer.height = std::max(layer.height, member.row + member.height);
    layer.tallest = std::max(layer.tallest, member.height);
    layer.members.push_back(std::move(member));
  }
  std::ranges::sort(layer.members, {},
                    [](const MosaicMember& member) { return std::tuple(member.row, member.column, member.order); });
  return layer;
}

/// The rectangle of the mosaic's coordinates that samples of a layer stand for; the outermost `reach` beyond their
/// positions, in samples.
MapBounds bounds_of(const MosaicLayer& layer, const Window& samples, double reach) {
  constexpr int kSteps = 32;
  const auto x = [&](double column) { return layer.origin_x + column * layer.spacing_x; };
  const auto y = [&](double row) { return layer.origin_y - row * layer.spacing_y; };
  const MapBounds own{x(static_cast<double>(samples.column) - reach),
                      y(static_cast<double>(samples.row + samples.rows - 1) + reach),
                      x(static_cast<double>(samples.column + samples.columns - 1) + reach),
                      y(static_cast<double>(samples.row) - reach)};
  if (!layer.way) return own;
  const auto to_mosaic = [&](const MapPoint& at) { return layer.way->mosaic_from_members(at); };
  const MapBounds image = image_bounds(own, to_mosaic, kSteps);
  if (std::isfinite(image.west)) return image;
  throw Error(ErrorCode::kInvalidArgument, layer.members.front().path +
                                               ": the map on which files are joined has no place for it; `projection` "
                                               "names another, or leave it out");
}

Window all_of(const MosaicLayer& layer) {
  return {0, 0, layer.width, layer.height};
}

/// The samples of a grid that lie in bounds, which may reach beyond the raster.
Window samples_within(const Georeference& grid, const MapBounds& bounds) {
  const auto first = [](double distance, double spacing) {
    return static_cast<std::int64_t>(std::ceil(distance / spacing - kOnSample));
  };
  const auto end = [](double distance, double spacing) {
    return static_cast<std::int64_t>(std::floor(distance / spacing + kOnSample)) + 1;
  };
  const std::int64_t column = first(bounds.west - grid.origin_x, grid.spacing_x);
  const std::int64_t row = first(grid.origin_y - bounds.north, grid.spacing_y);
  return {column, row, end(bounds.east - grid.origin_x, grid.spacing_x) - column,
          end(grid.origin_y - bounds.south, grid.spacing_y) - row};
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

/// Sorts layers, coarsest first, and ranks them.
void rank(std::vector<MosaicLayer>& layers, bool is_reprojected) {
  // Of two of one area, the one with the wider columns comes first.
  std::ranges::stable_sort(layers, std::greater(), [](const MosaicLayer& layer) {
    return std::pair(layer.size_x * layer.size_y, layer.size_x);
  });
  const auto is_as_fine = [](double a, double b) { return std::max(a / b, b / a) <= kAboutAsFine; };
  for (std::size_t i = 1, first = 0; i < layers.size(); ++i) {
    const MosaicLayer& coarsest = layers[first];
    MosaicLayer& layer = layers[i];
    const bool is_same =
        is_reprojected && is_as_fine(coarsest.size_x, layer.size_x) && is_as_fine(coarsest.size_y, layer.size_y);
    layer.rank = coarsest.rank + (is_same ? 0 : 1);
    if (!is_same) first = i;
  }
}

/// Chooses the mosaic's grid: that of the finest layer in its own reference system. If there is none, or none as fine
/// as others: spacings of three digits, samples on whole multiples of them. Returns the samples that the layer has.
Window choose_grid(const std::vector<MosaicLayer>& layers, Georeference& place) {
  // Of equally fine layers the last, the finest in the other direction as well.
  const MosaicLayer* x_from = nullptr;
  const MosaicLayer* y_from = nullptr;
  double finest = HUGE_VAL;
  for (auto layer = layers.rbegin(); layer != layers.rend(); ++layer) {
    finest = std::min({finest, layer->size_x, layer->size_y});
    if (layer->way) continue;
    if (x_from == nullptr || layer->spacing_x < x_from->spacing_x) x_from = &*layer;
    if (y_from == nullptr || layer->spacing_y < y_from->spacing_y) y_from = &*layer;
  }
  if (x_from != nullptr && std::min(x_from->spacing_x, y_from->spacing_y) <= kAboutAsFine * finest) {
    std::tie(place.spacing_x, place.origin_x) = std::pair(x_from->spacing_x, x_from->origin_x);
    std::tie(place.spacing_y, place.origin_y) = std::pair(y_from->spacing_y, y_from->origin_y);
    return {0, 0, x_from->width, y_from->height};
  }
  const double reach = place.registration == Registration::kArea ? 0.5 : 0.0;
  double west = HUGE_VAL;
  double north = -HUGE_VAL;
  for (const MosaicLayer& layer : layers) {
    const MapBounds bounds = bounds_of(layer, all_of(layer), reach);
    west = std::min(west, bounds.west);
    north = std::max(north, bounds.north);
  }
  const double grain = std::pow(10.0, std::floor(std::log10(finest)) - 2.0);
  place.spacing_x = place.spacing_y = std::round(finest / grain) * grain;
  place.origin_x = (std::floor(west / place.spacing_x) + reach) * place.spacing_x;
  place.origin_y = (std::ceil(north / place.spacing_y) - reach) * place.spacing_y;
  return {0, 0, 1, 1};
}

Window joined(const Window& a, const Window& b) {
  const std::int64_t column = std::min(a.column, b.column);
  const std::int64_t row = std::min(a.row, b.row);
  return {column, row, std::max(a.column + a.columns, b.column + b.columns) - column,
          std::max(a.row + a.rows, b.row + b.rows) - row};
}

/// Samples of `region` in none of `members`, and the first rectangle of them.
std::int64_t uncovered(std::vector<Window> members, const Window& region, std::optional<Window>& first) {
  std::ranges::sort(members, {}, &Window::row);
  const std::int64_t east = region.column + region.columns;
  const auto in_region = [&](std::int64_t row) { return std::clamp(row, region.row, region.row + region.rows); };
  std::set<std::int64_t> cuts = {region.row, region.row + region.rows};
  for (const Window& member : members) cuts.insert({in_region(member.row), in_region(member.row + member.rows)});
  std::int64_t count = 0;
  std::vector<Window> active;
  auto next = members.begin();
  for (auto cut = cuts.begin(); std::next(cut) != cuts.end(); ++cut) {
    const std::int64_t top = *cut;
    const std::int64_t rows = *std::next(cut) - top;
    std::erase_if(active, [&](const Window& member) { return member.row + member.rows <= top; });
    for (; next != members.end() && next->row <= top; ++next) {
      if (next->row + next->rows > top && next->columns > 0) active.push_back(*next);
    }
    std::ranges::sort(active, {}, &Window::column);
    std::int64_t reached = region.column;
    const auto skip_to = [&](std::int64_t column) {
      column = std::min(column, east);
      if (column <= reached) return;
      count += (column - reached) * rows;
      if (!first) first = Window{reached, top, column - reached, rows};
    };
    for (const Window& member : active) {
      skip_to(member.column);
      reached = std::max(reached, member.column + member.columns);
    }
    skip_to(east);
  }
  return count;
}

}  // namespace

MapPoint MosaicWay::members_from_mosaic(MapPoint place) const {
  const GeoPoint geo = mosaic->geo_from_map(place);
  return members ? members->map_from_geo(geo) : MapPoint{geo.longitude, geo.latitude};
}

MapPoint MosaicWay::mosaic_from_members(MapPoint place) const {
  return mosaic->map_from_geo(members ? members->geo_from_map(place) : GeoPoint{place.easting, place.northing});
}

Span intersection(Span a, Span b) {
  const std::int64_t first = std::max(a.first, b.first);
  return {first, std::min(a.first + a.count, b.first + b.count) - first};
}

void join_antimeridian(std::vector<PlacedMember>& members) {
  constexpr double kTurn = 360.0;
  const auto end_of = [](const PlacedMember& placed) {
    return placed.origin_x + static_cast<double>(placed.member.width) * placed.spacing_x;
  };
  std::vector<std::size_t> order(members.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto sort_by_west = [&] { std::ranges::sort(order, {}, [&](std::size_t i) { return members[i].origin_x; }); };
  sort_by_west();
  const double east = end_of(std::ranges::max(members, {}, end_of));
  // Some files count longitudes from 0 to 360, others from -180 to 180.
  if (east - members[order.front()].origin_x > kTurn + 2.0 * members.front().spacing_x) {
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
  SourceInfo& info = plan.info;
  double worst = 0.0;
  for (std::vector<PlacedMember>& group : by_resolution(std::move(members))) {
    plan.layers.push_back(lay_out(std::move(group), worst));
    measure(plan.layers.back());
  }
  if (worst > kWorthANote) {
    info.warnings.push_back({fmt::format("places of files are rounded: they lie up to {:.2g} of a sample off their "
                                         "common grid and are put on it",
                                         worst),
                             worst >= kPlaceLost ? Warning::Kind::kLoss : Warning::Kind::kNote});
  }
  rank(plan.layers, plan.is_reprojected);
  Georeference& place = info.georeference;
  Window whole = choose_grid(plan.layers, place);
  const double reach = place.registration == Registration::kArea ? 0.5 : 0.0;
  for (const MosaicLayer& layer : plan.layers) {
    if (!plan.is_on_grid(layer)) whole = joined(whole, samples_within(place, bounds_of(layer, all_of(layer), reach)));
  }
  if (!(static_cast<double>(whole.columns) < kMostSamples && static_cast<double>(whole.rows) < kMostSamples)) {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("the files make a mosaic of {} x {} samples; are their georeferences right?", whole.columns,
                            whole.rows));
  }
  info.width = whole.columns;
  info.height = whole.rows;
  // Not touched if the finest members reach as far as any: the whole has the very origin of its pieces then.
  if (whole.column != 0) place.origin_x += static_cast<double>(whole.column) * place.spacing_x;
  if (whole.row != 0) place.origin_y -= static_cast<double>(whole.row) * place.spacing_y;
  for (MosaicLayer& layer : plan.layers) {
    if (!plan.is_on_grid(layer)) continue;
    for (MosaicMember& member : layer.members) {
      member.column -= whole.column;
      member.row -= whole.row;
    }
    std::tie(layer.origin_x, layer.origin_y) = std::pair(place.origin_x, place.origin_y);
    std::tie(layer.width, layer.height) = std::pair(info.width, info.height);
  }
}

void check_coverage(MosaicPlan& plan, const Window& region) {
  constexpr double kReach = 0.5;
  const Georeference& place = plan.info.georeference;
  std::vector<Window> covered;
  std::map<std::tuple<std::int64_t, std::int64_t, std::int64_t, std::int64_t>, const MosaicMember*> grounds;
  std::int64_t hidden = 0;
  std::string pair;
  for (const MosaicLayer& layer : plan.layers) {
    for (const MosaicMember& member : layer.members) {
      covered.push_back(plan.is_on_grid(layer) ? member.window()
                                               : samples_within(place, bounds_of(layer, member.window(), kReach)));
      const Window& at = covered.back();
      const auto [other, is_new] = grounds.try_emplace({at.column, at.row, at.columns, at.rows}, &member);
      if (!is_new && ++hidden == 1) pair = fmt::format("{} and {}", other->second->path, member.path);
    }
  }
  std::optional<Window> first;
  plan.samples_missing = uncovered(covered, region, first);
  if (first) {
    const double reach = place.registration == Registration::kPoint ? 0.0 : kReach;
    const double west = place.origin_x + (static_cast<double>(first->column) - reach) * place.spacing_x;
    const double north = place.origin_y - (static_cast<double>(first->row) - reach) * place.spacing_y;
    plan.info.warnings.push_back(
        fmt::format("{} samples lie in no file, the first at x {:.10g}...{:.10g}, y {:.10g}...{:.10g}",
                    plan.samples_missing, west, west + static_cast<double>(first->columns) * place.spacing_x,
                    north - static_cast<double>(first->rows) * place.spacing_y, north));
  }
  if (hidden == 0) return;
  plan.info.warnings.push_back(
      loss(fmt::format("{} lie over exactly the same ground{}: one hides the other wherever both have elevations; name "
                       "the one that is meant, if they are not parts of one surface",
                       pair, hidden > 1 ? fmt::format(" (and {} more)", hidden - 1) : "")));
}

}  // namespace isohf
