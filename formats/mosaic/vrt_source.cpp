/// GDAL's virtual rasters as gdalbuildvrt writes them: lists of files for a mosaic.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <pugixml.hpp>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "formats/georeference/sidecars.h"
#include "formats/geotiff/gdal_tags.h"
#include "formats/io/bands.h"
#include "formats/io/packed_files.h"
#include "formats/io/raw_file.h"
#include "formats/io/text_tokens.h"
#include "formats/mosaic/mosaic_source.h"
#include "formats/open_options.h"
#include "formats/readers.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/projection/crs/crs.h"

namespace isohf {
namespace {

constexpr std::uint64_t kLongestVrt = std::uint64_t{256} << 20U;
constexpr double kMostSide = 1e9;
/// Of a sample: positions in a VRT are written in decimals.
constexpr double kOnTheGrid = 1e-3;

class VrtReader {
 public:
  VrtReader(const std::string& path, const OpenOptions& options) : path_(path), options_(options) {
    list_.remedy = fmt::format("gdal_translate {} OUT.tif makes a GeoTIFF of it", path);
    info_.path = path;
  }

  [[nodiscard]] std::unique_ptr<HeightSource> open() {
    const RawFile file(path_);
    if (file.size_bytes() > kLongestVrt) fail(ErrorCode::kUnsupported, "is larger than 256 MiB");
    std::string text = first_bytes(file, kLongestVrt);
    pugi::xml_document document;
    const pugi::xml_parse_result parsed = document.load_buffer_inplace(text.data(), text.size());
    if (!parsed)
      fail(ErrorCode::kCorrupt, fmt::format("is no whole XML: {} at byte {}", parsed.description(), parsed.offset));
    const pugi::xml_node root = document.child("VRTDataset");
    const pugi::xml_node band = read_list(root);
    OpenOptions inside;
    inside.buffer_bytes = options_.buffer_bytes;
    try {
      choose_channel(inside);
      MosaicPlan plan = plan_mosaic(list_, inside);
      for (const double value : nodata_of_sources_) {
        if (is_mixed() && options_.void_values.empty() && !holds(plan.info.void_values_of_files, value))
          refuse(fmt::format("has a NODATA of {} for files that do not state it", value));
      }
      const auto is_scaled_alike = [&](const SampleKind& kind) {
        return kind.z_scale == plan.kinds[0].z_scale && kind.z_offset == plan.kinds[0].z_offset;
      };
      if (has_scale(band) && !std::ranges::all_of(plan.kinds, is_scaled_alike))
        refuse("states one scale for files of several");
      describe(root, band, plan.info);
      return std::make_unique<MosaicSource>(path_, std::move(plan), inside, OverlapRule::kLast);
    } catch (const Error& error) {
      throw std::string_view(error.what()).starts_with(path_ + ": ") ? error : error.within(path_);
    }
  }

 private:
  [[noreturn]] void fail(ErrorCode code, const std::string& what) const { throw Error(code, path_ + ": " + what); }
  [[noreturn]] void refuse(const std::string& what) const {
    fail(ErrorCode::kUnsupported, fmt::format("{}; {}", what, list_.remedy));
  }

  [[nodiscard]] double number(const char* name, std::string_view text) const {
    double value = 0.0;
    if (!read_decimal(trimmed(text), value))
      fail(ErrorCode::kCorrupt, fmt::format("{} is \"{}\", must be a number", name, printable(text)));
    return value;
  }

  [[nodiscard]] std::int64_t whole(const pugi::xml_node& node, const char* attribute, double otherwise) const {
    const pugi::xml_attribute found = node.attribute(attribute);
    const double value = found ? number(attribute, found.value()) : otherwise;
    if (!(value > -kOnTheGrid && value <= kMostSide))
      fail(ErrorCode::kCorrupt,
           fmt::format("{} of {} is {}, must be 0 to {}", attribute, node.name(), value, kMostSide));
    const double nearest = std::round(value);
    if (std::abs(value - nearest) > kOnTheGrid)
      refuse(fmt::format("resamples: {} of {} is {}, between samples", attribute, node.name(), value));
    return static_cast<std::int64_t>(nearest);
  }

