#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <optional>
#include <pugixml.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/georeference/files_beside.h"
#include "formats/georeference/map_wkt.h"
#include "formats/grids/described_source.h"
#include "formats/io/bands.h"
#include "formats/io/text.h"
#include "formats/io/text_tokens.h"
#include "formats/readers.h"
#include "isohf/error.h"
#include "isohf/projection/body.h"
#include "isohf/projection/crs.h"
#include "isohf/projection/length_unit.h"
#include "isohf/projection/reference_map.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

constexpr std::string_view kProduct = "Product_Observational";
constexpr std::size_t kLongestProlog = 65536;

/// Without the prefix of its name space, which a label chooses.
std::string_view local_name(const pugi::xml_node& node) {
  const std::string_view name = node.name();
  const std::size_t colon = name.find(':');
  return colon == std::string_view::npos ? name : name.substr(colon + 1);
}

pugi::xml_node child(const pugi::xml_node& of, std::string_view name) {
  return of.find_child([&](const pugi::xml_node& node) { return local_name(node) == name; });
}

/// At any depth.
pugi::xml_node inner(const pugi::xml_node& of, std::string_view name) {
  return of.find_node([&](const pugi::xml_node& node) { return local_name(node) == name; });
}

std::string text_in(const pugi::xml_node& of, std::string_view name) {
  return trimmed(child(of, name).text().get());
}

/// A number at any depth; nullopt where it is not there or is none (xsi:nil).
std::optional<double> number_in(const pugi::xml_node& of, std::string_view name) {
  double value = 0.0;
  const pugi::xml_node node = inner(of, name);
  return node && read_decimal(trimmed(node.text().get()), value) && std::isfinite(value) ? std::optional(value)
                                                                                         : std::nullopt;
}

/// The same in metres, which are meant where no unit stands there; "km/pixel" counts as km, degrees as nothing.
std::optional<double> metres_in(const pugi::xml_node& of, std::string_view name) {
  const std::optional<double> value = number_in(of, name);
  const std::string unit = inner(of, name).attribute("unit").as_string("m");
  const std::optional<LinearUnit> length = linear_unit(unit.substr(0, unit.find('/')));
  return value && length ? std::optional(*value * length->metres) : std::nullopt;
}

struct ElementType {
  std::string_view name;
  SampleType type;
  bool big_endian;
  StoredAs stored_as = StoredAs::kItself;
};

// PDS4 Data Dictionary, data_type of an Element_Array, less complex numbers.
constexpr std::array<ElementType, 18> kTypes = {{{"UnsignedByte", SampleType::kUint8, false},
                                                 {"SignedByte", SampleType::kInt8, false},
                                                 {"UnsignedLSB2", SampleType::kUint16, false},
                                                 {"UnsignedMSB2", SampleType::kUint16, true},
                                                 {"SignedLSB2", SampleType::kInt16, false},
                                                 {"SignedMSB2", SampleType::kInt16, true},
                                                 {"UnsignedLSB4", SampleType::kUint32, false},
                                                 {"UnsignedMSB4", SampleType::kUint32, true},
                                                 {"SignedLSB4", SampleType::kInt32, false},
                                                 {"SignedMSB4", SampleType::kInt32, true},
                                                 {"UnsignedLSB8", SampleType::kFloat64, false, StoredAs::kUint64},
                                                 {"UnsignedMSB8", SampleType::kFloat64, true, StoredAs::kUint64},
                                                 {"SignedLSB8", SampleType::kFloat64, false, StoredAs::kInt64},
                                                 {"SignedMSB8", SampleType::kFloat64, true, StoredAs::kInt64},
                                                 {"IEEE754LSBSingle", SampleType::kFloat32, false},
                                                 {"IEEE754MSBSingle", SampleType::kFloat32, true},
                                                 {"IEEE754LSBDouble", SampleType::kFloat64, false},
                                                 {"IEEE754MSBDouble", SampleType::kFloat64, true}}};

/// The label of a product: its document, and the array that is a raster.
struct Label {
  std::string path;
  std::string text;
  pugi::xml_document document;
  pugi::xml_node product;
  pugi::xml_node array;
  std::string data;  ///< the file that has its samples
  std::size_t arrays = 0;

