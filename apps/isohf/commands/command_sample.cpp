/// isohf sample: elevation and normal at places of an archive's surface.

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "commands/command.h"
#include "commands/line_reader.h"
#include "isohf/archive.h"
#include "isohf/error.h"
#include "isohf/projection/other_reading.h"
#include "isohf/surface.h"
#include "open_archive.h"
#include "options/command_line.h"
#include "options/option_values.h"
#include "options/sun_options.h"
#include "options/work_options.h"
#include "output/json_output.h"
#include "output/standard_output.h"
#include "work_arena.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

constexpr const char* kSampleFooter =
    R"(Places are world units from the surface's North-West corner, x eastwards, z southwards: metres where the
source's units are known. Standard input holds one place a line, "x z" or "x,z"; empty lines and lines that
start with # are passed over. For each place one line is printed:

  elevation nx ny nz tile_column tile_row

The elevation is that of the triangle there, as it is drawn; the normal (x, y up, z) is the vertex normals'
blend over it, of length 1. Heights and lengths count in metres if their units are known. A place without
elevation gives 'void', one beyond the tiles 'outside'.

With --shadow two numbers follow: the elevation up to which the surface's shadow reaches there, and the share of the
sun that is seen, 0 to 1, from the surface or from --above it. Nothing is swept: the line to the sun is followed over
each triangle.

Examples:
  isohf sample dem.isohf --at 1200.5,340
  isohf sample dem.isohf --at 6.865,45.833 --in lonlat
  isohf sample dem.isohf --at 334000,5077500 --in crs --with lonlat
  isohf sample dem.isohf < places.txt > elevations.txt
  isohf sample dem.isohf --at 1200.5,340 --shadow --sun 120,8 --above 30    a roof)";

/// What numbers of places are.
enum class PlaceKind : std::uint8_t { kWorld, kSource, kGeo };

struct SampleOptions {
  const Common& common;
  std::string archive{};
  std::vector<MapPoint> places{};  ///< of --at
  PlaceKind in = PlaceKind::kWorld;
  bool with_degrees = false;  ///< answers hold them
  bool with_source = false;
  bool with_shadow = false;
  Sun sun{};
  SunPlace sun_place = kUsualSun;
  std::optional<SolarTime> date{};
  double above = 0.0;
  int threads = 0;
};

double parse_height(const std::string& text) {
  const double height = parse_number(text);
  if (height >= 0.0) return height;
  throw Error(ErrorCode::kInvalidArgument, "found '" + text + "', must be 0 or more");
}

/// Reads "x z" or "x,z"; false where the text is neither.
bool read_place(std::string_view text, WorldPoint& place) {
  constexpr std::string_view kBlanks = " \t";
  const auto next_word = [&]() -> std::string_view {
    const std::size_t first = std::min(text.find_first_not_of(kBlanks), text.size());
    const std::size_t last = std::min(text.find_first_of(" \t,", first), text.size());
    const std::string_view word = text.substr(first, last - first);
    text.remove_prefix(last);
    return word;
  };
  const auto skip_blanks = [&] { text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size())); };
  if (!read_number(next_word(), place.x)) return false;
  skip_blanks();
  if (!text.empty() && text.front() == ',') text.remove_prefix(1);
  if (!read_number(next_word(), place.z)) return false;
  skip_blanks();
  return text.empty() && std::isfinite(place.x) && std::isfinite(place.z);
}

/// What answers say of their places.
struct PlaceOutput {
  const WorldGeoreference* geo = nullptr;  ///< nullptr: no longitudes and latitudes
  const WorldGeoreference* source = nullptr;
};

std::string columns_from(const PlaceOutput& output, WorldPoint place) {
  std::string text;
  if (output.source != nullptr) {
    const MapPoint at = output.source->source_from_world(place);
    text += fmt::format(" {:.12g} {:.12g}", at.easting, at.northing);
  }
  if (output.geo != nullptr) {
    const GeoPoint at = output.geo->geo_from_world(place);
    text += fmt::format(" {:.12g} {:.12g}", at.longitude, at.latitude);
  }
  return text + '\n';
}

