#include "isohf/convert/stages/choose_quantisation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "isohf/error.h"
#include "isohf/sampling/resample/height_error.h"

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

/// The step that is asked for or that suits the source; nullopt: the finest.
std::optional<double> wanted_step(const QuantisationRequest& request, const SourceInfo& info) {
  const std::optional<double> most =
      request.max_rounding ? std::optional(2.0 * (*request.max_rounding - request.height_error)) : std::nullopt;
  const std::optional<double> step = request.step ? request.step : most;
  if (request.step && most && *step > *most) {
    throw Error(
        ErrorCode::kInvalidArgument,
        fmt::format("step {} rounds by up to {:.6g}, more than `max_rounding` {}; use a step of {:.6g} or less, or "
                    "leave it out",
                    *step, *step / 2.0 + request.height_error, *request.max_rounding, *most));
  }
  if (most && !(*most > 0.0)) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("`max_rounding` {} is below what sums in single precision hold of elevations so far from "
                            "each other; use {:.3g} or more",
                            *request.max_rounding, 1.25 * request.height_error));
  }
  if (step && *step != 0.0) {
    if (!(std::isfinite(*step) && *step > 0.0)) {
      throw Error(ErrorCode::kInvalidArgument, fmt::format("step is {}, must be positive, or 0 for the finest", *step));
    }
    return step;
  }
  const bool is_whole = !is_floating(info.sample_type);
  if (!step && request.wish) {
    // Whole elevations stay whole: the source's own step times a power of two.
    return is_whole ? std::abs(info.z_scale) * std::exp2(std::floor(std::log2(*request.wish / std::abs(info.z_scale))))
                    : *request.wish;
  }
  if (!step && is_whole && request.type == CodeType::kU16) return std::abs(info.z_scale) / kStepsPerSourceStep;
  return std::nullopt;
}

/// Up to that steps are doubled where the range needs it, and whole elevations stay whole; beyond, few would, and the
/// finest step is nearer to all.
double whole_step(const SourceInfo& info) {
  return is_floating(info.sample_type) ? 0.0 : std::abs(info.z_scale);
}

bool is_asked_for(const QuantisationRequest& request) {
  return request.max_rounding || (request.step && *request.step != 0.0);
}

[[noreturn]] void refuse_step(const QuantisationRequest& request, double steps, const ElevationRange& range,
                              double codes, bool divides_range) {
  const double finest = divides_range ? (range.max - range.min) / codes : finest_step(range, codes) * 1.0001;
  const bool by_rounding = !request.step;
  const double wanted = by_rounding ? finest / 2.0 + request.height_error : finest;
  throw Error(ErrorCode::kInvalidArgument,
              fmt::format("{} {} needs {:.0f} codes for elevations {} to {}, {} has {:.0f}; use {:.{}g}{}, or "
                          "`code_type` f32",
                          by_rounding ? "`max_rounding`" : "step", by_rounding ? *request.max_rounding : *request.step,
                          steps + 1.0, range.min, range.max, to_string(request.type), codes + 1.0, wanted,
                          divides_range ? 12 : 6, divides_range ? "" : " or more"));
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
  const auto finest = [&] {
    quantisation.scale = finest_step(range, codes);
    quantisation.offset = range.min;
    return quantisation;
  };
  if (const std::optional<double> step = wanted_step(request, info)) {
    quantisation.scale = *step;
    if (is_asked_for(request)) {
      if (codes_needed(range, *step) > codes) refuse_step(request, codes_needed(range, *step), range, codes, false);
    } else {
      while (codes_needed(range, quantisation.scale) > codes && quantisation.scale < whole_step(info)) {
        quantisation.scale *= 2.0;
      }
      if (codes_needed(range, quantisation.scale) > codes) return finest();
    }
    quantisation.offset = std::floor(range.min / quantisation.scale) * quantisation.scale;
    return quantisation;
  }
  return finest();
}

Quantisation quantisation_of_range(const QuantisationRequest& request, const ElevationRange& range,
                                   const SourceInfo& info) {
  Quantisation quantisation;
  quantisation.type = request.type;
  if (request.type == CodeType::kF32) return quantisation;
  const auto codes = static_cast<double>(quantisation.max_code());
  const double span = range.max - range.min;
  // Decimal steps divide decimal ranges but for the last bits.
  const auto steps_of = [&](double step) {
    const double whole = std::round(span / step);
    return std::abs(span / step - whole) <= 1e-9 * whole ? whole : std::ceil(span / step);
  };
  double steps = codes;
  if (std::optional<double> step = wanted_step(request, info)) {
    steps = steps_of(*step);
    if (is_asked_for(request)) {
      if (steps > codes) refuse_step(request, steps, range, codes, request.step.has_value());
      if (request.step && std::abs(span / *step - steps) > 1e-9 * steps) {
        throw Error(ErrorCode::kInvalidArgument,
                    fmt::format("`step` {} does not divide `z_range` {}:{}, whose ends are both codes: {:.6g} steps; "
                                "use `step` {:.9g}, `z_range` {}:{:.9g}, or `max_rounding` {}",
                                *step, range.min, range.max, span / *step, span / steps, range.min,
                                range.min + steps * *step, *step / 2.0 + request.height_error));
      }
    }
    while (steps > codes && *step < whole_step(info)) steps = steps_of(*step *= 2.0);
    steps = std::min(steps, codes);
  }
  quantisation.offset = range.min;
  quantisation.scale = span / steps;
  // Not even by its last bit may the last code lie beyond the range.
  while (quantisation.offset + quantisation.scale * steps > range.max) {
    quantisation.scale = std::nextafter(quantisation.scale, 0.0);
  }
  return quantisation;
}

double overshoot(const Kernel& kernel, const Prefilter& prefilter) {
  const bool stays_within =
      kernel.filter() == Filter::kNearest || kernel.filter() == Filter::kBilinear || kernel.is_limited();
  if (stays_within && prefilter.is_identity()) return 0.0;
  const double lebesgue = lebesgue_constant(kernel, prefilter);
  return (lebesgue * lebesgue - 1.0) / 2.0;
}

ElevationRange widened(const ElevationRange& range, double fraction) {
  const double margin = (range.max - range.min) * fraction;
  return {range.min - margin, range.max + margin};
}

}  // namespace isohf
