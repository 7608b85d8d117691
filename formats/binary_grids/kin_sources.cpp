/// More plain samples with a header: IDRISI's .rdc, ROI_PAC's .rsc, the labels of VICAR, Terragen's chunks, and the
/// numbers of a Netpbm graymap.

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/binary_grids/described_source.h"
#include "formats/files/bands.h"
#include "formats/files/text.h"
#include "formats/georeference/files_beside.h"
#include "formats/georeference/map_wkt.h"
#include "formats/georeference/reference_system.h"
#include "formats/georeference/units.h"
#include "formats/open_options.h"
#include "formats/planetary/label_text.h"
#include "formats/planetary/pds3_place.h"
#include "formats/readers.h"
#include "isohf/base/bytes.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

class IdrisiSource final : public DescribedSource {
 public:
  IdrisiSource(const std::string& data, const std::string& header, const OpenOptions& options)
      : DescribedSource(data, "IDRISI", header, options) {
    (void)choose_band(info_, options, 1);
    const HeaderWords words = read_header_words(header, ':');
    set_size(number(words, "columns"), number(words, "rows"));
    static constexpr std::array<std::pair<std::string_view, SampleType>, 3> kTypes = {
        {{"byte", SampleType::kUint8}, {"integer", SampleType::kInt16}, {"real", SampleType::kFloat32}}};
    if (const std::string kind = word_in(words, "file type"); kind != "binary") {
      refuse(kind.empty() ? ErrorCode::kCorrupt : ErrorCode::kUnsupported,
             fmt::format("file type is \"{}\", must be binary", printable(kind)));
    }
    set_type(kTypes, word_in(words, "data type"), "data type");
    const double west = number(words, "min. x");
    const double north = number(words, "max. y");
    place_by_corner(west, north, (number(words, "max. x") - west) / static_cast<double>(info_.width),
                    (north - number(words, "min. y")) / static_cast<double>(info_.height));
    read_system(words);
    const std::string flag = word_in(words, "flag value");
    if (!flag.empty() && flag != "none") set_void(number(flag, "flag value"));
    if (const auto unit = linear_unit(word_in(words, "value units"))) {
      info_.vertical_unit = unit->name;
      info_.metres_per_vertical_unit = unit->metres;
    }
    finish(options);
  }

 private:
  void read_system(const HeaderWords& words) {
    Georeference& place = info_.georeference;
    const std::string system = word_in(words, "ref. system");
    const std::string unit = word_in(words, "ref. units");
    int zone = 0;
    char half = 'n';
    if (unit == "deg" || unit == "degrees" || system == "latlong") {
      place.unit = HorizontalUnit::kDegree;
    } else if (const auto length = linear_unit(unit)) {
      place.unit = HorizontalUnit::kMetre;
      place.metres_per_unit = length->metres * number(words, "unit dist.", 1.0);
    }
    if (system == "latlong") {
      place.system = wgs84_system();
    } else if (std::sscanf(system.c_str(), "utm-%d%c", &zone, &half) == 2 && zone >= 1 && zone <= 60) {
      place.system = wgs84_utm_zone(zone, half == 's');
    } else if (!system.empty() && system != "plane" && !read_parameters(file_beside(header_, system + ".ref")) &&
               !read_state_plane(system)) {
      leave_out_system("reference system", system);
    }
  }

