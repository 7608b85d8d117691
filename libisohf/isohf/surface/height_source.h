#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "isohf/base/view.h"
#include "isohf/surface/heightmap.h"

namespace isohf {

/// A rectangle of source samples, column before row; inside the raster.
struct Window {
  std::int64_t column = 0;
  std::int64_t row = 0;
  std::int64_t columns = 0;
  std::int64_t rows = 0;
};

/// A raster of elevations that is read in windows, never as a whole.
///
/// A reader keeps at most a few rows of blocks in memory, whatever the raster's size. One thread calls at a time.
/// Reading from North to South in full-width windows is the fast order; any order works.
class HeightSource {
 public:
  HeightSource() = default;
  HeightSource(const HeightSource&) = delete;
  HeightSource& operator=(const HeightSource&) = delete;
  virtual ~HeightSource() = default;

  [[nodiscard]] virtual const SourceInfo& info() const = 0;

  /// Reads the raw samples of `window` in the source's own sample type and host byte order, row by row, without gaps.
  /// samples [window.columns * window.rows * size_bytes(sample_type)] out.
  /// Throws Error{kIo, kCorrupt}: a sample is either delivered as stored or reported, never made up.
  virtual void read_window(const Window& window, std::span<std::byte> samples) = 0;

  /// Asks to keep no more than about `bytes` of decoded samples from one call to the next: for a caller that reads
  /// whole blocks in order and never goes back.
  virtual void limit_buffers(std::uint64_t /*bytes*/) {}
  /// How many bytes are kept at most once that was asked; more where the source cannot do with so few, 0 where there
  /// are none to speak of.
  [[nodiscard]] virtual std::uint64_t buffer_bytes(std::uint64_t /*limit*/) const { return 0; }

  /// The source whose samples are the file's own: this one, or what it is made of where it changes them.
  [[nodiscard]] virtual HeightSource& as_stored() { return *this; }
};

/// Raw samples -> elevations, relative to `datum`: float(raw * z_scale + z_offset - datum), NaN where void.
/// raw [count samples of info.sample_type]   heights [count] out, vertical units of the source
/// The arithmetic is double until the last rounding; with datum 0, scale 1 and offset 0 samples of up to 24 bits and
/// floats come through unchanged. Vectorised, cannot fail.
void heights_from_samples(const SourceInfo& info, double datum, std::span<const std::byte> raw,
                          std::span<float> heights);

}  // namespace isohf
