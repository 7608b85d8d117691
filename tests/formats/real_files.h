#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "isohf/surface/height_source.h"

namespace isohf::testing {

/// Folder of the real elevation files; it is no part of the repository and may be absent.
inline std::filesystem::path real_data() {
  return std::filesystem::path(ISOHF_SOURCE_DIR) / ".." / "shared" / "data";
}

/// Sample `i` of `raw` as a number.
inline double value_at(SampleType type, const std::vector<std::byte>& raw, std::size_t i) {
  const auto as = [&](auto value) {
    std::memcpy(&value, raw.data() + i * sizeof(value), sizeof(value));
    return value;
  };
  switch (type) {
    case SampleType::kUint8:
      return as(std::uint8_t{});
    case SampleType::kInt8:
      return as(std::int8_t{});
    case SampleType::kUint16:
      return as(std::uint16_t{});
    case SampleType::kInt16:
      return as(std::int16_t{});
    case SampleType::kUint32:
      return as(std::uint32_t{});
    case SampleType::kInt32:
      return as(std::int32_t{});
    case SampleType::kFloat16:
      return static_cast<double>(float_from_half(as(std::uint16_t{})));
    case SampleType::kFloat32:
      return static_cast<double>(as(float{}));
    case SampleType::kFloat64:
      return as(double{});
  }
  return 0.0;
}

inline std::vector<std::byte> read_all(HeightSource& source) {
  const SourceInfo& info = source.info();
  std::vector<std::byte> raw(static_cast<std::size_t>(info.width * info.height) * size_bytes(info.sample_type));
  source.read_window({0, 0, info.width, info.height}, raw);
  return raw;
}

inline bool is_void(const SourceInfo& info, double value) {
  if (!std::isfinite(value) || value < info.valid_min || value > info.valid_max) return true;
  return std::find(info.void_values.begin(), info.void_values.end(), value) != info.void_values.end();
}

/// Holds what `source` delivers against the reference that GDAL wrote for the same file.
/// `turned`: the file's rows run from South to North, so that the reference's row r is our row height - 1 - r.
inline void expect_as_reference(HeightSource& source, const nlohmann::json& ref, bool turned) {
  const SourceInfo& info = source.info();
  ASSERT_EQ(info.width, ref.at("width").get<std::int64_t>());
  ASSERT_EQ(info.height, ref.at("height").get<std::int64_t>());
  std::string type = ref.at("dtype");
  std::transform(type.begin(), type.end(), type.begin(), [](unsigned char c) { return std::tolower(c); });
  EXPECT_EQ(to_string(info.sample_type), type);

  // GDAL's geotransform names the corner of the pixel, isohf the sample itself.
  const auto& gt = ref.at("geotransform");
  const double dx = gt[1];
  const double dy = gt[5];
  const Georeference& geo = info.georeference;
  // Sums of half pixels in another order differ in the last bits of coordinates up to 1e7.
  const double tolerance = 1e-9 * std::max({1.0, std::abs(gt[0].get<double>()), std::abs(gt[3].get<double>())});
  EXPECT_TRUE(geo.has_origin);
  EXPECT_NEAR(geo.spacing_x, dx, 1e-15 * dx);
  EXPECT_NEAR(geo.spacing_y, std::abs(dy), 1e-15 * std::abs(dy));
  EXPECT_NEAR(geo.origin_x, gt[0].get<double>() + dx / 2, tolerance);
  const double first_row = turned ? static_cast<double>(info.height) - 0.5 : 0.5;
  EXPECT_NEAR(geo.origin_y, gt[3].get<double>() + first_row * dy, tolerance);
  if (ref.at("area_or_point").is_string()) {
    EXPECT_EQ(geo.registration, ref.at("area_or_point") == "Point" ? Registration::kPoint : Registration::kArea);
  }
  if (ref.at("crs").is_object() && ref.at("crs").at("epsg").is_number()) {
    EXPECT_EQ(geo.system.epsg, ref.at("crs").at("epsg").get<int>());
  }
  EXPECT_EQ(info.z_scale, ref.at("scale").get<double>());
  EXPECT_EQ(info.z_offset, ref.at("offset").get<double>());

  const std::vector<std::byte> raw = read_all(source);
  double lowest = INFINITY;
  double highest = -INFINITY;
  double sum = 0.0;
  std::int64_t voids = 0;
  const auto count = static_cast<std::size_t>(info.width * info.height);
  for (std::size_t i = 0; i < count; ++i) {
    const double value = value_at(info.sample_type, raw, i);
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
  const double mean = sum / static_cast<double>(static_cast<std::int64_t>(count) - voids);
  // The reference sums in another order.
  EXPECT_NEAR(mean, ref.at("raw_mean").get<double>(), 1e-9 * std::max(1.0, std::abs(mean)));
  for (const char* list : {"pixels", "corners"}) {
    for (const auto& pixel : ref.at(list)) {
      const auto column = pixel.at("col").get<std::int64_t>();
      const auto row =
          turned ? info.height - 1 - pixel.at("row").get<std::int64_t>() : pixel.at("row").get<std::int64_t>();
      const double value = value_at(info.sample_type, raw, static_cast<std::size_t>(row * info.width + column));
      if (pixel.at("raw").is_string()) {
        EXPECT_FALSE(std::isfinite(value)) << column << ", " << row;
      } else {
        EXPECT_EQ(value, pixel.at("raw").get<double>()) << column << ", " << row;
      }
    }
  }
}

inline nlohmann::json reference_of(const std::filesystem::path& file) {
  std::ifstream in(real_data() / "ref" / (file.filename().string() + ".json"));
  return nlohmann::json::parse(in);
}

/// The files below the real data, in its folder and derived/, whose names end in one of `endings`, with a reference.
inline std::vector<std::filesystem::path> real_files(const std::vector<std::string>& endings) {
  std::vector<std::filesystem::path> files;
  for (const auto& folder : {real_data(), real_data() / "derived"}) {
    if (!std::filesystem::is_directory(folder)) continue;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      const std::string name = entry.path().filename().string();
      const bool wanted = std::any_of(endings.begin(), endings.end(), [&](const std::string& ending) {
        return name.size() > ending.size() && name.substr(name.size() - ending.size()) == ending;
      });
      if (wanted && std::filesystem::exists(real_data() / "ref" / (name + ".json"))) files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace isohf::testing