  /// "spc83ca1": NAD83 or NAD27, the state, its zone. EPSG's conversions have the numbers of the zones in them; false
  /// where there is none of that number, several systems are meant, or PROJ is not there.
  bool read_state_plane(const std::string& name) {
    int year = 0;
    int zone = 0;
    int read = 0;
    std::array<char, 3> state{};
    if (std::sscanf(name.c_str(), "spc%2d%2[a-z]%1d%n", &year, state.data(), &zone, &read) != 3 ||
        static_cast<std::size_t>(read) != name.size() || (year != 27 && year != 83)) {
      return false;
    }
    // State Plane Coordinate System of 1983 (NOAA NOS NGS 5), appendix A: numbers of zones are these and two digits.
    static constexpr std::string_view kStates =
        "al01az02ar03ca04co05ct06de07fl09ga10id11il12in13ia14ks15ky16la17me18md19ma20mi21mn22ms23mo24mt25ne26nv27nh28"
        "nj29nm30ny31nc32nd33oh34ok35or36pa37ri38sc39sd40tn41tx42ut43vt44va45wa46wv47wi48wy49ak50hi51pr52";
    std::size_t at = 0;
    while (at < kStates.size() && kStates.substr(at, 2) != state.data()) at += 4;
    if (at == kStates.size()) return false;
    const int number = 10 * (kStates[at + 2] - '0') + kStates[at + 3] - '0';
    // A state of one zone has it under 0. IDRISI's feet are those that EPSG has a system of the zone in: the state's.
    struct Unit {
      int axes;  ///< EPSG's
      double metres;
    };
    constexpr std::array<Unit, 3> kUnits = {{{4499, 1.0}, {4497, 1200.0 / 3937.0}, {4495, 0.3048}}};
    const bool in_metres = info_.georeference.metres_per_unit == 1.0;
    for (const Unit& unit : kUnits) {
      if (in_metres != (unit.metres == 1.0)) continue;
      for (const int each : {zone, 0}) {
        if (each == 0 && zone > 1) continue;
        SourceInfo found = info_;
        found.georeference.metres_per_unit = unit.metres;
        try {
          take_system(
              fmt::format("urn:ogc:def:crs,crs:EPSG::{},cs:EPSG::{},coordinateOperation:EPSG::{}",
                          year == 83 ? 4269 : 4267, unit.axes, 10000 + 100 * number + each + (year == 83 ? 30 : 0)),
              found);
        } catch (const Error&) {  // no such zone
          continue;
        }
        if (!found.georeference.system.epsg) continue;
        info_ = found;
        return true;
      }
    }
    return false;
  }

  /// A reference system parameter file (.ref); false where it is not there or has a projection that is not known.
  bool read_parameters(const std::string& path) {
    if (path.empty()) return false;
    const HeaderWords words = read_header_words(path, ':');
    static constexpr std::array<std::pair<std::string_view, std::string_view>, 12> kMethods = {
        {{"cylindrical equal area", "Cylindrical_Equal_Area"},
         {"azimuthal equal area", "Lambert_Azimuthal_Equal_Area"},
         {"polar stereographic", "Polar_Stereographic"},
         {"oblique stereographic", "Oblique_Stereographic"},
         {"transverse stereographic", "Stereographic"},
         {"transverse mercator", "Transverse_Mercator"},
         {"gauss-kruger", "Transverse_Mercator"},
         {"mercator", "Mercator_1SP"},
         {"lambert conformal conic", "Lambert_Conformal_Conic_2SP"},
         {"alber's equal area conic", "Albers_Conic_Equal_Area"},
         {"plate carr", "Equirectangular"},
         {"sinusoidal", "Sinusoidal"}}};
    const std::string projection = word_in(words, "projection");
    const auto* const method = std::ranges::find_if(
        kMethods, [&](const auto& known) { return projection.find(known.first) != std::string::npos; });
    const bool is_map = projection != "none";
    if (is_map ? method == kMethods.end() : !word_in(words, "units").starts_with("deg")) return false;
    const double a = number(words, "major s-ax");
    const double b = number(words, "minor s-ax");
    if (!(a > 0.0 && b > 0.0)) refuse(ErrorCode::kCorrupt, path + " gives axes of no ellipsoid");
    const auto name = [&](const char* key) {
      const auto found = words.find(key);
      return found == words.end() ? std::string("unknown") : found->second;
    };
    const double flattening = std::abs(a - b) < kAxisRounding ? 0.0 : a / (a - b);
    const std::string geographic = geographic_wkt(is_map ? "unknown" : name("datum"), name("datum"), name("ellipsoid"),
                                                  a, known_flattening(name("ellipsoid"), flattening));
    const double scale = number(words, "scale fac", 1.0);
    const MapParameters parameters{number(words, "origin lat", 0.0),
                                   number(words, "origin long", 0.0),
                                   number(words, "stand ln 1", 0.0),
                                   number(words, "stand ln 2", 0.0),
                                   scale == 0.0 ? 1.0 : scale,
                                   0.0,
                                   0.0,
                                   number(words, "origin x", 0.0),
                                   number(words, "origin y", 0.0)};
    const double metres_per_unit =
        std::exchange(info_.georeference.metres_per_unit, 1.0);  // the text's own unit counts
    read_system_text(
        is_map ? map_wkt(name("ref. system"), geographic, method->second, parameters, metres_per_unit) : geographic,
        path, info_);
    return true;
  }

