#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>
#include <pugixml.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "formats/georeference/sidecars.h"
#include "formats/grids/described_source.h"
#include "formats/io/bands.h"
#include "formats/io/raw_file.h"
#include "formats/io/text_tokens.h"
#include "formats/planetary/planetary_system.h"
#include "formats/readers.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/projection/length_unit.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

constexpr std::string_view kProduct = "Product_Observational";
constexpr std::size_t kLongestProlog = 65536;

/// Without the prefix of its name space, which a label chooses.
std::string_view local_name(const pugi::xml_node& node) {
  const std::string_view name = node.name();
  return name.substr(name.find(':') + 1);  // npos + 1 is 0
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
  const std::string text = trimmed(inner(of, name).text().get());
  return read_decimal(text, value) && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

/// The same in metres, which are meant where no unit stands there; "km/pixel" counts as km, degrees as nothing.
std::optional<double> metres_in(const pugi::xml_node& of, std::string_view name) {
  const std::optional<double> value = number_in(of, name);
  const std::string unit = inner(of, name).attribute("unit").as_string("m");
  const std::optional<LinearUnit> length = linear_unit(unit.substr(0, unit.find('/')));
  return value && length ? std::optional(*value * length->metres) : std::nullopt;
}

struct ElementType {
  std::string_view name;  ///< without its byte order
  SampleType type;
  StoredAs stored_as = StoredAs::kItself;
};

// PDS4 Data Dictionary, data_type of an Element_Array, less complex numbers.
constexpr std::array<ElementType, 10> kTypes = {{{"UnsignedByte", SampleType::kUint8},
                                                 {"SignedByte", SampleType::kInt8},
                                                 {"Unsigned2", SampleType::kUint16},
                                                 {"Signed2", SampleType::kInt16},
                                                 {"Unsigned4", SampleType::kUint32},
                                                 {"Signed4", SampleType::kInt32},
                                                 {"Unsigned8", SampleType::kFloat64, StoredAs::kUint64},
                                                 {"Signed8", SampleType::kFloat64, StoredAs::kInt64},
                                                 {"IEEE754Single", SampleType::kFloat32},
                                                 {"IEEE754Double", SampleType::kFloat64}}};

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
      : DescribedSource(label.data, "PDS4", label.path), array_(label.array) {
    if (label.arrays > 1) info_.warnings.push_back(fmt::format("there are {} arrays; the first is read", label.arrays));
    read_elements(child(array_, "Element_Array"));
    read_axes(options);
    const pugi::xml_node direction = inner(label.product, "Display_Direction");
    if (text_in(direction, "horizontal_display_direction") == "Right to Left")
      refuse(ErrorCode::kUnsupported, "its samples run from right to left (gdal_translate turns them)");
    layout_.from_south = text_in(direction, "vertical_display_direction") == "Bottom to Top";
    for (const pugi::xml_node& node : child(array_, "Special_Constants").children()) {
      const auto value = constant(trimmed(node.text().get()));
      if (!value) continue;
      const std::string_view name = local_name(node);
      name == "valid_minimum"   ? void(info_.valid_min = *value)
      : name == "valid_maximum" ? void(info_.valid_max = *value)
                                : set_void(*value);
    }
    const pugi::xml_node target = inner(label.product, "Target_Identification");
    read_place(inner(label.product, "Cartography"), printable(text_in(target, "name")));
    finish(options, 0);
  }

 private:
  /// What stands there is a number, or nothing stands there.
  [[nodiscard]] double number_or(const pugi::xml_node& of, const char* name, double otherwise) const {
    const std::string text = text_in(of, name);
    return text.empty() ? otherwise : number(text, name);
  }

  void read_elements(const pugi::xml_node& elements) {
    const std::string given = text_in(elements, "data_type");
    std::string name = given;
    layout_.big_endian = name.find("MSB") != std::string::npos;
    for (const std::string_view order : {"MSB", "LSB"}) {
      if (const std::size_t at = name.find(order); at != std::string::npos) name.erase(at, order.size());
    }
    const auto* const type = std::ranges::find(kTypes, name, &ElementType::name);
    if (type == kTypes.end())
      refuse(ErrorCode::kUnsupported, fmt::format("data_type is \"{}\", which isohf does not read", printable(given)));
    info_.sample_type = type->type;
    layout_.stored_as = type->stored_as;
    set_scale(number_or(elements, "scaling_factor", 1.0), number_or(elements, "value_offset", 0.0), "scaling_factor");
    if (const std::string unit = text_in(elements, "unit"); !unit.empty()) set_unit(unit);
  }

  /// Axes in their order, the last of which runs fastest.
  void read_axes(const OpenOptions& options) {
    struct Axis {
      std::string name;
      double elements = 0.0;
      double sequence = 0.0;
      double step = 0.0;  ///< bytes from one element to the next
    };
    if (const std::string order = text_in(array_, "axis_index_order"); !order.empty() && order != "Last Index Fastest")
      refuse(ErrorCode::kUnsupported,
             fmt::format("axis_index_order is \"{}\", must be \"Last Index Fastest\"", printable(order)));
    std::vector<Axis> axes;
    for (const pugi::xml_node& node : array_.children()) {
      if (local_name(node) != "Axis_Array" || axes.size() > 3) continue;
      axes.push_back({lower_case(text_in(node, "axis_name")), number(text_in(node, "elements"), "elements"),
                      number(text_in(node, "sequence_number"), "sequence_number")});
    }
    if (axes.size() != 2 && axes.size() != 3)
      refuse(ErrorCode::kUnsupported, fmt::format("its array has {} axes, must have 2 or 3", axes.size()));
    std::ranges::stable_sort(axes, {}, &Axis::sequence);
    double step = static_cast<double>(size_bytes(info_.sample_type));
    for (std::size_t i = axes.size(); i-- > 0;) {
      axes[i].step = step;
      step *= axes[i].elements;
    }
    if (!(step < 0x1p60)) refuse(ErrorCode::kCorrupt, "says more samples than are in any file");
    auto line = std::ranges::find(axes, "line", &Axis::name);
    auto sample = std::ranges::find(axes, "sample", &Axis::name);
    if (axes.size() == 2 && (line == axes.end() || sample == axes.end())) {
      line = axes.begin();
      sample = axes.begin() + 1;
    }
    if (line == axes.end() || sample == axes.end())
      refuse(ErrorCode::kUnsupported, "its array of 3 axes has none called Line or Sample");
    const auto band =
        std::ranges::find_if(axes, [&](const Axis& axis) { return &axis != &*line && &axis != &*sample; });
    const bool has_bands = band != axes.end();
    set_size(sample->elements, line->elements);
    const std::int64_t bands = has_bands ? count(band->elements, "the number of bands") : 1;
    layout_.row_bytes = static_cast<std::uint64_t>(line->step);
    layout_.column_bytes = static_cast<std::uint64_t>(sample->step);
    layout_.offset_bytes = static_cast<std::uint64_t>(count(number_or(array_, "offset", 0.0), "offset", 0.0)) +
                           static_cast<std::uint64_t>(choose_band(info_, options, bands)) *
                               static_cast<std::uint64_t>(has_bands ? band->step : 0.0);
  }

  /// The discipline area Cartography (PDS4 Cartography Discipline LDD), as far as it is a map.
  void read_place(const pugi::xml_node& cartography, const std::string& target) {
    const pugi::xml_node system = inner(cartography, "Horizontal_Coordinate_System_Definition");
    const pugi::xml_node projection = inner(system, "Map_Projection");
    const pugi::xml_node degrees = inner(system, "Geographic");
    if (!projection && !degrees) return;
    const auto first = [&](std::initializer_list<const char*> names, double otherwise) {
      for (const char* name : names) {
        if (const auto value = number_in(projection, name)) return *value;
      }
      return otherwise;
    };
    const pugi::xml_node model = child(system, "Geodetic_Model");
    const auto radius = [&](const char* name, const char* old_name) {
      const auto found = metres_in(model, name);
      return found ? found : metres_in(model, old_name);
    };
    const double east = text_in(model, "longitude_direction") == "Positive West" ? -1.0 : 1.0;
    PlanetaryMap map;
    map.projection = printable(text_in(projection, "map_projection_name"));
    if (projection && map.projection.empty()) map.projection = "unknown projection";
    map.target = target;
    map.name = projection ? map.projection + ' ' + target : target;
    map.equatorial_radius_m = radius("a_axis_radius", "semi_major_radius");
    map.polar_radius_m = radius("c_axis_radius", "polar_radius");
    map.planetographic = text_in(model, "latitude_type") == "Planetographic";
    map.longitude = east * first({"longitude_of_central_meridian", "straight_vertical_longitude_from_pole"}, 0.0);
    map.parallel_1 = first({"standard_parallel_1"}, 0.0);
    map.parallel_2 = first({"standard_parallel_2"}, 0.0);
    map.scale = first({"scale_factor_at_projection_origin", "scale_factor_at_central_meridian"}, 1.0);
    map.latitude = map.projection == "Equirectangular" ? map.parallel_1 : first({"latitude_of_projection_origin"}, 0.0);
    map.pole = {east * first({"oblique_proj_pole_longitude"}, 0.0), first({"oblique_proj_pole_latitude"}, 90.0)};
    map.pole_rotation = first({"oblique_proj_pole_rotation"}, 0.0);
    take_planetary_map(map, info_);
    if (projection) {
      const pugi::xml_node corner = inner(system, "Geo_Transformation");
      const auto dx = metres_in(system, "pixel_resolution_x");
      const auto dy = metres_in(system, "pixel_resolution_y");
      const auto x = metres_in(corner, "upperleft_corner_x");
      const auto y = metres_in(corner, "upperleft_corner_y");
      if (number_in(system, "map_projection_rotation").value_or(0.0) != 0.0) return lose_place("the map is rotated");
      if (!dx || !dy || !x || !y)
        return lose_place("the label gives no pixel_resolution or upperleft_corner in metres");
      return place_by_corner(*x, *y, *dx, *dy);
    }
    const auto west = number_in(cartography, "west_bounding_coordinate");
    const auto north = number_in(cartography, "north_bounding_coordinate");
    const auto dx = number_in(degrees, "longitude_resolution");
    const auto dy = number_in(degrees, "latitude_resolution");
    if (!west || !north || !dx || !dy || east < 0.0)
      return lose_place("the label gives no bounds and resolution in degrees East");
    place_by_corner(*west, *north, *dx, *dy);
  }

  pugi::xml_node array_;
};

