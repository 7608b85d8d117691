#include "raster/restored_samples.h"

#include <fmt/format.h>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <tuple>
#include <type_traits>
#include <utility>

#include "isohf/error.h"
#include "isohf/surface/source/sample_types.h"

namespace isohf::cli {
namespace {

template <typename T>
void put(T value, std::byte* raw) {
  std::memcpy(raw, &value, sizeof(value));
}

void store_nan(SampleType type, std::byte* raw) {
  if (type == SampleType::kFloat16) return put(std::uint16_t{0x7E00}, raw);
  if (type == SampleType::kFloat32) return put(std::numeric_limits<float>::quiet_NaN(), raw);
  put(std::numeric_limits<double>::quiet_NaN(), raw);
}

}  // namespace

std::pair<double, double> sample_range(SampleType type) {
  return with_stored_type(type, [](auto stored) -> std::pair<double, double> {
    using T = decltype(stored);
    if constexpr (std::is_same_v<T, StoredHalf>) {
      return {-65504.0, 65504.0};  // (2 - 2^-10) * 2^15
    } else {
      return {static_cast<double>(std::numeric_limits<T>::lowest()),
              static_cast<double>(std::numeric_limits<T>::max())};
    }
  });
}

std::optional<double> usual_void(SampleType type) {
  if (is_floating(type)) return std::nullopt;
  const auto [low, high] = sample_range(type);
  return low < 0.0 ? low : high;
}

SampleStore::SampleStore(const SampleMapping& mapping, std::optional<double> void_value, bool clamp)
    : mapping_(mapping), void_value_(void_value), clamp_(clamp) {
  std::tie(low_, high_) = sample_range(mapping.type);
  if (void_value == low_) low_ += 1.0;
  if (void_value == high_) high_ -= 1.0;
}

SampleStore::Outcome SampleStore::store(double elevation, std::byte* raw) const {
  const SampleMapping plain{mapping_.type, 1.0, 0.0};
  if (std::isnan(elevation)) {
    if (!void_value_ && !is_floating(mapping_.type)) return Outcome::kRefused;
    if (void_value_) {
      store_sample(plain, *void_value_, raw);
    } else {
      store_nan(mapping_.type, raw);
    }
    return Outcome::kVoid;
  }
  std::array<std::byte, sizeof(double)> bytes{};
  const bool held = store_sample(mapping_, elevation, bytes.data());
  const double stored = held ? load_sample(mapping_.type, bytes.data()) : 0.0;
  if (held && stored >= low_ && stored <= high_) {
    std::copy_n(bytes.begin(), size_bytes(mapping_.type), raw);
    return Outcome::kStored;
  }
  if (!clamp_) return Outcome::kRefused;
  const double sample = (elevation - mapping_.z_offset) / mapping_.z_scale;
  store_sample(plain, sample < low_ + (high_ - low_) / 2.0 ? low_ : high_, raw);
  return Outcome::kClamped;
}

bool SampleStore::holds(double raw) const {
  std::array<std::byte, sizeof(double)> bytes{};
  return store_sample({mapping_.type, 1.0, 0.0}, raw, bytes.data()) && load_sample(mapping_.type, bytes.data()) == raw;
}

void refuse_sample(const std::string& output, SampleType type, std::int64_t column, std::int64_t row, double value,
                   const char* remedy) {
  throw Error(ErrorCode::kInvalidArgument,
              fmt::format("{}: sample (column {}, row {}) is {:.9g}, which {} does not hold; {}", output, column, row,
                          value, to_string(type), remedy));
}

std::vector<std::byte> store_rows(const SampleStore& store, SampleType type, const std::string& output,
                                  std::int64_t width, std::int64_t first_row, std::span<const double> elevations,
                                  SampleCounts& counts) {
  using Outcome = SampleStore::Outcome;
  std::vector<std::byte> raw(elevations.size() * size_bytes(type));
  std::vector<Outcome> outcomes(elevations.size());
  oneapi::tbb::parallel_for(oneapi::tbb::blocked_range<std::size_t>(0, elevations.size(), 4096),
                            [&](const oneapi::tbb::blocked_range<std::size_t>& part) {
                              for (std::size_t i = part.begin(); i < part.end(); ++i) {
                                outcomes[i] = store.store(elevations[i], raw.data() + i * size_bytes(type));
                              }
                            });
  counts.voids += std::count(outcomes.begin(), outcomes.end(), Outcome::kVoid);
  counts.clamped += std::count(outcomes.begin(), outcomes.end(), Outcome::kClamped);
  const auto refused = std::find(outcomes.begin(), outcomes.end(), Outcome::kRefused);
  if (refused != outcomes.end()) {
    const std::int64_t place = refused - outcomes.begin();
    refuse_sample(output, type, place % width, first_row + place / width, elevations[static_cast<std::size_t>(place)],
                  "--clamp-range moves it, .exr holds it");
  }
  return raw;
}

}  // namespace isohf::cli
