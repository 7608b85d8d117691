#include "isohf/restore/raster/sample_store.h"

#include <fmt/format.h>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <tuple>

#include "isohf/base/assert.h"
#include "isohf/base/sample.h"
#include "isohf/error.h"

namespace isohf {
std::optional<double> usual_nodata(SampleType type) {
  if (is_floating(type)) return std::nullopt;
  const auto [low, high] = sample_range(type);
  return low < 0.0 ? low : high;
}

SampleMapping spread(SampleType type, std::pair<double, double> elevations, bool has_nodata) {
  auto [low, high] = sample_range(type);
  const std::optional<double> nodata = has_nodata ? usual_nodata(type) : std::nullopt;
  if (nodata == low) low += 1.0;
  if (nodata == high) high -= 1.0;
  const double scale =
      elevations.second > elevations.first ? (elevations.second - elevations.first) / (high - low) : 1.0;
  return {type, scale, elevations.first - low * scale};
}

SampleStore::SampleStore(const SampleMapping& mapping, std::optional<double> nodata, Clamp clamp)
    : mapping_(mapping), nodata_(nodata), clamp_(clamp) {
  std::tie(low_, high_) = sample_range(mapping.type);
  if (nodata == low_) low_ += 1.0;
  if (nodata == high_) high_ -= 1.0;
}

SampleStore::Outcome SampleStore::store(double elevation, std::byte* raw) const {
  const StoreSample put = store_sample(mapping_.type);
  if (std::isnan(elevation)) {
    if (!nodata_ && !is_floating(mapping_.type)) return Outcome::kRefused;
    put(nodata_.value_or(elevation), raw);
    return Outcome::kNodata;
  }
  const double sample = (elevation - mapping_.z_offset) / mapping_.z_scale;
  const std::optional<double> held = rounded_sample(mapping_.type, sample);
  if (held && *held >= low_ && *held <= high_) {
    put(*held, raw);
    return Outcome::kStored;
  }
  const double end = sample < low_ + (high_ - low_) / 2.0 ? low_ : high_;
  const auto [lowest, highest] = sample_range(mapping_.type);
  const bool is_free = end == lowest || end == highest;
  if (clamp_ == Clamp::kNone || (clamp_ == Clamp::kAtFreeEnds && !is_free)) return Outcome::kRefused;
  put(end, raw);
  return Outcome::kClamped;
}

bool SampleStore::holds(double raw) const {
  return rounded_sample(mapping_.type, raw) == raw;
}

SampleStore::Result SampleStore::store(std::span<const double> elevations, std::span<std::byte> raw) const {
  const std::size_t sample_bytes = size_bytes(mapping_.type);
  ISOHF_ASSERT(raw.size() == elevations.size() * sample_bytes);
  std::vector<Outcome> outcomes(elevations.size());
  oneapi::tbb::parallel_for(oneapi::tbb::blocked_range<std::size_t>(0, elevations.size(), 4096), [&](const auto& part) {
    for (std::size_t i = part.begin(); i < part.end(); ++i) {
      outcomes[i] = store(elevations[i], raw.data() + i * sample_bytes);
    }
  });
  Result result;
  result.nodata = std::count(outcomes.begin(), outcomes.end(), Outcome::kNodata);
  result.clamped = std::count(outcomes.begin(), outcomes.end(), Outcome::kClamped);
  const auto refused = std::find(outcomes.begin(), outcomes.end(), Outcome::kRefused);
  if (refused != outcomes.end()) result.refused = static_cast<std::size_t>(refused - outcomes.begin());
  return result;
}

void refuse_sample(const StoredRaster& raster, SampleType type, std::int64_t sample, const std::string& value) {
  throw Error(ErrorCode::kInvalidArgument,
              {raster.path,
               fmt::format("sample (column {}, row {}) is {}, which {} does not hold", sample % raster.width,
                           sample / raster.width, value, to_string(type)),
               "", raster.remedy});
}

std::vector<std::byte> RowStore::raw_rows(std::int64_t first_row, std::span<const double> elevations) {
  const SampleMapping& mapping = store_.mapping();
  std::vector<std::byte> raw(elevations.size() * size_bytes(mapping.type));
  const SampleStore::Result result = store_.store(elevations, raw);
  counts_.nodata += result.nodata;
  counts_.clamped += result.clamped;
  if (result.refused) {
    const double elevation = elevations[*result.refused];
    std::string value = std::isnan(elevation) ? "nodata" : fmt::format("{:.9g}", elevation);
    if (!std::isnan(elevation) && (mapping.z_scale != 1.0 || mapping.z_offset != 0.0))
      value = fmt::format("{:.9g} (elevation {})", (elevation - mapping.z_offset) / mapping.z_scale, value);
    refuse_sample(raster_, mapping.type, first_row * raster_.width + static_cast<std::int64_t>(*result.refused), value);
  }
  return raw;
}

std::optional<std::size_t> convert_exactly(const LosslessRecord& record, std::span<const std::byte> raw,
                                           std::optional<double> nodata, SampleType to, std::span<std::byte> out) {
  const SampleType from = record.mapping.type;
  const SampleStore store({to, 1.0, 0.0}, std::nullopt, SampleStore::Clamp::kNone);
  const std::size_t count = raw.size() / size_bytes(from);
  ISOHF_ASSERT(out.size() == count * size_bytes(to));
  const LoadSample load = load_sample(from);
  const LoadSample load_again = load_sample(to);
  for (std::size_t i = 0; i < count; ++i) {
    const double value = load(raw.data() + i * size_bytes(from));
    std::byte* const at = out.data() + i * size_bytes(to);
    const double written = record.is_void(value) ? nodata.value_or(value) : value;
    const SampleStore::Outcome outcome = store.store(written, at);
    if (outcome == SampleStore::Outcome::kNodata) continue;
    if (outcome != SampleStore::Outcome::kStored) return i;
    if (load_again(at) != written) return i;
  }
  return std::nullopt;
}

void elevations_of(const LosslessRecord& record, std::span<const std::byte> raw, std::span<std::byte> out) {
  const SampleMapping& mapping = record.mapping;
  const std::size_t bytes = size_bytes(mapping.type);
  const std::size_t count = raw.size() / bytes;
  ISOHF_ASSERT(out.size() == count * sizeof(double));
  const LoadSample load = load_sample(mapping.type);
  // 123 / 10 is the decimal 12.3, 123 * 0.1 is not.
  constexpr double kWhole = 1e-12;
  const double inverse = std::round(1.0 / mapping.z_scale);
  const bool divides = std::abs(inverse) > 1.0 && std::abs(inverse * mapping.z_scale - 1.0) < kWhole;
  for (std::size_t i = 0; i < count; ++i) {
    const double number = load(raw.data() + i * bytes);
    const double elevation = (divides ? number / inverse : number * mapping.z_scale) + mapping.z_offset;
    const double value = record.is_void(number) ? std::nan("") : elevation;
    std::memcpy(out.data() + i * sizeof(double), &value, sizeof value);
  }
}

}  // namespace isohf
