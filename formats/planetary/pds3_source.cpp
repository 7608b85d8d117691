#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <numbers>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "formats/georeference/sidecars.h"
#include "formats/grids/described_source.h"
#include "formats/io/bands.h"
#include "formats/io/raw_file.h"
#include "formats/planetary/label_text.h"
#include "formats/planetary/planetary_system.h"
#include "formats/readers.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/projection/body.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

constexpr std::int64_t kMostBytes = std::int64_t{1} << 31;  ///< of a record or of a line's prefix
constexpr double kDegree = std::numbers::pi / 180.0;
/// Bounds and offsets agree where they differ by less, in pixels; the meanings of the offsets differ by 1.
constexpr double kSamePlace = 0.25;

/// A product's label, and where the samples are that it describes.
struct Product {
  std::string path;
  LabelText label;
  const LabelBlock* image = nullptr;  ///< in the label
  std::string data = {};
  std::uint64_t begin_bytes = 0;  ///< where ^IMAGE points
  int line = 0;                   ///< of ^IMAGE
};

/// Whether samples are in the byte order of PCs.
bool is_little_endian(std::string_view type) {
  return type.starts_with("LSB_") || type.starts_with("PC_") || type.starts_with("VAX_");
}

/// The label describes what comes out of the JPEG 2000 file that has the samples.
[[noreturn]] void refuse_jpeg2000(const Product& product, const std::string& packed, const std::string& name) {
  const LabelBlock& image = *product.image;
  std::string remedy = fmt::format("gdal_translate {} OUT.tif converts the samples: it", packed);
  if (is_little_endian(image.word("SAMPLE_TYPE"))) {
    remedy = fmt::format("gdal_translate -of ENVI {} {} unpacks the samples for {}; any other copy", packed,
                         std::filesystem::path(product.path).replace_filename(name).string(), product.path);
  }
  throw Error(ErrorCode::kUnsupported,
              {product.path, "its samples are in JPEG 2000", "",
               fmt::format("{} needs `z_scale` {} and `z_offset` {}", remedy,
                           image.number("SCALING_FACTOR").value_or(1.0), image.number("OFFSET").value_or(0.0))});
}

/// The file of samples that ^IMAGE, which `holder` has, names.
std::string data_file(const Product& product, const LabelBlock& holder, const std::string& name) {
  const std::string data = name.find('/') == std::string::npos ? file_beside(product.path, name) : std::string();
  if (!data.empty()) return data;
  for (const LabelBlock* compressed : product.label.root.all("COMPRESSED_FILE")) {
    const std::string packed = file_beside(product.path, compressed->text("FILE_NAME").value_or("/"));
    if (!packed.empty()) refuse_jpeg2000(product, packed, name);
  }
  holder.refuse("^IMAGE", "a file beside the label");
}

/// Follows ^IMAGE: (record), <BYTES>, "file", ("file", record). The outer label's pointer goes before inner ones.
Product read_product(const std::string& path) {
  Product product{path, read_label(path)};
  const LabelBlock& root = product.label.root;
  const auto refuse = [&](const std::string& what) {
    throw Error(ErrorCode::kUnsupported, path + ": the label " + what);
  };
  const auto images = root.all("IMAGE");
  if (images.size() != 1) refuse(fmt::format("describes {} objects IMAGE, must be 1", images.size()));
  product.image = images.front();
  std::vector<const LabelBlock*> holders = {&root};
  for (const char* name : {"UNCOMPRESSED_FILE", "FILE"}) std::ranges::copy(root.all(name), std::back_inserter(holders));
  const auto found =
      std::ranges::find_if(holders, [](const LabelBlock* block) { return block->entry("^IMAGE") != nullptr; });
  if (found == holders.end()) refuse("has no ^IMAGE, which says where the samples are");
  const LabelBlock& holder = **found;
  const LabelEntry& pointer = *holder.entry("^IMAGE");
  product.line = pointer.line;
  const std::size_t values = pointer.values.size();
  if (values != 1 && values != 2) holder.refuse("^IMAGE", "a place, a file, or a file and a place");
  const bool names_file = values == 2 || !number_of(pointer.values.front());
  product.data = names_file ? data_file(product, holder, pointer.values.front().text) : path;
  if (names_file && values == 1) return product;
  const LabelBlock& records = holder.entry("RECORD_BYTES") != nullptr ? holder : root;
  const LabelValue& place = pointer.values.back();
  const double unit =
      place.unit.starts_with("byte") ? 1.0 : static_cast<double>(records.count("RECORD_BYTES", 1, kMostBytes));
  const double number = number_of(place).value_or(0.0);
  if (!(number >= 1.0 && number * unit < 0x1p53) || number != std::floor(number))
    holder.refuse("^IMAGE", "at a whole number from 1");
  product.begin_bytes = static_cast<std::uint64_t>((number - 1.0) * unit);
  return product;
}

