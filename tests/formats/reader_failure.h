#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

#include "isohf/error.h"
#include "support/error_of.h"
#include "support/in_folder.h"
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

/// Files of a reader, in a folder of their own.
class ReaderTest : public InFolder {
 protected:
  /// Its path.
  template <typename Bytes>
  std::string write(const std::string& name, const Bytes& bytes) const {
    write_file(folder / name, bytes);
    return folder / name;
  }

  /// What `open` or reading the first samples says; empty where it works.
  template <typename Open>
  static std::string failure_at(const std::string& path, ErrorCode* code, const Open& open) {
    return failure_of(path, code, [&] { read_corner(*open(path, OpenOptions{})); });
  }
};

}  // namespace isohf::test
