#include "formats/georeference/sidecars.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <locale>
#include <optional>
#include <pugixml.hpp>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "formats/geotiff/gdal_tags.h"
#include "formats/io/raw_file.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/projection/crs/source_system.h"

namespace isohf {
namespace {

/// Grids of so many metres and less within 360 m of (0, 0) are rarer than those in degrees: it is 36" of arc.
constexpr double kFinestAsMetres = 0.01;

/// Of a .prj or world file.
constexpr std::size_t kLongestText = 65536;

std::optional<std::string> text_of(const std::filesystem::path& path) {
  if (!is_file(path)) return std::nullopt;
  std::ifstream in(path, std::ios::binary);
  std::string text(kLongestText, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  return text;
}

std::vector<std::string> spellings(const std::vector<std::string>& extensions) {
  std::vector<std::string> all;
  for (const std::string& extension : extensions) {
    all.push_back(extension);
    all.push_back(upper_case(extension));
  }
  return all;
}

/// .jgw and .jpgw for .jpg: the first and last letter and a w, or all of them.
std::vector<std::string> world_extensions(const std::string& raster_path) {
  const std::string own = extension_of(raster_path);
  if (own == ".flt") return {".flw", ".ftw", ".fltw", ".wld"};
  if (own.size() < 3 || own == ".tif" || own == ".tiff") return {".tfw", ".tifw", ".wld"};
  return {fmt::format(".{}{}w", own[1], own.back()), own + "w", ".wld"};
}

/// "x0, dx, turn, y0, turn, dy": where the outer corner of the first pixel lies, and how far it is to the next ones.
std::array<double, 6> six_numbers(const std::string& path, std::string_view text) {
  std::array<double, 6> numbers{};
  const char* at = text.data();
  const char* const end = at + text.size();
  for (double& number : numbers) {
    while (at != end && (*at == ' ' || *at == ',' || *at == '\n' || *at == '+')) ++at;
    const auto [after, failure] = std::from_chars(at, end, number);
    if (failure != std::errc() || !std::isfinite(number)) {
      throw Error(ErrorCode::kCorrupt,
                  fmt::format("{}: GeoTransform is \"{}\", must be six numbers", path, printable(text)));
    }
    at = after;
  }
  return numbers;
}

}  // namespace

void place_by_transform(const std::string& path, const std::string& text, Georeference& place) {
  const auto [x0, dx, turn_x, y0, turn_y, dy] = six_numbers(path, text);
  if (turn_x != 0.0 || turn_y != 0.0 || !(dx > 0.0) || !(dy < 0.0)) {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("{}: GeoTransform has a dx of {}, a dy of {} and rotations of {} and {}: columns must run "
                            "from West to East (dx > 0) and rows from North to South (dy < 0); gdalwarp turns it",
                            path, dx, dy, turn_x, turn_y));
  }
  place.has_origin = true;
  place.spacing_x = dx;
  place.spacing_y = -dy;
  place.origin_x = x0 + dx / 2;
  place.origin_y = y0 + dy / 2;
}

void read_system_text(const std::string& text, const std::string& path, SourceInfo& info) {
  try {
    take_system(text, info);
  } catch (const Error& error) {
    // One that says how its coordinates are counted, but otherwise than ours, cannot be left out.
    if (error.code() == ErrorCode::kUnsupported) throw error.within(path);
    info.warnings.push_back(loss(fmt::format("{}: {}: the reference system is left out", path, error.what())));
  }
}

std::string world_file_name(const std::string& raster_path) {
  return std::filesystem::path(raster_path).replace_extension(world_extensions(raster_path).front()).string();
}

std::optional<WorldFile> world_file_beside(const std::string& raster_path) {
  for (const std::string& extension : spellings(world_extensions(raster_path))) {
    const std::filesystem::path path = std::filesystem::path(raster_path).replace_extension(extension);
    const std::optional<std::string> text = text_of(path);
    if (!text) continue;
    std::istringstream in(*text);
    in.imbue(std::locale::classic());
    double rotation_y = 0.0;
    double rotation_x = 0.0;
    WorldFile world;
    world.path = path.string();
    if (!(in >> world.dx >> rotation_y >> rotation_x >> world.dy >> world.x0 >> world.y0)) {
      throw Error(ErrorCode::kCorrupt, world.path + ": is not a world file, which has six numbers");
    }
    if (rotation_x != 0.0 || rotation_y != 0.0 || !(world.dx > 0.0) || world.dy == 0.0) {
      throw Error(
          ErrorCode::kUnsupported,
          fmt::format("{}: dx {}, rotations {} and {}, dy {}: isohf reads rasters whose columns run from West to "
                      "East, without rotation",
                      world.path, world.dx, rotation_y, rotation_x, world.dy));
    }
    return world;
  }
  return std::nullopt;
}

std::string prj_beside(const std::string& raster_path) {
  for (const std::string& extension : spellings({".prj"})) {
    if (auto text = text_of(std::filesystem::path(raster_path).replace_extension(extension))) {
      while (!text->empty() && std::isspace(static_cast<unsigned char>(text->back())) != 0) text->pop_back();
      return *text;
    }
  }
  return {};
}

std::string file_beside(const std::string& beside, const std::string& name) {
  const std::filesystem::path folder = std::filesystem::path(beside).parent_path();
  if (is_file(folder / name)) return (folder / name).string();
  std::string found;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder.empty() ? "." : folder, ignored)) {
    const std::string candidate = entry.path().filename().string();
    if (lower_case(candidate) == lower_case(name) && (found.empty() || candidate < found)) found = candidate;
  }
  return found.empty() ? found : (folder / found).string();
}