std::string spaced(std::string text) {
  std::ranges::replace(text, '_', ' ');
  return text;
}

std::string capitalised(const std::string& text) {
  return text.empty() ? text : text.substr(0, 1) + lower_case(text.substr(1));
}

/// Where the edges of a map lie by its label, in units of the map; nullopt where the label does not say.
struct Edges {
  std::optional<double> west;
  std::optional<double> east;
  std::optional<double> north;
  std::optional<double> south;
  double turn = 360.0;  ///< once round
};

/// What projection offsets count from.
struct Middle {
  double x = 0.0;
  std::array<double, 2> y = {};  ///< latitudes that the lines may count from
};

class Pds3Source final : public DescribedSource {
 public:
  Pds3Source(const Product& product, const OpenOptions& options) : DescribedSource(product.data, "PDS3", product.path) {
    const LabelBlock& image = *product.image;
    read_type(image);
    read_layout(product, options);
    describe(image);
    read_place(product.label.root);
    finish(options, 0);
  }

 private:
  void read_type(const LabelBlock& image) {
    std::string type = image.word("SAMPLE_TYPE");
    std::ranges::replace(type, ' ', '_');
    // PDS Data Dictionary: in its synonyms what the bytes are follows their order.
    std::string kind = type;
    for (const std::string_view order : {"LSB_", "PC_", "VAX_", "MSB_", "SUN_", "MAC_", "IEEE_"}) {
      if (type.starts_with(order)) kind.erase(0, order.size());
    }
    const bool is_float = kind == "REAL" || kind == "FLOAT";
    const bool is_unsigned = kind == "UNSIGNED_INTEGER";
    if (!is_float && !is_unsigned && kind != "INTEGER") {
      refuse(ErrorCode::kUnsupported, fmt::format("SAMPLE_TYPE is \"{}\"; MSB_, LSB_ and UNSIGNED integers, IEEE_REAL, "
                                                  "PC_REAL and VAX_REAL are read",
                                                  printable(type)));
    }
    layout_.big_endian = !is_little_endian(type);
    const bool is_vax = is_float && type.starts_with("VAX_");
    if (is_vax) layout_.stored_as = StoredAs::kVaxFloat;
    const std::int64_t bits = image.count("SAMPLE_BITS", 1, 64);
    if (is_float ? bits != 32 && (bits != 64 || is_vax) : bits != 8 && bits != 16 && bits != 32)
      image.refuse("SAMPLE_BITS", is_vax ? "32 for VAX floats" : is_float ? "32 or 64 for floats" : "8, 16 or 32");
    const std::string name = is_float ? "float" : is_unsigned ? "uint" : "int";
    info_.sample_type = sample_type_from_string(name + std::to_string(bits));
  }

