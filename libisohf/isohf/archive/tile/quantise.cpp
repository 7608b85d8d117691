#include "isohf/archive/tile/quantise.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "isohf/base/assert.h"
#include "isohf/base/simd.h"

namespace isohf {
namespace {

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

ISOHF_KERNEL void round_to_codes(const float* __restrict heights, std::size_t count, CodeLine& line,
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

/// round_to_codes(), but for the codes that are chosen: the nearest to `smooth` within `reach` codes of what is exact.
ISOHF_KERNEL void round_within_reach(const float* __restrict heights, const float* __restrict smooth, std::size_t count,
                                     double reach, CodeLine& line, std::uint16_t* __restrict codes) {
  const double last = line.last;
  for (std::size_t i = 0; i < count; ++i) {
    const double exact = double{heights[i]} * line.inverse + line.shift;
    if (exact != exact) {
      codes[i] = static_cast<std::uint16_t>(line.void_code);
      continue;
    }
    const double inside = std::min(std::max(exact, 0.0), last);
    const double nearest = std::floor(inside + 0.5);
    const double least = std::max(std::ceil(inside - reach), 0.0);
    const double most = std::min(std::floor(inside + reach), last);
    const double wanted = std::floor(double{smooth[i]} * line.inverse + line.shift + 0.5);  // NaN compares false
    double code = wanted < least ? least : (wanted > most ? most : wanted);
    code = wanted == wanted && least <= most ? code : nearest;
    line.below += exact < -0.5 ? 1 : 0;
    line.above += exact >= last + 0.5 ? 1 : 0;
    line.worst = std::max(line.worst, std::abs(inside - code));
    codes[i] = static_cast<std::uint16_t>(static_cast<std::int32_t>(code));
  }
}

/// Heights by `datum` higher; the largest rounding, voids left aside. Floats that are not negative are ordered like
/// their bits, and a maximum of integers vectorises.
ISOHF_KERNEL float raise_heights(const float* __restrict heights, std::size_t count, double datum,
                                 float* __restrict raised) {
  std::int32_t worst = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double exact = double{heights[i]} + datum;
    const auto rounded = static_cast<float>(exact);
    const auto off = static_cast<float>(std::abs(double{rounded} - exact));
    const std::int32_t bits = off == off ? std::bit_cast<std::int32_t>(off) : 0;
    worst = bits > worst ? bits : worst;
    raised[i] = rounded;
  }
  return std::bit_cast<float>(worst);
}

/// A tile of `count` codes, which are yet to be chosen.
CodeLine start_line(const Quantisation& quantisation, const CodeLimits& limits, double datum, std::size_t count,
                    TileCodes& tile) {
  tile.type = quantisation.type;
  tile.heights.clear();
  tile.codes.resize(count);
  CodeLine line;
  line.inverse = 1.0 / quantisation.scale;
  line.shift = (datum - quantisation.offset) * line.inverse;
  line.last = static_cast<double>(quantisation.max_code());
  if (limits.highest < code_limits(quantisation).highest) {
    line.last = std::round((limits.highest - quantisation.offset) / quantisation.scale);
  }
  line.void_code = static_cast<std::int32_t>(quantisation.void_code());
  return line;
}

QuantiserCounts counts_of(const CodeLine& line, const Quantisation& quantisation) {
  return {line.below, line.above, line.worst * quantisation.scale};
}

/// The float that is nearest to `limit` on the side of `inner`, or `limit` itself.
float float_within(double limit, float inner) {
  const auto nearest = static_cast<float>(limit);
  const bool beyond = inner > 0.0F ? double{nearest} < limit : double{nearest} > limit;
  return beyond ? std::nextafter(nearest, inner) : nearest;
}

}  // namespace

QuantiserCounts quantise(const Quantisation& quantisation, double datum, std::span<const float> heights,
                         TileCodes& tile) {
  return quantise(quantisation, code_limits(quantisation), datum, heights, tile);
}

QuantiserCounts quantise(const Quantisation& quantisation, const CodeLimits& limits, double datum,
                         std::span<const float> heights, TileCodes& tile) {
  QuantiserCounts counts;
  tile.type = quantisation.type;
  const std::size_t n = heights.size();
  if (quantisation.type == CodeType::kF32) {
    tile.codes.clear();
    tile.heights.resize(n);
    counts.worst_rounding = double{vectorised<raise_heights>(heights.data(), n, datum, tile.heights.data())};
    if (std::isinf(limits.lowest) && std::isinf(limits.highest)) return counts;
    const float lowest = float_within(limits.lowest, HUGE_VALF);
    const float highest = float_within(limits.highest, -HUGE_VALF);
    for (float& height : tile.heights) height = height < lowest ? lowest : (height > highest ? highest : height);
    return counts;
  }
  CodeLine line = start_line(quantisation, limits, datum, n, tile);
  vectorised<round_to_codes>(heights.data(), n, line, tile.codes.data());
  return counts_of(line, quantisation);
}

QuantiserCounts quantise_within(const Quantisation& quantisation, const CodeLimits& limits, double datum,
                                double most_off, std::span<const float> heights, std::span<const float> smooth,
                                TileCodes& tile) {
  ISOHF_ASSERT(quantisation.type != CodeType::kF32 && smooth.size() == heights.size());
  CodeLine line = start_line(quantisation, limits, datum, heights.size(), tile);
  vectorised<round_within_reach>(heights.data(), smooth.data(), heights.size(), most_off * line.inverse, line,
                                 tile.codes.data());
  return counts_of(line, quantisation);
}

CodeLimits code_limits(const Quantisation& quantisation) {
  if (quantisation.type == CodeType::kF32) return {-HUGE_VAL, HUGE_VAL};
  return {quantisation.offset, elevation_from_code(quantisation, quantisation.max_code())};
}

CodeLimits code_limits(const Metadata& metadata) {
  if (metadata.z_range) return {metadata.z_range->first, metadata.z_range->second};
  return code_limits(metadata.quantisation);
}

std::vector<double> elevations_of(const TileCodes& tile, const Quantisation& quantisation) {
  if (tile.type == CodeType::kF32) return {tile.heights.begin(), tile.heights.end()};
  std::vector<double> elevations(tile.codes.size());
  for (std::size_t i = 0; i < elevations.size(); ++i) elevations[i] = elevation_of_vertex(tile, quantisation, i);
  return elevations;
}

}  // namespace isohf