  explicit Label(const std::string& label) : path(label), text(read_header_text(label)) {
    const pugi::xml_parse_result parsed = document.load_buffer_inplace(text.data(), text.size());
    if (!parsed) {
      refuse(ErrorCode::kCorrupt, fmt::format("is no whole XML: {} at byte {}", parsed.description(), parsed.offset));
    }
    product = child(document, kProduct);
    for (const pugi::xml_node& area : product.children()) {
      for (const pugi::xml_node& each : area.children()) {
        if (local_name(area) != "File_Area_Observational" || !local_name(each).starts_with("Array_")) continue;
        if (arrays++ == 0) array = each;
      }
    }
    if (!array) refuse(ErrorCode::kUnsupported, "describes no array (a PDS4 product of tables, or of other things)");
    const std::string name = text_in(child(array.parent(), "File"), "file_name");
    if (name.empty() || name.find('/') != std::string::npos) {
      refuse(ErrorCode::kCorrupt, fmt::format("file_name is \"{}\", must be a file beside the label", printable(name)));
    }
    data = file_beside(path, name);
    if (data.empty()) refuse(ErrorCode::kIo, fmt::format("its samples, {}, are not beside it", printable(name)));
  }

  [[noreturn]] void refuse(ErrorCode code, const std::string& what) const { throw Error(code, path + ": " + what); }
};

class Pds4Source final : public DescribedSource {
 public:
  Pds4Source(const Label& label, const OpenOptions& options)
      : DescribedSource(label.data, "PDS4", label.path, options), array_(label.array) {
    if (label.arrays > 1) info_.warnings.push_back(fmt::format("there are {} arrays; the first is read", label.arrays));
    read_elements(child(array_, "Element_Array"));
    read_axes(options);
    const pugi::xml_node direction = inner(label.product, "Display_Direction");
    if (const std::string across = text_in(direction, "horizontal_display_direction"); across == "Right to Left")
      refuse(ErrorCode::kUnsupported, "its samples run from right to left (gdal_translate turns them)");
    layout_.from_south = text_in(direction, "vertical_display_direction") == "Bottom to Top";
    read_constants(child(array_, "Special_Constants"));
    read_place(label);
    finish(options, 0);
  }

 private:
  /// What stands there is a number, or nothing stands there.
  [[nodiscard]] double number_or(const pugi::xml_node& of, std::string_view name, double otherwise) const {
    const auto value = number_in(of, name);
    const std::string text = trimmed(inner(of, name).text().get());
    if (!value && !text.empty()) {
      refuse(ErrorCode::kCorrupt, fmt::format("{} is \"{}\", must be a number", name, printable(text)));
    }
    return value.value_or(otherwise);
  }

  void read_elements(const pugi::xml_node& elements) {
    const std::string name = text_in(elements, "data_type");
    const auto* const type = std::ranges::find(kTypes, name, &ElementType::name);
    if (type == kTypes.end()) {
      refuse(ErrorCode::kUnsupported, fmt::format("data_type is \"{}\", which isohf does not read", printable(name)));
    }
    info_.sample_type = type->type;
    layout_.big_endian = type->big_endian;
    layout_.stored_as = type->stored_as;
    set_scale(number_or(elements, "scaling_factor", 1.0), number_or(elements, "value_offset", 0.0), "scaling_factor");
    const std::string unit = text_in(elements, "unit");
    if (unit.empty()) return;
    const std::optional<LinearUnit> length = linear_unit(unit);
    info_.vertical_unit = length ? length->name : printable(unit);
    info_.metres_per_vertical_unit = length ? length->metres : 1.0;
  }