  void read_layout(const Product& product, const OpenOptions& options) {
    const LabelBlock& image = *product.image;
    if (const std::string coding = image.word("ENCODING_TYPE", "N/A"); coding != "N/A" && coding != "NONE")
      refuse(ErrorCode::kUnsupported,
             fmt::format("ENCODING_TYPE is {}; only plain samples are read", printable(coding)));
    for (const auto& [key, way] :
         {std::pair("LINE_DISPLAY_DIRECTION", "DOWN"), {"SAMPLE_DISPLAY_DIRECTION", "RIGHT"}}) {
      if (image.word(key, way) != way) image.refuse(key, way);
    }
    info_.width = image.count("LINE_SAMPLES", 1, kMostSamples);
    info_.height = image.count("LINES", 1, kMostSamples);
    const std::int64_t bands = image.count("BANDS", 1, kMostBands, 1);
    const std::int64_t prefix = image.count("LINE_PREFIX_BYTES", 0, kMostBytes, 0);
    const std::int64_t margin = prefix + image.count("LINE_SUFFIX_BYTES", 0, kMostBytes, 0);
    const std::string order = image.word("BAND_STORAGE_TYPE", "BAND_SEQUENTIAL");
    const bool by_sample = order == "SAMPLE_INTERLEAVED";
    const bool by_line = order == "LINE_INTERLEAVED";
    if (bands > 1 && !by_sample && !by_line && order != "BAND_SEQUENTIAL")
      image.refuse("BAND_STORAGE_TYPE", "BAND_SEQUENTIAL, LINE_INTERLEAVED or SAMPLE_INTERLEAVED");
    const auto samples = static_cast<double>(info_.width * (by_sample ? bands : 1));
    const double line = samples * static_cast<double>(size_bytes(info_.sample_type)) + static_cast<double>(margin);
    const auto lines = static_cast<double>(info_.height * (by_sample ? 1 : bands));
    layout_.offset_bytes = begin_of_samples(product, line * lines) + static_cast<std::uint64_t>(prefix);
    layout_.take_band(info_,
                      by_sample ? BandOrder::kSamples
                      : by_line ? BandOrder::kLines
                                : BandOrder::kBands,
                      choose_band(info_, options, bands), bands, header_, static_cast<std::uint64_t>(margin));
  }

  /// Editing a label's text moves the samples. Where they fill the rest of the file there is no doubt.
  std::uint64_t begin_of_samples(const Product& product, double total_bytes) {
    const std::uint64_t end = product.label.end_bytes;
    if (product.data != product.path || product.begin_bytes >= end) return product.begin_bytes;
    const double more = static_cast<double>(file_->size_bytes()) - static_cast<double>(end) - total_bytes;
    const std::string where =
        fmt::format("^IMAGE points at byte {}, inside the label, which ends at byte {}", product.begin_bytes + 1, end);
    if (!(more >= 0.0 && more <= 3.0))
      refuse(ErrorCode::kCorrupt, fmt::format("label line {}: {}", product.line, where));
    info_.warnings.emplace_back(where + "; the samples fill the rest of the file and are read from there");
    return end;
  }

  void describe(const LabelBlock& image) {
    set_scale(image.number("SCALING_FACTOR").value_or(1.0), image.number("OFFSET").value_or(0.0), "SCALING_FACTOR");
    const std::string unit = image.word("UNIT", "N/A");
    if (unit != "N/A" && unit != "UNK" && unit != "NULL") set_unit(unit);
    for (const char* key : {"MISSING_CONSTANT", "MISSING", "NULL", "NULL_CONSTANT", "CORE_NULL", "INVALID_CONSTANT",
                            "LOW_REPR_SATURATION", "LOW_INSTR_SATURATION", "HIGH_REPR_SATURATION",
                            "HIGH_INSTR_SATURATION", "CORE_LOW_REPR_SATURATION", "CORE_LOW_INSTR_SATURATION",
                            "CORE_HIGH_REPR_SATURATION", "CORE_HIGH_INSTR_SATURATION"}) {
      const LabelEntry* const entry = image.entry(key);
      if (entry == nullptr) continue;
      for (const LabelValue& value : entry->values) {
        if (const auto number = constant(value.text)) set_void(*number);
      }
    }
    // ISIS writes its special pixels into PDS products: the lowest values of 32 bit floats, up to FF7FFFF9.
    if (info_.sample_type == SampleType::kFloat32 && layout_.stored_as == StoredAs::kItself)
      info_.valid_min = std::bit_cast<float>(0xFF7FFFFAU);
  }

