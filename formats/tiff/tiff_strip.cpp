#include "formats/tiff/tiff_strip.h"

#include <libdeflate.h>

#include <cstdint>
#include <cstring>
#include <memory>

#include "isohf/error.h"

namespace isohf {
namespace {

constexpr int kLevel = 6;

/// Differences to the sample one pixel before, modulo the type's range; from the end, so that it can be done in place.
template <typename Unsigned>
void difference_row(std::byte* row, std::size_t samples, std::size_t channels) {
  for (std::size_t at = samples; at-- > channels;) {
    Unsigned value{};
    Unsigned before{};
    std::memcpy(&value, row + at * sizeof(Unsigned), sizeof(Unsigned));
    std::memcpy(&before, row + (at - channels) * sizeof(Unsigned), sizeof(Unsigned));
    value = static_cast<Unsigned>(value - before);
    std::memcpy(row + at * sizeof(Unsigned), &value, sizeof(Unsigned));
  }
}

/// The bytes of a row's samples, most significant ones first, each significance together; then differences of bytes.
void difference_byte_planes(std::byte* row, std::size_t samples, std::size_t size, std::size_t channels,
                            std::vector<std::byte>& scratch) {
  scratch.assign(row, row + samples * size);
  for (std::size_t byte = 0; byte < size; ++byte) {
    std::byte* plane = row + (size - 1 - byte) * samples;
    for (std::size_t at = 0; at < samples; ++at) plane[at] = scratch[at * size + byte];
  }
  difference_row<std::uint8_t>(row, samples * size, channels);
}

void predict(const TiffStripLayout& layout, std::span<std::byte> rows) {
  const std::size_t size = size_bytes(layout.sample_type);
  const std::size_t row_bytes = layout.samples_per_row * size;
  std::vector<std::byte> scratch;
  for (std::size_t at = 0; at < rows.size(); at += row_bytes) {
    std::byte* row = rows.data() + at;
    if (is_floating(layout.sample_type)) {
      difference_byte_planes(row, layout.samples_per_row, size, layout.channels, scratch);
    } else if (size == 1) {
      difference_row<std::uint8_t>(row, layout.samples_per_row, layout.channels);
    } else if (size == 2) {
      difference_row<std::uint16_t>(row, layout.samples_per_row, layout.channels);
    } else {
      difference_row<std::uint32_t>(row, layout.samples_per_row, layout.channels);
    }
  }
}

}  // namespace

std::vector<std::byte> compress_tiff_strip(const TiffStripLayout& layout, std::span<std::byte> rows) {
  predict(layout, rows);
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(kLevel), libdeflate_free_compressor);
  if (!compressor) throw Error(ErrorCode::kOutOfMemory, "libdeflate ran out of memory");
  std::vector<std::byte> compressed(libdeflate_zlib_compress_bound(compressor.get(), rows.size()));
  compressed.resize(
      libdeflate_zlib_compress(compressor.get(), rows.data(), rows.size(), compressed.data(), compressed.size()));
  return compressed;
}

}  // namespace isohf
