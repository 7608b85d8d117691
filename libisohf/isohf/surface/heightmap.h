#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "isohf/base/warning.h"

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
  std::string path;         ///< for messages
  std::string format;       ///< "GeoTIFF", "OpenEXR", "PNG", "SRTM HGT", ...
  std::int64_t width = 0;   ///< columns, >= 1
  std::int64_t height = 0;  ///< rows, >= 1
  SampleType sample_type = SampleType::kFloat32;
  std::string channel;              ///< the chosen channel's name or number; empty where there is but one
  std::vector<double> void_values;  ///< raw values that mean "no elevation"; NaN and infinities always do
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
};

/// Half-precision bits to float, exact.
[[nodiscard]] float float_from_half(std::uint16_t bits);

}  // namespace isohf
