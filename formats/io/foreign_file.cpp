#include "formats/io/foreign_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <utility>

#include "formats/georeference/files_beside.h"
#include "formats/io/text.h"

namespace isohf {
namespace {

using namespace std::string_view_literals;

constexpr const char* kGdal = "gdal_translate {} OUT.tif makes a GeoTIFF of it";
constexpr const char* kExport = "isohf export {} OUT.tif makes a raster of it";
constexpr const char* kUnpack = "unpack it first";

bool has_extension(const std::string& path, std::string_view extension) {
  return lower_case(path).ends_with(extension);
}

/// Whether the file of another extension lies beside it.
bool has_beside(const std::string& path, const char* extension) {
  return !file_beside(path, std::filesystem::path(path).filename().replace_extension(extension).string()).empty();
}

/// The file of samples that a header describes; `path` for any other file.
std::string samples_of(const std::string& path) {
  for (const auto& [header, samples] : {std::pair(".sgrd", ".sdat"), {".rdc", ".rst"}, {".rsc", ""}}) {
    if (has_extension(path, header)) return std::filesystem::path(path).replace_extension(samples).string();
  }
  return path;
}

/// Whether text begins with a line of GRASS's r.in.ascii, "north: 4928000".
bool is_grass_text(const std::string& /*path*/, std::string_view head) {
  const std::string name = lower_case(trimmed(head.substr(0, head.find(':'))));
  constexpr std::array<std::string_view, 6> kNames = {"north", "south", "east", "west", "rows", "cols"};
  return name.size() < head.size() && std::ranges::find(kNames, name) != kNames.end();
}

/// Whether text begins a record of type A (USGS, Standards for Digital Elevation Models, part 2): codes in columns of six.
bool is_usgs_dem(const std::string& /*path*/, std::string_view head) {
  constexpr std::size_t kCodes = 144;
  constexpr std::size_t kColumn = 6;
  constexpr std::pair<int, int> kRanges[] = {{0, 9}, {1, 4}, {-9999, 99}, {-9999, 9999}};
  if (head.size() < kCodes + std::size(kRanges) * kColumn) return false;
  head = head.substr(0, kCodes + std::size(kRanges) * kColumn);
  if (!std::ranges::all_of(head, [](char c) { return c >= ' ' && c <= '~'; })) return false;
  for (std::size_t i = 0; i < std::size(kRanges); ++i) {
    const std::string text = trimmed(head.substr(kCodes + i * kColumn, kColumn));
    if (i == 1 && text.empty()) continue;
    int code = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), code);
    if (error != std::errc{} || end != text.data() + text.size()) return false;
    if (code < kRanges[i].first || code > kRanges[i].second) return false;
  }
  return true;
}

bool is_graymap(const std::string& /*path*/, std::string_view head) {
  return head.size() > 2 && head.starts_with("P5") &&
         std::string_view(" \t\n\v\f\r#").find(head[2]) != std::string::npos;
}

bool is_mbtiles(const std::string& path, std::string_view head) {
  constexpr std::size_t kApplicationAt = 68;
  return head.starts_with("SQLite format 3") &&
         (has_extension(path, ".mbtiles") || head.substr(std::min(kApplicationAt, head.size())).starts_with("MPBX"));
}

bool is_saga(const std::string& path, std::string_view /*head*/) {
  return has_extension(path, ".sdat") || has_extension(path, ".sgrd");
}

bool is_idrisi(const std::string& path, std::string_view /*head*/) {
  return has_extension(path, ".rdc") || (has_extension(path, ".rst") && has_beside(path, ".rdc"));
}

bool is_roi_pac(const std::string& path, std::string_view /*head*/) {
  return has_extension(path, ".rsc") || (has_extension(path, ".dem") && has_beside(path, ".dem.rsc"));
}

/// A raster of another program: by what its files begin with, or by more than that.
struct Raster {
  const char* is;
  std::array<std::string_view, 3> begins;
  bool (*is_one)(const std::string& path, std::string_view head) = nullptr;
  const char* help = kGdal;
};