/// sun  null: not asked for
std::string text_from(const SurfaceSample& sample, const SunSample* sun) {
  if (sample.state == SurfaceState::kOutside) return "outside";
  if (sample.state == SurfaceState::kNodata) return "void";
  std::string text = fmt::format("{:.9g} {:.7f} {:.7f} {:.7f} {} {}", sample.elevation, sample.normal[0],
                                 sample.normal[1], sample.normal[2], sample.tile.column, sample.tile.row);
  if (sun != nullptr) text += fmt::format(" {:.9g} {:.7f}", sun->shadow_height, sun->share);
  return text;
}

std::string line_of(const SurfaceSample& sample, const SunSample* sun, WorldPoint place, const PlaceOutput& output) {
  // A place that the map does not show has no world coordinates.
  const auto number = [](double value) { return std::isnan(value) ? ordered_json(nullptr) : ordered_json(value); };
  ordered_json json = {{"x", number(place.x)}, {"z", number(place.z)}};
  const auto pair = [&](const char* first, double a, const char* second, double b) {
    return ordered_json{{first, number(a)}, {second, number(b)}};
  };
  if (output.source != nullptr) {
    const MapPoint at = output.source->source_from_world(place);
    json["crs"] = pair("x", at.easting, "y", at.northing);
  }
  if (output.geo != nullptr) {
    const GeoPoint at = output.geo->geo_from_world(place);
    json["lonlat"] = pair("longitude", at.longitude, "latitude", at.latitude);
  }
  constexpr const char* kStates[] = {"surface", "void", "outside"};
  json["state"] = kStates[static_cast<std::size_t>(sample.state)];
  if (sample.state != SurfaceState::kOutside) {
    json["tile"] = {{"column", sample.tile.column}, {"row", sample.tile.row}};
  }
  if (sample.state == SurfaceState::kSurface) {
    json["elevation"] = sample.elevation;
    json["normal"] = sample.normal;
    if (sun != nullptr) json["shadow"] = {{"elevation", sun->shadow_height}, {"sun_share", sun->share}};
  }
  return json_line(json);
}

/// Recognises places that lie outside because their numbers are swapped, or of another kind.
class PlaceHints {
 public:
  PlaceHints(const Metadata& metadata, std::string archive, PlaceKind asked)
      : covered_{metadata.valid.x0, metadata.valid.z0, metadata.valid.x1, metadata.valid.z1},
        archive_(std::move(archive)),
        asked_(asked) {}

  /// Looks at a place as it was typed; `world` is where that lies.
  void look_at(MapPoint typed, WorldPoint world) {
    const bool is_inside =
        world.x >= covered_.west && world.x <= covered_.east && world.z >= covered_.south && world.z <= covered_.north;
    if (is_inside || !hint_.empty() || looked_at_ == kMostLookedAt) return;
    if (looked_at_++ == 0) prepare();
    const MapBounds place{typed.easting, typed.northing, typed.easting, typed.northing};
    const auto other = other_reading(place, covered_, readings_);
    if (!other) return;
    constexpr const char* kWords[] = {"world", "crs", "lonlat"};
    const char* const in = kWords[static_cast<std::size_t>(kinds_[other->index])];
    hint_ = fmt::format("{:.10g},{:.10g} lies outside; read as {} it lies inside: --at {:.10g},{:.10g} --in {}",
                        typed.easting, typed.northing, other->words, other->is_swapped ? typed.northing : typed.easting,
                        other->is_swapped ? typed.easting : typed.northing, in);
  }
  /// Of the first place that was recognised; empty where none was.
  [[nodiscard]] const std::string& hint() const { return hint_; }

 private:
  static constexpr int kMostLookedAt = 1000;

  /// What is asked for comes first.
  void add(PlaceKind kind, const PairReading& reading) {
    readings_.insert(kind == asked_ ? readings_.begin() : readings_.end(), reading);
    kinds_.insert(kind == asked_ ? kinds_.begin() : kinds_.end(), kind);
  }