  /// Axes in their order, the last of which runs fastest.
  void read_axes(const OpenOptions& options) {
    struct Axis {
      std::string name;
      double elements = 0.0;
      double sequence = 0.0;
      double step = 0.0;  ///< bytes from one element to the next
    };
    if (const std::string order = text_in(array_, "axis_index_order");
        !order.empty() && order != "Last Index Fastest") {
      refuse(ErrorCode::kUnsupported,
             fmt::format("axis_index_order is \"{}\", must be \"Last Index Fastest\"", printable(order)));
    }
    std::vector<Axis> axes;
    for (const pugi::xml_node& node : array_.children()) {
      if (local_name(node) != "Axis_Array" || axes.size() > 3) continue;
      axes.push_back({lower_case(text_in(node, "axis_name")), number(text_in(node, "elements"), "elements"),
                      number(text_in(node, "sequence_number"), "sequence_number")});
    }
    if (axes.size() != 2 && axes.size() != 3) {
      refuse(ErrorCode::kUnsupported, fmt::format("its array has {} axes, must have 2 or 3", axes.size()));
    }
    std::ranges::stable_sort(axes, {}, &Axis::sequence);
    double step = static_cast<double>(size_bytes(info_.sample_type));
    for (std::size_t i = axes.size(); i-- > 0;) {
      axes[i].step = step;
      step *= axes[i].elements;
    }
    if (!(step < 0x1p60)) refuse(ErrorCode::kCorrupt, "says more samples than are in any file");
    const auto find = [&](std::string_view name) { return std::ranges::find(axes, name, &Axis::name); };
    auto line = find("line");
    auto sample = find("sample");
    const auto band = find("band");
    if (axes.size() == 2 && (line == axes.end() || sample == axes.end())) {
      line = axes.begin();
      sample = axes.begin() + 1;
    }
    if (line == axes.end() || sample == axes.end()) {
      refuse(ErrorCode::kUnsupported, "its array of 3 axes has none called Line or Sample");
    }
    set_size(sample->elements, line->elements);
    std::int64_t bands = 1;
    double band_step = 0.0;
    if (axes.size() == 3) {
      const auto other = band != axes.end() ? band : std::ranges::find_if(axes, [&](const Axis& axis) {
        return &axis != &*line && &axis != &*sample;
      });
      bands = count(other->elements, "the number of bands");
      band_step = other->step;
    }
    layout_.row_bytes = static_cast<std::uint64_t>(line->step);
    layout_.column_bytes = static_cast<std::uint64_t>(sample->step);
    const double offset = number_or(array_, "offset", 0.0);
    layout_.offset_bytes =
        static_cast<std::uint64_t>(count(offset, "offset", 0.0)) +
        static_cast<std::uint64_t>(choose_band(info_, options, bands)) * static_cast<std::uint64_t>(band_step);
  }

  /// Whatever is no elevation, and the range of those that are.
  void read_constants(const pugi::xml_node& constants) {
    for (const pugi::xml_node& node : constants.children()) {
      const std::string_view name = local_name(node);
      const std::optional<double> value = constant(trimmed(node.text().get()));
      if (!value) continue;
      if (name == "valid_minimum") {
        info_.valid_min = *value;
      } else if (name == "valid_maximum") {
        info_.valid_max = *value;
      } else {
        set_void(*value);
      }
    }
  }

  /// A number, or the bits of a sample: 16#FF7FFFFB#, 0xFF7FFFFB.
  [[nodiscard]] std::optional<double> constant(const std::string& text) const {
    double value = 0.0;
    const bool is_based = text.starts_with("16#");
    if (!is_based && !text.starts_with("0x") && !text.starts_with("0X")) {
      return read_decimal(text, value) ? std::optional(value) : std::nullopt;
    }
    const std::uint64_t bits = std::strtoull(text.c_str() + (is_based ? 3 : 2), nullptr, 16);
    switch (info_.sample_type) {
      case SampleType::kFloat32:
        return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
      case SampleType::kFloat64:
        return layout_.stored_as == StoredAs::kItself ? std::bit_cast<double>(bits) : static_cast<double>(bits);
      case SampleType::kInt8:
        return static_cast<std::int8_t>(bits);
      case SampleType::kInt16:
        return static_cast<std::int16_t>(bits);
      case SampleType::kInt32:
        return static_cast<std::int32_t>(bits);
      default:
        return static_cast<double>(bits);
    }
  }

