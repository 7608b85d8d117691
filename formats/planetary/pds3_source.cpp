#include "formats/readers.h"
#include "isohf/projection/body.h"
#include "isohf/projection/length_unit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "formats/georeference/files_beside.h"
#include "formats/georeference/map_wkt.h"
#include "formats/grids/plain_samples.h"
#include "formats/io/bands.h"
#include "formats/io/text.h"
#include "formats/open_options.h"
#include "formats/planetary/label_text.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

/// How the samples of a PDS3 IMAGE follow each other; offsets are from where ^IMAGE points.
struct Pds3Layout {
  std::int64_t columns = 0;
  std::int64_t rows = 0;
  std::int64_t bands = 1;
  SampleType type = SampleType::kInt16;
  BandOrder order = BandOrder::kBands;
  PlainLayout samples;
  std::uint64_t margin_bytes = 0;  ///< of a line: prefix and suffix
  std::uint64_t total_bytes = 0;   ///< all bands with them, below 2^50
};

constexpr std::int64_t kMostMarginBytes = std::int64_t{1} << 31;

struct SampleKind {
  const char* name;
  char kind;  ///< i: signed, u: unsigned, f: IEEE float, v: VAX F-float, g: another VAX float
  bool big_endian;
};

// PDS Data Dictionary, SAMPLE_TYPE, with its synonyms.
constexpr std::array<SampleKind, 22> kSampleKinds = {{{"MSB_INTEGER", 'i', true},
                                                      {"INTEGER", 'i', true},
                                                      {"SUN_INTEGER", 'i', true},
                                                      {"MAC_INTEGER", 'i', true},
                                                      {"LSB_INTEGER", 'i', false},
                                                      {"PC_INTEGER", 'i', false},
                                                      {"VAX_INTEGER", 'i', false},
                                                      {"MSB_UNSIGNED_INTEGER", 'u', true},
                                                      {"UNSIGNED_INTEGER", 'u', true},
                                                      {"SUN_UNSIGNED_INTEGER", 'u', true},
                                                      {"MAC_UNSIGNED_INTEGER", 'u', true},
                                                      {"LSB_UNSIGNED_INTEGER", 'u', false},
                                                      {"PC_UNSIGNED_INTEGER", 'u', false},
                                                      {"VAX_UNSIGNED_INTEGER", 'u', false},
                                                      {"IEEE_REAL", 'f', true},
                                                      {"REAL", 'f', true},
                                                      {"FLOAT", 'f', true},
                                                      {"SUN_REAL", 'f', true},
                                                      {"MAC_REAL", 'f', true},
                                                      {"PC_REAL", 'f', false},
                                                      {"VAX_REAL", 'v', false},
                                                      {"VAXG_REAL", 'g', false}}};

SampleType sample_type(char kind, std::int64_t bits, const LabelFields& image) {
  if (kind == 'v') {
    if (bits == 32) return SampleType::kFloat32;
    image.refuse("SAMPLE_BITS", "32 for VAX floats");
  }
  if (kind == 'f') {
    if (bits == 32) return SampleType::kFloat32;
    if (bits == 64) return SampleType::kFloat64;
    image.refuse("SAMPLE_BITS", "32 or 64 for floats");
  }
  if (bits == 8) return kind == 'u' ? SampleType::kUint8 : SampleType::kInt8;
  if (bits == 16) return kind == 'u' ? SampleType::kUint16 : SampleType::kInt16;
  if (bits == 32) return kind == 'u' ? SampleType::kUint32 : SampleType::kInt32;
  image.refuse("SAMPLE_BITS", "8, 16 or 32 for integers");
}

