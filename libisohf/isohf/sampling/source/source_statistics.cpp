#include "isohf/sampling/source/source_statistics.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>

#include "isohf/base/sample.h"
#include "isohf/base/void_values.h"

namespace isohf {
namespace {

/// Range of the valid raw samples.
template <typename T>
void scan(const SourceInfo& info, std::span<const std::byte> raw, SourceScan& scan) {
  using Wide = decltype(number_of(T{}));
  const std::size_t count = raw.size() / sizeof(T);
  Wide low = std::numeric_limits<Wide>::max();
  Wide high = std::numeric_limits<Wide>::lowest();
  std::int64_t valid = 0;
  const bool bounded = std::isfinite(info.valid_min) || std::isfinite(info.valid_max);
  const auto accept = [&](Wide value, bool is_valid) {
    low = is_valid && value < low ? value : low;
    high = is_valid && value > high ? value : high;
    valid += is_valid ? 1 : 0;
  };
  const auto is_number = [](Wide value) {
    if constexpr (std::is_floating_point_v<Wide>) return static_cast<bool>(std::isfinite(value));
    return true;
  };
  if (!bounded && info.void_values.size() <= 1) {
    const bool has_void = !info.void_values.empty();
    const double void_value = has_void ? info.void_values.front() : 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      const Wide value = number_of(stored_at<T>(raw.data() + i * sizeof(T)));
      accept(value, is_number(value) && !(has_void && static_cast<double>(value) == void_value));
    }
  } else {
    for (std::size_t i = 0; i < count; ++i) {
      const Wide value = number_of(stored_at<T>(raw.data() + i * sizeof(T)));
      const auto number = static_cast<double>(value);
      bool is_valid = is_number(value) && number >= info.valid_min && number <= info.valid_max;
      for (const double void_value : info.void_values) is_valid = is_valid && number != void_value;
      accept(value, is_valid);
    }
  }
  scan.voids += static_cast<std::int64_t>(count) - valid;
  if (valid == 0) return;
  const double a = static_cast<double>(low) * info.z_scale + info.z_offset;
  const double b = static_cast<double>(high) * info.z_scale + info.z_offset;
  const double least = std::min(a, b);
  const double most = std::max(a, b);
  scan.range.min = scan.valid == 0 ? least : std::min(scan.range.min, least);
  scan.range.max = scan.valid == 0 ? most : std::max(scan.range.max, most);
  scan.valid += valid;
}

constexpr std::size_t kRun = 4096;  // sums of sums: rounding grows with the root of the count

/// As `sum` for integers of up to 16 bits, of which a run's sum fits 32 bits: no rounding, and vectors of them.
template <typename T>
double sum_of_small(const SourceInfo& info, std::span<const std::byte> raw) {
  const auto least = static_cast<double>(std::numeric_limits<T>::lowest());
  const auto most = static_cast<double>(std::numeric_limits<T>::max());
  if (!(info.valid_min <= most) || !(info.valid_max >= least)) return 0.0;
  const auto low = static_cast<std::int32_t>(std::ceil(std::max(info.valid_min, least)));
  const auto high = static_cast<std::int32_t>(std::floor(std::min(info.valid_max, most)));
  constexpr std::int32_t kNoSample = std::int32_t{1} << 20U;
  std::int32_t void_value = kNoSample;
  if (!info.void_values.empty()) {
    const double value = info.void_values.front();
    if (value >= least && value <= most && value == std::floor(value)) void_value = static_cast<std::int32_t>(value);
  }
  const std::size_t count = raw.size() / sizeof(T);
  double total = 0.0;
  for (std::size_t first = 0; first < count; first += kRun) {
    const std::byte* const samples = raw.data() + first * sizeof(T);
    const std::size_t in_run = std::min(kRun, count - first);
    std::int32_t run = 0;
    for (std::size_t i = 0; i < in_run; ++i) {
      const auto number = static_cast<std::int32_t>(stored_at<T>(samples + i * sizeof(T)));
      const bool is_valid = (number >= low) & (number <= high) & (number != void_value);
      run += is_valid ? number : 0;
    }
    total += run;
  }
  return total;
}

template <typename T>
double sum(const SourceInfo& info, std::span<const std::byte> raw) {
  if constexpr (std::is_integral_v<T> && sizeof(T) <= 2) {
    if (info.void_values.size() <= 1) return sum_of_small<T>(info, raw);
  }
  const std::size_t count = raw.size() / sizeof(T);
  double total = 0.0;
  for (std::size_t first = 0; first < count; first += kRun) {
    double run = 0.0;
    for (std::size_t i = first; i < std::min(first + kRun, count); ++i) {
      const auto number = static_cast<double>(number_of(stored_at<T>(raw.data() + i * sizeof(T))));
      bool is_valid = std::isfinite(number) && number >= info.valid_min && number <= info.valid_max;
      for (const double void_value : info.void_values) is_valid = is_valid && number != void_value;
      run += is_valid ? number : 0.0;
    }
    total += run;
  }
  return total;
}

constexpr std::array<double, 10> kMarks = {-32768.0, -32767.0, 32767.0, 65535.0,   -9999.0,
                                           9999.0,   -99999.0, 99999.0, -999999.0, 999999.0};
bool is_mark(double value) {
  return std::find(kMarks.begin(), kMarks.end(), value) != kMarks.end();
}

void merge(SourceScan& into, const SourceScan& part) {
  into.voids += part.voids;
  if (part.valid == 0) return;
  into.range.min = into.valid == 0 ? part.range.min : std::min(into.range.min, part.range.min);
  into.range.max = into.valid == 0 ? part.range.max : std::max(into.range.max, part.range.max);
  into.valid += part.valid;
}

/// The end of the range of raw samples that has half of it for itself; nullopt if there are others in both halves.
template <typename T>
std::optional<double> lonely_end(const SourceInfo& info, std::span<const std::byte> raw, const ElevationRange& range) {
  const double middle = range.min / 2.0 + range.max / 2.0;
  const std::size_t count = raw.size() / sizeof(T);
  bool has_low = false;
  bool has_high = false;
  for (const std::size_t step : {std::size_t{97}, std::size_t{1}}) {  // a few samples are enough of most parts
    for (std::size_t i = 0; i < count; i += step) {
      const auto value = static_cast<double>(number_of(stored_at<T>(raw.data() + i * sizeof(T))));
      if (!(value > range.min && value < range.max)) continue;
      if (std::ranges::find(info.void_values, value) != info.void_values.end()) continue;
      (value < middle ? has_low : has_high) = true;
      if (has_low && has_high) return std::nullopt;
    }
  }
  return has_high ? range.min : range.max;
}

}  // namespace

