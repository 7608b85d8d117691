/// More plain samples with a header: ROI_PAC's .rsc, the labels of VICAR, Terragen's chunks, and the
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