void read_sample_type(const LabelFields& image, Pds3Layout& layout) {
  std::string type = image.word("SAMPLE_TYPE").value_or("");
  std::replace(type.begin(), type.end(), ' ', '_');
  const auto* const kind =
      std::find_if(kSampleKinds.begin(), kSampleKinds.end(), [&](const SampleKind& k) { return type == k.name; });
  if (kind == kSampleKinds.end() || kind->kind == 'g') {
    throw Error(ErrorCode::kUnsupported, fmt::format("{}: SAMPLE_TYPE is \"{}\"; MSB_, LSB_ and UNSIGNED integers, "
                                                     "IEEE_REAL, PC_REAL and VAX_REAL are read",
                                                     image.path(), type));
  }
  layout.type = sample_type(kind->kind, image.count("SAMPLE_BITS", 1, 64), image);
  layout.samples.big_endian = kind->big_endian;
  if (kind->kind == 'v') layout.samples.stored_as = StoredAs::kVaxFloat;
}

/// Reads an IMAGE object. Throws Error: kCorrupt for a field that says nothing, kUnsupported for what is not read.
Pds3Layout pds3_layout(const LabelFields& image) {
  const std::string coding = image.word("ENCODING_TYPE").value_or("N/A");
  if (coding != "N/A" && coding != "NONE") {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("{}: ENCODING_TYPE is {}; only plain samples are read", image.path(), coding));
  }
  if (image.word("LINE_DISPLAY_DIRECTION").value_or("DOWN") != "DOWN") image.refuse("LINE_DISPLAY_DIRECTION", "DOWN");
  if (image.word("SAMPLE_DISPLAY_DIRECTION").value_or("RIGHT") != "RIGHT") {
    image.refuse("SAMPLE_DISPLAY_DIRECTION", "RIGHT");
  }
  Pds3Layout layout;
  read_sample_type(image, layout);
  layout.columns = image.count("LINE_SAMPLES", 1, kMostSamples);
  layout.rows = image.count("LINES", 1, kMostSamples);
  layout.bands = image.count("BANDS", 1, kMostBands, 1);
  const std::int64_t prefix = image.count("LINE_PREFIX_BYTES", 0, kMostMarginBytes, 0);
  const std::int64_t suffix = image.count("LINE_SUFFIX_BYTES", 0, kMostMarginBytes, 0);
  const auto size = static_cast<std::int64_t>(size_bytes(layout.type));
  const std::string order = image.word("BAND_STORAGE_TYPE").value_or("BAND_SEQUENTIAL");
  const bool by_sample = order == "SAMPLE_INTERLEAVED";
  const bool by_line = order == "LINE_INTERLEAVED";
  if (layout.bands > 1 && !by_sample && !by_line && order != "BAND_SEQUENTIAL") {
    image.refuse("BAND_STORAGE_TYPE", "BAND_SEQUENTIAL, LINE_INTERLEAVED or SAMPLE_INTERLEAVED");
  }
  layout.order = by_sample ? BandOrder::kSamples : by_line ? BandOrder::kLines : BandOrder::kBands;
  // At most 2^50: the factors are bounded.
  const std::int64_t line = prefix + layout.columns * size * (by_sample ? layout.bands : 1) + suffix;
  const std::int64_t lines_of_a_row = by_sample ? 1 : layout.bands;
  const double total = static_cast<double>(line) * static_cast<double>(layout.rows * lines_of_a_row);
  if (!(total < kMostBytes)) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("{}: {} x {} samples in {} bands need {:.3g} bytes, must be below 2^50", image.path(),
                            layout.columns, layout.rows, layout.bands, total));
  }
  layout.samples.offset_bytes = static_cast<std::uint64_t>(prefix);
  layout.margin_bytes = static_cast<std::uint64_t>(prefix + suffix);
  layout.total_bytes = static_cast<std::uint64_t>(line * layout.rows * lines_of_a_row);
  return layout;
}

constexpr double kDegree = std::numbers::pi / 180.0;
/// Bounds and offsets agree where they differ by less, in pixels; the meanings of the offsets differ by 1.
constexpr double kSamePlace = 0.25;

std::string spaced(std::string text) {
  std::replace(text.begin(), text.end(), '_', ' ');
  return text;
}