  /// Its own reader: the source's map is understood for hints alone.
  void prepare() {
    ArchiveReader archive = open_archive(archive_);
    try {
      understand_source(archive);
    } catch (const Error&) {  // then places may still be swapped
    }
    const WorldGeoreference places(archive.metadata());
    const auto flat = [](WorldPoint at) { return MapPoint{at.x, at.z}; };
    // Every small number is a place of the world.
    if (asked_ == PlaceKind::kWorld) add(PlaceKind::kWorld, {"x, z", "z, x", [](MapPoint at) { return at; }});
    if (places.has_source() && archive.metadata().source.crs_unit != "degree") {
      add(PlaceKind::kSource, {"easting, northing", "northing, easting",
                               [places, flat](MapPoint at) { return flat(places.world_from_source(at)); }});
    }
    if (places.has_geo()) {
      add(PlaceKind::kGeo, geographic_reading([places, flat](GeoPoint at) { return flat(places.world_from_geo(at)); }));
    }
  }

  MapBounds covered_;  ///< x0, z0, x1, z1
  std::string archive_;
  PlaceKind asked_;
  std::vector<PairReading> readings_;
  std::vector<PlaceKind> kinds_;
  std::string hint_;
  int looked_at_ = 0;
};

/// Collects places and answers them together, in their order.
class Answers {
 public:
  Answers(const ArchiveReader& archive, const SampleOptions& options, const PlaceOutput& output)
      : options_(options), output_(output), surface_(archive, job()) {}

  void add(WorldPoint place) {
    places_.push_back(place);
    if (places_.size() == kMostPlaces) answer();
  }

  /// Answers what there is, and hands it to the operating system.
  void flush() {
    answer();
    out_.flush();
  }

 private:
  static constexpr std::size_t kMostPlaces = std::size_t{1} << 18U;
  static constexpr std::size_t kPlacesOfText = 4096;
  static constexpr std::uint64_t kTileBytes = std::uint64_t{256} << 20U;  ///< decoded tiles that are kept

  /// Its threads are those of the arena around it, which answers are written on as well.
  static Job job() {
    Job job;
    job.memory_bytes = kTileBytes;
    return job;
  }

  void answer() {
    std::vector<SurfaceSample> samples(places_.size());
    surface_.sample(places_, std::span(samples));
    std::vector<SunSample> suns(options_.with_shadow ? places_.size() : 0);
    if (options_.with_shadow) surface_.sample(places_, options_.sun, options_.above, suns);
    std::vector<std::string> texts((samples.size() + kPlacesOfText - 1) / kPlacesOfText);
    oneapi::tbb::parallel_for(std::size_t{0}, texts.size(), [&](std::size_t part) {
      const std::size_t end = std::min((part + 1) * kPlacesOfText, samples.size());
      for (std::size_t i = part * kPlacesOfText; i < end; ++i) {
        const SunSample* sun = options_.with_shadow ? &suns[i] : nullptr;
        texts[part] += options_.common.json ? line_of(samples[i], sun, places_[i], output_)
                                            : text_from(samples[i], sun) + columns_from(output_, places_[i]);
      }
    });
    for (const std::string& text : texts) out_.write(text);
    places_.clear();
  }

  const SampleOptions& options_;
  const PlaceOutput& output_;
  Surface surface_;
  StandardOutput out_{options_.common};
  std::vector<WorldPoint> places_;
};

/// Every place on standard input: x and z, or longitude and latitude.
void read_places(const Common& common, Answers& answers, const std::function<void(MapPoint)>& take) {
  LineReader reader(common.in);
  const auto flush = [&] { answers.flush(); };
  WorldPoint place{};
  while (const std::optional<std::string> line = reader.next(flush)) {
    const std::size_t first = line->find_first_not_of(" \t");
    if (first == std::string::npos || (*line)[first] == '#') continue;
    if (!read_place(*line, place)) {
      throw Error(ErrorCode::kCorrupt, fmt::format("standard input, line {}: found '{}', must be 'x z', two numbers",
                                                   reader.line_number(), line->substr(0, 80)));
    }
    take({place.x, place.z});
  }
}

/// The archive's places; its source's map is understood where that is `needed` for them, or `welcome`.
WorldGeoreference places_of(ArchiveReader& archive, bool needs_geo, bool needs_source, bool is_welcome) {
  const auto lacks = [](const WorldGeoreference& places, bool geo, bool source) {
    return (geo && !places.has_geo()) || (source && !places.has_source());
  };
  const WorldGeoreference first(archive.metadata());
  const bool is_needed = lacks(first, needs_geo, needs_source);
  if (!is_needed && !(is_welcome && lacks(first, true, true))) return first;
  try {
    understand_source(archive);
  } catch (const Error&) {
    if (is_needed) throw;
  }
  WorldGeoreference places(archive.metadata());
  if (!lacks(places, needs_geo, needs_source)) return places;
  throw Error(ErrorCode::kInvalidArgument, archive.path() + ": its source has no place in " +
                                               (needs_geo ? "degrees" : "coordinates") +
                                               "; give places in world units, --in world");
}

