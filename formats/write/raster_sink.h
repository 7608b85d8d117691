#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "formats/registry.h"
#include "formats/write/raster_spec.h"
#include "isohf/error.h"

namespace isohf {

class OutputFile;
class RasterEncoder;

/// A raster file that is written from its first row to its last.
///
/// Everything goes to NAME.part (output_file.h), which finish() flushes to the disk and renames; a sink that is
/// destroyed before leaves nothing behind. Its sidecar files get their names first, when all are
/// on the disk; samples and a description that do not belong together never stand beside each other. One thread calls.
/// Memory: a few megabytes, a few rows where these are longer, and 256 rows for TIFF, of 64 MiB at most. TIFF strips
/// are compressed on the caller's oneTBB arena; the bytes do not depend on the number of threads.
class RasterSink {
 public:
  RasterSink(std::string path, const RasterSpec& spec, std::unique_ptr<OutputFile> file,
             std::vector<std::unique_ptr<OutputFile>> sidecars, std::unique_ptr<RasterEncoder> encoder);
  RasterSink(const RasterSink&) = delete;
  RasterSink& operator=(const RasterSink&) = delete;
  ~RasterSink();

  /// The raster, and the files that stand beside it.
  [[nodiscard]] std::vector<std::string> files() const;

  /// Appends whole rows: [k * width * channels] samples in host byte order, the channels of a pixel together.
  /// Throws Error naming the path: kIo (disk full, ...), kInvalidArgument (part of a row; more rows than declared).
  void write_rows(std::span<const std::byte> rows);

  /// Completes the file and gives it its name. All rows must have been written. Throws Error{kIo, kInvalidArgument}.
  void finish();
  /// Puts all of it on the disk, where finish() finds nothing more to write. Throws as finish() does.
  void close();
  /// close(), and lets NAME.part go, for name_raster() or drop_raster(): one of many files that get their names
  /// together.
  void complete();

 private:
  std::string path_;
  RasterSpec spec_;
  std::unique_ptr<OutputFile> file_;  ///< outlives the encoder, which writes to it
  std::vector<std::unique_ptr<OutputFile>> sidecars_;
  std::unique_ptr<RasterEncoder> encoder_;
  std::int64_t rows_written_ = 0;
};

/// Begins a raster whose format follows from the extension of `path`, in any case, as writable_formats() lists them.
/// Throws Error naming the path: kInvalidArgument (no such extension; sizes, or samples that the format cannot hold;
/// the file exists and overwrite is not set, or is of another kind), kIo.
[[nodiscard]] std::unique_ptr<RasterSink> create_raster(const std::string& path, const RasterSpec& spec);

/// Gives a raster of RasterSink::complete() its name, as finish() does. `spec` is that of create_raster(). Throws
/// Error{kIo, kInvalidArgument}.
void name_raster(const std::string& path, const RasterSpec& spec);
/// Removes what RasterSink::complete(), or a run that was killed, left of a raster without its name.
void drop_raster(const std::string& path) noexcept;
/// Removes a raster and the files beside it, but those that a raster of the same name in another format may share.
void remove_raster(const std::string& path);

/// Refuses a name that create_raster would refuse, before any work: Error naming the path.
void check_raster_target(const std::string& path, bool overwrite);

/// Refuses rasters, `count` of them like `path`, that the file system surely has no room for, before any work:
/// Error{kIo} naming the path. What is compressed may become as small as its compression can make it.
void check_raster_room(const std::string& path, const RasterSpec& spec, std::int64_t count = 1);

/// What rasters of a format hold beside samples.
struct RasterTraits {
  bool states_scale = false;   ///< scale, offset and unit, in the file or beside it
  bool has_place = false;      ///< always lies somewhere
  bool is_text = false;        ///< holds any number
  bool voids_are_nan = false;  ///< no other value can be declared
  bool is_srtm = false;        ///< WGS 84, metres above the geoid, -32768 for nodata
  bool is_bare = false;        ///< numbers alone, as engines read them
};
/// Throws Error naming the path if create_raster() knows no such extension.
[[nodiscard]] RasterTraits raster_traits(const std::string& path);

/// The sample type of a raster of that name: `wanted` if the format holds it, else the nearest that it holds (float32
/// in EXR and GridFloat, int16 in HGT, uint16 in PNG and .r16). Throws likewise.
[[nodiscard]] SampleType held_type(const std::string& path, SampleType wanted);

/// Warnings of what `spec` states and the format has no place for, or states otherwise.
[[nodiscard]] std::vector<Warning> losses_of(const std::string& path, const RasterSpec& spec);

/// The extensions that create_raster knows: ".tif", ...
[[nodiscard]] const std::vector<std::string>& writable_extensions();

/// The formats behind them; a note says what samples one holds.
[[nodiscard]] const std::vector<Format>& writable_formats();

}  // namespace isohf