std::string capitalised(std::string text) {
  for (std::size_t i = 1; i < text.size(); ++i) {
    text[i] = static_cast<char>(std::tolower(static_cast<unsigned char>(text[i])));
  }
  return text;
}

/// A length in metres; kilometres where no unit stands there, as the data dictionary has it. "km/pixel" counts as km.
std::optional<double> metres(const LabelFields& fields, const char* key) {
  const std::optional<double> number = fields.number(key);
  if (!number || !(*number > 0.0)) return std::nullopt;
  const std::string unit = fields.unit(key);
  if (unit.empty()) return *number * 1000.0;
  const std::optional<LinearUnit> length = linear_unit(unit.substr(0, unit.find('/')));
  return length ? std::optional(*number * length->metres) : std::nullopt;
}

/// What a label says of a raster's place.
struct Pds3Place {
  Georeference georeference;
  std::vector<Warning> warnings;
};

class Placer {
 public:
  Placer(const LabelFields& map, std::int64_t columns, std::int64_t rows, Pds3Place& place)
      : map_(map), columns_(columns), rows_(rows), place_(place), geo_(place.georeference) {}

  void read(const std::string& target) {
    projection_ = spaced(map_.word("MAP_PROJECTION_TYPE").value_or(""));
    read_ellipsoid();
    const double rotation = map_.number("MAP_PROJECTION_ROTATION").value_or(0.0);
    if (rotation != 0.0) {
      warn(loss(fmt::format("the map is rotated by {} degrees; its place is left out", rotation)));
      return;
    }
    if (!read_scale()) {
      warn(loss("the label gives no MAP_RESOLUTION in pixels per degree and no MAP_SCALE; the place is left out"));
      return;
    }
    if (degrees_) {
      geo_.unit = HorizontalUnit::kDegree;
      geo_.system.name = fmt::format("{} {}", target, map_.word("COORDINATE_SYSTEM_NAME").value_or("PLANETOCENTRIC"));
    } else {
      geo_.unit = HorizontalUnit::kMetre;
      geo_.system.name = fmt::format("{} {}", projection_.empty() ? "UNKNOWN PROJECTION" : projection_, target);
    }
    name_map(target);
    geo_.spacing_x = geo_.spacing_y = spacing_;
    geo_.registration = Registration::kArea;
    read_bounds();
    const std::optional<double> line = map_.number("LINE_PROJECTION_OFFSET");
    const std::optional<double> sample = map_.number("SAMPLE_PROJECTION_OFFSET");
    if (line && sample) {
      place_by_offsets(*sample, *line);
    } else {
      place_by_bounds();
    }
    if (degrees_ && geo_.has_origin) choose_turn();
  }

 private:
  void warn(Warning text) { place_.warnings.push_back(std::move(text)); }

  void read_ellipsoid() {
    const std::optional<double> a = metres(map_, "A_AXIS_RADIUS");
    const std::optional<double> c = metres(map_, "C_AXIS_RADIUS");
    if (!a) return;
    geo_.system.semi_major_axis_m = a;
    geo_.system.inverse_flattening = c && *c != *a ? *a / (*a - *c) : 0.0;
  }

