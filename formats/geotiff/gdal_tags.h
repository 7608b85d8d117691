#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "isohf/raster.h"

namespace isohf {

constexpr std::uint32_t kGdalMetadataTag = 42112;
constexpr std::uint32_t kGdalNodataTag = 42113;

/// Reads GDAL_NODATA (tag 42113) into info.void_values: a number in decimal, "nan" or "inf". A number of few digits also
/// means the type's largest value or the power of two that it is the rounded text of. A value that no sample of
/// info.sample_type can hold, or a text that is not a number, becomes a warning.
void read_gdal_nodata(const std::string& text, SourceInfo& info);

/// Takes a number or unit of a band: `role` is "scale", "offset" or "unittype". Malformed numbers and units that are not
/// lengths become warnings.
void read_gdal_item(const std::string& role, const std::string& text, SourceInfo& info);

/// Reads scale, offset and unit of band `sample` from GDAL_METADATA (tag 42112, XML of <Item> elements).
/// Items that isohf does not use are skipped; malformed numbers become warnings.
void read_gdal_metadata(const std::string& xml, int sample, SourceInfo& info);

/// The names of the bands in GDAL_METADATA, empty if it has none.
[[nodiscard]] std::vector<std::string> gdal_band_names(const std::string& xml, std::size_t bands);

/// GDAL_METADATA of scale, offset and unit (empty: none); empty if there is nothing to say.
[[nodiscard]] std::string gdal_metadata(double z_scale, double z_offset, const std::string& unit);

}  // namespace isohf
