#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "isohf/base/error.h"
#include "isohf/surface/height_source.h"
#include "support/write_bytes.h"

namespace isohf::testing {

/// Reads the North-West corner, 512 x 64 samples at most.
inline void read_corner(HeightSource& source) {
  const SourceInfo& info = source.info();
  const Window window = {0, 0, std::min<std::int64_t>(info.width, 512), std::min<std::int64_t>(info.height, 64)};
  std::vector<std::byte> raw(static_cast<std::size_t>(window.columns * window.rows) * size_bytes(info.sample_type));
  source.read_window(window, raw);
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

}  // namespace isohf::testing