double sum_of_samples(const SourceInfo& info, std::span<const std::byte> raw) {
  return with_stored_type(info.sample_type, [&](auto sample) { return sum<decltype(sample)>(info, raw); });
}

void scan_samples(const SourceInfo& info, std::span<const std::byte> raw, SourceScan& found) {
  with_stored_type(info.sample_type, [&](auto sample) { scan<decltype(sample)>(info, raw, found); });
}

double choose_datum(const ElevationRange& range) {
  return std::round((range.min + range.max) / 2.0);
}

SourceSurvey::SourceSurvey(const SourceInfo& info, bool with_mean)
    : info_(info), z_scale_(info.z_scale), z_offset_(info.z_offset), with_mean_(with_mean) {
  info_.z_scale = 1.0;
  info_.z_offset = 0.0;
}

void SourceSurvey::add(std::span<const std::byte> raw) {
  SourceScan part;
  scan_samples(info_, raw, part);
  merge(all_, part);
  if (with_mean_) sum_ += sum_of_samples(info_, raw);
  find_clusters(raw, part);
}

void SourceSurvey::add(const SourceSurvey& other) {
  merge(all_, other.all_);
  for (const Cluster& cluster : other.clusters_) add(cluster);
  sum_ += other.sum_;
}

/// Takes lonely ends off the part, one after the other. One that lies far from all samples of the source does so in
/// every part that has it.
void SourceSurvey::find_clusters(std::span<const std::byte> raw, SourceScan part) {
  constexpr int kMostEnds = 4;
  SourceInfo without = info_;
  for (int i = 0; i < kMostEnds && part.valid > 0 && part.range.min < part.range.max; ++i) {
    const std::optional<double> end = with_stored_type(
        info_.sample_type, [&](auto sample) { return lonely_end<decltype(sample)>(without, raw, part.range); });
    if (!end) break;
    const std::int64_t before = part.valid;
    without.void_values.push_back(*end);
    part = {};
    scan_samples(without, raw, part);
    add({*end, *end, before - part.valid});
  }
  if (part.valid > 0) add({part.range.min, part.range.max, part.valid});
}

