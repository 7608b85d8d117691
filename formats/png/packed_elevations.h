#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "isohf/raster.h"

namespace isohf {

/// How the 8-bit channels of a picture hold one elevation together. A picture does not say which, and is not asked.
enum class Packing {
  kTerrarium,  ///< R * 256 + G + B / 256 - 32768 metres (Mapzen); black is nodata
  kMapbox,     ///< (R * 65536 + G * 256 + B) * 0.1 - 10000 metres (Mapbox terrain-RGB); black is nodata
  kGsi,  ///< centimetres, 24 bits in two's complement (Geospatial Information Authority of Japan); -2^23 is nodata
  kRgbaFloat,  ///< R, G, B, A are the bytes of a big-endian IEEE float (MMGIS)
};

/// For messages: the names of all.
inline constexpr const char* kEncodings = "terrarium, mapbox, gsi or rgba-float";

[[nodiscard]] std::string to_string(Packing packing);  ///< "terrarium", "mapbox", "gsi", "rgba-float"
/// The inverse of to_string; nullopt for any other text.
[[nodiscard]] std::optional<Packing> packing_from_string(const std::string& text);
/// What options.encoding names; nullopt if it is empty. Throws Error{kInvalidArgument} without a path for other names.
[[nodiscard]] std::optional<Packing> stated_packing(const OpenOptions& options);

/// Sets sample type, scale, offset, unit, void value and channel of a picture with that packing. Codes are int32, but
/// for floats, and exact. A transparent pixel is void. Scale and offset are those of the packing; of Mapbox's those of
/// `options` if both are given, as tiles have them that rio-rgbify made with another base and interval
/// (apply_open_options() then applies them). Throws Error{kInvalidArgument} naming info.path for channels of other than
/// 8 `bits`, and for floats without a channel of opacity.
void describe_packing(Packing packing, std::size_t channels, int bits, const OpenOptions& options, SourceInfo& info);

/// Unpacks pixels of 1 to 4 channels, a byte each, into samples of the type that describe_packing sets. Grey is red,
/// green and blue alike.
void unpack_elevations(Packing packing, std::size_t channels, std::span<const std::byte> pixels,
                       std::span<std::byte> samples);

/// Places a tile of a web map as the end of its path says: ZOOM/COLUMN/ROW.png, rows counted as tile_scheme_of() has
/// them, of 2^ZOOM by 2^ZOOM squares of the Web Mercator map. Leaves a place alone that is known, paths that end
/// otherwise, and, with a warning, tiles of another map and tiles whose size is not a power of two: these have a rim.
void place_web_tile(SourceInfo& info);

inline constexpr int kMostZoom = 30;
/// Places a raster whose North-West tile is that one, of tiles of `side` samples each way.
void place_web_tiles(int zoom, std::int64_t column, std::int64_t row, std::int64_t side, SourceInfo& info);

}  // namespace isohf
