#include "isohf/surface/source_axis.h"

#include <algorithm>

#include "isohf/base/error.h"

namespace isohf {
namespace {

/// Positions this close to the end of the covered ground count as on it: the end is computed from products of extents
/// and counts and may miss it by a few units in the last place.
constexpr double kEndTolerance = 1e-6;

}  // namespace

std::string to_string(Outside outside) {
  switch (outside) {
    case Outside::kCover:
      return "cover";
    case Outside::kClamp:
      return "clamp";
    case Outside::kVoid:
      break;
  }
  return "void";
}

Outside outside_from_string(const std::string& text) {
  if (text == "cover") return Outside::kCover;
  if (text == "clamp") return Outside::kClamp;
  if (text == "void") return Outside::kVoid;
  throw Error(ErrorCode::kInvalidArgument, "outside is \"" + text + "\", must be cover, clamp or void");
}

SourceAxis::SourceAxis(std::int64_t samples, double first_world, double spacing_world, Registration registration,
                       Outside outside)
    : samples_(samples),
      first_world_(first_world),
      spacing_world_(spacing_world),
      reach_(registration == Registration::kArea ? 0.5 : 0.0),
      outside_(outside) {}

bool SourceAxis::covers(double u) const {
  return u >= -reach_ - kEndTolerance && u <= static_cast<double>(samples_ - 1) + reach_ + kEndTolerance;
}

double SourceAxis::position(double world) const {
  const double u = (world - first_world_) / spacing_world_;
  if (outside_ == Outside::kCover && !covers(u)) return u;
  return std::clamp(u, 0.0, static_cast<double>(samples_ - 1));
}

bool SourceAxis::has_elevation(double world) const {
  return outside_ != Outside::kVoid || covers((world - first_world_) / spacing_world_);
}

}  // namespace isohf