constexpr Raster kRasters[] = {
    {"a JPEG 2000 picture", {"\0\0\0\x0CjP  \r\n\x87\n"sv, "\xFF\x4F\xFF\x51"}},
    {"an ERDAS Imagine raster", {"EHFA_HEADER_TAG"}},
    {"a Surfer grid", {"DSAA", "DSBB", "DSRB"}},
    {"a VICAR raster", {"LBLSIZE="}},
    {"a Terragen terrain", {"TERRAGENTERRAIN "}},
    {"a portable graymap", {}, is_graymap},
    {"an MBTiles file", {}, is_mbtiles, "pmtiles convert {} OUT.pmtiles makes a PMTiles archive of it"},
    {"a SAGA grid", {}, is_saga},
    {"an IDRISI raster", {}, is_idrisi},
    {"a ROI_PAC raster", {}, is_roi_pac},
    {"a GRASS ASCII raster", {}, is_grass_text},
    {"a USGS DEM", {}, is_usgs_dem},
};

const Raster* raster_of(const std::string& path, std::string_view head) {
  for (const Raster& raster : kRasters) {
    if (raster.is_one != nullptr && raster.is_one(path, head)) return &raster;
    for (const std::string_view begin : raster.begins) {
      if (!begin.empty() && head.starts_with(begin)) return &raster;
    }
  }
  return nullptr;
}

struct Signature {
  std::string_view bytes;
  const char* is;
  const char* help = "";
  std::size_t at = 0;
};

constexpr Signature kSignatures[] = {
    {"isohf.json"sv, "an isohf archive", kExport, 30},
    {"mimetypeapplication/vnd.isohf"sv, "an isohf archive", kExport, 30},
    {"PK\x03\x04"sv, "a ZIP file", "it is damaged or cut off"},
    {"\x1f\x8b"sv, "a gzip file", "gunzip it first"},
    {"BZh"sv, "a bzip2 file", kUnpack},
    {"\xfd"
     "7zXZ"sv,
     "an xz file", kUnpack},
    {"\x28\xb5\x2f\xfd"sv, "a Zstandard file", kUnpack},
    {"7z\xbc\xaf"sv, "a 7-Zip file", kUnpack},
    {"Rar!"sv, "a RAR file", kUnpack},
    {"%PDF"sv, "a PDF document"},
    {"LASF"sv, "a LAS point cloud", "PDAL grids it: pdal translate {} OUT.tif --writers.gdal.resolution=1"},  // NOLINT
    {"ply\n"sv, "a PLY mesh"},
    {"glTF"sv, "a glTF model"},
    {"\x0e\x03\x13\x01"sv, "an HDF4 file", kGdal},
    {"GRIB"sv, "a GRIB file", kGdal},
    {"NITF"sv, "a NITF raster", kGdal},
    {"msid"sv, "a MrSID picture", kGdal},
    {"SQLite format 3"sv, "an SQLite database, as a GeoPackage is one", kGdal},
    {"\x00\x00\x27\x0a"sv, "a shapefile, which holds points or outlines", "gdal_grid makes a raster of points"},
    {"\xff\xd8\xff"sv, "a JPEG picture"},
    {"GIF8"sv, "a GIF picture"},
    {"RIFF"sv, "a RIFF file: a WebP picture, sound or film"},
    {"\x7f"
     "ELF"sv,
     "a program"},
    {"<?xml"sv, "XML text"},
    {"{"sv, "JSON text"},
};

bool is_text(std::string_view head) {
  return !head.empty() && std::all_of(head.begin(), head.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte >= 0x20 ? byte != 0x7f : byte == '\n' || byte == '\r' || byte == '\t' || byte == '\f';
  });
}

}  // namespace

bool is_foreign_raster(const std::string& path, std::span<const std::byte> head) {
  return raster_of(path, text_of(head)) != nullptr;
}

ForeignFile foreign_file(const std::string& path) {
  constexpr std::size_t kHeadBytes = 512;
  std::string head(kHeadBytes, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  if (const Raster* const raster = raster_of(path, head)) {
    return {raster->is, fmt::format(fmt::runtime(raster->help), samples_of(path))};
  }
  for (const Signature& signature : kSignatures) {
    if (head.size() < signature.at || !std::string_view(head).substr(signature.at).starts_with(signature.bytes))
      continue;
    return {signature.is, fmt::format(fmt::runtime(signature.help), path)};
  }
  if (is_text(head)) return {"text", ""};
  return {};
}

}  // namespace isohf
