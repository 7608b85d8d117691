#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "formats/write/raster_sink.h"
#include "isohf/base/output_file.h"

namespace isohf {

/// One file format's way of storing rows; RasterSink checks the calls and minds the file's name. Errors carry no path.
class RasterEncoder {
 public:
  RasterEncoder() = default;
  RasterEncoder(const RasterEncoder&) = delete;
  RasterEncoder& operator=(const RasterEncoder&) = delete;
  virtual ~RasterEncoder() = default;

  /// Stores `count` rows, those after the ones stored before.
  virtual void write(std::span<const std::byte> rows, std::int64_t count) = 0;
  /// Writes what is pending.
  virtual void close() = 0;
};

/// Each writes to `out`, which is empty and outlives it, and throws Error{kInvalidArgument} for a spec that it cannot
/// store.
[[nodiscard]] std::unique_ptr<RasterEncoder> encode_tiff(OutputFile& out, const RasterSpec& spec);
[[nodiscard]] std::unique_ptr<RasterEncoder> encode_exr(OutputFile& out, const RasterSpec& spec);
[[nodiscard]] std::unique_ptr<RasterEncoder> encode_png(OutputFile& out, const RasterSpec& spec);
[[nodiscard]] std::unique_ptr<RasterEncoder> encode_hgt(OutputFile& out, const RasterSpec& spec);
[[nodiscard]] std::unique_ptr<RasterEncoder> encode_r16(OutputFile& out, const RasterSpec& spec);
[[nodiscard]] std::unique_ptr<RasterEncoder> encode_r32(OutputFile& out, const RasterSpec& spec);
[[nodiscard]] std::unique_ptr<RasterEncoder> encode_flt(OutputFile& out, const RasterSpec& spec);
[[nodiscard]] std::unique_ptr<RasterEncoder> encode_npy(OutputFile& out, const RasterSpec& spec);
[[nodiscard]] std::unique_ptr<RasterEncoder> encode_asc(OutputFile& out, const RasterSpec& spec);

/// Bytes of one row of all channels.
[[nodiscard]] inline std::size_t row_bytes(const RasterSpec& spec) {
  return static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.channels) * size_bytes(spec.sample_type);
}

}  // namespace isohf