namespace {

/// GDAL's file beside a raster.
class AuxiliaryFile {
 public:
  explicit AuxiliaryFile(const std::string& raster_path) : path_(raster_path + ".aux.xml") {
    if (!is_file(path_)) return;
    // Histograms and attribute tables have some megabytes.
    constexpr std::uintmax_t kLongestXml = std::uintmax_t{64} << 20U;
    if (std::filesystem::file_size(path_) > kLongestXml) refuse("has more than 64 MiB");
    const pugi::xml_parse_result result = document_.load_file(path_.c_str());
    if (!result) refuse(fmt::format("byte {}: {}", result.offset, result.description()));
    root_ = document_.child("PAMDataset");
  }

  [[nodiscard]] std::string band_name(std::size_t band) const {
    return trimmed(band_node(static_cast<int>(band)).child_value("Description"));
  }

  void place(SourceInfo& info) const {
    Georeference& place = info.georeference;
    if (const std::string transform = root_.child_value("GeoTransform"); !place.has_origin && !transform.empty()) {
      place_by_transform(path_, transform, place);
    }
    if (const std::string system = root_.child_value("SRS");
        place.unit == HorizontalUnit::kUnknown && !has_reference_system(place) && !system.empty()) {
      read_system_text(system, path_, info);  // GDAL takes a code as well
    }
    if (place.registration != Registration::kUnknown) return;
    for (const pugi::xml_node metadata : root_.children("Metadata")) {
      if (metadata.attribute("domain")) continue;  // those of a domain are other things
      const std::string kind = metadata.find_child_by_attribute("MDI", "key", "AREA_OR_POINT").text().get();
      if (kind == "Area") place.registration = Registration::kArea;
      if (kind == "Point") place.registration = Registration::kPoint;
    }
  }