  /// IMAGE_MAP_PROJECTION (PDS Standards Reference 3.8, appendix B). Simple cylindrical maps, and equirectangular ones true
  /// at the equator, are placed in degrees, East positive; all others in metres of their own projection.
  void read_place(const LabelBlock& root) {
    const LabelEntry* const entry = root.entry("TARGET_NAME");
    const std::string target = entry == nullptr || entry->values.empty() ? "" : entry->values.front().text;
    const auto maps = root.all("IMAGE_MAP_PROJECTION");
    if (maps.empty()) {
      std::string& body = info_.georeference.system.body;
      body = body_of(target, std::nullopt);
      if (body.empty()) body = capitalised(target);
      return;
    }
    const LabelBlock& label = *maps.front();
    const auto number = [&](const char* key, double otherwise = 0.0) { return label.number(key).value_or(otherwise); };
    const auto length = [&](const char* key) {
      const auto metres = label.metres(key, "km");
      return metres && *metres > 0.0 ? metres : std::nullopt;
    };
    const double east = label.word("POSITIVE_LONGITUDE_DIRECTION") == "WEST" ? -1.0 : 1.0;
    const double centre_longitude = east * number("CENTER_LONGITUDE");
    const double centre_latitude = number("CENTER_LATITUDE");
    const std::string projection = spaced(label.word("MAP_PROJECTION_TYPE", "UNKNOWN PROJECTION"));
    const bool is_simple = projection == "SIMPLE CYLINDRICAL";
    const bool is_cylinder = is_simple || projection == "EQUIRECTANGULAR" || projection == "EQUIDISTANT CYLINDRICAL";
    const double true_latitude = is_simple ? 0.0 : number("FIRST_STANDARD_PARALLEL", centre_latitude);
    const bool is_degrees = is_cylinder && true_latitude == 0.0;
    const std::string system = label.word("COORDINATE_SYSTEM_NAME", "PLANETOCENTRIC");

    PlanetaryMap map;
    map.name = is_degrees ? target + ' ' + system : projection + ' ' + target;
    if (!is_degrees) map.projection = projection;
    map.target = capitalised(target);
    map.equatorial_radius_m = length("A_AXIS_RADIUS");
    map.polar_radius_m = length("C_AXIS_RADIUS");
    map.planetographic = system == "PLANETOGRAPHIC";
    map.longitude = centre_longitude;
    map.latitude = is_cylinder ? true_latitude : centre_latitude;
    map.parallel_1 = number("FIRST_STANDARD_PARALLEL");
    map.parallel_2 = number("SECOND_STANDARD_PARALLEL");
    map.pole = {east * number("OBLIQUE_PROJ_POLE_LONGITUDE"), number("OBLIQUE_PROJ_POLE_LATITUDE", 90.0)};
    map.pole_rotation = number("OBLIQUE_PROJ_POLE_ROTATION");
    take_planetary_map(map, info_);
    if (number("MAP_PROJECTION_ROTATION") != 0.0) return lose_place("the map is rotated");

    const std::string unit = label.unit("MAP_RESOLUTION");
    const bool is_per_degree = unit.empty() || unit.find("/deg") != std::string::npos;
    // 0 stands for what the label does not say.
    const double resolution = is_per_degree ? std::max(0.0, number("MAP_RESOLUTION")) : 0.0;
    const double scale = length("MAP_SCALE").value_or(0.0);
    const double radius = map.equatorial_radius_m.value_or(0.0);
    const double spacing = is_degrees    ? (resolution > 0.0 ? 1.0 / resolution : scale / (radius * kDegree))
                           : scale > 0.0 ? scale
                                         : radius * kDegree / resolution;
    if (!(spacing > 0.0 && std::isfinite(spacing)))
      return lose_place("the label gives no MAP_RESOLUTION in pixels per degree and no MAP_SCALE");
    Georeference& geo = info_.georeference;
    geo.spacing_x = geo.spacing_y = spacing;
    geo.registration = Registration::kArea;

    const Middle middle{is_degrees ? centre_longitude : 0.0, {0.0, is_simple ? centre_latitude : 0.0}};
    Edges edges;
    if (is_cylinder) {
      // The radius that the label itself uses: HiRISE's is that of the ellipsoid at the true latitude.
      const double used = resolution > 0.0 && scale > 0.0 ? scale * resolution / kDegree : radius;
      const double to_y = is_degrees ? 1.0 : used * kDegree;
      const double to_x = to_y * std::cos(true_latitude * kDegree);
      const auto find = [&](const char* key, double factor, double from, double to, double to_unit) {
        const auto degrees = label.number(key);
        return degrees ? std::optional((factor * *degrees - from) * to_unit + to) : std::nullopt;
      };
      edges = {find("WESTERNMOST_LONGITUDE", east, centre_longitude, middle.x, to_x),
               find("EASTERNMOST_LONGITUDE", east, centre_longitude, middle.x, to_x),
               find("MAXIMUM_LATITUDE", 1.0, 0.0, 0.0, to_y), find("MINIMUM_LATITUDE", 1.0, 0.0, 0.0, to_y),
               360.0 * to_x};
    }
    const auto line = label.number("LINE_PROJECTION_OFFSET");
    const auto sample = label.number("SAMPLE_PROJECTION_OFFSET");
    if (line && sample) {
      place_by_offsets({*sample, *line}, middle, edges);
    } else {
      place_by_edges(edges);
    }
    if (is_degrees && geo.has_origin) choose_turn(edges.west);
  }

