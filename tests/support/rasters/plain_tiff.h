#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace isohf::test {

/// An uncompressed little-endian TIFF of one strip for each row, made without any library.
/// height_at(column, row) gives the elevations.
void write_float_tiff(const std::string& path, std::uint32_t width, std::uint32_t height,
                      const std::function<float(std::int64_t, std::int64_t)>& height_at);
void write_int16_tiff(const std::string& path, std::uint32_t width, std::uint32_t height,
                      const std::function<std::int16_t(std::int64_t, std::int64_t)>& height_at);

/// The same of 16-bit zeros as a sparse file: takes no room on the disk, whatever its size.
void write_sparse_tiff(const std::string& path, std::uint32_t width, std::uint32_t height);

}  // namespace isohf::test