  /// What a band's samples are and mean. What the raster says otherwise itself stays, with a note.
  void describe(SourceInfo& info, int band) const {
    const pugi::xml_node node = band_node(band);
    const auto of_band = [&](const char* element) { return std::string(node.child_value(element)); };
    const pugi::xml_node structure = node.find_child_by_attribute("Metadata", "domain", "IMAGE_STRUCTURE");
    const std::string type = structure.find_child_by_attribute("MDI", "key", "PIXELTYPE").text().get();
    if (info.sample_type == SampleType::kUint8 && type == "SIGNEDBYTE") {
      info.sample_type = SampleType::kInt8;
      for (double& value : info.void_values) value -= value > 127.0 ? 256.0 : 0.0;
    }
    SourceInfo said;
    said.sample_type = info.sample_type;
    read_gdal_nodata(of_band("NoDataValue"), said);
    const auto item = [&](const char* role, const char* element) {
      if (const std::string value = trimmed(of_band(element)); !value.empty()) read_gdal_item(role, value, said);
    };
    item("unittype", "UnitType");
    item("scale", "Scale");
    item("offset", "Offset");
    info.warnings.insert(info.warnings.end(), said.warnings.begin(), said.warnings.end());
    const auto note = [&](const std::string& theirs, const std::string& ours) {
      info.warnings.push_back(fmt::format("{} gives {}; followed is the raster itself, which gives {}",
                                          std::filesystem::path(path_).filename().string(), theirs, ours));
    };
    if (info.void_values.empty()) {
      info.void_values = said.void_values;
    } else if (!said.void_values.empty() && !std::isnan(said.void_values.front()) &&
               std::ranges::find_first_of(info.void_values, said.void_values) == info.void_values.end()) {
      note(fmt::format("the void value {}", said.void_values.front()),
           fmt::format("{} (`void_values` {} takes the other)", info.void_values.front(), said.void_values.front()));
    }
    const auto scale_of = [](const SourceInfo& of) { return fmt::format("sample * {} + {}", of.z_scale, of.z_offset); };
    const auto is_scaled = [](const SourceInfo& of) { return of.z_scale != 1.0 || of.z_offset != 0.0; };
    if (!is_scaled(info)) {
      info.z_scale = said.z_scale;
      info.z_offset = said.z_offset;
    } else if (is_scaled(said) && scale_of(said) != scale_of(info)) {
      note("elevations as " + scale_of(said), scale_of(info));
    }
    if (info.vertical_unit.empty()) {
      info.vertical_unit = said.vertical_unit;
      info.metres_per_vertical_unit = said.metres_per_vertical_unit;
    } else if (!said.vertical_unit.empty() && said.vertical_unit != info.vertical_unit) {
      note("the unit " + printable(said.vertical_unit), info.vertical_unit);
    }
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: {}; remove the file or have GDAL write it anew", path_, what));
  }
  [[nodiscard]] pugi::xml_node band_node(int band) const {
    return root_.find_child_by_attribute("PAMRasterBand", "band", std::to_string(band).c_str());
  }

  std::string path_;
  pugi::xml_document document_;
  pugi::xml_node root_;  ///< empty where there is no file
};

/// Whether the .prj beside says where the raster lies.
bool take_prj(SourceInfo& info) {
  const std::string text = prj_beside(info.path);
  if (text.empty()) return false;
  try {
    take_system(text, info);
    return true;
  } catch (const Error& error) {
    if (error.code() == ErrorCode::kUnsupported) throw error.within(info.path);
  }
  info.warnings.push_back(loss(
      "the .prj beside the file is of no reference system that PROJ understands; it is ignored (`reference_system` "
      "EPSG:n names it)"));
  return false;
}

void suspect_degrees(SourceInfo& info) {
  const Georeference& place = info.georeference;
  if (place.unit == HorizontalUnit::kUnknown && place.has_origin && place.spacing_x < kFinestAsMetres &&
      place.spacing_y < kFinestAsMetres && std::abs(place.origin_x) <= 360.0 && std::abs(place.origin_y) <= 90.0) {
    info.warnings.emplace_back(
        "the coordinates look like degrees, but no .prj beside the file says so; with one, or with `reference_system` "
        "EPSG:4326, distances would be in metres");
  }
}

}  // namespace

void name_bands_beside(const std::string& raster_path, std::size_t bands, std::vector<std::string>& names) {
  const AuxiliaryFile file(raster_path);
  names.resize(std::max(bands, names.size()));
  for (std::size_t i = 0; i < bands; ++i) {
    if (names[i].empty()) names[i] = file.band_name(i + 1);
  }
}

void place_by(const WorldFile& world, std::int64_t rows, Georeference& place) {
  place.spacing_x = world.dx;
  place.spacing_y = std::abs(world.dy);
  place.has_origin = true;
  place.origin_x = world.x0;
  place.origin_y = world.y0 + (world.rows_from_south() ? static_cast<double>(rows - 1) * world.dy : 0.0);
}

bool has_reference_system(const Georeference& place) {
  return place.unit == HorizontalUnit::kDegree || place.system.epsg || !place.system.wkt.empty();
}

bool read_sidecars(SourceInfo& info, int band, bool may_turn) {
  const AuxiliaryFile file(info.path);
  file.place(info);
  if (band > 0) file.describe(info, band);
  Georeference& place = info.georeference;
  bool rows_from_south = false;
  if (const auto world = place.has_origin ? std::nullopt : world_file_beside(info.path)) {
    rows_from_south = world->rows_from_south();
    if (rows_from_south && !may_turn) {
      throw Error(ErrorCode::kUnsupported, world->path + ": dy is positive; rows must run from North to South");
    }
    place_by(*world, info.height, place);
  }
  // Without a place there is nothing that a system could be of.
  if (place.has_origin && !has_reference_system(place) && !take_prj(info)) suspect_degrees(info);
  return rows_from_south;
}

}  // namespace isohf
