#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <pugixml.hpp>
#include <sstream>

#include "formats/georeference/gdal_unit.h"
#include "formats/georeference/sidecars.h"
#include "formats/io/raw_file.h"
#include "formats/write/encoders.h"
#include "isohf/base/output_file.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/projection/crs/crs.h"

namespace isohf {
namespace {

std::string beside(const std::string& path, const char* extension) {
  return std::filesystem::path(path).replace_extension(extension).string();
}

bool is_raw(const std::string& extension) {
  return extension == ".r16" || extension == ".r32" || extension == ".raw";
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

/// ESRI's WKT of the reference system; empty if nothing names it.
std::string prj_text(const RasterSpec& spec) {
  return spec.georeference ? wkt_of(spec.georeference->system, WktDialect::kEsri) : std::string();
}

/// GDAL's Persistent Auxiliary Metadata: the place, and what the numbers of elevations mean.
std::string auxiliary_text(const RasterSpec& spec) {
  const Georeference& place = *spec.georeference;
  pugi::xml_document document;
  pugi::xml_node root = document.append_child("PAMDataset");
  const auto add = [](pugi::xml_node parent, const char* name, const std::string& text) {
    pugi::xml_node node = parent.append_child(name);
    node.text().set(text.c_str());
    return node;
  };
  const std::string system = wkt_of(place.system, WktDialect::kGdal);
  if (!system.empty()) add(root, "SRS", system);
  add(root, "GeoTransform",
      fmt::format("{}, {}, 0, {}, 0, {}", place.origin_x - place.spacing_x / 2.0, place.spacing_x,
                  place.origin_y + place.spacing_y / 2.0, -place.spacing_y));
  if (place.registration != Registration::kUnknown) {
    const char* const kind = place.registration == Registration::kPoint ? "Point" : "Area";
    add(root.append_child("Metadata"), "MDI", kind).append_attribute("key") = "AREA_OR_POINT";
  }
  if (spec.channels == 1) {
    pugi::xml_node band = root.append_child("PAMRasterBand");
    band.append_attribute("band") = 1;
    if (spec.void_value) add(band, "NoDataValue", fmt::format("{}", *spec.void_value));
    if (!spec.vertical_unit.empty()) {
      add(band, "UnitType", gdal_unit(spec.vertical_unit, place.system.vertical_epsg.has_value()));
    }
    if (spec.z_scale != 1.0 || spec.z_offset != 0.0) {
      add(band, "Offset", fmt::format("{}", spec.z_offset));
      add(band, "Scale", fmt::format("{}", spec.z_scale));
    }
  }
  std::ostringstream text;
  document.save(text, "  ", pugi::format_indent | pugi::format_no_declaration);
  return text.str();
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

/// Whether a file, if it exists, is what its extension says: not a Radiance picture or ENVI header called .hdr.
bool is_sidecar(const std::string& path) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 16U;
  const std::vector<std::byte> bytes = head_of_file(path, kMostBytes);
  const std::string text = lower_case(text_of(bytes));
  const std::string extension = extension_of(path);
  if (text.empty()) return true;
  if (extension == ".json") {
    const auto json = nlohmann::json::parse(text, nullptr, false);
    return json.is_object() && json.contains("width") && json.contains("sample_type");
  }
  if (extension == ".xml") return text.starts_with("<pamdataset");
  if (extension == ".wld" || (extension.size() > 2 && extension.back() == 'w')) {
    return text.find_first_not_of("0123456789+-.e \t\r\n") == text.npos;
  }
  if (extension == ".hdr") return text.find("ncols") != text.npos && text.find("nrows") != text.npos;
  const std::size_t end = text.find_first_not_of("abcdefghijklmnopqrstuvwxyz_");
  return end > 0 && end != text.npos && (text[end] == '[' || text.starts_with("projection"));
}

}  // namespace

double grid_void(const RasterSpec& spec) {
  if (spec.void_value && !std::isnan(*spec.void_value)) return *spec.void_value;
  // Integers without a nodata value have none; the word is required all the same.
  return is_floating(spec.sample_type) ? static_cast<double>(std::numeric_limits<float>::lowest()) : -2147483648.0;
}

std::string ascii_grid_header(const RasterSpec& spec) {
  // In the digits of the voids themselves: a reader compares the two as doubles.
  const bool is_single = spec.sample_type == SampleType::kFloat16 || spec.sample_type == SampleType::kFloat32;
  return grid_words(
      spec, is_single ? fmt::format("{}", static_cast<float>(grid_void(spec))) : fmt::format("{}", grid_void(spec)));
}

std::vector<std::string> sidecar_paths(const std::string& path) {
  const std::string extension = extension_of(path);
  if (extension == ".flt") return {beside(path, ".hdr"), beside(path, ".prj")};
  if (extension == ".asc") return {beside(path, ".prj")};
  if (extension == ".exr") return {world_file_name(path), path + ".aux.xml"};
  if (extension == ".png") return {path + ".json", world_file_name(path), path + ".aux.xml"};
  return is_raw(extension) ? std::vector<std::string>{path + ".json"} : std::vector<std::string>{};
}

std::vector<Sidecar> sidecars_of(const std::string& path, const RasterSpec& spec) {
  const std::string extension = extension_of(path);
  std::vector<Sidecar> list;
  if (extension == ".flt") list.push_back({beside(path, ".hdr"), grid_float_header(spec)});
  if (extension == ".flt" || extension == ".asc") {
    if (std::string text = prj_text(spec); !text.empty()) list.push_back({beside(path, ".prj"), text + "\n"});
  }
  if (is_raw(extension) || (extension == ".png" && spec.describe)) {
    list.push_back({path + ".json", json_text(extension, spec)});
  }
  if ((extension == ".exr" || extension == ".png") && spec.georeference && spec.georeference->has_origin) {
    list.push_back({world_file_name(path), world_text(*spec.georeference)});
    list.push_back({path + ".aux.xml", auxiliary_text(spec)});
  }
  return list;
}

std::vector<std::string> stale_sidecars(const std::string& path, const RasterSpec* spec) {
  std::vector<std::string> stale = sidecar_paths(path);
  stale.push_back(path + ".aux.xml");
  const bool has_place = spec != nullptr && spec->georeference.has_value();
  if (!has_place || !spec->georeference->has_origin) {
    stale.push_back(world_file_name(path));
    stale.push_back(beside(path, ".wld"));
  }
  if (!has_place || system_text(spec->georeference->system).empty()) stale.push_back(beside(path, ".prj"));
  std::ranges::sort(stale);
  stale.erase(std::ranges::unique(stale).begin(), stale.end());
  const std::vector<Sidecar> kept = spec != nullptr ? sidecars_of(path, *spec) : std::vector<Sidecar>{};
  std::erase_if(stale, [&](const std::string& file) {
    std::error_code ignored;
    return std::ranges::find(kept, file, &Sidecar::path) != kept.end() ||
           !std::filesystem::is_regular_file(file, ignored) || !is_sidecar(file);
  });
  return stale;
}

void check_sidecar_target(const std::string& path) {
  if (is_sidecar(path)) return;
  throw Error(
      ErrorCode::kInvalidArgument,
      fmt::format("exists and is no {} of a raster, which alone is replaced; remove it first, or choose another "
                  "name for the raster",
                  extension_of(path)));
}

}  // namespace isohf