  /// Axes are written to millimetres: the flattening that is meant, where WGS 84 and GRS 1980 differ by name alone.
  static double known_flattening(const std::string& ellipsoid, double computed) {
    constexpr double kMillimetre = 1e-4;
    if (ellipsoid == "GRS 1980" && std::abs(computed - 298.257222101) < kMillimetre) return 298.257222101;
    for (const double known : {298.257223563, 299.1528128, 297.0, 294.978698213898, 298.3, 293.465, 300.8017, 298.25}) {
      if (std::abs(computed - known) < kMillimetre) return known;
    }
    return computed;
  }
  static constexpr double kAxisRounding = 0.0015;
};

/// An interferometric DEM: NAME.dem of int16, and NAME.dem.rsc.
class RoiPacSource final : public DescribedSource {
 public:
  RoiPacSource(const std::string& data, const std::string& header, const OpenOptions& options)
      : DescribedSource(data, "ROI_PAC DEM", header, options) {
    (void)choose_band(info_, options, 1);
    const HeaderWords words = read_header_words(header, ' ');
    info_.sample_type = SampleType::kInt16;
    set_size(number(words, "width"), number(words, "file_length"));
    if (words.contains("x_first") && words.contains("y_first")) {
      place_by_corner(number(words, "x_first"), number(words, "y_first"), number(words, "x_step"),
                      -number(words, "y_step"));
    }
    read_auxiliary_metadata(info_, 1);  // which goes before the header, as for GDAL
    if (info_.z_scale == 1.0 && info_.z_offset == 0.0)
      set_scale(number(words, "z_scale", 1.0), number(words, "z_offset", 0.0), "Z_SCALE");
    Georeference& place = info_.georeference;
    const std::string projection = word_in(words, "projection");
    int zone = 0;
    if (projection.empty() || projection == "latlon" || projection == "ll") {
      place.unit = HorizontalUnit::kDegree;
      read_datum(word_in(words, "datum"), 0);
    } else if (std::sscanf(projection.c_str(), "utm%d", &zone) == 1 && zone >= 1 && zone <= 60) {
      place.unit = HorizontalUnit::kMetre;
      read_datum(word_in(words, "datum"), zone);
    } else {
      leave_out_system("projection", projection);
    }
    finish(options, 0);
  }

 private:
  /// zone  of UTM in the North; 0: degrees
  void read_datum(const std::string& name, int zone) {
    struct Datum {
      std::string_view names[2];
      int degrees;
      int zones;  ///< code of zone 0
      int first;
      int last;
    };
    static constexpr std::array<Datum, 4> kDatums = {
        {{{"nad83", "north_american_datum_1983"}, 4269, 26900, 1, 23},
         {{"nad27", "north_american_datum_1927"}, 4267, 26700, 1, 22},
         {{"etrs89", "european_terrestrial_reference_system_1989"}, 4258, 25800, 28, 38},
         {{"ed50", "european_datum_1950"}, 4230, 23000, 28, 38}}};
    if (name == "wgs84" || name == "wgs_1984") {
      info_.georeference.system = zone == 0 ? wgs84_system() : wgs84_utm_zone(zone, false);
      return;
    }
    if (name.empty()) return;
    const auto* const known =
        std::ranges::find_if(kDatums, [&](const Datum& each) { return std::ranges::count(each.names, name) != 0; });
    if (known == kDatums.end() || (zone != 0 && (zone < known->first || zone > known->last))) {
      return leave_out_system("datum", name);
    }
    info_.georeference.system.epsg = zone == 0 ? known->degrees : known->zones + zone;
    info_.georeference.system.body = "Earth";
  }
};