  /// The projection offsets count from the middle of sample (1, 1); MOLA's labels count that sample as 1 instead, and old
  /// ones turn the sign. MAXIMUM_LATITUDE and WESTERNMOST_LONGITUDE, which name edges of pixels, tell which is meant.
  void place_by_offsets(const MapPoint& offsets, const Middle& middle, const Edges& edges) {
    Georeference& geo = info_.georeference;
    const double spacing = geo.spacing_x;
    const auto [sample, line] = offsets;
    // The first sample from the middle, in samples; the standard's way comes first.
    const std::array<MapPoint, 3> ways = {{{-sample, line}, {1.0 - sample, line - 1.0}, {sample, -line}}};
    const auto first = [&](const MapPoint& way, double base) {
      return MapPoint{middle.x + way.easting * spacing, base + way.northing * spacing};
    };
    MapPoint chosen = first(ways[0], middle.y[0]);
    if (edges.west && edges.north) {
      double least = INFINITY;
      MapPoint nearest;
      for (const MapPoint& way : ways) {
        for (const double base : middle.y) {
          const MapPoint point = first(way, base);
          const double off_x = std::remainder(point.easting - spacing / 2.0 - *edges.west, edges.turn);
          const double off_y = point.northing + spacing / 2.0 - *edges.north;
          const double distance = std::max(std::abs(off_x), std::abs(off_y)) / spacing;
          if (distance < least) std::tie(least, nearest) = std::tuple(distance, point);
        }
      }
      if (least <= kSamePlace) {
        chosen = nearest;
      } else {
        info_.warnings.emplace_back(
            fmt::format("LINE_ and SAMPLE_PROJECTION_OFFSET lie {:.2f} samples or more off MAXIMUM_LATITUDE and "
                        "WESTERNMOST_LONGITUDE; the offsets are followed",
                        least));
      }
    } else {
      // A map round its own middle tells by its size alone.
      const auto is_half = [&](double one) {
        return 2.0 * sample == static_cast<double>(info_.width) + one &&
               2.0 * line == static_cast<double>(info_.height) + one;
      };
      if (is_half(1.0)) {
        chosen = first(ways[1], middle.y[0]);
      } else if (!is_half(-1.0)) {
        info_.warnings.emplace_back(
            "nothing in the label confirms LINE_ and SAMPLE_PROJECTION_OFFSET; they are taken from the middle of the "
            "first sample");
      }
    }
    geo.has_origin = true;
    geo.origin_x = chosen.easting;
    geo.origin_y = chosen.northing;
  }