  /// Fills list_; returns the band that is read.
  pugi::xml_node read_list(const pugi::xml_node& root) {
    if (!root) fail(ErrorCode::kCorrupt, "has no VRTDataset");
    if (const std::string kind = root.attribute("subClass").value(); !kind.empty()) refuse("is a " + printable(kind));
    list_.width = whole(root, "rasterXSize", 0.0);
    list_.height = whole(root, "rasterYSize", 0.0);
    if (list_.width < 1 || list_.height < 1) fail(ErrorCode::kCorrupt, "has a rasterXSize or rasterYSize of 0");
    if (const auto node = root.child("GeoTransform")) place_by_transform(path_, node.text().get(), list_.place);
    std::vector<pugi::xml_node> bands;
    std::vector<std::string> names;
    for (const pugi::xml_node& band : root.children("VRTRasterBand")) {
      bands.push_back(band);
      names.push_back(trimmed(band.child("Description").text().get()));
    }
    if (bands.empty()) fail(ErrorCode::kCorrupt, "has no VRTRasterBand");
    const auto chosen = choose_band(info_, options_, static_cast<std::int64_t>(bands.size()), names);
    const pugi::xml_node band = bands[static_cast<std::size_t>(chosen)];
    const std::string kind = band.attribute("subClass").value();
    if (!kind.empty() && kind != "VRTSourcedRasterBand") refuse("has a " + printable(kind));
    for (const pugi::xml_node& node : band.children()) {
      if (std::string_view(node.name()).ends_with("Source")) read_source(band, node);
    }
    if (list_.rasters.empty()) refuse("has no sources");
    if (const auto nodata = band.child("NoDataValue")) nodata_ = number("NoDataValue", nodata.text().get());
    return band;
  }

  void read_source(const pugi::xml_node& band, const pugi::xml_node& node) {
    const std::string_view kind = node.name();
    if (kind != "SimpleSource" && kind != "ComplexSource") refuse(fmt::format("has a {}", printable(kind)));
    for (const char* calculated :
         {"LUT", "Exponent", "ColorTableComponent", "OpenOptions", "ScaleOffset", "ScaleRatio", "UseMaskBand"}) {
      if (node.child(calculated)) refuse(fmt::format("has a {} with {}", kind, calculated));
    }
    ListedRaster raster;
    raster.path = path_of(node.child("SourceFilename"));
    if (is_vrt(raster.path)) refuse(raster.path + " is a virtual raster itself");
    const double number_of_band = number("SourceBand", node.child("SourceBand").text().as_string("1"));
    if (!(number_of_band >= 1.0 && number_of_band < 65536.0)) refuse(fmt::format("takes the band {}", number_of_band));
    if (!list_.rasters.empty() && number_of_band != band_) refuse("takes different bands of its files");
    band_ = number_of_band;
    const pugi::xml_node from = node.child("SrcRect");
    const pugi::xml_node to = node.child("DstRect");
    raster.window = {whole(to, "xOff", 0.0), whole(to, "yOff", 0.0),
                     whole(to, "xSize", static_cast<double>(list_.width)),
                     whole(to, "ySize", static_cast<double>(list_.height))};
    const Window& at = raster.window;
    if (whole(from, "xOff", 0.0) != 0 || whole(from, "yOff", 0.0) != 0) refuse("takes a part of " + raster.path);
    if (whole(from, "xSize", static_cast<double>(at.columns)) != at.columns ||
        whole(from, "ySize", static_cast<double>(at.rows)) != at.rows) {
      refuse("resamples " + raster.path);
    }
    if (at.column + at.columns > list_.width || at.row + at.rows > list_.height) refuse("cuts off " + raster.path);
    const std::string type = node.child("SourceProperties").attribute("DataType").value();
    const std::string own_type = band.attribute("dataType").as_string("Byte");
    if (!type.empty() && type != own_type) {
      refuse(fmt::format("has samples of {}, those of {} are {}", printable(own_type), raster.path, printable(type)));
    }
    const double nodata =
        kind == "ComplexSource" && node.child("NODATA") ? number("NODATA", node.child("NODATA").text().get()) : NAN;
    if (std::isfinite(nodata)) nodata_of_sources_.insert(nodata);
    list_.rasters.push_back(std::move(raster));
  }

  /// GDAL's relative names begin at the VRT's folder if it says so, else at the current one, and here at either.
  [[nodiscard]] std::string path_of(const pugi::xml_node& node) const {
    const std::string name = node.text().get();
    if (name.empty()) fail(ErrorCode::kCorrupt, "has a source without SourceFilename");
    if (name != one_line(name)) fail(ErrorCode::kCorrupt, "names a file with control characters: " + printable(name));
    const std::string path = without_vsi(name);
    if (path.starts_with("/vsi")) refuse("names a file that is not on a disk, " + printable(path));
    const std::filesystem::path from_folder = std::filesystem::path(path_).parent_path() / path;
    std::error_code none;
    const bool is_here =
        !node.attribute("relativeToVRT").as_bool() && (std::filesystem::exists(path, none) || member_path(path));
    return is_here ? path : from_folder.string();
  }