  /// The WKT of the map, in degrees or metres as it is placed.
  void name_map(const std::string& target) {
    PlanetaryMap planet{degrees_ ? "" : projection_,
                        capitalised(target),
                        geo_.system.semi_major_axis_m.value_or(0.0),
                        metres(map_, "C_AXIS_RADIUS").value_or(0.0),
                        map_.word("COORDINATE_SYSTEM_NAME").value_or("") == "PLANETOGRAPHIC",
                        {}};
    const bool to_west = map_.word("POSITIVE_LONGITUDE_DIRECTION").value_or("EAST") == "WEST";
    planet.parameters.longitude = map_.number("CENTER_LONGITUDE").value_or(0.0) * (to_west ? -1.0 : 1.0);
    planet.parameters.latitude = map_.number("CENTER_LATITUDE").value_or(0.0);
    if (cylindrical_) planet.parameters.latitude = true_latitude_;
    planet.parameters.parallel_1 = map_.number("FIRST_STANDARD_PARALLEL").value_or(0.0);
    planet.parameters.parallel_2 = map_.number("SECOND_STANDARD_PARALLEL").value_or(0.0);
    planet.pole.latitude = map_.number("OBLIQUE_PROJ_POLE_LATITUDE").value_or(90.0);
    planet.pole.longitude = map_.number("OBLIQUE_PROJ_POLE_LONGITUDE").value_or(0.0) * (to_west ? -1.0 : 1.0);
    planet.pole_rotation = map_.number("OBLIQUE_PROJ_POLE_ROTATION").value_or(0.0);
    geo_.system.wkt = planetary_wkt(planet, place_.warnings);
  }

  /// Which unit the map has, and how many of them lie between samples; false where the label does not say.
  bool read_scale() {
    const bool simple = projection_ == "SIMPLE CYLINDRICAL";
    cylindrical_ = simple || projection_ == "EQUIRECTANGULAR" || projection_ == "EQUIDISTANT CYLINDRICAL";
    const double centre = map_.number("CENTER_LATITUDE").value_or(0.0);
    if (!simple) true_latitude_ = map_.number("FIRST_STANDARD_PARALLEL").value_or(centre);
    if (simple) bases_[1] = centre;
    degrees_ = cylindrical_ && true_latitude_ == 0.0;

    const std::string unit = map_.unit("MAP_RESOLUTION");
    const bool per_degree = unit.empty() || unit.find("/deg") != std::string::npos;
    // 0 stands for what the label does not say.
    const double resolution = per_degree ? std::max(0.0, map_.number("MAP_RESOLUTION").value_or(0.0)) : 0.0;
    const double scale = metres(map_, "MAP_SCALE").value_or(0.0);
    const double radius = geo_.system.semi_major_axis_m.value_or(0.0);
    // The radius that the label itself uses: HiRISE's is that of the ellipsoid at the true latitude.
    radius_ = resolution > 0.0 && scale > 0.0 ? scale * resolution / kDegree : radius;
    if (degrees_) {
      spacing_ = resolution > 0.0 ? 1.0 / resolution : scale / (radius * kDegree);
    } else {
      spacing_ = scale > 0.0 ? scale : radius * kDegree / resolution;
    }
    return spacing_ > 0.0 && std::isfinite(spacing_);
  }

  /// The West and North edges in units of the map, and the middle of the projection.
  void read_bounds() {
    const bool west_positive = map_.word("POSITIVE_LONGITUDE_DIRECTION").value_or("EAST") == "WEST";
    const double east = west_positive ? -1.0 : 1.0;
    const double centre = east * map_.number("CENTER_LONGITUDE").value_or(0.0);
    if (degrees_) centre_x_ = centre;
    if (!cylindrical_) return;
    const double to_x = degrees_ ? 1.0 : radius_ * kDegree * std::cos(true_latitude_ * kDegree);
    const double to_y = degrees_ ? 1.0 : radius_ * kDegree;
    turn_ = 360.0 * to_x;
    if (const auto value = map_.number("WESTERNMOST_LONGITUDE")) west_ = (east * *value - centre) * to_x + centre_x_;
    if (const auto value = map_.number("MAXIMUM_LATITUDE")) north_ = *value * to_y;
    if (const auto value = map_.number("MINIMUM_LATITUDE")) south_ = *value * to_y;
    if (const auto value = map_.number("EASTERNMOST_LONGITUDE")) east_ = (east * *value - centre) * to_x + centre_x_;
  }

  /// How far, in pixels, the bounds are from a raster whose first sample has these coordinates.
  [[nodiscard]] double distance_to_bounds(double x, double y) const {
    double distance = 0.0;
    if (west_) distance = std::abs(std::remainder(x - spacing_ / 2.0 - *west_, turn_)) / spacing_;
    if (north_) distance = std::max(distance, std::abs(y + spacing_ / 2.0 - *north_) / spacing_);
    return distance;
  }

