#include "isohf/convert/quantiser.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "isohf/base/error.h"

namespace isohf {
namespace {

/// Integer sources get steps of half their own (docs/decisions/0011).
constexpr double kStepsPerSourceStep = 2.0;

/// The finest step of which `codes` steps span the range: a hair wider than range/codes, so that the last elevation
/// does not round past the last code.
double finest_step(const ElevationRange& range, double codes) {
  const double span = range.max - range.min;
  return span > 0.0 ? span / codes * (1.0 + 1e-9) : 1.0;
}

/// Codes that the range needs when the offset is moved down to a multiple of the step, less one.
double codes_needed(const ElevationRange& range, double step) {
  return std::ceil(range.max / step) - std::floor(range.min / step);
}

}  // namespace

bool has_codes_for(const Quantisation& quantisation, const ElevationRange& range) {
  return codes_needed(range, quantisation.scale) <= static_cast<double>(quantisation.max_code());
}

Quantisation choose_quantisation(const QuantisationRequest& request, const ElevationRange& range,
                                 const SourceInfo& info) {
  Quantisation quantisation;
  quantisation.type = request.type;
  if (request.type == CodeType::kF32) return quantisation;
  const auto codes = static_cast<double>(quantisation.max_code());
  const double finest = finest_step(range, codes);
  if (request.step && *request.step != 0.0) {
    if (!(std::isfinite(*request.step) && *request.step > 0.0)) {
      throw Error(ErrorCode::kInvalidArgument,
                  fmt::format("step is {}, must be positive, or 0 for the finest", *request.step));
    }
    if (codes_needed(range, *request.step) > codes) {
      throw Error(
          ErrorCode::kInvalidArgument,
          fmt::format("step {} needs {:.0f} codes for elevations {} to {}, {} has {:.0f}; use a step of {:.6g} or "
                      "more, or type f32",
                      *request.step, codes_needed(range, *request.step) + 1.0, range.min, range.max,
                      to_string(request.type), codes + 1.0, finest * 1.0001));
    }
    quantisation.scale = *request.step;
  } else if (!request.step && !is_floating(info.sample_type) && request.type == CodeType::kU16) {
    quantisation.scale = std::abs(info.z_scale) / kStepsPerSourceStep;
    while (codes_needed(range, quantisation.scale) > codes) quantisation.scale *= 2.0;
  } else {
    quantisation.scale = finest;
    quantisation.offset = range.min;
    return quantisation;
  }
  quantisation.offset = std::floor(range.min / quantisation.scale) * quantisation.scale;
  return quantisation;
}

}  // namespace isohf