  /// The discipline area Cartography (PDS4 Cartography Discipline LDD), as far as it is a map.
  void read_place(const Label& label) {
    const pugi::xml_node cartography = inner(label.product, "Cartography");
    const pugi::xml_node system = inner(cartography, "Horizontal_Coordinate_System_Definition");
    if (!system) return;
    Georeference& place = info_.georeference;
    const std::string target = printable(text_in(inner(label.product, "Target_Identification"), "name"));
    const pugi::xml_node model = child(system, "Geodetic_Model");
    const auto radius = [&](const char* name, const char* old_name) {
      const auto found = metres_in(model, name);
      return found ? found : metres_in(model, old_name);
    };
    const std::optional<double> a = radius("a_axis_radius", "semi_major_radius");
    const std::optional<double> c = radius("c_axis_radius", "polar_radius");
    place.system.semi_major_axis_m = a;
    if (a) place.system.inverse_flattening = c && *c != *a ? *a / (*a - *c) : 0.0;
    place.system.body = body_of(target, a);
    if (place.system.body.empty()) place.system.body = target;
    const pugi::xml_node projection = inner(system, "Map_Projection");
    const std::string kind = printable(text_in(projection, "map_projection_name"));
    PlanetaryMap map{
        kind, target, a.value_or(0.0), c.value_or(0.0), text_in(model, "latitude_type") == "Planetographic", {}};
    const bool to_west = text_in(model, "longitude_direction") == "Positive West";
    const auto parameter = [&](std::initializer_list<const char*> names, double otherwise) {
      for (const char* name : names) {
        if (const auto value = number_in(projection, name)) return *value;
      }
      return otherwise;
    };
    MapParameters& parameters = map.parameters;
    parameters.longitude = (to_west ? -1.0 : 1.0) *
                           parameter({"longitude_of_central_meridian", "straight_vertical_longitude_from_pole"}, 0.0);
    parameters.parallel_1 = parameter({"standard_parallel_1"}, 0.0);
    parameters.parallel_2 = parameter({"standard_parallel_2"}, 0.0);
    parameters.scale = parameter({"scale_factor_at_projection_origin", "scale_factor_at_central_meridian"}, 1.0);
    parameters.latitude =
        kind == "Equirectangular" ? parameters.parallel_1 : parameter({"latitude_of_projection_origin"}, 0.0);
    const pugi::xml_node degrees = inner(system, "Geographic");
    if (projection) {
      map.pole = {(to_west ? -1.0 : 1.0) * parameter({"oblique_proj_pole_longitude"}, 0.0),
                  parameter({"oblique_proj_pole_latitude"}, 90.0)};
      map.pole_rotation = parameter({"oblique_proj_pole_rotation"}, 0.0);
      place.system.wkt = planetary_wkt(map, info_.warnings);
      place.system.name = fmt::format("{} {}", kind, target);
      place.unit = HorizontalUnit::kMetre;
      const pugi::xml_node corner = inner(system, "Geo_Transformation");
      const auto dx = metres_in(system, "pixel_resolution_x");
      const auto dy = metres_in(system, "pixel_resolution_y");
      const auto x = metres_in(corner, "upperleft_corner_x");
      const auto y = metres_in(corner, "upperleft_corner_y");
      if (const auto turn = number_in(system, "map_projection_rotation"); turn.value_or(0.0) != 0.0) {
        info_.warnings.push_back(loss("the map is rotated; its place is left out"));
      } else if (!dx || !dy || !x || !y) {
        info_.warnings.push_back(
            loss("the label gives no pixel_resolution or upperleft_corner in metres; the place is left out"));
      } else {
        place_by_corner(*x, *y, *dx, *dy);
        return compare_with_bounds(cartography, to_west);
      }
      place.unit = HorizontalUnit::kUnknown;
    } else if (degrees) {
      map.projection.clear();
      place.system.wkt = planetary_wkt(map, info_.warnings);
      place.system.name = target;
      const auto west = number_in(cartography, "west_bounding_coordinate");
      const auto north = number_in(cartography, "north_bounding_coordinate");
      const auto dx = number_in(degrees, "longitude_resolution");
      const auto dy = number_in(degrees, "latitude_resolution");
      if (!west || !north || !dx || !dy || to_west) {
        info_.warnings.push_back(
            loss("the label gives no bounds and resolution in degrees East; the place is left out"));
        return;
      }
      place.unit = HorizontalUnit::kDegree;
      place_by_corner(*west, *north, *dx, *dy);
    }
  }

