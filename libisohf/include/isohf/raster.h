// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "isohf/error.h"
#include "isohf/job.h"

namespace isohf {

/// How a raster stores one elevation.
enum class SampleType { kUint8, kInt8, kUint16, kInt16, kUint32, kInt32, kFloat16, kFloat32, kFloat64 };

/// Bytes of one sample.
[[nodiscard]] std::size_t size_bytes(SampleType type);
/// Stable lower-case name as it appears in metadata: "uint8", "int16", "float16", ...
[[nodiscard]] std::string to_string(SampleType type);
/// The inverse of to_string; throws Error{kInvalidArgument} for any other text.
[[nodiscard]] SampleType sample_type_from_string(const std::string& text);
[[nodiscard]] bool is_floating(SampleType type);

/// Where a sample lies: in the middle of the area it stands for, or on a post.
enum class Registration { kUnknown, kArea, kPoint };

[[nodiscard]] std::string to_string(Registration registration);  ///< "unknown", "area", "point"

/// What one horizontal unit of the source's coordinates is.
enum class HorizontalUnit { kUnknown, kMetre, kDegree };

/// The body and reference system that a file declares. Carried, never transformed; empty or nullopt where unknown.
struct ReferenceSystem {
  std::string name;                          ///< citation or name as found in the file
  std::optional<int> epsg;                   ///< code of the horizontal system
  std::string wkt;                           ///< as found (a .prj beside the file), else empty
  std::string body;                          ///< "Earth", "Mars", "Moon", ...; empty where unknown
  std::optional<double> semi_major_axis_m;   ///< ellipsoid
  std::optional<double> inverse_flattening;  ///< 0 for a sphere
  std::optional<int> vertical_epsg;          ///< code of the vertical system
  std::string vertical_datum;                ///< name as found
};

/// Where the samples lie on the ground. Rows run from North to South and columns from West to East in the order that
/// read_window delivers; a file stored otherwise is turned by its reader.
struct Georeference {
  Registration registration = Registration::kUnknown;
  HorizontalUnit unit = HorizontalUnit::kUnknown;
  double metres_per_unit = 1.0;  ///< for a linear unit (feet, kilometres); 1 for metres and unknown units
  double spacing_x = 1.0;        ///< between neighbouring columns, in units, > 0
  double spacing_y = 1.0;        ///< between neighbouring rows, in units, > 0
  bool has_origin = false;       ///< false: origin_x and origin_y are not known
  double origin_x = 0.0;         ///< coordinates of sample (0, 0), its centre or post, East positive
  double origin_y = 0.0;         ///< North positive
  ReferenceSystem system;
};

/// How far voids are filled, in samples: where nothing else is said, and at most.
inline constexpr std::int64_t kDefaultFillDistance = 100;
inline constexpr std::int64_t kMaxFillDistance = 4096;

/// What is to become of voids, and of samples that should be some.
struct VoidTreatment {
  std::optional<std::pair<double, double>> valid_range;  ///< elevations outside are void
  bool fill = false;
  std::optional<std::int64_t> fill_distance;  ///< 1 to kMaxFillDistance samples; fills, whatever `fill` says

  /// How far voids are filled; 0: none are.
  [[nodiscard]] std::int64_t distance() const { return fill_distance.value_or(fill ? kDefaultFillDistance : 0); }
  [[nodiscard]] bool does_anything() const { return valid_range || distance() > 0; }
};

/// All that is known of a raster of elevations before a sample is read.
struct SourceInfo {
  std::string path;             ///< for messages
  std::string format;           ///< "GeoTIFF", "OpenEXR", "PNG", "SRTM HGT", ...
  std::int64_t width = 0;       ///< columns, >= 1
  std::int64_t height = 0;      ///< rows, >= 1
  bool repeats_column = false;  ///< one more column, the first again a turn on, was left out
  SampleType sample_type = SampleType::kFloat32;
  std::string channel;                       ///< the chosen channel's name or number; empty where there is but one
  std::vector<double> void_values;           ///< raw values that mean "no elevation"; NaN and infinities always do
  std::vector<double> void_values_of_files;  ///< of a mosaic: what means no elevation in one file or another
  /// Raw values outside [valid_min, valid_max] are void as well (special pixel ranges); infinite where unbounded.
  double valid_min = -std::numeric_limits<double>::infinity();
  double valid_max = std::numeric_limits<double>::infinity();
  /// What a FilledSource was asked to do, for the record: elevations outside are void; voids up to so many samples from
  /// an elevation are filled, 0: none.
  std::optional<std::pair<double, double>> valid_range;
  std::int64_t fill_distance = 0;
  double z_scale = 1.0;  ///< elevation = raw * z_scale + z_offset, in vertical units
  double z_offset = 0.0;
  std::string vertical_unit;  ///< "metre", "foot", ...; empty where unknown
  double metres_per_vertical_unit = 1.0;
  Georeference georeference;
  /// Rows that the file stores together (strip or tile height) and columns (tile width; = width for strips): reading
  /// whole multiples of these costs no sample twice.
  std::int64_t block_width = 0;
  std::int64_t block_height = 1;
  std::vector<Warning> warnings;  ///< for the user; e.g. "values look like 0...1"

