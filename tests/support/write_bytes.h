#pragma once

#include <fstream>
#include <ios>
#include <string>
#include <string_view>

namespace isohf::testing {

/// Makes the file at `path` hold just these bytes.
inline void write_bytes(const std::string& path, std::string_view bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

}  // namespace isohf::testing
