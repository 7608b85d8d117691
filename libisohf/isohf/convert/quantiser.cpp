#include "isohf/convert/quantiser.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "isohf/base/error.h"
#include "isohf/base/vectorised.h"

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

/// code = height * inverse + shift, rounded, held within 0..last; what became of it is added up.
struct CodeLine {
  double inverse = 1.0;
  double shift = 0.0;
  double last = 0.0;
  std::int32_t void_code = 0;
  double worst = 0.0;  ///< largest rounding, in codes
  std::int64_t below = 0;
  std::int64_t above = 0;
};

ISOHF_VECTORISED void round_to_codes(const float* __restrict heights, std::size_t count, CodeLine& line,
                                     std::uint16_t* __restrict codes) {
  const double inverse = line.inverse;
  const double shift = line.shift;
  const double last = line.last;
  const std::int32_t void_code = line.void_code;
  std::int64_t worst = 0;
  std::int64_t below = 0;
  std::int64_t above = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double exact = double{heights[i]} * inverse + shift;  // NaN compares false below
    const bool is_void = exact != exact;
    const double raised = exact < 0.0 || is_void ? 0.0 : exact;
    const double inside = raised > last ? last : raised;
    const auto code = static_cast<std::int32_t>(inside + 0.5);
    below += exact < -0.5 ? 1 : 0;
    above += exact >= last + 0.5 ? 1 : 0;
    // Doubles that are not negative are ordered like their bits, and a maximum of integers vectorises.
    const auto off = std::bit_cast<std::int64_t>(std::abs(inside - static_cast<double>(code)));
    worst = off > worst ? off : worst;
    codes[i] = static_cast<std::uint16_t>(is_void ? void_code : code);
  }
  line.worst = std::bit_cast<double>(worst);
  line.below = below;
  line.above = above;
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

QuantiserCounts quantise(const Quantisation& quantisation, double datum, std::span<const float> heights,
                         TileCodes& tile) {
  QuantiserCounts counts;
  tile.type = quantisation.type;
  const std::size_t n = heights.size();
  if (quantisation.type == CodeType::kF32) {
    tile.codes.clear();
    tile.heights.resize(n);
    float worst = 0.0F;
    for (std::size_t i = 0; i < n; ++i) {
      const double exact = double{heights[i]} + datum;
      tile.heights[i] = static_cast<float>(exact);
      const auto off = static_cast<float>(std::abs(double{tile.heights[i]} - exact));
      worst = off > worst ? off : worst;
    }
    counts.worst_rounding = double{worst};
    return counts;
  }
  tile.heights.clear();
  tile.codes.resize(n);
  CodeLine line;
  line.inverse = 1.0 / quantisation.scale;
  line.shift = (datum - quantisation.offset) * line.inverse;
  line.last = static_cast<double>(quantisation.max_code());
  line.void_code = static_cast<std::int32_t>(quantisation.void_code());
  round_to_codes(heights.data(), n, line, tile.codes.data());
  counts.below = line.below;
  counts.above = line.above;
  counts.worst_rounding = line.worst * quantisation.scale;
  return counts;
}

}  // namespace isohf
