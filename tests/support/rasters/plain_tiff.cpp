#include "support/rasters/plain_tiff.h"

#include <cstring>
#include <filesystem>
#include <fstream>

namespace isohf::test {
namespace {

void append(std::string& bytes, std::uint32_t value, int size) {
  for (int i = 0; i < size; ++i) bytes += static_cast<char>((value >> (8 * i)) & 0xFFU);
}

/// Everything before the samples: header, directory, and one strip offset and size for each row.
std::string head(std::uint32_t width, std::uint32_t height, std::uint32_t bits, std::uint32_t sample_format) {
  constexpr std::uint32_t kEntries = 10;
  constexpr std::uint32_t kShort = 3;
  constexpr std::uint32_t kLong = 4;
  constexpr std::uint32_t kTables = 8 + 2 + 12 * kEntries + 4;
  const std::uint32_t row_bytes = width * bits / 8;
  const std::uint32_t data = kTables + 8 * height;
  std::string bytes = "II*";
  append(bytes, 0, 1);
  append(bytes, 8, 4);
  append(bytes, kEntries, 2);
  const auto entry = [&](std::uint32_t tag, std::uint32_t type, std::uint32_t count, std::uint32_t value) {
    append(bytes, tag, 2);
    append(bytes, type, 2);
    append(bytes, count, 4);
    append(bytes, value, 4);
  };
  const bool in_place = height == 1;
  entry(256, kLong, 1, width);
  entry(257, kLong, 1, height);
  entry(258, kShort, 1, bits);
  entry(259, kShort, 1, 1);  // no compression
  entry(262, kShort, 1, 1);  // black is zero
  entry(273, kLong, height, in_place ? data : kTables);
  entry(277, kShort, 1, 1);
  entry(278, kLong, 1, 1);  // rows a strip
  entry(279, kLong, height, in_place ? row_bytes : kTables + 4 * height);
  entry(339, kShort, 1, sample_format);
  append(bytes, 0, 4);
  for (std::uint32_t r = 0; r < height; ++r) append(bytes, data + r * row_bytes, 4);
  for (std::uint32_t r = 0; r < height; ++r) append(bytes, row_bytes, 4);
  return bytes;
}

template <typename T>
void write(const std::string& path, std::uint32_t width, std::uint32_t height, std::uint32_t sample_format,
           const std::function<T(std::int64_t, std::int64_t)>& height_at) {
  std::string bytes = head(width, height, 8 * sizeof(T), sample_format);
  for (std::int64_t r = 0; r < height; ++r) {
    for (std::int64_t c = 0; c < width; ++c) {
      const T value = height_at(c, r);
      char raw[sizeof(T)];
      std::memcpy(raw, &value, sizeof(T));
      bytes.append(raw, sizeof(T));
    }
  }
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

}  // namespace

void write_float_tiff(const std::string& path, std::uint32_t width, std::uint32_t height,
                      const std::function<float(std::int64_t, std::int64_t)>& height_at) {
  write<float>(path, width, height, 3, height_at);
}

void write_int16_tiff(const std::string& path, std::uint32_t width, std::uint32_t height,
                      const std::function<std::int16_t(std::int64_t, std::int64_t)>& height_at) {
  write<std::int16_t>(path, width, height, 2, height_at);
}

void write_sparse_tiff(const std::string& path, std::uint32_t width, std::uint32_t height) {
  const std::string bytes = head(width, height, 16, 2);
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  std::filesystem::resize_file(path, bytes.size() + std::uint64_t{2} * width * height);
}

}  // namespace isohf::test
