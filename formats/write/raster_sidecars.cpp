#include "formats/georeference/gdal_unit.h"
#include "formats/write/encoders.h"
#include "isohf/projection/crs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "formats/georeference/files_beside.h"
#include "formats/io/text.h"
#include "isohf/base/output_file.h"
#include "isohf/error.h"

namespace isohf {
namespace {

std::string extension_of(const std::string& path) {
  return lower_case(std::filesystem::path(path).extension().string());
}

/// Size, place and void value in the words that GridFloat and ASCII grids share. Cells are areas: the corner of the
/// South-West cell lies half a spacing off its sample.
std::string grid_words(const RasterSpec& spec, const std::string& void_text) {
  std::string words = fmt::format("ncols {}\nnrows {}\n", spec.width, spec.height);
  const Georeference place = spec.georeference.value_or(Georeference{});
  const double south = place.origin_y - static_cast<double>(spec.height - 1) * place.spacing_y;
  const double x = place.has_origin ? place.origin_x - place.spacing_x / 2.0 : 0.0;
  const double y = place.has_origin ? south - place.spacing_y / 2.0 : 0.0;
  words += fmt::format("xllcorner {}\nyllcorner {}\n", x, y);
  words += place.spacing_x == place.spacing_y ? fmt::format("cellsize {}\n", place.spacing_x)
                                              : fmt::format("dx {}\ndy {}\n", place.spacing_x, place.spacing_y);
  return words + fmt::format("NODATA_value {}\n", void_text);
}

/// GridFloat knows one cell size; EHdr's words, which its readers take as well, know two.
std::string grid_float_header(const RasterSpec& spec) {
  const Georeference place = spec.georeference.value_or(Georeference{});
  if (place.spacing_x == place.spacing_y)
    return grid_words(spec, fmt::format("{}", grid_void(spec))) + "byteorder LSBFIRST\n";
  return fmt::format(
      "NROWS {}\nNCOLS {}\nNBANDS 1\nNBITS 32\nPIXELTYPE FLOAT\nBYTEORDER LSBFIRST\nLAYOUT BIL\nULXMAP {}\n"
      "ULYMAP {}\nXDIM {}\nYDIM {}\nNODATA {}\n",
      spec.height, spec.width, place.has_origin ? place.origin_x : place.spacing_x / 2.0,
      place.has_origin ? place.origin_y : (static_cast<double>(spec.height) - 0.5) * place.spacing_y, place.spacing_x,
      place.spacing_y, grid_void(spec));
}

/// ESRI's WKT of the reference system, without PROJ for the commonest: WGS 84 in degrees and its UTM zones. Empty where
/// nothing names the system.
std::string esri_text(const ReferenceSystem& system) {
  const std::string wgs84 = R"(GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,298.257223563]],)"
                            R"(PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]])";
  const int epsg = system.vertical_epsg ? 0 : system.epsg.value_or(0);
  if (epsg == 4326) return wgs84;
  const bool north = epsg > 32600 && epsg <= 32660;
  const bool south = epsg > 32700 && epsg <= 32760;
  if (!north && !south) return wkt_of(system, WktDialect::kEsri);
  const int zone = epsg % 100;
  return fmt::format(
      R"(PROJCS["WGS_1984_UTM_Zone_{}{}",{},PROJECTION["Transverse_Mercator"],PARAMETER["False_Easting",500000.0],)"
      R"(PARAMETER["False_Northing",{}],PARAMETER["Central_Meridian",{}],PARAMETER["Scale_Factor",0.9996],)"
      R"(PARAMETER["Latitude_Of_Origin",0.0],UNIT["Meter",1.0]])",
      zone, north ? 'N' : 'S', wgs84, north ? "0.0" : "10000000.0", 6 * zone - 183);
}

std::string prj_text(const RasterSpec& spec) {
  return spec.georeference ? esri_text(spec.georeference->system) : std::string();
}

std::string xml_text(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    escaped += c == '<' ? "&lt;" : c == '&' ? "&amp;" : c == '>' ? "&gt;" : std::string(1, c);
  }
  return escaped;
}

/// GDAL's Persistent Auxiliary Metadata: the place, and of elevations what the numbers mean.
std::string auxiliary_text(const RasterSpec& spec) {
  const Georeference& place = *spec.georeference;
  std::string text = "<PAMDataset>\n";
  std::string system = wkt_of(place.system, WktDialect::kGdal);
  if (system.empty()) system = prj_text(spec);  // without PROJ
  if (!system.empty()) text += fmt::format("  <SRS>{}</SRS>\n", xml_text(system));
  text += fmt::format("  <GeoTransform>{}, {}, 0, {}, 0, {}</GeoTransform>\n", place.origin_x - place.spacing_x / 2.0,
                      place.spacing_x, place.origin_y + place.spacing_y / 2.0, -place.spacing_y);
  if (place.registration != Registration::kUnknown) {
    text += fmt::format("  <Metadata>\n    <MDI key=\"AREA_OR_POINT\">{}</MDI>\n  </Metadata>\n",
                        place.registration == Registration::kPoint ? "Point" : "Area");
  }
  if (spec.channels == 1) {
    text += "  <PAMRasterBand band=\"1\">\n";
    if (spec.void_value) text += fmt::format("    <NoDataValue>{}</NoDataValue>\n", *spec.void_value);
    if (!spec.vertical_unit.empty()) {
      text += fmt::format("    <UnitType>{}</UnitType>\n",
                          xml_text(gdal_unit(spec.vertical_unit, place.system.vertical_epsg.has_value())));
    }
    if (spec.z_scale != 1.0 || spec.z_offset != 0.0) {
      text += fmt::format("    <Offset>{}</Offset>\n    <Scale>{}</Scale>\n", spec.z_offset, spec.z_scale);
    }
    text += "  </PAMRasterBand>\n";
  }
  return text + "</PAMDataset>\n";
}

/// The six numbers of a world file: the middle of the first sample, whatever samples stand for.
std::string world_text(const Georeference& place) {
  return fmt::format("{}\n0\n0\n{}\n{}\n{}\n", place.spacing_x, -place.spacing_y, place.origin_x, place.origin_y);
}

std::string json_text(const std::string& extension, const RasterSpec& spec) {
  nlohmann::ordered_json json = {{"format", extension == ".png" ? "png" : "raw samples"},
                                 {"width", spec.width},
                                 {"height", spec.height},
                                 {"sample_type", to_string(spec.sample_type)}};
  if (extension != ".png") json["byte_order"] = "little";
  json["row_order"] = "north to south";
  json["z_scale"] = spec.z_scale;
  json["z_offset"] = spec.z_offset;
  json["vertical_unit"] = spec.vertical_unit.empty() ? "unknown" : spec.vertical_unit;
  json["void_value"] = spec.void_value ? nlohmann::ordered_json(*spec.void_value) : nlohmann::ordered_json(nullptr);
  if (spec.georeference) {
    const Georeference& place = *spec.georeference;
    const bool degrees = place.unit == HorizontalUnit::kDegree;
    const bool metres = place.unit == HorizontalUnit::kMetre;
    json["registration"] = to_string(place.registration);
    json["spacing_x"] = place.spacing_x;
    json["spacing_y"] = place.spacing_y;
    json["horizontal_unit"] = degrees ? "degree" : metres ? "metre" : "unknown";
    if (metres && place.metres_per_unit != 1.0) json["metres_per_unit"] = place.metres_per_unit;
    if (place.has_origin) {
      json["origin_x"] = place.origin_x;
      json["origin_y"] = place.origin_y;
    }
    if (!place.system.name.empty()) json["crs_name"] = place.system.name;
    if (place.system.epsg) json["crs_epsg"] = *place.system.epsg;
    if (!place.system.epsg && !place.system.wkt.empty()) json["crs_wkt"] = place.system.wkt;
    if (!place.system.body.empty()) json["body"] = place.system.body;
    if (!place.system.vertical_datum.empty()) json["vertical_datum"] = place.system.vertical_datum;
    if (place.system.vertical_epsg) json["vertical_epsg"] = *place.system.vertical_epsg;
  }
  // What is no UTF-8 in a name found in a file must not keep it from being written.
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace

double grid_void(const RasterSpec& spec) {
  if (spec.void_value && !std::isnan(*spec.void_value)) return *spec.void_value;
  switch (spec.sample_type) {
    case SampleType::kFloat16:
    case SampleType::kFloat32:
    case SampleType::kFloat64:
      return static_cast<double>(std::numeric_limits<float>::lowest());
    default:
      return -2147483648.0;  // integers without a void value have none; the word is required all the same
  }
}

std::string ascii_grid_header(const RasterSpec& spec) {
  // In the digits of the voids themselves: a reader compares the two as doubles.
  const bool is_single = spec.sample_type == SampleType::kFloat16 || spec.sample_type == SampleType::kFloat32;
  return grid_words(
      spec, is_single ? fmt::format("{}", static_cast<float>(grid_void(spec))) : fmt::format("{}", grid_void(spec)));
}

std::vector<std::string> sidecar_paths(const std::string& path) {
  const std::string extension = extension_of(path);
  const auto beside = [&](const char* other) { return std::filesystem::path(path).replace_extension(other).string(); };
  if (extension == ".flt") return {beside(".hdr"), beside(".prj")};
  if (extension == ".asc") return {beside(".prj")};
  if (extension == ".exr") return {world_file_name(path), path + ".aux.xml"};
  if (extension == ".png") return {path + ".json", world_file_name(path), path + ".aux.xml"};
  const bool described = extension == ".r16" || extension == ".r32" || extension == ".raw";
  return described ? std::vector<std::string>{path + ".json"} : std::vector<std::string>{};
}

std::vector<std::string> stale_sidecars(const std::string& path, const RasterSpec* spec) {
  std::vector<std::string> stale = sidecar_paths(path);
  stale.push_back(path + ".aux.xml");
  const auto beside = [&](const char* other) { return std::filesystem::path(path).replace_extension(other).string(); };
  const bool has_place = spec != nullptr && spec->georeference.has_value();
  if (!has_place || !spec->georeference->has_origin) {
    stale.push_back(world_file_name(path));
    stale.push_back(beside(".wld"));
  }
  if (!has_place || system_text(spec->georeference->system).empty()) stale.push_back(beside(".prj"));
  std::sort(stale.begin(), stale.end());
  stale.erase(std::unique(stale.begin(), stale.end()), stale.end());
  const std::vector<Sidecar> kept = spec != nullptr ? sidecars_of(path, *spec) : std::vector<Sidecar>{};
  std::erase_if(stale, [&](const std::string& file) {
    std::error_code ignored;
    if (std::ranges::any_of(kept, [&](const Sidecar& sidecar) { return sidecar.path == file; })) return true;
    if (!std::filesystem::is_regular_file(file, ignored)) return true;
    try {
      check_sidecar_target(file);
    } catch (const Error&) {
      return true;
    }
    return false;
  });
  return stale;
}

void check_sidecar_target(const std::string& path) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 16U;
  const std::vector<std::byte> bytes = head_of_file(path, kMostBytes);
  if (bytes.empty()) return;
  const std::string text = lower_case({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  const std::string extension = extension_of(path);
  bool is_kind = false;
  if (extension == ".json") {
    const auto json = nlohmann::json::parse(text, nullptr, false);
    is_kind = json.is_object() && json.contains("width") && json.contains("sample_type");
  } else if (extension == ".xml") {
    is_kind = text.starts_with("<pamdataset");
  } else if (extension == ".wld" || (extension.size() > 2 && extension.back() == 'w')) {
    is_kind = text.find_first_not_of("0123456789+-.e \t\r\n") == std::string::npos;
  } else if (extension == ".hdr") {
    is_kind = text.find("ncols") != std::string::npos && text.find("nrows") != std::string::npos;
  } else {
    const std::size_t end = text.find_first_not_of("abcdefghijklmnopqrstuvwxyz_");
    is_kind = end > 0 && end != std::string::npos && (text[end] == '[' || text.starts_with("projection"));
  }
  if (is_kind) return;
  throw Error(
      ErrorCode::kInvalidArgument,
      fmt::format("exists and is no {} of a raster, which alone is replaced; remove it first, or choose another "
                  "name for the raster",
                  extension));
}

std::vector<Sidecar> sidecars_of(const std::string& path, const RasterSpec& spec) {
  const std::string extension = extension_of(path);
  const auto beside = [&](const char* other) { return std::filesystem::path(path).replace_extension(other).string(); };
  std::vector<Sidecar> list;
  if (extension == ".flt") list.push_back({beside(".hdr"), grid_float_header(spec)});
  if (extension == ".flt" || extension == ".asc") {
    if (std::string text = prj_text(spec); !text.empty()) list.push_back({beside(".prj"), text + "\n"});
  }
  const bool raw = extension == ".r16" || extension == ".r32" || extension == ".raw";
  if (raw || (extension == ".png" && spec.describe)) list.push_back({path + ".json", json_text(extension, spec)});
  if ((extension == ".exr" || extension == ".png") && spec.georeference && spec.georeference->has_origin) {
    list.push_back({world_file_name(path), world_text(*spec.georeference)});
    list.push_back({path + ".aux.xml", auxiliary_text(spec)});
  }
  return list;
}

}  // namespace isohf