  void place_by_offsets(double sample, double line) {
    const std::array<std::array<double, 2>, 3> first = {
        {{-sample, line}, {1.0 - sample, line - 1.0}, {sample, -line}}};  // columns East, rows North of the middle
    std::size_t best = 0;
    double best_base = bases_[0];
    double least = INFINITY;
    for (std::size_t i = 0; i < first.size(); ++i) {
      for (const double base : bases_) {
        const double distance = distance_to_bounds(centre_x_ + first[i][0] * spacing_, base + first[i][1] * spacing_);
        if (distance < least) std::tie(best, best_base, least) = std::tuple(i, base, distance);
      }
    }
    if (!west_ || !north_) {
      // A map round its own middle tells by its size alone.
      const auto middle = [&](double one) {
        return 2.0 * sample == static_cast<double>(columns_) + one && 2.0 * line == static_cast<double>(rows_) + one;
      };
      best = middle(1.0) ? 1 : 0;
      best_base = bases_[0];
      if (!middle(1.0) && !middle(-1.0)) {
        warn(
            "nothing in the label confirms LINE_ and SAMPLE_PROJECTION_OFFSET; they are taken from the middle of the "
            "first sample");
      }
    } else if (!(least <= kSamePlace)) {
      best = 0;
      best_base = bases_[0];
      warn(
          fmt::format("LINE_ and SAMPLE_PROJECTION_OFFSET lie {:.2f} samples or more off MAXIMUM_LATITUDE and "
                      "WESTERNMOST_LONGITUDE; the offsets are followed",
                      least));
    }
    geo_.has_origin = true;
    geo_.origin_x = centre_x_ + first[best][0] * spacing_;
    geo_.origin_y = best_base + first[best][1] * spacing_;
  }

  void place_by_bounds() {
    if (!west_ || !north_ || !south_ || !east_) {
      warn(loss("the label gives neither projection offsets nor bounds; the origin is unknown"));
      return;
    }
    const auto spans = [&](std::int64_t columns, std::int64_t rows) {
      const double width = static_cast<double>(columns) * spacing_;
      return std::abs(std::remainder(*east_ - *west_ - width, turn_)) <= kSamePlace * spacing_ &&
             std::abs(*north_ - *south_ - static_cast<double>(rows) * spacing_) <= kSamePlace * spacing_;
    };
    double inward = 0.0;
    if (spans(columns_, rows_)) {
      inward = spacing_ / 2.0;
    } else if (spans(columns_ - 1, rows_ - 1)) {
      geo_.registration = Registration::kPoint;
    } else {
      warn(loss(fmt::format(
          "the label's bounds do not span {} x {} samples and it gives no projection offsets; the origin is "
          "unknown",
          columns_, rows_)));
      return;
    }
    geo_.has_origin = true;
    geo_.origin_x = *west_ + inward;
    geo_.origin_y = *north_ - inward;
  }

  /// The turn of longitude that the label's bounds name; within [-180, 360) where they name none.
  void choose_turn() {
    if (west_ && *west_ >= -180.0 && *west_ < 360.0) {
      geo_.origin_x += 360.0 * std::round((*west_ - geo_.origin_x) / 360.0);
    } else if (geo_.origin_x < -180.0 || geo_.origin_x >= 360.0) {
      geo_.origin_x -= 360.0 * std::floor((geo_.origin_x + 180.0) / 360.0);
    }
  }

  const LabelFields& map_;
  std::int64_t columns_;
  std::int64_t rows_;
  Pds3Place& place_;
  Georeference& geo_;
  std::string projection_;
  bool cylindrical_ = false;
  bool degrees_ = false;
  double true_latitude_ = 0.0;
  double spacing_ = 0.0;
  double radius_ = 0.0;
  double centre_x_ = 0.0;             // where the offsets count from
  std::array<double, 2> bases_ = {};  // latitudes that the lines may count from
  double turn_ = 360.0;               // once round
  std::optional<double> west_;        // edges
  std::optional<double> east_;
  std::optional<double> north_;
  std::optional<double> south_;
};

