#include "isohf/convert/stages/code_source.h"

#include <cmath>

namespace isohf {
namespace {

/// Where elevations are moved into a range, those beyond the source's edge are, too, and counted.
ElevationRange limits_of(const Conversion& conversion) {
  if (conversion.options.clamp_range) return {-HUGE_VAL, HUGE_VAL};
  return {conversion.limits.lowest - conversion.datum, conversion.limits.highest - conversion.datum};
}

}  // namespace

CodeSource::CodeSource(const Conversion& conversion)
    : conversion_(conversion), exact_(conversion, limits_of(conversion), conversion.prefilter) {
  if (conversion.most_off() > 0.0) {
    smooth_.emplace(conversion, limits_of(conversion), Prefilter::smoothing());
  }
}

std::shared_ptr<const CodeSource::Part> CodeSource::read(TileIndex tile) {
  const auto part = std::make_shared<Part>();
  part->exact = exact_.read(tile);
  if (smooth_) part->smooth = smooth_->read(tile);
  return part;
}

std::optional<QuantiserCounts> CodeSource::cut(TileIndex tile, const Part& part, std::vector<float>& heights,
                                               TileCodes& codes) const {
  heights.resize(static_cast<std::size_t>(conversion_.plan.grid.shape().stored_vertex_count()));
  if (!exact_.cut(tile, *part.exact, heights)) return std::nullopt;
  if (!smooth_) return quantise(conversion_.quantisation, conversion_.limits, conversion_.datum, heights, codes);
  std::vector<float> smooth(heights.size());
  (void)smooth_->cut(tile, *part.smooth, smooth);
  return quantise_within(conversion_.quantisation, conversion_.limits, conversion_.datum, conversion_.most_off(),
                         heights, smooth, codes);
}

}  // namespace isohf
