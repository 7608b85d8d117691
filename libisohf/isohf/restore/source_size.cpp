#include "isohf/restore/source_size.h"

#include "isohf/archive/metadata/cut_record.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "isohf/surface.h"

namespace isohf {
namespace {

/// 0 if the archive's word is not a sample type.
std::uint64_t bytes_of_type(const std::string& sample_type) {
  try {
    return size_bytes(sample_type_from_string(sample_type));
  } catch (const Error&) {
    return 0;
  }
}

}  // namespace

SizeBesideSource::SizeBesideSource(const Metadata& metadata, std::uint64_t tile_bytes) {
  GridSize size{metadata.source.width, metadata.source.height};
  if (is_cut(metadata)) {
    const SampleGrid there = natural_grid(metadata);
    size = {there.width, there.height};
  }
  source_samples = static_cast<std::uint64_t>(size.first) * static_cast<std::uint64_t>(size.second);
  source_bytes = source_samples * bytes_of_type(metadata.source.sample_type);
  if (source_samples > 0) {
    bits_per_source_sample = 8.0 * static_cast<double>(tile_bytes) / static_cast<double>(source_samples);
  }
  if (tile_bytes > 0) ratio_to_source = static_cast<double>(source_bytes) / static_cast<double>(tile_bytes);
}

}  // namespace isohf