/// KEY=VALUE items apart by blanks, texts in quotes, lists in brackets (VICAR File Format, 1992); the first of a key
/// counts, which is the system's.
HeaderWords vicar_words(std::string_view text) {
  HeaderWords words;
  std::size_t at = 0;
  while ((at = text.find_first_not_of(" \n\r\t\0", at)) != std::string_view::npos) {
    const std::size_t equals = text.find('=', at);
    if (equals == std::string_view::npos) break;
    const std::string key = lower_case(trimmed(text.substr(at, equals - at)));
    std::size_t begin = equals + 1;
    while (begin < text.size() && text[begin] == ' ') ++begin;
    const char first = begin < text.size() ? text[begin] : ' ';
    const char closing = first == '\'' ? '\'' : first == '(' ? ')' : ' ';
    const std::size_t end = std::min(text.find(closing, begin + 1), text.size());
    words.emplace(key,
                  std::string(text.substr(begin + (closing == '\'' ? 1 : 0), end - begin - (closing == '\'' ? 1 : 0))));
    at = std::min(end + 1, text.size());
  }
  return words;
}

class VicarSource final : public DescribedSource {
 public:
  VicarSource(const std::string& path, const OpenOptions& options) : DescribedSource(path, "VICAR", path, options) {
    constexpr std::size_t kMostLabelBytes = std::size_t{1} << 20U;
    std::string head(64, '\0');
    head.resize(file_->read_some(0, std::as_writable_bytes(std::span(head))));
    const std::int64_t label = count(number(vicar_words(head), "lblsize"), "LBLSIZE");
    if (static_cast<std::size_t>(label) > kMostLabelBytes)
      refuse(ErrorCode::kCorrupt, "has a label of more than 1 MiB");
    std::string text(static_cast<std::size_t>(label), '\0');
    file_->read(0, std::as_writable_bytes(std::span(text)));
    text.resize(std::min(text.find('\0'), text.size()));  // it is filled up with zeros
    const HeaderWords words = vicar_words(text);
    static constexpr std::array<std::pair<std::string_view, SampleType>, 7> kTypes = {{{"byte", SampleType::kUint8},
                                                                                       {"half", SampleType::kInt16},
                                                                                       {"word", SampleType::kInt16},
                                                                                       {"full", SampleType::kInt32},
                                                                                       {"long", SampleType::kInt32},
                                                                                       {"real", SampleType::kFloat32},
                                                                                       {"doub", SampleType::kFloat64}}};
    set_type(kTypes, word_in(words, "format"), "FORMAT");
    set_size(number(words, "ns"), number(words, "nl"));
    const std::int64_t bands = count(number(words, "nb", 1.0), "NB");
    const bool is_real = is_floating(info_.sample_type);
    const std::string real = word_in(words, "realfmt");
    if (is_real && real == "vax") {
      if (info_.sample_type == SampleType::kFloat64) refuse(ErrorCode::kUnsupported, "REALFMT of its doubles is VAX");
      layout_.stored_as = StoredAs::kVaxFloat;
    }
    layout_.big_endian = is_real ? real == "ieee" : word_in(words, "intfmt") == "high";
    if (word_in(words, "compress") != "" && word_in(words, "compress") != "none") {
      refuse(ErrorCode::kUnsupported, "its samples are compressed");
    }
    const std::string order = word_in(words, "org");
    if (order != "bsq" && order != "bil" && order != "bip") {
      refuse(ErrorCode::kCorrupt, fmt::format("ORG is \"{}\", must be BSQ, BIL or BIP", printable(order)));
    }
    const double prefix = static_cast<double>(count(number(words, "nbb", 0.0), "NBB", 0.0));
    const double headers = static_cast<double>(count(number(words, "nlb", 0.0), "NLB", 0.0));
    const double offset = static_cast<double>(label) + headers * number(words, "recsize", 0.0) + prefix;
    layout_.offset_bytes = static_cast<std::uint64_t>(count(offset, "the samples' offset", 0.0));
    layout_.take_band(info_,
                      order == "bil"   ? BandOrder::kLines
                      : order == "bip" ? BandOrder::kSamples
                                       : BandOrder::kBands,
                      choose_band(info_, options, bands), bands, header_, static_cast<std::uint64_t>(prefix));
    place_by_map(text);
    if (!info_.georeference.has_origin) read_place_beside(info_, bands == 1 ? 1 : 0);
    finish(options, 0);
  }