/// Interprets TARGET_NAME and IMAGE_MAP_PROJECTION of a label (PDS Standards Reference 3.8, appendix B).
///
/// Simple cylindrical maps, and equirectangular ones true at the equator, are placed in degrees, East positive; all
/// others in metres of their own projection, whose name is carried. The projection offsets count from the middle of
/// sample (1, 1); MOLA's labels count that sample as 1 instead, and old ones turn the sign. MAXIMUM_LATITUDE and
/// WESTERNMOST_LONGITUDE, which name edges of pixels, tell which is meant; what they do not confirm is said in a
/// warning.
Pds3Place place_from_pds3(const std::string& path, const LabelBlock& root, std::int64_t columns, std::int64_t rows) {
  Pds3Place place;
  const LabelEntry* target = root.entry("TARGET_NAME");
  const std::string name = target == nullptr || target->values.empty() ? "" : target->values.front().text;
  const auto maps = root.all("IMAGE_MAP_PROJECTION");
  if (!maps.empty()) Placer(LabelFields(path, *maps.front()), columns, rows, place).read(name);
  ReferenceSystem& system = place.georeference.system;
  system.body = body_of(name, system.semi_major_axis_m);
  if (body_of(name, std::nullopt).empty() && !name.empty()) system.body = capitalised(name);
  return place;
}

class Pds3Source final : public PlainSource {
 public:
  Pds3Source(const std::string& path, const OpenOptions& options) : PlainSource(path, "PDS3"), label_path_(path) {
    if (has_pds3_label(path)) label_path_ = file_beside(path, std::filesystem::path(path).stem().string() + ".lbl");
    const LabelText label = read_label(label_path_, options.unpacked_bytes);
    const LabelBlock& image = only_image(label.root);
    const LabelFields fields(label_path_, image);
    image_ = pds3_layout(fields);
    find_data(label);
    if (label_path_ != path && !same_file(path, data_path_)) {
      throw Error(ErrorCode::kUnsupported,
                  fmt::format("{}: its label {} describes {} instead", path, label_path_, data_path_));
    }
    file_.emplace(data_path_, options.unpacked_bytes);
    check_size(label);
    describe(fields, label.root);
    layout_.take_band(info_, image_.order, choose_band(info_, options, image_.bands), image_.bands, label_path_,
                      image_.margin_bytes);
    apply_open_options(info_, options);
  }

 private:
  [[nodiscard]] const LabelBlock& only_image(const LabelBlock& root) const {
    const auto images = root.all("IMAGE");
    if (images.size() == 1) return *images.front();
    throw Error(ErrorCode::kUnsupported,
                fmt::format("{}: the label describes {} objects IMAGE, must be 1", label_path_, images.size()));
  }