  void place_by_edges(const Edges& edges) {
    Georeference& geo = info_.georeference;
    const double spacing = geo.spacing_x;
    const auto span = [&](std::int64_t columns, std::int64_t rows) {
      const double width = static_cast<double>(columns) * spacing;
      return std::abs(std::remainder(*edges.east - *edges.west - width, edges.turn)) <= kSamePlace * spacing &&
             std::abs(*edges.north - *edges.south - static_cast<double>(rows) * spacing) <= kSamePlace * spacing;
    };
    const bool are_there = edges.west && edges.east && edges.north && edges.south;
    const bool is_area = are_there && span(info_.width, info_.height);
    if (!is_area && !(are_there && span(info_.width - 1, info_.height - 1))) {
      info_.warnings.push_back(
          loss(fmt::format("the label gives no projection offsets, and no bounds that span {} x {} samples; the origin "
                           "is unknown",
                           info_.width, info_.height)));
      return;
    }
    if (!is_area) geo.registration = Registration::kPoint;
    geo.has_origin = true;
    geo.origin_x = *edges.west + (is_area ? spacing / 2.0 : 0.0);
    geo.origin_y = *edges.north - (is_area ? spacing / 2.0 : 0.0);
  }

  /// The turn of longitude that the label's bounds name; within [-180, 360) where they name none.
  void choose_turn(const std::optional<double>& west) {
    double& x = info_.georeference.origin_x;
    if (west && *west >= -180.0 && *west < 360.0) {
      x += 360.0 * std::round((*west - x) / 360.0);
    } else if (x < -180.0 || x >= 360.0) {
      x -= 360.0 * std::floor((x + 180.0) / 360.0);
    }
  }
};

bool begins_with_label(const std::string& path) {
  const std::string head = first_bytes(RawFile(path), 128);
  return kPds3Format.recognises(std::as_bytes(std::span(head)));
}

/// The label beside a file of samples, NAME.lbl or, of JPEG 2000, NAME_jp2.lbl, in any case; empty where there is none.
std::string label_beside(const std::string& path) {
  const std::string stem = std::filesystem::path(path).stem().string();
  for (const char* ending : {".lbl", "_jp2.lbl"}) {
    const std::string label = file_beside(path, stem + ending);
    if (!label.empty() && begins_with_label(label)) return label;
  }
  return {};
}

bool looks_like_pds3(std::span<const std::byte> head) {
  std::string_view text = text_of(head);
  const auto skip_blank = [&] {
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.front())) != 0) text.remove_prefix(1);
  };
  skip_blank();
  if (text.starts_with("CCSD") || text.starts_with("NJPL")) {
    text.remove_prefix(std::min(text.find('\n'), text.size()));
    skip_blank();
  }
  return text.starts_with("PDS_VERSION_ID");
}

/// The label of samples that carry none themselves; empty for other files.
std::string pds3_label_of(const std::string& path) {
  return lower_case(path).ends_with(".img") && !begins_with_label(path) ? label_beside(path) : std::string();
}

bool has_pds3_label(const std::string& path) {
  return !pds3_label_of(path).empty();
}

std::unique_ptr<HeightSource> open_pds3(const std::string& path, const OpenOptions& options) {
  const std::string label = pds3_label_of(path);
  const Product product = read_product(label.empty() ? path : label);
  if (!label.empty()) require_described(path, label, product.data);
  return std::make_unique<Pds3Source>(product, options);
}

}  // namespace

const Format kPds3Format = {.name = "PDS3",
                            .extensions = {".img", ".lbl"},
                            .note = "takes `channel`",
                            .open = open_pds3,
                            .recognises = looks_like_pds3,
                            .described = has_pds3_label};

std::string jpeg2000_help(const std::string& path) {
  const std::string label = label_beside(path);
  if (label.empty()) return {};
  try {
    (void)open_pds3(label, {});
    return fmt::format("its samples are unpacked already: open {}", label);
  } catch (const Error& error) {
    return error.parts().remedy;
  }
}

}  // namespace isohf
