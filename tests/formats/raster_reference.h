#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "isohf/base/error.h"
#include "isohf/surface/height_source.h"
#include "support/write_bytes.h"

/// What the tests of raster readers share: scratch folders, whole-raster reads, and the reference values of real files.
namespace isohf::testing {

/// A folder that goes away with the test.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "isohf_test_XXXXXX").string();
    folder_ = ::mkdtemp(pattern.data());
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  [[nodiscard]] std::string operator/(const std::string& name) const { return (folder_ / name).string(); }

 private:
  std::filesystem::path folder_;
};

inline std::vector<char> file_bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

inline std::vector<std::byte> read_window(HeightSource& source, const Window& window) {
  std::vector<std::byte> samples(static_cast<std::size_t>(window.columns * window.rows) *
                                 size_bytes(source.info().sample_type));
  source.read_window(window, samples);
  return samples;
}

inline Window whole(const HeightSource& source) {
  return {0, 0, source.info().width, source.info().height};
}

inline std::vector<std::byte> read_whole(HeightSource& source) {
  return read_window(source, whole(source));
}

/// One raw sample as a double.
inline double raw_value(SampleType type, const std::byte* at) {
  const auto load = [&](auto value) {
    std::memcpy(&value, at, sizeof value);
    return value;
  };
  switch (type) {
    case SampleType::kUint8:
      return load(std::uint8_t{});
    case SampleType::kInt8:
      return load(std::int8_t{});
    case SampleType::kUint16:
      return load(std::uint16_t{});
    case SampleType::kInt16:
      return load(std::int16_t{});
    case SampleType::kUint32:
      return load(std::uint32_t{});
    case SampleType::kInt32:
      return load(std::int32_t{});
    case SampleType::kFloat16:
      return static_cast<double>(float_from_half(load(std::uint16_t{})));
    case SampleType::kFloat32:
      return static_cast<double>(load(float{}));
    case SampleType::kFloat64:
      return load(double{});
  }
  return std::numeric_limits<double>::quiet_NaN();
}

/// The folder of real terrain beside the repository; nullopt where a checkout has none.
inline std::optional<std::filesystem::path> shared_data() {
  const std::filesystem::path folder = std::filesystem::path(ISOHF_SOURCE_DIR) / ".." / "shared" / "data";
  if (!std::filesystem::is_directory(folder)) return std::nullopt;
  return folder;
}

struct Reference {
  std::string path;
  nlohmann::json expected;
};

/// Every real file whose name ends in `extension`, with the values that another reader found in it.
inline std::vector<Reference> references(const std::string& extension) {
  std::vector<Reference> found;
  const auto folder = shared_data();
  if (!folder) return found;
  for (const auto& entry : std::filesystem::directory_iterator(*folder / "ref")) {
    const std::string name = entry.path().stem().string();
    if (entry.path().extension() != ".json" || std::filesystem::path(name).extension() != extension) continue;
    for (const auto& candidate : {*folder / name, *folder / "derived" / name}) {
      if (std::filesystem::exists(candidate)) {
        found.push_back({candidate.string(), nlohmann::json::parse(std::ifstream(entry.path()))});
      }
    }
  }
  return found;
}

/// Compares size, listed pixels, minimum and maximum of the raw samples, voids left out.
inline void expect_matches(HeightSource& source, const nlohmann::json& expected) {
  const SourceInfo& info = source.info();
  ASSERT_EQ(info.width, expected.at("width").get<std::int64_t>());
  ASSERT_EQ(info.height, expected.at("height").get<std::int64_t>());
  std::string type = expected.at("dtype").get<std::string>();
  for (char& c : type) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  EXPECT_EQ(to_string(info.sample_type), type);
  const std::size_t size = size_bytes(info.sample_type);
  const auto samples = read_whole(source);
  for (const auto& pixel : expected.at("pixels")) {
    if (!pixel.at("raw").is_number()) continue;
    const auto at = static_cast<std::size_t>(pixel.at("row").get<std::int64_t>() * info.width +
                                             pixel.at("col").get<std::int64_t>());
    EXPECT_EQ(raw_value(info.sample_type, samples.data() + at * size), pixel.at("raw").get<double>())
        << "column " << pixel.at("col") << " row " << pixel.at("row");
  }
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -lowest;
  for (std::size_t at = 0; at < samples.size(); at += size) {
    const double value = raw_value(info.sample_type, samples.data() + at);
    lowest = std::min(lowest, value);
    highest = std::max(highest, value);
  }
  EXPECT_EQ(lowest, expected.at("raw_min").get<double>());
  EXPECT_EQ(highest, expected.at("raw_max").get<double>());
}

/// The code and message of the Error that `action` throws; fails the test where it throws none.
template <typename Action>
Error error_of(Action action) {
  try {
    action();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "no error";
  return {ErrorCode::kCancelled, ""};
}

}  // namespace isohf::testing
