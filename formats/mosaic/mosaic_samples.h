#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "isohf/raster.h"

namespace isohf {

/// How a raster's raw samples are read: the part of a SourceInfo that decides on elevations and voids.
struct SampleKind {
  SampleType type = SampleType::kFloat32;
  std::vector<double> void_values;
  double valid_min = 0.0;  ///< as in SourceInfo, infinite if unbounded
  double valid_max = 0.0;
  double z_scale = 1.0;
  double z_offset = 0.0;

  [[nodiscard]] static SampleKind of(const SourceInfo& info);
  void put_into(SourceInfo& info) const;
  friend bool operator==(const SampleKind& a, const SampleKind& b) = default;
};

/// The samples of a mosaic: a kind that holds those of all its members, and the raw sample where there is no member.
struct MosaicSamples {
  SampleKind kind;
  std::vector<std::byte> gap;  ///< one raw sample that is void; without meaning if the mosaic has no gaps
  std::vector<Warning> notes;  ///< what was changed for it to hold all, one line each
};

/// Chooses the samples of a mosaic. Members of one kind keep it, with their void values, and so do integers of one type
/// and scale with a void in common. Otherwise integers become int32, floats float32 or float64, whichever holds every
/// raw sample exactly; with several scales or offsets samples become float64 elevations. Their voids become one: the
/// lowest int32, or NaN.
/// gaps: there is ground without a member, which needs a void.
/// why_interpolated: if not nullptr, some samples are computed between others, which makes integers floats; what a note
/// says of the files.
/// kinds must not be empty. The result does not depend on their order.
[[nodiscard]] MosaicSamples choose_mosaic_samples(const std::vector<SampleKind>& kinds, bool gaps,
                                                  const char* why_interpolated);

/// Fills `out`, whole samples, with one sample.
void fill_with(std::span<const std::byte> sample, std::span<std::byte> out);

/// Raw samples of a member's kind -> raw samples of the mosaic's. Exact, but for float64 elevations if scales differ.
/// raw [n samples of `from`]   out [n samples of `to.kind`]
void convert_samples(const SampleKind& from, std::span<const std::byte> raw, const MosaicSamples& to,
                     std::span<std::byte> out);

/// Lays raw samples over others of the same kind: a void that lies over an elevation leaves it.
/// upper, lower [n samples of kind.type]
void lay_over(const SampleKind& kind, std::span<const std::byte> upper, std::span<std::byte> lower);

/// Raw samples as numbers, NaN for voids; no scale or offset. raw [n samples of kind.type]   numbers [n] out
void numbers_from_samples(const SampleKind& kind, std::span<const std::byte> raw, std::span<double> numbers);

/// Numbers -> raw samples of a floating kind without void values, rounded to nearest; NaN stays NaN.
void samples_from_numbers(SampleType type, std::span<const double> numbers, std::span<std::byte> raw);

}  // namespace isohf
