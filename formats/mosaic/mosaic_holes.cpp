#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "formats/mosaic/mosaic_place.h"

namespace isohf {
namespace {

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
std::int64_t uncovered(const MosaicPlan& plan, std::optional<SampleRectangle>& first) {
  std::vector<SampleRectangle> members = grounds(plan, 0.5);
  std::sort(members.begin(), members.end(),
            [](const SampleRectangle& a, const SampleRectangle& b) { return a.row < b.row; });
  const Window& region = plan.region;
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

}  // namespace

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
  holes.samples = uncovered(plan, first);
  if (holes.samples == 0) return holes;
  find_missing_places(plan, holes);
  if (holes.tiles_missing == 0 && first) holes.missing = {place_name(plan, *first)};
  return holes;
}

}  // namespace isohf
