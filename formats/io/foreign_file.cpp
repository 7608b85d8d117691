#include "formats/io/foreign_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <utility>

#include "formats/georeference/sidecars.h"
#include "formats/readers.h"
#include "isohf/base/text/text.h"

namespace isohf {
namespace {

using namespace std::string_view_literals;

constexpr const char* kGdal = "gdal_translate {} OUT.tif makes a GeoTIFF of it";
constexpr const char* kPdal = "PDAL grids it: pdal translate {} OUT.tif --writers.gdal.resolution=1";  // NOLINT
constexpr const char* kNumpy = R"(np.save("a.npy", np.load("{}")["a"]) saves its array a by itself)";
constexpr const char* kPmtiles = "pmtiles convert {} OUT.pmtiles makes a PMTiles archive of it";
constexpr const char* kExport = "isohf export {} OUT.tif makes a raster of it";

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

bool is_graymap(std::string_view head) {
  return head.size() > 2 && head.starts_with("P5") &&
         std::string_view(" \t\n\v\f\r#").find(head[2]) != std::string::npos;
}

/// Whether an SQLite database has the application number of MBTiles.
bool is_mbtiles_id(std::string_view head) {
  constexpr std::size_t kApplicationAt = 68;
  return head.starts_with("SQLite format 3") && head.substr(std::min(kApplicationAt, head.size())).starts_with("MPBX");
}

/// Whether text has two bytes a letter, by its byte order mark and some zeros.
bool is_utf16(std::string_view head) {
  return (head.starts_with("\xFF\xFE") || head.starts_with("\xFE\xFF")) && head.find('\0') != head.npos;
}

/// What marks files of a format; all that is given must hold.
struct Mark {
  std::string_view begins = {};  ///< the file's bytes from `at` on
  std::string_view extension = {};
  std::string_view beside = {};  ///< extension of a file of the same name
  bool (*is_one)(std::string_view head) = nullptr;
  std::size_t at = 0;
};

struct Row {
  const char* is;
  Mark mark;
  const char* help = kGdal;       ///< with {} for the file's name
  const char* samples = nullptr;  ///< extension of the file to convert, if another
};

/// Rasters that another program converts: they are recognised before isohf's own readers try.
constexpr Row kConverted[] = {
    {"a JPEG 2000 picture", {"\0\0\0\x0CjP  \r\n\x87\n"sv}},
    {"a JPEG 2000 picture", {"\xFF\x4F\xFF\x51"}},
    {"an ERDAS Imagine raster", {"EHFA_HEADER_TAG"}},
    {"a Surfer grid", {"DSAA"}},
    {"a Surfer grid", {"DSBB"}},
    {"a Surfer grid", {"DSRB"}},
    {"a VICAR raster", {"LBLSIZE="}},
    {"a Terragen terrain", {"TERRAGENTERRAIN "}},
    {"a PCRaster map", {"RUU CROSS SYSTEM MAP FORMAT"}},
    {"an ER Mapper raster", {"DatasetHeader Begin"}},
    {"an Arc/Info grid", {.extension = ".adf"}},
    {"a BAG bathymetry grid", {"\x89HDF\r\n\x1a\n", ".bag"}},
    {"a GeoPackage", {"SQLite format 3", ".gpkg"}},
    {"an MBTiles file", {"SQLite format 3", ".mbtiles"}, kPmtiles},
    {"an MBTiles file", {.is_one = is_mbtiles_id}, kPmtiles},
    {"an isohf archive", {"PK\x03\x04", ".isohf"}, kExport},
    {"an isohf archive", {.begins = "isohf.json", .at = 30}, kExport},
    {"an isohf archive", {.begins = "mimetypeapplication/vnd.isohf", .at = 30}, kExport},
    {"a NumPy archive", {"PK", ".npz"}, kNumpy},
    {"a portable graymap", {.is_one = is_graymap}},
    {"a SAGA grid", {.extension = ".sdat"}},
    {"a SAGA grid", {.extension = ".sgrd"}, kGdal, ".sdat"},
    {"an IDRISI raster", {.extension = ".rst", .beside = ".rdc"}},
    {"an IDRISI raster", {.extension = ".rdc"}, kGdal, ".rst"},
    {"a ROI_PAC raster", {.extension = ".dem", .beside = ".dem.rsc"}},
    {"a ROI_PAC raster", {.extension = ".rsc"}, kGdal, ""},
    {"a GRASS ASCII raster", {.is_one = is_grass_text}},
    {"a USGS DEM", {.is_one = is_usgs_dem}},
};

/// What no reader of isohf's takes.
constexpr Row kOthers[] = {
    {"a gzip file", {"\x1f\x8b"}, "a name that ends in .gz has it unpacked"},
    {"a bzip2 file", {"BZh"}, "a name that ends in .bz2 has it unpacked"},
    {"an xz file", {"\xfd\x37zXZ"}, "a name that ends in .xz has it unpacked"},
    {"a Zstandard file", {"\x28\xb5\x2f\xfd"}, "a name that ends in .zst has it unpacked"},
    {"a RAR file", {"Rar!"}, "unpack it first"},
    {"a LAS point cloud", {"LASF"}, kPdal},
    {"an E57 point cloud", {"ASTM-E57"}, kPdal},
    {"an HDF4 file", {"\x0e\x03\x13\x01"}},
    {"a GRIB file", {"GRIB"}},
    {"a NITF raster", {"NITF"}},
    {"a MrSID picture", {"msid"}},
    {"an SQLite database, as a GeoPackage is one", {"SQLite format 3"}},
    {"a shapefile, which holds points or outlines", {"\0\0\x27\x0a"sv}, "gdal_grid makes a raster of points"},
    {"text in UTF-16", {.is_one = is_utf16}, "iconv -f UTF-16 -t UTF-8 {} -o OUT makes UTF-8 of it"},
    {"a PDF document", {"%PDF"}, ""},
    {"a PLY mesh", {"ply\n"}, ""},
    {"a glTF model", {"glTF"}, ""},
    {"a JPEG picture", {"\xff\xd8\xff"}, ""},
    {"a GIF picture", {"GIF8"}, ""},
    {"a RIFF file: a WebP picture, sound or film", {"RIFF"}, ""},
    {"a program", {"\177ELF"}, ""},
    {"XML text", {"<?xml"}, ""},
    {"JSON text", {"{"}, ""},
};

const Row* find_row(std::span<const Row> rows, const std::string& path, std::string_view head) {
  const auto is_of = [&](const Row& row) {
    const Mark& mark = row.mark;
    if (!mark.extension.empty() && !lower_case(path).ends_with(mark.extension)) return false;
    if (mark.at > head.size() || !head.substr(mark.at).starts_with(mark.begins)) return false;
    if (mark.is_one != nullptr && !mark.is_one(head)) return false;
    const std::string name = std::filesystem::path(path).filename().replace_extension(mark.beside).string();
    return mark.beside.empty() || !file_beside(path, name).empty();
  };
  const auto found = std::ranges::find_if(rows, is_of);
  return found == rows.end() ? nullptr : &*found;
}

bool is_text(std::string_view head) {
  return !head.empty() && std::all_of(head.begin(), head.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte >= 0x20 ? byte != 0x7f : byte == '\n' || byte == '\r' || byte == '\t' || byte == '\f';
  });
}

}  // namespace

bool is_foreign_raster(const std::string& path, std::span<const std::byte> head) {
  return find_row(kConverted, path, text_of(head)) != nullptr;
}

ForeignFile foreign_file(const std::string& path) {
  std::string head(512, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  const Row* row = find_row(kConverted, path, head);
  if (row == nullptr) row = find_row(kOthers, path, head);
  if (row == nullptr) return {is_text(head) ? "text" : "", ""};
  if (row->mark.begins.starts_with("\0\0\0\x0CjP"sv)) {
    if (std::string help = jpeg2000_help(path); !help.empty()) return {row->is, std::move(help)};
  }
  std::filesystem::path converted = path;
  if (row->samples != nullptr) converted.replace_extension(row->samples);
  return {row->is, fmt::format(fmt::runtime(row->help), converted.string())};
}

}  // namespace isohf
