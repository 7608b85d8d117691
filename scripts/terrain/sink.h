#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

namespace isohf::terrain {

enum class SampleType { kInt16, kUint16, kFloat32, kFloat16 };

[[nodiscard]] std::size_t size_bytes(SampleType type);

/// The raster to write.
struct Raster {
  std::int64_t columns = 0;
  std::int64_t rows = 0;
  SampleType type = SampleType::kInt16;
  double spacing_m = 30;
  bool voids = false;   ///< some samples are void: mark them, or refuse where the format cannot
  bool tiled = true;    ///< TIFF, EXR: tiles of 256x256; otherwise strips or scan lines
  bool deflate = true;  ///< TIFF, EXR: lossless compression
};

/// Samples that mean "no height here" in files of each type; the float types use NaN.
inline constexpr std::int16_t kVoidInt16 = -32768;
inline constexpr std::uint16_t kVoidUint16 = 65535;

/// A file written from North to South.
class Sink {
 public:
  static constexpr std::int64_t kBandRows = 256;

  Sink() = default;
  Sink(const Sink&) = delete;
  Sink& operator=(const Sink&) = delete;
  virtual ~Sink() = default;

  /// The next kBandRows rows (fewer at the end), row by row without gaps. Throws Error{kIo}.
  virtual void write_band(std::span<std::byte> samples) = 0;

  /// Ends the file; nothing is complete before. Throws Error{kIo}.
  virtual void finish() = 0;
};

[[nodiscard]] std::unique_ptr<Sink> make_tiff_sink(const std::string& path, const Raster& raster);
[[nodiscard]] std::unique_ptr<Sink> make_exr_sink(const std::string& path, const Raster& raster);
[[nodiscard]] std::unique_ptr<Sink> make_png_sink(const std::string& path, const Raster& raster);
[[nodiscard]] std::unique_ptr<Sink> make_raw_sink(const std::string& path, const Raster& raster, bool big_endian);

/// The sink for the extension of `name`, writing to `path`. Throws Error{kInvalidArgument} where format, type and size
/// do not go together.
[[nodiscard]] std::unique_ptr<Sink> make_sink(const std::string& name, const std::string& path, const Raster& raster);

}  // namespace isohf::terrain
