#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "formats/format.h"
#include "isohf/raster.h"

namespace isohf {

// The formats that are read. docs/formats.md says what of its files each reader takes.

/// OpenEXR: one channel of a flat part, scan lines or tiles.
extern const Format kExrFormat;
/// TIFF 6.0, GeoTIFF (OGC 19-008r4), BigTIFF, COG: one channel of an image, with masks and opacity.
extern const Format kTiffFormat;
/// PNG: one channel as stored, or elevations packed into all (packed_elevations.h).
extern const Format kPngFormat;
/// The same of WebP, decoded whole.
extern const Format kWebpFormat;
/// PMTiles version 3: elevations packed into the tiles of a web map, of one zoom level.
extern const Format kPmtilesFormat;
/// ESRI ASCII grid.
extern const Format kAsciiGridFormat;
/// GridFloat, ESRI's EHdr of one band, and GTOPO30: plain samples with a text header beside them; either file.
extern const Format kHeaderGridFormat;
/// ENVI: plain samples with its header beside them; either file.
extern const Format kEnviFormat;
/// netCDF, classic and netCDF-4: a variable of two dimensions (CF 1.8).
extern const Format kNetcdfFormat;
/// A GDAL virtual raster as gdalbuildvrt writes it: a list of whole files, as their mosaic.
extern const Format kVrtFormat;
/// The IMAGE of a PDS3 product (PDS Standards Reference 3.8): its label, or the data file beside it.
extern const Format kPds3Format;
/// The first array of a PDS4 product (PDS4 Data Standards): its label, or the data file beside it.
extern const Format kPds4Format;
/// An ISIS 3 cube (USGS, logical and physical cube formats), or a label that names its file.
extern const Format kIsis3Format;
/// An array that numpy.save wrote (NEP 1, versions 1 to 3).
extern const Format kNpyFormat;
/// A DTED cell of any level (MIL-PRF-89020B); checksums are verified.
extern const Format kDtedFormat;
/// Points of a regular grid in text, in any order.
extern const Format kXyzFormat;
/// An SRTM tile (NASA, SRTM topography, 2005); its name gives its place.
extern const Format kHgtFormat;
/// The raster in an archive or compressed file (packed_files.h), with its sidecars.
extern const Format kPackedFormat;
/// Nothing but samples, as options.raw or a NAME.r16.json beside describes them.
extern const Format kRawFormat;

/// Keeps what was unpacked for a source that is open, for the next one that opens the same file; nullptr where nothing
/// was, or where the temporary files have no room for that.
[[nodiscard]] std::shared_ptr<const void> keep_unpacked(const std::string& path, const OpenOptions& options);

/// Whether an archive holds a raster, or is too damaged to say.
[[nodiscard]] bool is_archive_of_rasters(const std::string& path);

/// What to do with the JPEG 2000 samples of such a product; empty where no label lies beside `path`.
[[nodiscard]] std::string jpeg2000_help(const std::string& path);

/// Reads "WxH:TYPE" ("200x200:u16le"): columns, rows, and u8, i8 or u16, i16, u32, i32, f32, f64 with le or be for the
/// byte order. Throws Error{kInvalidArgument} saying what was found and what is required.
[[nodiscard]] RawLayout raw_layout_from_string(std::string_view text);

/// What no native reader knows, through OpenImageIO in the module isohf_oiio.so, which is loaded at the first call
/// (module_loader.h). Of several channels options.channel names one. Error{kUnsupported} if there is no module, or it
/// does not know the format either.
[[nodiscard]] std::unique_ptr<HeightSource> open_with_oiio(const std::string& path, const OpenOptions& options);

/// The most bytes that the pixels of a picture may take that is decoded whole, WebP or interlaced PNG: 1 GiB.
inline constexpr std::uint64_t kMaxInterlacedBytes = std::uint64_t{1} << 30U;

/// The most bytes that one decoded OpenEXR chunk (a block of scan lines or a tile, all channels) may have, in a file
/// that is large enough to hold such chunks; less in small files.
inline constexpr std::uint64_t kMaxExrChunkBytes = std::uint64_t{1} << 30U;

}  // namespace isohf
