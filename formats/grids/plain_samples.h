#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "formats/io/file_source.h"
#include "isohf/raster.h"

namespace isohf {

/// Samples whose bytes are not those of their type: VAX F-floats become float32, whole numbers of 64 bits the float64
/// that must hold them.
enum class StoredAs { kItself, kVaxFloat, kInt64, kUint64 };

/// In which order a file has its bands: one after the other, line by line, sample by sample.
enum class BandOrder { kBands, kLines, kSamples };

/// Where the samples of an uncompressed raster lie in its file: at equal distances.
struct PlainLayout {
  std::uint64_t offset_bytes = 0;  ///< of the first sample
  std::uint64_t row_bytes = 0;     ///< from a row's first sample to the next row's; 0: rows lie together
  std::uint64_t column_bytes = 0;  ///< from a sample to the next of its row; 0: they lie together
  bool big_endian = false;
  bool from_south = false;  ///< the first row is the southernmost
  StoredAs stored_as = StoredAs::kItself;

  /// Goes on to one band of several, of which offset_bytes is the first line's begin; every line has more_bytes that are
  /// no samples. Throws Error{kCorrupt} naming `header` where so many samples are in no file.
  void take_band(const SourceInfo& info, BandOrder order, std::int64_t band, std::int64_t bands,
                 const std::string& header, std::uint64_t more_bytes = 0);
  /// Where the last sample ends; infinite where no file is so large.
  [[nodiscard]] double end_bytes(const SourceInfo& info) const;
};

/// Reads `window` of the raster that `info` and `layout` describe, in host byte order. Throws Error{kIo, kCorrupt}, and
/// kUnsupported for a whole number that float64 does not hold.
void read_plain_samples(const RawFile& file, const SourceInfo& info, const PlainLayout& layout, const Window& window,
                        std::span<std::byte> samples);

/// A VAX F-float, its bytes as stored, as an IEEE float: words in the other order, no leading 1 in front of the point,
/// exponents up to 127; its reserved operand is a NaN. The smallest ones lose bits, which are no elevation.
[[nodiscard]] float float_from_vax(std::uint32_t stored);

/// Whole numbers of 64 bits, in host byte order, as the float64 that they are, in place. Throws Error{kUnsupported}
/// naming the sample of `window` that is none.
void widen_whole_numbers(const std::string& path, bool is_signed, const Window& window, std::span<std::byte> samples);

/// A raster of nothing but such samples, behind a header perhaps.
class PlainSource : public FileSource {
 public:
  void read_window(const Window& window, std::span<std::byte> samples) override {
    read_plain_samples(*file_, info_, layout_, window, samples);
  }

 protected:
  using FileSource::FileSource;

  PlainLayout layout_;
};

// Rasters that are stored from South to North, which are delivered from North to South.

/// The rows of `window` as they are stored, of a raster of `height` rows.
[[nodiscard]] inline Window turned(const Window& window, std::int64_t height) {
  return {window.column, height - window.row - window.rows, window.columns, window.rows};
}

/// Turns rows of row_bytes each upside down.
inline void turn_rows(std::span<std::byte> samples, std::size_t row_bytes) {
  const std::size_t rows = row_bytes == 0 ? 0 : samples.size() / row_bytes;
  for (std::size_t row = 0; row < rows / 2; ++row) {
    std::byte* const upper = samples.data() + row * row_bytes;
    std::swap_ranges(upper, upper + row_bytes, samples.data() + (rows - 1 - row) * row_bytes);
  }
}

}  // namespace isohf
