#include "isohf/verify/accuracy/same_source.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "isohf/base/handed_in.h"
#include "isohf/error.h"
#include "isohf/restore/sample_grids.h"
#include "isohf/surface.h"

namespace isohf {
namespace {

constexpr double kOfSample = 1e-3;
/// Radii of one body are told apart where the ground would move by more.
constexpr double kSameEllipsoid = 1e-5;

/// What of the two places differs, one clause each.
void compare_places(const Georeference& ours, const Georeference& theirs, const SourceInfo& other,
                    std::vector<std::string>& found) {
  const bool units_known = ours.unit != HorizontalUnit::kUnknown && theirs.unit != HorizontalUnit::kUnknown;
  if (units_known && ours.unit != theirs.unit) {
    found.push_back(fmt::format("is in {}, not {}", describe_unit(theirs.unit), describe_unit(ours.unit)));
    return;
  }
  if (units_known && std::abs(ours.metres_per_unit - theirs.metres_per_unit) > 1e-9 * ours.metres_per_unit) {
    found.push_back(fmt::format("counts {:.9g} m a unit, not {:.9g}", theirs.metres_per_unit, ours.metres_per_unit));
  }
  const bool placed = ours.has_origin && theirs.has_origin;
  if (!placed && !units_known) return;
  const auto other_spacing = [](double a, double b, std::int64_t samples) {
    return std::abs(a - b) * static_cast<double>(std::max<std::int64_t>(samples - 1, 1)) > kOfSample * a;
  };
  if (other_spacing(ours.spacing_x, theirs.spacing_x, other.width) ||
      other_spacing(ours.spacing_y, theirs.spacing_y, other.height)) {
    found.push_back(fmt::format("has samples {:.9g} by {:.9g} apart, not {:.9g} by {:.9g}", theirs.spacing_x,
                                theirs.spacing_y, ours.spacing_x, ours.spacing_y));
  }
  if (!placed) return;
  double east = theirs.origin_x - ours.origin_x;
  if (ours.unit == HorizontalUnit::kDegree) east = std::remainder(east, 360.0);
  if (std::abs(east) > kOfSample * ours.spacing_x ||
      std::abs(theirs.origin_y - ours.origin_y) > kOfSample * ours.spacing_y) {
    found.push_back(fmt::format("begins at ({:.12g}, {:.12g}), not at ({:.12g}, {:.12g})", theirs.origin_x,
                                theirs.origin_y, ours.origin_x, ours.origin_y));
  }
}

void compare_systems(const ReferenceSystem& ours, const ReferenceSystem& theirs, std::optional<bool> same,
                     std::vector<std::string>& found) {
  if (!ours.body.empty() && !theirs.body.empty() && ours.body != theirs.body) {
    found.push_back(fmt::format("is of {}, not {}", theirs.body, ours.body));
    return;
  }
  if (same == false) {
    found.push_back(fmt::format("is in {}, not {}", describe_system(theirs), describe_system(ours)));
    return;
  }
  const auto& a = ours.semi_major_axis_m;
  const auto& b = theirs.semi_major_axis_m;
  if (!same && a && b && std::abs(*a - *b) > kSameEllipsoid * *a) {
    found.push_back(fmt::format("lies on an ellipsoid of {:.9g} m, not {:.9g}", *b, *a));
  }
}

}  // namespace

std::vector<Warning> check_same_source(const ArchiveReader& archive, const SourceInfo& other,
                                       std::optional<bool> same_system) {
  require_source(other);
  const Metadata& metadata = archive.metadata();
  const SourceRecord& record = metadata.source;
  const Georeference ours = source_georeference(record);
  std::vector<std::string> found;
  if (other.width != record.width || other.height != record.height) {
    found.push_back(
        fmt::format("has {}x{} samples, not {}x{}", other.width, other.height, record.width, record.height));
  }
  compare_places(ours, other.georeference, other, found);
  compare_systems(ours.system, other.georeference.system, same_system, found);
  if (metadata.vertical_unit != "unknown" && !other.vertical_unit.empty() &&
      metadata.vertical_unit != other.vertical_unit) {
    found.push_back(
        fmt::format("has heights in units of \"{}\", not \"{}\"", other.vertical_unit, metadata.vertical_unit));
  }
  if (!found.empty()) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("{}: is not what {} was made from: {}", other.path,
                                                         archive.path(), fmt::join(found, "; ")));
  }
  if (ours.has_origin && !other.georeference.has_origin) {
    return {
        fmt::format("{}: does not say where it lies; it is compared as if it were the archive's source", other.path)};
  }
  return {};
}

void add_findings(const Metadata& metadata, const VertexReport& vertices, const AccuracyReport& surface,
                  VerifyReport& report) {
  const auto add = [&](int id, const std::string& text, std::optional<TileIndex> tile = {}) {
    report.findings.push_back({id, severity_of(id), tile, text});
    ++report.findings_total;
  };
  if (vertices.wrong > 0) {
    add(finding::kVertex,
        fmt::format("{} vertices, from this tile on, differ from the input resampled, by up to {:.6g} ({:.6g} is "
                    "allowed), or in having an elevation",
                    vertices.wrong, vertices.worst, vertices.bound),
        vertices.first_wrong);
  }
  if (const std::string text = contradiction(metadata, surface); !text.empty()) add(finding::kAccuracy, text);
  if (surface.lost_inside > 0) {
    add(finding::kSourceLost,
        fmt::format("{} elevations of the input are where the archive has none", surface.lost_inside));
  }
  if (surface.invented_inside > 0) {
    add(finding::kSourceInvented,
        fmt::format("{} nodata samples of the input are where the archive has elevations", surface.invented_inside));
  }
}

}  // namespace isohf