 private:
  /// The property MAP, where it names a map, which goes on up to the next one or the first task: the words of PDS3's IMAGE_MAP_PROJECTION.
  void place_by_map(const std::string& label) {
    constexpr std::string_view kMap = "PROPERTY='MAP'";
    const std::size_t begin = label.find(kMap);
    if (begin == std::string::npos) return;
    const std::size_t first = begin + kMap.size();
    const std::size_t end = std::min(label.find(" PROPERTY=", first), label.find(" TASK=", first));
    LabelBlock map{"IMAGE_MAP_PROJECTION", 0, {}, {}};
    LabelBlock root;
    const HeaderWords words = vicar_words(std::string_view(label).substr(first, end - first));
    if (!words.contains("map_projection_type")) return;  // GDAL has its map in a file beside
    for (const auto& [key, value] : words) {
      auto& entries = key == "target_name" ? root.entries : map.entries;
      entries.push_back({upper_case(key), {{value, {}}}, 0});
    }
    root.blocks.push_back(std::move(map));
    Pds3Place place = place_from_pds3(header_, root, info_.width, info_.height, LabelOf::kVicar);
    info_.georeference = std::move(place.georeference);
    info_.warnings.insert(info_.warnings.end(), place.warnings.begin(), place.warnings.end());
  }
};

class TerragenSource final : public DescribedSource {
 public:
  TerragenSource(const std::string& path, const OpenOptions& options)
      : DescribedSource(path, "Terragen", path, options) {
    (void)choose_band(info_, options, 1);
    info_.sample_type = SampleType::kInt16;
    layout_.from_south = true;
    double columns = 0.0;
    double rows = 0.0;
    float scale_x = 30.0F;
    float scale_y = 30.0F;
    float scale_z = 30.0F;
    for (std::uint64_t at = 16;;) {
      std::array<std::byte, 16> chunk{};
      if (file_->read_some(at, chunk) < 8) refuse(ErrorCode::kCorrupt, "ends before its elevations (ALTW)");
      const std::string_view name = text_of(chunk).substr(0, 4);
      const auto whole = [&](std::size_t offset) { return load_little<std::uint16_t>(chunk.data() + offset); };
      if (name == "SIZE") columns = rows = whole(4) + 1.0;
      if (name == "XPTS") columns = whole(4);
      if (name == "YPTS") rows = whole(4);
      if (name == "SCAL") {
        scale_x = load_little<float>(chunk.data() + 4);
        scale_y = load_little<float>(chunk.data() + 8);
        scale_z = load_little<float>(chunk.data() + 12);
      }
      if (name == "ALTW") {
        const auto height = static_cast<double>(static_cast<std::int16_t>(whole(4)));
        const auto base = static_cast<double>(static_cast<std::int16_t>(whole(6)));
        set_scale(height / 65536.0 * static_cast<double>(scale_z), base * static_cast<double>(scale_z), "ALTW");
        layout_.offset_bytes = at + 8;
        break;
      }
      if (name == "EOF ") refuse(ErrorCode::kCorrupt, "has no elevations (ALTW)");
      at += name == "SCAL" ? 16 : 8;
    }
    set_size(columns, rows);
    Georeference& place = info_.georeference;
    if (!(scale_x > 0.0F && scale_y > 0.0F)) refuse(ErrorCode::kCorrupt, "gives no positive spacing (SCAL)");
    place.unit = HorizontalUnit::kMetre;
    place.spacing_x = static_cast<double>(scale_x);
    place.spacing_y = static_cast<double>(scale_y);
    info_.vertical_unit = "metre";
    finish(options);
  }
};

