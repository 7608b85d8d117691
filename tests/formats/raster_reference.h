#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "support/rasters/samples.h"
#include "support/real_files.h"

namespace isohf::test {

/// What another reader, GDAL for most, found in one of the real files.
inline nlohmann::json reference_of(const std::filesystem::path& file) {
  return nlohmann::json::parse(std::ifstream(real_data() / "ref" / (file.filename().string() + ".json")));
}

/// GDAL's rows of some files run from South to North, ours never do: its row r is then our row height - 1 - r.
inline bool is_turned(const nlohmann::json& ref) {
  return ref.at("geotransform").is_array() && ref.at("geotransform")[5].get<double>() > 0.0;
}

inline std::int64_t our_row(const nlohmann::json& ref, const nlohmann::json& pixel, std::int64_t height) {
  const std::int64_t row = pixel.at("row");
  return is_turned(ref) ? height - 1 - row : row;
}

/// GDAL's geotransform names the corner of the pixel, isohf the sample itself.
inline void expect_reference_place(const Georeference& place, const nlohmann::json& gt, std::int64_t height) {
  if (gt.is_null()) {
    EXPECT_FALSE(place.has_origin);
    return;
  }
  const double dx = gt[1];
  const double dy = gt[5];
  // Sums of half pixels in another order differ in the last bits of coordinates up to 1e7.
  const double tolerance = 1e-9 * std::max({1.0, std::abs(gt[0].get<double>()), std::abs(gt[3].get<double>())});
  EXPECT_TRUE(place.has_origin);
  EXPECT_NEAR(place.spacing_x, dx, 1e-15 * dx);
  EXPECT_NEAR(place.spacing_y, std::abs(dy), 1e-15 * std::abs(dy));
  EXPECT_NEAR(place.origin_x, gt[0].get<double>() + dx / 2, tolerance);
  const double first_row = dy > 0.0 ? static_cast<double>(height) - 0.5 : 0.5;
  EXPECT_NEAR(place.origin_y, gt[3].get<double>() + first_row * dy, tolerance);
}

/// Holds what `source` delivers against the reference of the same file.
inline void expect_as_reference(HeightSource& source, const nlohmann::json& ref) {
  const SourceInfo& info = source.info();
  ASSERT_EQ(info.width, ref.at("width").get<std::int64_t>());
  ASSERT_EQ(info.height, ref.at("height").get<std::int64_t>());
  std::string type = ref.at("dtype");
  std::transform(type.begin(), type.end(), type.begin(), [](unsigned char c) { return std::tolower(c); });
  EXPECT_EQ(to_string(info.sample_type), type);

  const Georeference& geo = info.georeference;
  expect_reference_place(geo, ref.at("geotransform"), info.height);
  if (ref.at("area_or_point").is_string()) {
    EXPECT_EQ(geo.registration, ref.at("area_or_point") == "Point" ? Registration::kPoint : Registration::kArea);
  }
  if (ref.at("crs").is_object() && ref.at("crs").at("epsg").is_number()) {
    EXPECT_EQ(geo.system.epsg, ref.at("crs").at("epsg").get<int>());
  }
  EXPECT_EQ(info.z_scale, ref.at("scale").get<double>());
  EXPECT_EQ(info.z_offset, ref.at("offset").get<double>());

  const std::vector<double> values = values_of(info.sample_type, read_whole(source));
  double lowest = INFINITY;
  double highest = -INFINITY;
  double sum = 0.0;
  std::int64_t voids = 0;
  for (const double value : values) {
    if (is_void(info, value)) {
      ++voids;
      continue;
    }
    lowest = std::min(lowest, value);
    highest = std::max(highest, value);
    sum += value;
  }
  EXPECT_EQ(voids, ref.at("nodata_count").get<std::int64_t>() + ref.at("inf_count").get<std::int64_t>());
  EXPECT_EQ(lowest, ref.at("raw_min").get<double>());
  EXPECT_EQ(highest, ref.at("raw_max").get<double>());
  const double mean = sum / static_cast<double>(static_cast<std::int64_t>(values.size()) - voids);
  // The reference sums in another order.
  EXPECT_NEAR(mean, ref.at("raw_mean").get<double>(), 1e-9 * std::max(1.0, std::abs(mean)));
  for (const char* list : {"pixels", "corners"}) {
    for (const auto& pixel : ref.at(list)) {
      const std::int64_t column = pixel.at("col");
      const double value = values[static_cast<std::size_t>(our_row(ref, pixel, info.height) * info.width + column)];
      if (pixel.at("raw").is_string()) {
        EXPECT_FALSE(std::isfinite(value)) << pixel;
      } else {
        EXPECT_EQ(value, pixel.at("raw").get<double>()) << pixel;
      }
    }
  }
}

}  // namespace isohf::test
