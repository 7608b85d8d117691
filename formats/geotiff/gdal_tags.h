#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "isohf/raster.h"

namespace isohf {

constexpr std::uint32_t kGdalMetadataTag = 42112;
constexpr std::uint32_t kGdalNodataTag = 42113;

/// Reads GDAL_NODATA (tag 42113) into info.void_values: a number in decimal, "nan" or "inf". A value that no sample of
/// info.sample_type can hold, or a text that is no number, becomes a warning.
void read_gdal_nodata(const std::string& text, SourceInfo& info);

/// Takes a number or unit of a band: `role` is "scale", "offset" or "unittype". Malformed numbers become warnings.
void read_gdal_item(const std::string& role, const std::string& text, SourceInfo& info);

/// Reads scale, offset and unit of band `sample` from GDAL_METADATA (tag 42112, XML of <Item> elements).
/// What isohf has no use for is skipped; malformed numbers become warnings.
void read_gdal_metadata(const std::string& xml, int sample, SourceInfo& info);

/// What GDAL_METADATA calls the bands, empty where it says nothing.
[[nodiscard]] std::vector<std::string> gdal_band_names(const std::string& xml, std::size_t bands);

}  // namespace isohf