  /// Whether a raw value means "no elevation".
  [[nodiscard]] bool is_nodata(double raw) const {
    return !std::isfinite(raw) || raw < valid_min || raw > valid_max ||
           std::find(void_values.begin(), void_values.end(), raw) != void_values.end();
  }
};

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

  /// Whether no sample of the window has an elevation, as far as that is known without reading it: between the files of a
  /// mosaic. Any thread.
  [[nodiscard]] virtual bool is_gap(const Window& /*window*/) const { return false; }

  /// Bytes that are kept at most from one call to the next, for decoded samples above all: within
  /// OpenOptions::buffer_bytes unless the source cannot do with so few; 0: none to speak of.
  [[nodiscard]] virtual std::uint64_t buffer_bytes() const { return 0; }

  /// The source whose samples are the file's own: this one, or what it is made of where it changes them.
  [[nodiscard]] virtual HeightSource& as_stored() { return *this; }
};

/// What the samples of a file without a header are.
struct RawLayout {
  std::int64_t width = 0;
  std::int64_t height = 0;
  SampleType type = SampleType::kUint16;
  bool big_endian = false;
};

/// What a user may say about an input that the file does not, or says wrongly.
struct OpenOptions {
  std::string channel;   ///< channel name or zero-based number; empty: the reader's choice
  std::string part;      ///< of a file of several parts: name or zero-based number
  std::string encoding;  ///< of elevations packed into colours: "terrarium", "mapbox", ...; or empty
  std::optional<Registration> registration;  ///< overrides the file's
  std::vector<double> void_values;           ///< override the file's; empty: the file's
  std::optional<double> z_scale;             ///< elevation = the file's own * z_scale + z_offset
  std::optional<double> z_offset;
  std::optional<double> spacing;  ///< sample spacing in metres, for files that do not say; overrides
  /// "EPSG:2154", WKT, a PROJ string: completes what the file says of its system.
  std::string reference_system;
  std::optional<RawLayout> raw;  ///< the file is nothing but these samples, whatever its name and content say
  /// Most bytes of decoded samples that a reader keeps from one call to the next.
  std::uint64_t buffer_bytes = std::uint64_t{256} << 20U;
  VoidTreatment voids;  ///< for with_voids_treated(), which is for the caller: open_raster leaves voids as they are
};

/// Opens a raster of elevations by its content, not by its name: the file's first bytes pick the reader; the extension
/// decides only for formats without a signature (.hgt), options.raw before both. What no native reader knows goes to
/// the OpenImageIO module. Throws Error naming the path: kIo (missing, folder, unreadable), kUnsupported (unknown
/// format, with what is read), kCorrupt (empty, truncated, absurd sizes), kInvalidArgument (no such channel, with those
/// there are).
[[nodiscard]] std::unique_ptr<HeightSource> open_raster(const std::string& path, const OpenOptions& options);

/// `source` itself where nothing is to be treated, else one whose elevations outside the valid range are void and whose
/// voids are filled; holds rows in a scratch file where they would take more than a third of the job's memory. Throws
/// Error{kInvalidArgument} where the valid range leaves nothing or the distance is beyond kMaxFillDistance.
[[nodiscard]] std::unique_ptr<HeightSource> with_voids_treated(std::unique_ptr<HeightSource> source,
                                                               const VoidTreatment& treatment, const Job& job = {});

/// Names a folder in which the module for OpenImageIO and isohf-netcdf-probe are looked for first; empty: only beside the
/// program and in ../lib/isohf. A program calls it before it opens anything.
void set_module_folder(const std::string& folder);

}  // namespace isohf