void SourceSurvey::add(const Cluster& cluster) {
  constexpr std::size_t kMostClusters = 16;
  const auto join = [&](std::size_t i) {  // with the next
    Cluster& low = clusters_[i];
    const Cluster& high = clusters_[i + 1];
    low = {low.low, std::max(low.high, high.high), low.count + high.count};
    clusters_.erase(clusters_.begin() + static_cast<std::ptrdiff_t>(i) + 1);
  };
  const auto gap = [&](std::size_t i) { return clusters_[i + 1].low - clusters_[i].high; };
  clusters_.insert(std::ranges::upper_bound(clusters_, cluster.low, {}, &Cluster::low), cluster);
  for (std::size_t i = 0; i + 1 < clusters_.size();) gap(i) <= 0.0 ? join(i) : static_cast<void>(++i);
  if (clusters_.size() <= kMostClusters) return;
  std::size_t nearest = 0;
  for (std::size_t i = 1; i + 1 < clusters_.size(); ++i) nearest = gap(i) < gap(nearest) ? i : nearest;
  join(nearest);
}

SourceScan SourceSurvey::scan() const {
  SourceScan scan = all_;
  const double a = all_.range.min * z_scale_ + z_offset_;
  const double b = all_.range.max * z_scale_ + z_offset_;
  scan.range = {std::min(a, b), std::max(a, b)};
  return scan;
}

std::optional<double> SourceSurvey::mean() const {
  if (!with_mean_ || all_.valid == 0) return std::nullopt;
  return sum_ / static_cast<double>(all_.valid) * z_scale_ + z_offset_;
}

/// `gap`  to the nearest other sample; `rest`  from the least to the greatest of the others.
bool SourceSurvey::is_outlier(const Cluster& cluster, double gap, double rest) const {
  constexpr double kHighLand = 10000.0;  // from the sea to the highest summit of the Earth, in metres
  if (cluster.low != cluster.high) return false;
  if (is_mark(cluster.low)) return gap > std::max(rest, 1.0);
  return gap > 10.0 * rest && gap * std::abs(z_scale_) > kHighLand;
}

SourceSurvey::Outliers SourceSurvey::outliers() const {
  Outliers found;
  std::vector<Cluster> rest = clusters_;
  while (rest.size() > 1) {
    const Cluster first = rest.front();
    const Cluster last = rest.back();
    const bool is_first = is_outlier(first, rest[1].low - first.high, last.high - rest[1].low);
    const double before_last = rest[rest.size() - 2].high;
    const bool is_last = is_outlier(last, last.low - before_last, before_last - first.low);
    if (!is_first && !is_last) break;
    // Of two values alone the mark, else the rarer.
    const auto rank = [](const Cluster& cluster) { return std::pair(!is_mark(cluster.low), cluster.count); };
    const bool takes_first = is_first && (!is_last || rank(first) < rank(last));
    found.voids.push_back({takes_first ? first.low : last.low, takes_first ? first.count : last.count});
    rest.erase(takes_first ? rest.begin() : rest.end() - 1);
  }
  std::ranges::sort(found.voids, {}, &UndeclaredVoid::value);
  if (rest.empty()) return found;
  const double a = rest.front().low * z_scale_ + z_offset_;
  const double b = rest.back().high * z_scale_ + z_offset_;
  found.others = {std::min(a, b), std::max(a, b)};
  return found;
}

std::string SourceSurvey::warning(const std::string& consequence) const {
  // A reader that counts on its own (ASCII grids, where text is parsed anyway) has said it.
  for (const Warning& warning : info_.warnings) {
    if (warning.kind == Warning::Kind::kUndeclaredNodata && consequence.empty()) return {};
  }
  const auto [voids, others] = outliers();
  std::string values;
  std::vector<double> list;
  for (const UndeclaredVoid& found : voids) {
    list.push_back(found.value);
    values += fmt::format("{}{} samples hold {}", values.empty() ? "" : ", ", found.count,
                          shortest_text(info_.sample_type, found.value));
  }
  if (values.empty()) return {};
  const double a = (others.min - z_offset_) / z_scale_;
  const double b = (others.max - z_offset_) / z_scale_;
  return fmt::format("{}, far from all others ({:.6g} to {:.6g}){}: if that means no elevation, give {}", values,
                     std::min(a, b), std::max(a, b), consequence, void_values_with(info_, list));
}

}  // namespace isohf
