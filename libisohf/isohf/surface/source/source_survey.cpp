#include "isohf/surface/source/source_survey.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace isohf {
namespace {

constexpr std::array<double, 10> kMarks = {-32768.0, -32767.0, 32767.0, 65535.0,   -9999.0,
                                           9999.0,   -99999.0, 99999.0, -999999.0, 999999.0};
/// No elevation on any body is as large in any unit.
constexpr double kHuge = 1e30;

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

}  // namespace

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
  look_for_voids(raw, part);
}

void SourceSurvey::add(const SourceSurvey& other) {
  merge(all_, other.all_);
  merge(others_, other.others_);
  merge(huge_negative_, other.huge_negative_);
  merge(huge_positive_, other.huge_positive_);
  for (const auto& [value, count] : other.suspects_) suspects_[value] += count;
  sum_ += other.sum_;
}

/// Takes suspects out of the part, one after the other, until its ends are none.
void SourceSurvey::look_for_voids(std::span<const std::byte> raw, SourceScan part) {
  SourceInfo without = info_;
  while (part.valid > 0) {
    const double low = part.range.min;
    const double high = part.range.max;
    const std::int64_t before = part.valid;
    std::int64_t* count = nullptr;
    if (low <= -kHuge) {
      SourceInfo only = without;
      only.valid_max = -kHuge;
      scan_samples(only, raw, huge_negative_);
      without.valid_min = std::max(without.valid_min, std::nextafter(-kHuge, 0.0));
    } else if (high >= kHuge) {
      SourceInfo only = without;
      only.valid_min = kHuge;
      scan_samples(only, raw, huge_positive_);
      without.valid_max = std::min(without.valid_max, std::nextafter(kHuge, 0.0));
    } else if (is_mark(low) || is_mark(high)) {
      const double value = is_mark(low) ? low : high;
      count = &suspects_[value];
      without.void_values.push_back(value);
    } else {
      break;
    }
    part = {};
    scan_samples(without, raw, part);
    if (count != nullptr) *count += before - part.valid;
  }
  merge(others_, part);
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

std::vector<UndeclaredVoid> SourceSurvey::undeclared_voids() const {
  std::vector<UndeclaredVoid> found;
  if (others_.valid == 0) return found;
  const auto add_huge = [&](const SourceScan& huge, double value) {
    if (huge.valid > 0) found.push_back({value, huge.valid, huge.range.min != huge.range.max});
  };
  add_huge(huge_negative_, huge_negative_.range.min);
  // Suspects that lie among the rest are part of it, the nearest first.
  ElevationRange rest = others_.range;
  std::vector<std::pair<double, std::int64_t>> suspects(suspects_.begin(), suspects_.end());
  const auto distance = [&](double value) { return std::max(rest.min - value, value - rest.max); };
  std::sort(suspects.begin(), suspects.end(),
            [&](const auto& a, const auto& b) { return distance(a.first) < distance(b.first); });
  for (const auto& [value, count] : suspects) {
    if (distance(value) > std::max(rest.max - rest.min, 1.0)) {
      found.push_back({value, count, false});
    } else {
      rest = {std::min(rest.min, value), std::max(rest.max, value)};
    }
  }
  add_huge(huge_positive_, huge_positive_.range.max);
  return found;
}

std::string SourceSurvey::warning() const {
  // A reader that counts on its own (ASCII grids, where text is parsed anyway) has said it.
  for (const std::string& warning : info_.warnings) {
    if (warning.find("--nodata") != std::string::npos) return {};
  }
  std::string values;
  std::string list;  // one value: --nodata takes no more
  for (const UndeclaredVoid& found : undeclared_voids()) {
    values += fmt::format("{}{} samples hold {:.9g}{}", values.empty() ? "" : ", ", found.count, found.value,
                          found.many_values ? " or the like" : "");
    if (list.empty()) list = fmt::format("{:.9g}", found.value);
  }
  if (values.empty()) return {};
  return fmt::format("{}, far from all others ({:.6g} to {:.6g}): if that means no elevation, give --{}", values,
                     others_.range.min, others_.range.max, "nodata " + list);
}

}  // namespace isohf
