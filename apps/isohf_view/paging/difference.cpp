#include "paging/difference.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "formats/georeference/units.h"
#include "isohf/error.h"
#include "reading/hud.h"

namespace isohf::view {
namespace {

/// Places a side that the range is taken from, and the share of them within it.
constexpr int kPlaces = 64;
constexpr double kWithin = 0.98;

bool same_system(const SourceRecord& a, const SourceRecord& b) {
  return a.crs_unit == b.crs_unit && a.crs_name == b.crs_name && a.crs_epsg == b.crs_epsg && a.crs_wkt == b.crs_wkt;
}

double unit_between(const Metadata& first, const Metadata& second) {
  // What states none counts as metres, as everywhere.
  const auto metres = [](const Metadata& metadata) {
    const auto unit = linear_unit(metadata.vertical_unit);
    return unit ? unit->metres : 1.0;
  };
  return metres(second) / metres(first);
}

}  // namespace

ArchiveReader understood(const ArchiveReader& archive) {
  ArchiveReader another({std::shared_ptr<void>(), &archive.source()}, archive.path());
  try {
    understand_source(another);
  } catch (const Error&) {
    // Places have no longitude and latitude then, nor one in the sky.
  }
  return another;
}

std::optional<WorldGeoreference> understood_places(const ArchiveReader& archive) {
  try {
    return WorldGeoreference(understood(archive).metadata());
  } catch (const Error&) {
    return std::nullopt;  // nor coordinates
  }
}

WorldJoin::WorldJoin(const ArchiveReader& from, const ArchiveReader& to)
    : from_(understood_places(from)), to_(understood_places(to)) {
  const std::string& body = from.metadata().source.body;
  const std::string& other = to.metadata().source.body;
  if (!body.empty() && !other.empty() && body != other) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("{} lies on {}, {} on {}: they have no place in common",
                                                         from.path(), body, to.path(), other));
  }
  const auto both = [this](auto has) { return from_ && to_ && ((*from_).*has)() && ((*to_).*has)(); };
  const auto either = [this](auto has) { return (from_ && ((*from_).*has)()) || (to_ && ((*to_).*has)()); };
  by_source_ = both(&WorldGeoreference::has_source) && same_system(from.metadata().source, to.metadata().source);
  if (by_source_ || both(&WorldGeoreference::has_geo)) return;
  if (either(&WorldGeoreference::has_source) || either(&WorldGeoreference::has_geo)) {
    throw Error(ErrorCode::kInvalidArgument,
                from.path() + " and " + to.path() + ": lie on no map that both name: no place is known in both");
  }
  from_.reset();
}

WorldPoint WorldJoin::operator()(WorldPoint at) const {
  if (!from_) return at;
  return by_source_ ? to_->world_from_source(from_->source_from_world(at))
                    : to_->world_from_geo(from_->geo_from_world(at));
}

SurfaceDifference::SurfaceDifference(const ArchiveReader& first, const std::string& second)
    : join_(first, ArchiveReader(second)),
      second_(second),
      unit_(unit_between(first.metadata(), second_.metadata())),
      surface_(second_) {
  const WorldBounds& ground = first.metadata().valid;
  std::vector<WorldPoint> at;
  for (int i = 0; i < kPlaces * kPlaces; ++i) {
    at.push_back({ground.x0 + (i % kPlaces + 0.5) / kPlaces * (ground.x1 - ground.x0),
                  ground.z0 + (i / kPlaces + 0.5) / kPlaces * (ground.z1 - ground.z0)});
  }
  std::vector<double> found(at.size());
  Surface(first).sample(at, found);
  take_from(at, found);
  std::erase_if(found, [](double value) { return std::isnan(value); });
  if (found.empty()) {
    throw Error(ErrorCode::kInvalidArgument, first.path() + " and " + second + ": have no ground in common");
  }
  for (double& value : found) value = std::abs(value);
  const auto most = found.begin() + static_cast<std::ptrdiff_t>(kWithin * static_cast<double>(found.size() - 1));
  std::nth_element(found.begin(), most, found.end());
  // Two ways of rounding make no difference.
  if (*most > 1e-6 * first.metadata().quantisation.scale) range_ = round_length(*most);
  if (range_ < *most) range_ = round_length(2.6 * range_);
}

void SurfaceDifference::take_from(std::span<const WorldPoint> at, std::span<double> elevations) const {
  std::vector<WorldPoint> there(at.size());
  std::transform(at.begin(), at.end(), there.begin(), join_);
  std::vector<double> found(at.size());
  {
    const std::lock_guard lock(one_);
    surface_.sample(there, found);
  }
  for (std::size_t i = 0; i < found.size(); ++i) elevations[i] = found[i] * unit_ - elevations[i];
}

}  // namespace isohf::view