  /// Follows ^IMAGE: (record), <BYTES>, "file", ("file", record). The outer label's pointer goes before inner ones.
  void find_data(const LabelText& label) {
    const LabelBlock* holder = label.root.entry("^IMAGE") != nullptr ? &label.root : nullptr;
    for (const char* name : {"UNCOMPRESSED_FILE", "FILE"}) {
      for (const LabelBlock* block : label.root.all(name)) {
        if (holder == nullptr && block->entry("^IMAGE") != nullptr) holder = block;
      }
    }
    if (holder == nullptr) {
      throw Error(ErrorCode::kUnsupported, label_path_ + ": the label has no ^IMAGE, which says where the samples are");
    }
    const LabelEntry& pointer = *holder->entry("^IMAGE");
    const auto refuse = [&](const std::string& what) {
      throw Error(ErrorCode::kCorrupt, fmt::format("{}: label line {}: ^IMAGE {}", label_path_, pointer.line, what));
    };
    if (pointer.values.empty() || pointer.values.size() > 2) refuse("must be a place, a file, or a file and a place");
    const bool names_file = pointer.values.size() == 2 || !number_of(pointer.values.front());
    data_path_ = label_path_;
    if (names_file) {
      const std::string& name = pointer.values.front().text;
      if (name.find('/') != std::string::npos) refuse(fmt::format("names {}, must be a file beside the label", name));
      data_path_ = file_beside(label_path_, name);
      if (data_path_.empty()) {
        throw Error(ErrorCode::kIo, fmt::format("{}: label line {}: ^IMAGE names {}, which is not beside the label",
                                                label_path_, pointer.line, name));
      }
    }
    if (names_file && pointer.values.size() == 1) return;
    const LabelValue& place = pointer.values.back();
    const std::optional<double> number = number_of(place);
    if (!number || !(*number >= 1.0) || *number > 9e15 || *number != static_cast<double>(std::int64_t(*number))) {
      refuse(fmt::format("is \"{}\", must be a whole number from 1", place.text));
    }
    const auto ordinal = static_cast<std::uint64_t>(*number) - 1;
    if (place.unit.rfind("byte", 0) == 0) {
      image_bytes_ = ordinal;
    } else {
      const LabelBlock& records = holder->entry("RECORD_BYTES") != nullptr ? *holder : label.root;
      const auto record =
          static_cast<std::uint64_t>(LabelFields(label_path_, records).count("RECORD_BYTES", 1, std::int64_t{1} << 31));
      if (ordinal > (std::uint64_t{1} << 62U) / record) refuse("points beyond any file");
      image_bytes_ = ordinal * record;
    }
    pointer_line_ = pointer.line;
  }

  [[nodiscard]] static bool same_file(const std::string& a, const std::string& b) {
    std::error_code ignored;
    return std::filesystem::equivalent(a, b, ignored);
  }

  /// Every sample must be in the file, and none inside the label.
  void check_size(const LabelText& label) {
    const std::uint64_t total = image_.total_bytes;
    const std::uint64_t there = file_->size_bytes();
    if (data_path_ == label_path_ && image_bytes_ < label.end_bytes) {
      // Editing a label's text moves the samples. Where they fill the rest of the file there is no doubt.
      if (there < label.end_bytes + total || there > label.end_bytes + total + 3) {
        throw Error(ErrorCode::kCorrupt, fmt::format("{}: label line {}: ^IMAGE points at byte {}, inside the label, "
                                                     "which ends at byte {}",
                                                     label_path_, pointer_line_, image_bytes_ + 1, label.end_bytes));
      }
      info_.warnings.push_back(
          fmt::format("^IMAGE points at byte {}, inside the label, which ends at byte {}; the samples fill the rest of "
                      "the file and "
                      "are read from there",
                      image_bytes_ + 1, label.end_bytes));
      image_bytes_ = label.end_bytes;
    }
    if (image_bytes_ + total > there) {
      throw Error(ErrorCode::kCorrupt,
                  fmt::format("{}: has {} bytes; {} x {} samples of {} from byte {} need {}", data_path_, there,
                              image_.columns, image_.rows, to_string(image_.type), image_bytes_, image_bytes_ + total));
    }
    layout_ = image_.samples;
    layout_.offset_bytes += image_bytes_;
  }

