#include "input/source_size.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "isohf/archive/metadata/cut_record.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "isohf/surface.h"
#include "options/describe.h"

namespace isohf::cli {
namespace {

/// 0 where the archive says something that is no sample type.
std::uint64_t bytes_of_type(const std::string& sample_type) {
  try {
    return size_bytes(sample_type_from_string(sample_type));
  } catch (const Error&) {
    return 0;
  }
}

}  // namespace

SizeBesideSource::SizeBesideSource(const Metadata& metadata, std::uint64_t tile_bytes) {
  const SourceRecord& source = metadata.source;
  is_part = is_cut(metadata);
  const SampleGrid samples = natural_grid(metadata);
  source_samples = is_part ? static_cast<std::uint64_t>(samples.width) * static_cast<std::uint64_t>(samples.height)
                           : static_cast<std::uint64_t>(source.width) * static_cast<std::uint64_t>(source.height);
  source_bytes = source_samples * bytes_of_type(source.sample_type);
  if (source_samples > 0) {
    bits_per_source_sample = 8.0 * static_cast<double>(tile_bytes) / static_cast<double>(source_samples);
  }
  if (tile_bytes > 0) ratio_to_source = static_cast<double>(source_bytes) / static_cast<double>(tile_bytes);
}

std::string describe_size(const Metadata& metadata, std::uint64_t tile_bytes) {
  const SizeBesideSource size(metadata, tile_bytes);
  const std::string text = fmt::format("elevations take {}, {:.3f} bits a source sample", describe_bytes(tile_bytes),
                                       size.bits_per_source_sample);
  if (size.ratio_to_source == 0.0) return text;
  const bool is_smaller = size.ratio_to_source >= 1.0;
  return text + fmt::format(": {:.2f} times {} the source's {} of {}{}",
                            is_smaller ? size.ratio_to_source : 1.0 / size.ratio_to_source,
                            is_smaller ? "smaller than" : "as large as", describe_bytes(size.source_bytes),
                            metadata.source.sample_type, size.is_part ? " there" : "");
}

double triangle_aspect(const TileGrid& grid) {
  return grid.sigma_x() * std::numbers::sqrt3 / grid.sigma_z();
}

}  // namespace isohf::cli
