#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "isohf/raster.h"

namespace isohf {

/// Smallest and largest elevation of a source, in its vertical units.
struct ElevationRange {
  double min = 0.0;
  double max = 0.0;
};

/// What the first pass over a source finds.
struct SourceScan {
  ElevationRange range;    ///< meaningless where valid is 0
  std::int64_t valid = 0;  ///< samples with an elevation
  std::int64_t voids = 0;
};

/// Accumulates range and counts over raw samples of the source's type, exactly, z_scale and z_offset applied.
void scan_samples(const SourceInfo& info, std::span<const std::byte> raw, SourceScan& scan);

/// The sum of all valid raw samples, z_scale and z_offset left aside. The order of summation is fixed.
[[nodiscard]] double sum_of_samples(const SourceInfo& info, std::span<const std::byte> raw);

/// The datum that heights of this source are taken from (heights_from_samples): the middle of the range, rounded, so
/// that single precision holds them as well as it can.
[[nodiscard]] double choose_datum(const ElevationRange& range);

/// A raw value that looks like a mark for voids that the source does not declare.
struct UndeclaredVoid {
  double value = 0.0;
  std::int64_t count = 0;  ///< samples that hold it
};

/// What one pass over a whole source finds, whatever parts it comes in: range and counts, the mean where it is wanted,
/// and voids that are not declared.
///
/// A value at an end of the range counts as an undeclared void if it lies far from all others: further than these lie
/// from each other, if it is one that files mark voids with (-32768, -32767, 32767, 65535, -9999, 9999, -99999, 99999,
/// -999999, 999999); else ten times as far, and further than land is high. Ordinary sources pay little for that: parts
/// of a source have some sample in both halves of their range, and then nothing else is looked at.
class SourceSurvey {
 public:
  /// with_mean: takes as long as the rest again.
  SourceSurvey(const SourceInfo& info, bool with_mean);

  /// Samples of the source's type; every sample of the source once, in any order that suits.
  void add(std::span<const std::byte> raw);
  /// So many samples without an elevation.
  void add_voids(std::int64_t samples) { all_.voids += samples; }
  /// What another survey of the same source found in other parts.
  void add(const SourceSurvey& other);

  /// Range in elevations.
  [[nodiscard]] SourceScan scan() const;
  /// Of all valid elevations; nullopt where there are none or it was not wanted.
  [[nodiscard]] std::optional<double> mean() const;

  struct Outliers {
    std::vector<UndeclaredVoid> voids;  ///< in ascending order
    ElevationRange others;              ///< elevations without them
  };
  [[nodiscard]] Outliers outliers() const;
  /// One line on them for the user, without the path; empty where there are none. `consequence`  of keeping them.
  [[nodiscard]] std::string warning(const std::string& consequence = {}) const;

 private:
  /// Samples from `low` to `high`, with none of the others between.
  struct Cluster {
    double low = 0.0;
    double high = 0.0;
    std::int64_t count = 0;
  };

  void find_clusters(std::span<const std::byte> raw, SourceScan part);
  void add(const Cluster& cluster);
  [[nodiscard]] bool is_outlier(const Cluster& cluster, double gap, double rest) const;

  SourceInfo info_;  ///< of raw samples: scale 1, offset 0
  double z_scale_ = 1.0;
  double z_offset_ = 0.0;
  bool with_mean_ = false;
  double sum_ = 0.0;
  SourceScan all_;                 ///< raw
  std::vector<Cluster> clusters_;  ///< raw, in ascending order, a few: of many the nearest are joined
};

}  // namespace isohf