  /// Warns where the label's bounds are those of other ground than its map's.
  void compare_with_bounds(const pugi::xml_node& cartography, bool to_west) {
    const auto side = [&](const char* name) { return number_in(cartography, name); };
    const auto west = side("west_bounding_coordinate");
    const auto east = side("east_bounding_coordinate");
    const auto south = side("south_bounding_coordinate");
    const auto north = side("north_bounding_coordinate");
    const Georeference& place = info_.georeference;
    if (!west || !east || !south || !north || place.system.wkt.empty()) return;
    std::optional<MapGround> found;
    bool is_cylinder = false;
    const double half_x = place.spacing_x / 2.0;
    const double half_y = place.spacing_y / 2.0;
    const MapBounds area{
        place.origin_x - half_x, place.origin_y + half_y - static_cast<double>(info_.height) * place.spacing_y,
        place.origin_x - half_x + static_cast<double>(info_.width) * place.spacing_x, place.origin_y + half_y};
    try {
      const auto map = understand_map(place.system.wkt, place.metres_per_unit);
      found = ground_under(*map, area);
      is_cylinder = turn_of(*map, area.middle()).has_value();
    } catch (const Error&) {  // without PROJ nobody can tell
    }
    if (!found) return;
    const GeoExtent& ours = found->extent;
    const GeoExtent theirs{to_west ? -*west : *west, *south, to_west ? -*east : *east, *north};
    // Labels round, count from middles of pixels, and have latitudes of normals or of the centre: on Mars 0.34 degrees.
    const auto margin = [](double length, std::int64_t pixels) {
      return std::max({0.01, 0.01 * length, 1.5 * length / static_cast<double>(pixels)});
    };
    const double inverse = place.system.inverse_flattening.value_or(0.0);
    const double tilt = inverse > 0.0 ? 180.0 / std::numbers::pi / inverse : 0.0;
    const double margin_x = margin(ours.east - ours.west, info_.width);
    const double margin_y = margin(ours.north - ours.south, info_.height) + tilt;
    const double length = std::min(theirs.east - theirs.west + (theirs.east <= theirs.west ? 360.0 : 0.0), 360.0);
    const auto apart = [](double a, double b) { return std::abs(std::remainder(a - b, 360.0)); };
    // On other maps than cylinders bounds may be those of edges, corners or a circle: the middle is what they must hold.
    const bool holds_middle = apart(found->centre.longitude, theirs.west + length / 2.0) <= length / 2.0 + margin_x &&
                              found->centre.latitude >= theirs.south - margin_y &&
                              found->centre.latitude <= theirs.north + margin_y;
    const bool is_same = apart(ours.west, theirs.west) <= margin_x && apart(ours.east, theirs.east) <= margin_x &&
                         std::abs(ours.south - theirs.south) <= margin_y &&
                         std::abs(ours.north - theirs.north) <= margin_y;
    if (is_cylinder ? is_same : holds_middle || std::abs(found->centre.latitude) > 89.0) return;
    info_.warnings.push_back(fmt::format(
        "the label's bounds, longitudes {:.6g} to {:.6g} and latitudes {:.6g} to {:.6g}, are not those of its map, "
        "{:.6g} to "
        "{:.6g} and {:.6g} to {:.6g}; the map is followed",
        theirs.west, theirs.east, theirs.south, theirs.north, ours.west, ours.east, ours.south, ours.north));
  }

  pugi::xml_node array_;
};

bool is_label(const std::string& path) {
  if (!is_file(path)) return false;
  const RawFile file(path);
  std::string text(kLongestProlog, '\0');
  text.resize(file.read_some(0, std::as_writable_bytes(std::span(text))));
  return text.find("<?xml") < 8 && text.find(kProduct) != std::string::npos;
}

/// NAME.xml of NAME.img; empty where there is none.
std::string label_of(const std::string& path) {
  static constexpr std::array<std::string_view, 5> kData = {".img", ".dat", ".raw", ".bin", ".cub"};
  const std::filesystem::path name(path);
  if (std::ranges::find(kData, lower_case(name.extension().string())) == kData.end()) return {};
  for (const char* extension : {".xml", ".lblx"}) {
    const std::string label = file_beside(path, name.stem().string() + extension);
    if (!label.empty() && is_label(label)) return label;
  }
  return {};
}

}  // namespace

bool looks_like_pds4(std::span<const std::byte> head) {
  return text_of(head).find(kProduct) != std::string_view::npos;
}

bool is_pds4(const std::string& path) {
  return is_label(path) || !label_of(path).empty();
}

std::unique_ptr<HeightSource> open_pds4(const std::string& path, const OpenOptions& options) {
  const std::string beside = label_of(path);
  const Label label(beside.empty() ? path : beside);
  std::error_code ignored;
  if (!beside.empty() && !std::filesystem::equivalent(path, label.data, ignored)) {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("{}: its label {} describes {} instead", path, label.path, label.data));
  }
  return std::make_unique<Pds4Source>(label, options);
}

}  // namespace isohf