  static bool is_vrt(const std::string& path) {
    if (!is_file(path)) return path.ends_with(".vrt");
    const std::string head = first_bytes(RawFile(path), 512);
    return kVrtFormat.recognises(std::as_bytes(std::span(head)));
  }

  /// The channel and the nodata of the files, by what the first of them has.
  void choose_channel(OpenOptions& inside) const {
    if (band_ > 1.0) inside.channel = fmt::format("{:.0f}", band_ - 1.0);
    const std::unique_ptr<HeightSource> first = open_raster(list_.rasters.front().path, inside);
    const SourceInfo& info = first->info();
    // A band called elevations was chosen, if there is one, and the VRT means the first; some formats have no order.
    const bool has_order = info.format != "OpenEXR" && !info.format.starts_with("netCDF");
    if (!info.channel.empty() && has_order) inside.channel = fmt::format("{:.0f}", band_ - 1.0);
    inside.void_values = options_.void_values;
    if (!inside.void_values.empty() || is_mixed()) return;
    std::vector<double> stated(nodata_of_sources_.begin(), nodata_of_sources_.end());
    if (nodata_) stated.push_back(*nodata_);
    std::vector<double> all = info.void_values;
    for (const double value : stated) {
      const auto stored = std::isfinite(value) ? void_value_as_stored(info.sample_type, value) : std::nullopt;
      if (stored && !holds(all, value)) all.push_back(*stored);
    }
    if (all.size() > info.void_values.size()) inside.void_values = all;
  }

  /// Whether one of the numbers is `value`, which may be written in 15 digits.
  static bool holds(const std::vector<double>& numbers, double value) {
    return std::ranges::any_of(numbers,
                               [&](double other) { return std::abs(value - other) <= 1e-14 * std::abs(value); });
  }
  /// The files have several nodata values: each must state its own.
  [[nodiscard]] bool is_mixed() const { return nodata_of_sources_.size() > 1; }

  static bool has_scale(const pugi::xml_node& band) { return band.child("Scale") || band.child("Offset"); }

  /// What the VRT itself says of the whole.
  void describe(const pugi::xml_node& root, const pugi::xml_node& band, SourceInfo& info) const {
    info.format = "VRT";
    info.channel = info_.channel;
    info.warnings.insert(info.warnings.begin(), info_.warnings.begin(), info_.warnings.end());
    Georeference& place = info.georeference;
    if (!list_.place.has_origin) place = {};
    if (const std::string system = trimmed(root.child("SRS").text().get()); !system.empty()) {
      SourceInfo own;
      read_system_text(system, path_, own);
      if (system_text(place.system).empty() || are_same(place.system, own.georeference.system) == false) {
        const ReferenceSystem of_files = std::exchange(place.system, {});
        read_system_text(system, path_, info);
        if (place.system.vertical_datum.empty()) {
          place.system.vertical_datum = of_files.vertical_datum;
          place.system.vertical_epsg = of_files.vertical_epsg;
        }
      }
    }
    for (const pugi::xml_node& metadata : root.children("Metadata")) {
      const auto item = metadata.find_child_by_attribute("MDI", "key", "AREA_OR_POINT");
      if (place.has_origin && std::string_view(item.text().get()) == "Point") place.registration = Registration::kPoint;
    }
    if (has_scale(band)) {
      info.z_scale = 1.0;
      info.z_offset = 0.0;
    }
    for (const auto& [role, element] : {std::pair{"unittype", "UnitType"}, {"scale", "Scale"}, {"offset", "Offset"}}) {
      if (const auto node = band.child(element)) read_gdal_item(role, trimmed(node.text().get()), info);
    }
    OpenOptions rest = options_;
    rest.void_values.clear();  // the files have taken them
    apply_open_options(info, rest);
  }

  std::string path_;
  const OpenOptions& options_;
  SourceInfo info_;  ///< of the choice of a band
  ListedMosaic list_;
  double band_ = 1.0;
  std::optional<double> nodata_;
  std::set<double> nodata_of_sources_;
};

bool looks_like_vrt(std::span<const std::byte> head) {
  return text_of(head).find("<VRTDataset") != std::string_view::npos;
}

std::unique_ptr<HeightSource> open_vrt(const std::string& path, const OpenOptions& options) {
  return VrtReader(path, options).open();
}

}  // namespace

const Format kVrtFormat = {.name = "GDAL virtual raster",
                           .extensions = {".vrt"},
                           .note = "takes `channel`",
                           .open = open_vrt,
                           .recognises = looks_like_vrt};

}  // namespace isohf