  void describe(const LabelFields& image, const LabelBlock& root) {
    info_.width = image_.columns;
    info_.height = image_.rows;
    info_.sample_type = image_.type;
    info_.block_width = info_.width;
    info_.block_height = 1;
    info_.z_scale = image.number("SCALING_FACTOR").value_or(1.0);
    info_.z_offset = image.number("OFFSET").value_or(0.0);
    if (info_.z_scale == 0.0) image.refuse("SCALING_FACTOR", "other than 0");
    const std::string unit = image.word("UNIT").value_or("N/A");
    if (unit != "N/A" && unit != "UNK" && unit != "NULL") {
      const std::optional<LinearUnit> length = linear_unit(unit);
      info_.vertical_unit = length ? length->name : lower_case(unit);
      info_.metres_per_vertical_unit = length ? length->metres : 1.0;
    }
    for (const char* key : {"MISSING_CONSTANT", "MISSING", "NULL", "NULL_CONSTANT", "CORE_NULL", "INVALID_CONSTANT",
                            "LOW_REPR_SATURATION", "LOW_INSTR_SATURATION", "HIGH_REPR_SATURATION",
                            "HIGH_INSTR_SATURATION", "CORE_LOW_REPR_SATURATION", "CORE_LOW_INSTR_SATURATION",
                            "CORE_HIGH_REPR_SATURATION", "CORE_HIGH_INSTR_SATURATION"}) {
      if (const LabelEntry* entry = image.block().entry(key)) {
        for (const LabelValue& value : entry->values) add_void(key, value);
      }
    }
    // ISIS writes its special pixels into PDS products: the lowest values of 32 bit floats, up to FF7FFFF9.
    if (info_.sample_type == SampleType::kFloat32 && layout_.stored_as != StoredAs::kVaxFloat)
      info_.valid_min = std::bit_cast<float>(0xFF7FFFFAU);
    Pds3Place place = place_from_pds3(label_path_, root, info_.width, info_.height);
    info_.georeference = std::move(place.georeference);
    info_.warnings.insert(info_.warnings.end(), place.warnings.begin(), place.warnings.end());
  }

  /// A based constant of a float gives the bits, not the number.
  void add_void(const char* key, const LabelValue& value) {
    std::optional<double> number = number_of(value);
    if (!number) return;  // N/A
    if (info_.sample_type == SampleType::kFloat32 && value.text.find('#') != std::string::npos) {
      const auto bits = static_cast<std::uint32_t>(*number);
      number = static_cast<double>(layout_.stored_as == StoredAs::kVaxFloat ? float_from_vax(bits)
                                                                            : std::bit_cast<float>(bits));
    }
    const std::optional<double> stored = void_value_as_stored(info_.sample_type, *number);
    if (!stored) {
      info_.warnings.push_back(loss(fmt::format("{} is {}, which no {} sample can hold; it is left aside", key,
                                                value.text, to_string(info_.sample_type))));
    } else if (std::find(info_.void_values.begin(), info_.void_values.end(), *stored) == info_.void_values.end()) {
      info_.void_values.push_back(*stored);
    }
  }

  std::string label_path_;
  Pds3Layout image_;
  std::string data_path_;
  std::uint64_t image_bytes_ = 0;  // where ^IMAGE points
  int pointer_line_ = 0;
};

}  // namespace

bool looks_like_pds3(std::span<const std::byte> head) {
  std::string_view text = text_of(head);
  const auto skip_blank = [&] {
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.front())) != 0) text.remove_prefix(1);
  };
  skip_blank();
  if (text.substr(0, 4) == "CCSD" || text.substr(0, 4) == "NJPL") {
    text.remove_prefix(std::min(text.find('\n'), text.size()));
    skip_blank();
  }
  return text.substr(0, 14) == "PDS_VERSION_ID";
}

bool has_pds3_label(const std::string& path) {
  if (lower_case(std::filesystem::path(path).extension().string()) != ".img") return false;
  std::array<std::byte, 128> head = {};
  const auto is_label = [&](const std::string& file) {
    const RawFile raw(file);
    return looks_like_pds3(std::span(head).first(raw.read_some(0, head)));
  };
  if (is_label(path)) return false;
  const std::string label = file_beside(path, std::filesystem::path(path).stem().string() + ".lbl");
  return !label.empty() && is_label(label);
}

std::unique_ptr<HeightSource> open_pds3(const std::string& path, const OpenOptions& options) {
  return std::make_unique<Pds3Source>(path, options);
}

}  // namespace isohf
