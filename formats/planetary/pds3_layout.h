#pragma once

#include <cstdint>

#include "formats/planetary/label_text.h"
#include "isohf/raster.h"

namespace isohf {

/// How the samples of a PDS3 IMAGE follow each other; offsets are from where ^IMAGE points.
struct Pds3Layout {
  std::int64_t columns = 0;
  std::int64_t rows = 0;
  std::int64_t bands = 1;
  SampleType type = SampleType::kInt16;
  bool big_endian = false;
  bool vax = false;                ///< VAX F-floats
  std::uint64_t offset_bytes = 0;  ///< of the first sample: the first line's prefix
  std::int64_t sample_stride_bytes = 0;
  std::int64_t line_stride_bytes = 0;
  std::int64_t band_stride_bytes = 0;
  std::uint64_t total_bytes = 0;  ///< all bands with prefixes and suffixes, below 2^50
};

/// Reads an IMAGE object. Throws Error: kCorrupt for a field that says nothing, kUnsupported for what is not read.
[[nodiscard]] Pds3Layout pds3_layout(const LabelFields& image);

}  // namespace isohf
