#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "formats/raster_sink.h"

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
  /// Writes what is pending and closes the file.
  virtual void close() = 0;
};

/// Each opens `path`, an empty file that exists, and throws Error{kUnsupported} for a spec that it cannot store.
[[nodiscard]] std::unique_ptr<RasterEncoder> encode_tiff(const std::string& path, const RasterSpec& spec);
[[nodiscard]] std::unique_ptr<RasterEncoder> encode_exr(const std::string& path, const RasterSpec& spec);
[[nodiscard]] std::unique_ptr<RasterEncoder> encode_png(const std::string& path, const RasterSpec& spec);
[[nodiscard]] std::unique_ptr<RasterEncoder> encode_hgt(const std::string& path, const RasterSpec& spec);
[[nodiscard]] std::unique_ptr<RasterEncoder> encode_r16(const std::string& path, const RasterSpec& spec);
[[nodiscard]] std::unique_ptr<RasterEncoder> encode_r32(const std::string& path, const RasterSpec& spec);
[[nodiscard]] std::unique_ptr<RasterEncoder> encode_flt(const std::string& path, const RasterSpec& spec);
[[nodiscard]] std::unique_ptr<RasterEncoder> encode_npy(const std::string& path, const RasterSpec& spec);
[[nodiscard]] std::unique_ptr<RasterEncoder> encode_asc(const std::string& path, const RasterSpec& spec);

/// Bytes of one row of all channels.
[[nodiscard]] inline std::size_t row_bytes(const RasterSpec& spec) {
  return static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.channels) * size_bytes(spec.sample_type);
}

}  // namespace isohf
