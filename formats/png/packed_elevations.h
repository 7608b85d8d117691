#pragma once

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "isohf/raster.h"

namespace isohf {

/// How the 8-bit channels of a picture hold one elevation together.
enum class Packing {
  kTerrarium,  ///< R * 256 + G + B / 256 - 32768 metres (Mapzen)
  kMapbox,     ///< (R * 65536 + G * 256 + B) * 0.1 - 10000 metres (Mapbox terrain-RGB)
  kRgbaFloat,  ///< R, G, B, A are the bytes of a big-endian IEEE float (MMGIS)
};

[[nodiscard]] std::string to_string(Packing packing);  ///< "terrarium", "mapbox", "rgba-float"
/// The inverse of to_string; nullopt for any other text.
[[nodiscard]] std::optional<Packing> packing_from_string(const std::string& text);

/// Sample type, scale, offset, unit, void value and channel of a picture with that packing. The codes of the first two
/// are int32, exact; where there is an alpha channel, a wholly transparent pixel is void (-1). Throws
/// Error{kInvalidArgument} for other than 3 or 4 `channels` of 8 `bits`, 4 of floats.
void describe_packing(Packing packing, std::size_t channels, int bits, SourceInfo& info);

/// A tile of a web map lies where the end of its path says: ZOOM/COLUMN/ROW.png, the rows counted from the North, of
/// 2^ZOOM by 2^ZOOM squares of the Web Mercator map. Leaves a place alone that is known, paths that end otherwise, and,
/// with a warning, tiles whose size is no power of two: these have a rim.
void place_web_tile(SourceInfo& info);

inline constexpr int kMostZoom = 30;
/// Places a raster whose North-West tile is that one, of tiles of `side` samples each way.
void place_web_tiles(int zoom, std::int64_t column, std::int64_t row, std::int64_t side, SourceInfo& info);

/// Pixels of `channels` bytes each, 3 or 4, into samples of the type that describe_packing names.
void unpack_elevations(Packing packing, std::size_t channels, std::span<const std::byte> pixels,
                       std::span<std::byte> samples);

/// Whether rows of a picture look packed. In codes the next higher byte goes on where one overflows, which colours do
/// not do; floats have exponents of heights, and an alpha channel that is noise.
class PackingEvidence {
 public:
  static constexpr std::size_t kRows = 64;  ///< that are enough to see it

  explicit PackingEvidence(std::size_t channels) : channels_(channels) {}
  void add(std::span<const std::byte> row);       ///< pixels of 8-bit channels
  void add_wide(std::span<const std::byte> row);  ///< of 16-bit channels, which pack nothing but may be greys
  /// One channel of a colour picture is seldom what is meant: packed elevations are unpacked where that is beyond
  /// doubt, and grey in three channels is grey (nullopt: the first one is read), which `info` warns of. Throws
  /// Error{kInvalidArgument} where the user has to say what is meant; `names` of the channels.
  [[nodiscard]] std::optional<Packing> decide(const std::string& names, SourceInfo& info) const;
  /// nullopt where nothing speaks for it, as in land so flat that no byte overflows.
  [[nodiscard]] std::optional<Packing> packing() const;

 private:
  /// Whether red, green and blue were equal everywhere.
  [[nodiscard]] bool is_grey() const { return pixels_ > 0 && differing_ == 0; }

  std::size_t channels_;
  double of_codes_ = 0.0;     ///< sum of the steps from pixel to pixel, of whole codes
  double of_channels_ = 0.0;  ///< and of the channels by themselves, weighted as in the code
  std::int64_t red_ = 0;
  std::int64_t pixels_ = 0;
  std::int64_t differing_ = 0;  ///< pixels that have a colour
  std::int64_t heights_ = 0;    ///< pixels that are floats of a height's size
  std::bitset<256> alphas_;     ///< that occur
};

}  // namespace isohf
