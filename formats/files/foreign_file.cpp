#include "formats/files/foreign_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <utility>

#include "formats/files/text.h"
#include "formats/georeference/files_beside.h"

namespace isohf {
namespace {

using namespace std::string_view_literals;

constexpr const char* kGdal = "gdal_translate {} OUT.tif makes a GeoTIFF of it";
constexpr const char* kRestore = "isohf restore {} OUT.tif makes a raster of it";
constexpr const char* kUnpack = "unpack it first";

/// A raster of another program.
struct Raster {
  const char* is;
  bool (*found)(const std::string& path, std::string_view head);
  const char* help = kGdal;
};

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
bool is_grass_text(std::string_view head) {
  const std::string name = lower_case(trimmed(head.substr(0, head.find(':'))));
  constexpr std::array<std::string_view, 6> kNames = {"north", "south", "east", "west", "rows", "cols"};
  return name.size() < head.size() && std::ranges::find(kNames, name) != kNames.end();
}

/// Whether text begins a record of type A (USGS, Standards for Digital Elevation Models, part 2): codes in columns of six.
bool is_usgs_dem(std::string_view head) {
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

constexpr Raster kRasters[] = {
    {"a JPEG 2000 picture",
     [](const std::string&, std::string_view head) {
       return head.starts_with("\0\0\0\x0CjP  \r\n\x87\n"sv) || head.starts_with("\xFF\x4F\xFF\x51");
     }},
    {"an MBTiles file",
     [](const std::string& path, std::string_view head) {
       return head.starts_with("SQLite format 3") &&
              (has_extension(path, ".mbtiles") ||
               head.substr(std::min<std::size_t>(68, head.size())).starts_with("MPBX"));
     },
     "pmtiles convert {} OUT.pmtiles makes a PMTiles archive of it"},
    {"an ERDAS Imagine raster",
     [](const std::string&, std::string_view head) { return head.starts_with("EHFA_HEADER_TAG"); }},
    {"a SAGA grid", [](const std::string& path,
                       std::string_view) { return has_extension(path, ".sdat") || has_extension(path, ".sgrd"); }},
    {"an IDRISI raster",
     [](const std::string& path, std::string_view) {
       return has_extension(path, ".rdc") || (has_extension(path, ".rst") && has_beside(path, ".rdc"));
     }},
    {"a ROI_PAC raster",
     [](const std::string& path, std::string_view) {
       return has_extension(path, ".rsc") || (has_extension(path, ".dem") && has_beside(path, ".dem.rsc"));
     }},
    {"a VICAR raster", [](const std::string&, std::string_view head) { return head.starts_with("LBLSIZE="); }},
    {"a Terragen terrain",
     [](const std::string&, std::string_view head) { return head.starts_with("TERRAGENTERRAIN "); }},
    {"a portable graymap",
     [](const std::string&, std::string_view head) {
       return head.size() > 2 && head.starts_with("P5") &&
              std::string_view(" \t\n\v\f\r#").find(head[2]) != std::string_view::npos;
     }},
    {"a Surfer grid",
     [](const std::string&, std::string_view head) {
       return head.starts_with("DSAA") || head.starts_with("DSBB") || head.starts_with("DSRB");
     }},
    {"a GRASS ASCII raster", [](const std::string&, std::string_view head) { return is_grass_text(head); }},
    {"a USGS DEM", [](const std::string&, std::string_view head) { return is_usgs_dem(head); }},
};

const Raster* raster_of(const std::string& path, std::string_view head) {
  const auto* const found = std::ranges::find_if(kRasters, [&](const Raster& each) { return each.found(path, head); });
  return found == std::ranges::end(kRasters) ? nullptr : found;
}

struct Signature {
  std::string_view bytes;
  const char* is;
  const char* help = "";
  std::size_t at = 0;
};

constexpr Signature kSignatures[] = {
    {"isohf.json"sv, "an isohf archive", kRestore, 30},
    {"mimetypeapplication/vnd.isohf"sv, "an isohf archive", kRestore, 30},
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
