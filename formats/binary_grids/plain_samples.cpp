#include "formats/binary_grids/plain_samples.h"

#include <bit>

namespace isohf {

void read_plain_samples(const RawFile& file, const SourceInfo& info, const PlainLayout& layout, const Window& window,
                        std::span<std::byte> samples) {
  const std::size_t size = size_bytes(info.sample_type);
  ISOHF_ASSERT(is_window_of(info, window, samples.size()));
  const std::size_t run_bytes = static_cast<std::size_t>(window.columns) * size;
  const std::uint64_t first = layout.offset_bytes + static_cast<std::uint64_t>(window.row) * layout.row_bytes +
                              static_cast<std::uint64_t>(window.column) * size;
  if (run_bytes == layout.row_bytes) {  // whole rows lie together in the file as in the window
    file.read(first, samples);
  } else {
    for (std::int64_t row = 0; row < window.rows; ++row) {
      file.read(first + static_cast<std::uint64_t>(row) * layout.row_bytes,
                samples.subspan(static_cast<std::size_t>(row) * run_bytes, run_bytes));
    }
  }
  if (layout.big_endian != (std::endian::native == std::endian::big)) swap_byte_order(samples, size);
}

}  // namespace isohf