bool is_label(const std::string& path) {
  if (!is_file(path)) return false;
  const RawFile file(path);
  // Asked of every file that has no signature: what is no XML shows so at once.
  constexpr std::uint64_t kDeclarationEnds = 12;
  return first_bytes(file, kDeclarationEnds).find("<?xml") != std::string::npos &&
         first_bytes(file, kLongestProlog).find(kProduct) != std::string::npos;
}

/// NAME.xml of NAME.img; empty where there is none.
std::string label_of(const std::string& path) {
  static constexpr std::array<std::string_view, 5> kData = {".img", ".dat", ".raw", ".bin", ".cub"};
  const std::filesystem::path name(path);
  if (std::ranges::find(kData, extension_of(path)) == kData.end()) return {};
  for (const char* extension : {".xml", ".lblx"}) {
    const std::string label = file_beside(path, name.stem().string() + extension);
    if (!label.empty() && is_label(label)) return label;
  }
  return {};
}

bool looks_like_pds4(std::span<const std::byte> head) {
  return text_of(head).find(kProduct) != std::string_view::npos;
}

bool is_pds4(const std::string& path) {
  return is_label(path) || !label_of(path).empty();
}

std::unique_ptr<HeightSource> open_pds4(const std::string& path, const OpenOptions& options) {
  const std::string beside = label_of(path);
  const Label label(beside.empty() ? path : beside);
  if (!beside.empty()) require_described(path, label.path, label.data);
  return std::make_unique<Pds4Source>(label, options);
}

}  // namespace

const Format kPds4Format = {.name = "PDS4",
                            .extensions = {".lblx"},
                            .note = "takes `channel`",
                            .open = open_pds4,
                            .recognises = looks_like_pds4,
                            .described = is_pds4};

}  // namespace isohf