/// A graymap of bytes or big-endian words (Netpbm's pgm(5), P5), whose values are read as they stand, whatever the largest
/// one is said to be.
class GraymapSource final : public DescribedSource {
 public:
  GraymapSource(const std::string& path, const OpenOptions& options)
      : DescribedSource(path, "Portable graymap", path, options) {
    (void)choose_band(info_, options, 1);
    constexpr std::size_t kMostHeaderBytes = std::size_t{64} << 10U;
    std::string head(kMostHeaderBytes, '\0');
    head.resize(file_->read_some(0, std::as_writable_bytes(std::span(head))));
    std::size_t at = 2;
    const double width = next_number(head, at, "width");
    const double height = next_number(head, at, "height");
    const double largest = next_number(head, at, "largest value");
    if (largest < 1.0 || largest > 65535.0) {
      refuse(ErrorCode::kCorrupt, fmt::format("largest value is {:.0f}, must be from 1 to 65535", largest));
    }
    info_.sample_type = largest > 255.0 ? SampleType::kUint16 : SampleType::kUint8;
    set_size(width, height);
    layout_.big_endian = true;
    layout_.offset_bytes = at + 1;  // behind one blank
    require_samples();
    info_.block_width = info_.width;
    info_.block_height = 1;
    read_place_beside(info_, 1);  // a picture's .prj says nothing without a world file
    apply_open_options(info_, options);
    if (const double end = layout_.end_bytes(info_); end < static_cast<double>(file_->size_bytes())) {
      info_.warnings.push_back(
          loss(fmt::format("{:.0f} bytes follow the samples", static_cast<double>(file_->size_bytes()) - end)));
    }
  }

 private:
  /// Of the header, past blanks and comments, which a # begins.
  double next_number(const std::string& head, std::size_t& at, const char* what) const {
    constexpr std::string_view kBlanks = " \t\n\v\f\r";
    while ((at = head.find_first_not_of(kBlanks, at)) != std::string::npos && head[at] == '#') at = head.find('\n', at);
    const std::size_t end = std::min(at == std::string::npos ? at : head.find_first_of(kBlanks, at), head.size());
    const std::size_t begin = std::min(at, end);
    at = end;
    return number(head.substr(begin, end - begin), what);
  }
};

}  // namespace

std::unique_ptr<HeightSource> open_idrisi(const std::string& path, const OpenOptions& options) {
  const auto [data, header] = data_and_header(path, ".rst", ".rdc");
  return std::make_unique<IdrisiSource>(data, header, options);
}

std::unique_ptr<HeightSource> open_roi_pac(const std::string& path, const OpenOptions& options) {
  return std::make_unique<RoiPacSource>(path, path + ".rsc", options);
}

bool looks_like_vicar(std::span<const std::byte> head) {
  return text_of(head).starts_with("LBLSIZE=");
}

std::unique_ptr<HeightSource> open_vicar(const std::string& path, const OpenOptions& options) {
  return std::make_unique<VicarSource>(path, options);
}

bool looks_like_terragen(std::span<const std::byte> head) {
  return text_of(head).starts_with("TERRAGENTERRAIN ");
}

std::unique_ptr<HeightSource> open_terragen(const std::string& path, const OpenOptions& options) {
  return std::make_unique<TerragenSource>(path, options);
}

bool looks_like_graymap(std::span<const std::byte> head) {
  const std::string_view text = text_of(head);
  return text.size() > 2 && text.starts_with("P5") && std::string_view(" \t\n\v\f\r#").find(text[2]) != text.npos;
}

std::unique_ptr<HeightSource> open_graymap(const std::string& path, const OpenOptions& options) {
  return std::make_unique<GraymapSource>(path, options);
}

}  // namespace isohf