/// The sun of --date, or that of --sun.
Sun sun_of(const SampleOptions& options, ArchiveReader& archive) {
  const SunPlace place = options.date ? sun_of_day(archive, *options.date) : options.sun_place;
  Sun sun;
  sun.azimuth_deg = place.azimuth_deg;
  sun.elevation_deg = place.elevation_deg;
  return sun;
}

int run(SampleOptions options) {
  const Common& common = options.common;
  ArchiveReader archive = open_archive(options.archive);
  print_warnings(common, archive.warnings());
  const bool takes_geo = options.in == PlaceKind::kGeo;
  const bool takes_source = options.in == PlaceKind::kSource;
  const WorldGeoreference places =
      places_of(archive, takes_geo || options.with_degrees, takes_source || options.with_source, common.json);
  options.sun = sun_of(options, archive);
  PlaceOutput output;
  if (options.with_degrees || (common.json && places.has_geo())) output.geo = &places;
  if (options.with_source || (common.json && places.has_source())) output.source = &places;
  PlaceHints hints(archive.metadata(), options.archive, options.in);
  WorkArena threads(options.threads);
  threads.execute([&] {
    Answers answers(archive, options, output);
    const auto take = [&](MapPoint typed) {
      const WorldPoint place = takes_geo      ? places.world_from_geo({typed.easting, typed.northing})
                               : takes_source ? places.world_from_source(typed)
                                              : WorldPoint{typed.easting, typed.northing};
      hints.look_at(typed, place);
      answers.add(place);
    };
    for (const MapPoint place : options.places) take(place);
    if (options.places.empty()) {
      try {
        read_places(common, answers, take);
      } catch (const Error&) {
        answers.flush();  // what came before a bad place is answered
        throw;
      }
    }
    answers.flush();
  });
  if (!hints.hint().empty()) print_warning(common, archive.path() + ": " + hints.hint());
  return kExitDone;
}

}  // namespace

Run add_sample(CLI::App& line, Common& common) {
  const auto kept = std::make_shared<SampleOptions>(SampleOptions{common});
  SampleOptions& options = *kept;
  positional(line, "ARCHIVE", "Archive to sample", options.archive);
  repeated(line, "--at", "X,Z", "A place, instead of those on standard input; may be given again",
           [&options](const std::string& text) {
             WorldPoint place{};
             if (!read_place(text, place))
               throw Error(ErrorCode::kInvalidArgument,
                           "found '" + text + "', must be X,Z, two numbers, as in 500,300");
             options.places.push_back({place.x, place.z});
           });
  choice<PlaceKind>(line, "--in",
                    {{"world", PlaceKind::kWorld}, {"lonlat", PlaceKind::kGeo}, {"crs", PlaceKind::kSource}},
                    "Places are world units, degrees of longitude and latitude, or coordinates of the input [default: "
                    "world]",
                    options.in);
  repeated(line, "--with", "lonlat|crs", "Print the place too, in degrees or in coordinates of the input",
           [&options](const std::string& text) {
             (parse_word(text, {"lonlat", "crs"}) == 0 ? options.with_degrees : options.with_source) = true;
           });
  group(line, "Shadow");
  CLI::Option* const shadow = line.add_flag("--shadow", options.with_shadow,
                                            "Print the shadow's elevation and the visible share of the sun too");
  option(line, "--above", "H", "Look from H above the surface, vertical units [default: 0]",
         [&options](const std::string& text) { options.above = parse_height(text); })
      ->needs(shadow);
  add_sun_options(line, options.sun_place, options.date);
  for (const char* name : {"--sun", "--date"}) line.get_option(name)->needs(shadow);
  add_threads_option(line, options.threads);
  line.footer(kSampleFooter);
  return [kept] { return run(*kept); };
}

}  // namespace isohf::cli
