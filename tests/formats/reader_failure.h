#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

#include "isohf/error.h"
#include "support/rasters/samples.h"

namespace isohf::test {

/// Reads the North-West corner, 512 x 64 samples at most.
inline void read_corner(HeightSource& source) {
  const SourceInfo& info = source.info();
  (void)read_window(source, {0, 0, std::min<std::int64_t>(info.width, 512), std::min<std::int64_t>(info.height, 64)});
}

/// What `use` throws: one line that begins with the path; empty where it works.
template <typename Use>
std::string failure_of(const std::string& path, ErrorCode* code, const Use& use) {
  try {
    use();
    return {};
  } catch (const Error& error) {
    if (code != nullptr) *code = error.code();
    const std::string message = error.what();
    EXPECT_EQ(message.rfind(path, 0), 0U) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    return message.empty() ? "?" : message;
  }
}

/// What comes of many damaged copies of a raster file: most are refused, in one line; what opens has a place, or none,
/// and all of its samples can be read.
class Damaged {
 public:
  /// open  gives the raster in the file at `path`
  template <typename Open>
  void try_one(const std::string& path, const Open& open) {
    ErrorCode code = ErrorCode::kCorrupt;
    const std::string refused = failure_of(path, &code, [&] {
      const auto source = open(path);
      const SourceInfo& info = source->info();
      const Georeference& place = info.georeference;
      EXPECT_GE(info.width, 1);
      EXPECT_GE(info.height, 1);
      EXPECT_TRUE(std::isfinite(info.z_scale) && info.z_scale != 0.0 && std::isfinite(info.z_offset));
      EXPECT_TRUE(place.spacing_x > 0.0 && std::isfinite(place.spacing_x)) << place.spacing_x;
      EXPECT_TRUE(place.spacing_y > 0.0 && std::isfinite(place.spacing_y)) << place.spacing_y;
      EXPECT_TRUE(std::isfinite(place.origin_x) && std::isfinite(place.origin_y));
      read_corner(*source);
    });
    EXPECT_TRUE(code == ErrorCode::kCorrupt || code == ErrorCode::kUnsupported || code == ErrorCode::kIo ||
                code == ErrorCode::kInvalidArgument)
        << refused;
    ++(refused.empty() ? read_ : refused_);
  }
  /// That damage was met, and harmless changes as well.
  void expect_both() const {
    EXPECT_GT(refused_, (refused_ + read_) / 20);
    EXPECT_GT(read_, 0);
  }

 private:
  int refused_ = 0;
  int read_ = 0;
};

/// The Error that `action` throws; fails the test where it throws none.
template <typename Action>
Error error_of(const Action& action) {
  try {
    action();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "no error";
  return {ErrorCode::kCancelled, ""};
}

}  // namespace isohf::test
