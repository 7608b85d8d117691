#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "isohf/raster.h"

namespace isohf {

/// The readers behind open_raster(), as the registry's table lists them: looks_like_X tells by a file's first bytes
/// whether X reads it, open_X opens it. Each throws Error naming the path: kIo; kCorrupt (truncated, contradictory or
/// absurdly large); kUnsupported (what the format can hold and isohf does not read); kInvalidArgument (no such channel,
/// options out of range). Memory is bounded by a few rows of blocks.

/// One channel of an OpenEXR file: scan lines or tiles (their largest level), any compression and line order, half,
/// float or uint samples as stored. The raster is the data window. options.part is the name or number of a part;
/// options.channel a name, "part.channel", or a number in the order in which an error message lists them. Without it the
/// first flat part is read: its channel Y, Z, height, Height, elevation, depth or R, else one whose layer name ends so,
/// else its first.
[[nodiscard]] bool looks_like_exr(std::span<const std::byte> head);
[[nodiscard]] std::unique_ptr<HeightSource> open_exr(const std::string& path, const OpenOptions& options);

/// The first full-size image, or that of the number options.part, of a TIFF, GeoTIFF, BigTIFF or COG file (TIFF 6.0; OGC GeoTIFF 1.1, 19-008r4): integers of
/// 8 to 32 bits, floats of 16 to 64, strips or tiles, any compression that libtiff was built with, interleaved or
/// separate samples, of which options.channel picks one ("0", "1", ... or "R", "G", "B", "A", "Y").
/// A raster stored from South to North (by its transformation, or by orientation bottom-left without a georeference) is
/// turned. Without GeoTIFF tags a world file places it. GDAL_NODATA is nodata; in a float raster without it, whatever
/// lies beyond 1e30. Without a channel, transparent samples are nodata as well: by a mask in the file or beside it
/// (.msk), or the opacity of a grey image of two channels. Blocks that a sparse file leaves out read as nodata, else as
/// 0, with a warning. Blocks are decoded on all threads of the caller's arena.
[[nodiscard]] bool looks_like_tiff(std::span<const std::byte> head);
[[nodiscard]] std::unique_ptr<HeightSource> open_tiff(const std::string& path, const OpenOptions& options);

/// One channel of a PNG file as stored, 8 or 16 bits, with no gamma, colour management or alpha applied; gray of 1, 2
/// and 4 bits is not stretched. A tRNS chunk's gray is nodata; without options.channel so is gray of opacity 0.
/// NAME.png.json says what the numbers mean (raster_description.h). options.channel is Y or A (gray), R, G, B or A
/// (colour), 0...3, or terrarium, mapbox or rgba-float for packed elevations (packed_elevations.h).
/// Going back further than the few hundred rows that are kept decodes again from the first. An interlaced picture is
/// decoded whole, up to kMaxInterlacedBytes.
[[nodiscard]] bool looks_like_png(std::span<const std::byte> head);
[[nodiscard]] std::unique_ptr<HeightSource> open_png(const std::string& path, const OpenOptions& options);

/// The same of a WebP picture, through libwebp, decoded whole. A lossy one is read with a warning, packed elevations in it
/// are refused.
[[nodiscard]] bool looks_like_webp(std::span<const std::byte> head);
[[nodiscard]] std::unique_ptr<HeightSource> open_webp(const std::string& path, const OpenOptions& options);

/// Elevations packed into the tiles of a web map (PNG or lossless WebP, one size, a power of two), as one raster in Web
/// Mercator: of the finest zoom level, or options.part's. Where a tile is missing, or transparent, is nodata.
/// options.channel is the packing; else the file's "encoding" counts, else what the bytes show. A row of tiles is kept, up
/// to 256 MiB. Of PMTiles version 3 is read, directories plain or in gzip.
[[nodiscard]] bool looks_like_pmtiles(std::span<const std::byte> head);
[[nodiscard]] std::unique_ptr<HeightSource> open_pmtiles(const std::string& path, const OpenOptions& options);

/// An ESRI ASCII grid: header words in any order and case, then ncols x nrows numbers from the North-West corner on,
/// broken into lines anywhere; cells are areas. A .prj beside it is read. Numbers have a decimal point or, all of them,
/// a decimal comma; nan and inf are nodata. Whole numbers that fit 32 bits become int32 samples, any others float64. Opening
/// checks every number and keeps the offsets of at most 65536 rows.
[[nodiscard]] bool looks_like_ascii_grid(std::span<const std::byte> head);
[[nodiscard]] std::unique_ptr<HeightSource> open_ascii_grid(const std::string& path, const OpenOptions& options);

/// Plain samples with a text header beside them: GridFloat (.flt and .hdr), ESRI's EHdr (.bil, .bip or .bsq and .hdr)
/// of one band, and GTOPO30 (.dem and .hdr). `path` is either file. Integers of 8 to 32 bits, floats of 32 and 64, both
/// byte orders, padded rows, skipped bytes; cells are areas. A .prj beside them is read, and a world file (.blw, .bqw,
/// .flw) where the header gives no place. Where the header leaves byte order or sign open, little-endian and signed
/// samples are read, with a warning.
[[nodiscard]] bool looks_like_grid_header(std::span<const std::byte> head);  ///< EHdr's
[[nodiscard]] std::unique_ptr<HeightSource> open_header_grid(const std::string& path, const OpenOptions& options);

/// Plain samples that an ENVI header (NAME.hdr or NAME.EXT.hdr) describes; `path` is either. Bands in any order, of which
/// options.channel picks one by its name or number; integers of 8 to 64 bits, floats of 32 and 64, both byte orders.
/// Cells are areas; "coordinate system string" is WKT; gains and offsets are the vertical scale and offset.
[[nodiscard]] bool looks_like_envi(std::span<const std::byte> head);
/// Whether a file has an ENVI header beside it.
[[nodiscard]] bool has_envi_header(const std::string& path);
[[nodiscard]] std::unique_ptr<HeightSource> open_envi(const std::string& path, const OpenOptions& options);

/// A variable of two dimensions (those before of one value, columns first or last) in a netCDF file of the classic
/// formats, which options.channel names, else the first; coordinates that are evenly spaced place it, "crs_wkt" or
/// "spatial_ref" of its grid mapping say where, degrees without one are on WGS 84. _FillValue and missing_value
/// are nodata, scale_factor and add_offset the vertical scale and offset.
[[nodiscard]] bool looks_like_netcdf(std::span<const std::byte> head);
[[nodiscard]] std::unique_ptr<HeightSource> open_netcdf(const std::string& path, const OpenOptions& options);

/// The same of a netCDF-4 file, which is HDF5, through libnetcdf in the module isohf_netcdf.so, which is loaded at the
/// first call. Blocks are its chunks, of 1 GiB at most; two rows of them are kept.
[[nodiscard]] bool looks_like_hdf5(std::span<const std::byte> head);
[[nodiscard]] std::unique_ptr<HeightSource> open_netcdf4(const std::string& path, const OpenOptions& options);

/// A GDAL virtual raster (VRT) as gdalbuildvrt writes it: whole files, read by whichever reader knows them, side by side
/// and over each other (SimpleSource, ComplexSource with NODATA). At most most_open_rasters() files are open at once.
/// Any other is refused.
[[nodiscard]] bool looks_like_vrt(std::span<const std::byte> head);
[[nodiscard]] std::unique_ptr<HeightSource> open_vrt(const std::string& path, const OpenOptions& options);

/// The IMAGE of a PDS3 product (PDS Standards Reference 3.8): a label with the samples behind it, a label (.lbl) that
/// names the data file beside it, or that data file. Integers of 8 to 32 bits and IEEE floats, both byte orders; line
/// prefixes and suffixes; bands in any order, of which options.channel picks one by its number. SCALING_FACTOR and
/// OFFSET are the vertical scale and offset; MISSING_CONSTANT and its kin are nodata, and so is what lies below ISIS's
/// valid range in 32 bit floats.
[[nodiscard]] bool looks_like_pds3(std::span<const std::byte> head);
/// Whether `path` is a data file (.img) whose PDS3 label lies beside it: the same name with .lbl, in any case.
[[nodiscard]] bool has_pds3_label(const std::string& path);
[[nodiscard]] std::unique_ptr<HeightSource> open_pds3(const std::string& path, const OpenOptions& options);

/// The first array of a PDS4 product (XML label; PDS4 Data Standards, Array_2D_Image, Array_3D_Image and their kin): the
/// label, or the data file (.img) beside which it lies. Integers of 8 to 64 bits and IEEE floats, both byte orders, axes
/// in any order; options.channel picks a band by its number. Special_Constants are nodata, scaling_factor and
/// value_offset the vertical scale and offset; the area Cartography places the samples.
[[nodiscard]] bool looks_like_pds4(std::span<const std::byte> head);
/// Whether `path` is a label, or has one beside it: long prologues put the product beyond a file's first bytes.
[[nodiscard]] bool is_pds4(const std::string& path);
[[nodiscard]] std::unique_ptr<HeightSource> open_pds4(const std::string& path, const OpenOptions& options);

/// An ISIS 3 cube with its label in the file, or a label whose ^Core names the file beside it (USGS, ISIS 3 logical and
/// physical cube formats): tiles or bands in sequence, both byte orders; Base and Multiplier are the vertical offset and
/// scale; special pixels are nodata. options.channel picks a band by its number. The group Mapping places the samples
/// in metres of its projection, whose name is carried with target and radii.
[[nodiscard]] bool looks_like_isis3(std::span<const std::byte> head);
[[nodiscard]] std::unique_ptr<HeightSource> open_isis3(const std::string& path, const OpenOptions& options);

/// An array that numpy.save wrote (NEP 1, versions 1 to 3): two dimensions, rows from North to South, C or Fortran
/// order, integers of 8 to 64 bits and floats of 16 to 64 in either byte order. Nothing is known of place or units.
[[nodiscard]] bool looks_like_npy(std::span<const std::byte> head);
[[nodiscard]] std::unique_ptr<HeightSource> open_npy(const std::string& path, const OpenOptions& options);
/// One array of an archive that numpy.savez wrote: the one that options.channel names, else the first that open_npy
/// would read, with a warning when there are others.
[[nodiscard]] std::unique_ptr<HeightSource> open_npz(const std::string& path, const OpenOptions& options);

/// A DTED cell of any level (MIL-PRF-89020B): columns of posts from South to North, each a record with a checksum,
/// sign-magnitude metres, nodata -32767. A column's record is checked with its checksum when it is first touched.
[[nodiscard]] bool looks_like_dted(std::span<const std::byte> head);
[[nodiscard]] std::unique_ptr<HeightSource> open_dted(const std::string& path, const OpenOptions& options);

/// Points of a regular grid in text: x, y and z on each line, in any order of lines, some of them missing perhaps; blanks,
/// commas or semicolons (with decimal commas) between them, a line of names, comments (#). Elevations that are all whole
/// are int32, any others float64; points are posts. Opening reads the text twice, and puts the elevations into a file
/// without a name in the folder for temporary files; in memory are the coordinates of rows and columns.
[[nodiscard]] bool looks_like_xyz(std::span<const std::byte> head);
/// Whether the file is called .xyz and begins with a point.
[[nodiscard]] bool is_xyz(const std::string& path);
[[nodiscard]] std::unique_ptr<HeightSource> open_xyz(const std::string& path, const OpenOptions& options);

/// Whether the file is called .zip and is an archive with one .hgt inside, as NASADEM_HGT_n44e006.zip is.
[[nodiscard]] bool is_zip_of_hgt(const std::string& path);
/// An SRTM tile, plain, in gzip, or as the one .hgt member of a zip archive (NASA, SRTM topography, 2005): big-endian
/// 16 bit metres above EGM96 on posts, n x n of one degree (1201: 3", 3601: 1") or 1801 x 3601, nodata -32768. The name
/// says where: N44E006.hgt has its South-West post at 44 N, 6 E; any other name leaves the origin unknown, with a
/// warning. HGT has no signature.
[[nodiscard]] std::unique_ptr<HeightSource> open_hgt(const std::string& path, const OpenOptions& options);

/// The raster of a ZIP or tar archive, or of a .gz whose reader needs a file, with the files of its name that lie beside
/// it. It is unpacked into a folder among the temporary files, which goes when it is closed. options.part names one of
/// several; several .hgt tiles are one raster.
[[nodiscard]] bool looks_like_tar(std::span<const std::byte> head);
/// Whether the file is a whole ZIP archive that isohf did not write.
[[nodiscard]] bool is_zip(const std::string& path);
/// Whether a ZIP or tar archive holds a raster, or is too damaged to say.
[[nodiscard]] bool is_archive_of_rasters(const std::string& path);
[[nodiscard]] std::unique_ptr<HeightSource> open_packed(const std::string& path, const OpenOptions& options);

/// Nothing but samples, row by row from the North-West one on, as options.raw says, or a NAME.r16.json beside, as isohf
/// writes it. Without either: kInvalidArgument, with a suggestion where the samples make a square.
[[nodiscard]] std::unique_ptr<HeightSource> open_raw(const std::string& path, const OpenOptions& options);
/// Reads "WxH:TYPE" ("200x200:u16le"): columns, rows, and u8, i8 or u16, i16, u32, i32, f32, f64 with le or be for the
/// byte order. Throws Error{kInvalidArgument} saying what was found and what is required.
[[nodiscard]] RawLayout raw_layout_from_string(std::string_view text);

/// What no native reader knows, through OpenImageIO in the module isohf_oiio.so, which is loaded at the first call
/// (module_loader.h). Error{kUnsupported} says what is read natively where there is no module or it knows no better.
[[nodiscard]] std::unique_ptr<HeightSource> open_with_oiio(const std::string& path, const OpenOptions& options);

/// Name and version of the libraries that formats are read and written with, as they run: "libtiff 4.5.0".
[[nodiscard]] std::string exr_library();
[[nodiscard]] std::string netcdf_library();
[[nodiscard]] std::string png_library();
[[nodiscard]] std::string tiff_library();
[[nodiscard]] std::string webp_library();

/// The most bytes that the pixels of an interlaced PNG may take: 1 GiB.
inline constexpr std::uint64_t kMaxInterlacedBytes = std::uint64_t{1} << 30U;

/// The most bytes that one decoded OpenEXR chunk (a block of scan lines or a tile, all channels) may have, in a file
/// that is large enough to hold such chunks; less in small files.
inline constexpr std::uint64_t kMaxExrChunkBytes = std::uint64_t{1} << 30U;

}  // namespace isohf
