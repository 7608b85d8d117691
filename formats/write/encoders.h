#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "formats/write/raster_spec.h"
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

/// A text file that belongs to a raster.
struct Sidecar {
  std::string path;
  std::string text;
};

/// The files that stand beside a raster of that name and spec: .hdr for GridFloat, .json (NAME.r16.json) for raw
/// samples and, where spec.describe says so, PNG, .prj for grids, and a world file and GDAL's .aux.xml for PNG and OpenEXR
/// that lie somewhere.
[[nodiscard]] std::vector<Sidecar> sidecars_of(const std::string& path, const RasterSpec& spec);

/// The names of all that may stand beside a raster of that name.
[[nodiscard]] std::vector<std::string> sidecar_paths(const std::string& path);

/// Files beside a raster that it replaces, which would be taken for the new one's: those of sidecar_paths() and GDAL's
/// .aux.xml, and where the new one says nothing of its place or system a world file and a .prj. Those that the new one
/// has, and files of another kind under such a name, are not among them. nullptr: the raster goes, and none replaces it.
[[nodiscard]] std::vector<std::string> stale_sidecars(const std::string& path, const RasterSpec* spec);

/// Throws Error{kInvalidArgument} without the path where another kind of file would be replaced: a Radiance picture or
/// an ENVI header for .hdr, somebody else's .json.
void check_sidecar_target(const std::string& path);

/// The lines in front of an ESRI ASCII grid's numbers.
[[nodiscard]] std::string ascii_grid_header(const RasterSpec& spec);

/// The void value of an ASCII grid or GridFloat: the spec's own, or the lowest float, as which NaN is written.
[[nodiscard]] double grid_void(const RasterSpec& spec);

}  // namespace isohf
