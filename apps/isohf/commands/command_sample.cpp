/// isohf sample: elevation and normal at places of an archive's surface.

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>
#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands/command.h"
#include "input/options_source.h"
#include "isohf/archive.h"
#include "isohf/base/arena.h"
#include "isohf/base/text/number_text.h"
#include "isohf/error.h"
#include "isohf/restore/place/archive_coordinates.h"
#include "isohf/surface.h"
#include "open_archive.h"
#include "options/command_line.h"
#include "options/option_values.h"
#include "options/sun_options.h"
#include "options/work_options.h"
#include "output/json_output.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

constexpr const char* kSampleFooter =
    R"(World coordinates count from the surface's North-West corner, x eastwards, z southwards: metres if the input's units
are known. Standard input holds one place a line, "x z" or "x,z"; empty lines and lines that start with # are skipped.
--in and --with take 'world', 'lonlat' (longitude first), 'crs' (the input's own coordinates), or any reference system:
a code such as EPSG:2154, WKT, a PROJ string, or a .prj file. For each place one line is printed: 'void' (nodata),
'outside' (beyond the tiles), or

  elevation nx ny nz tile_column tile_row

with the normal of length 1, y up. --shadow appends the elevation up to which the surface's shadow reaches there, and
the visible share of the sun, 0 to 1, from the surface or from --above it. --with appends the place.

Examples:
  isohf sample dem.isohf --at 1200.5,340
  isohf sample dem.isohf --at 6.865,45.833 --in lonlat --with EPSG:2154
  isohf sample dem.isohf --in crs < places.txt > elevations.txt
  isohf sample dem.isohf --at 1200.5,340 --shadow --sun 120,8 --above 30    a roof)";

struct SampleOptions {
  const Common& common;
  std::string archive{};
  std::vector<MapPoint> places{};   ///< of --at
  std::string in{};                 ///< empty: world
  std::vector<std::string> with{};  ///< after --with
  bool with_shadow = false;
  SunPlace sun = kUsualSun;
  std::optional<SolarTime> date{};
  double above = 0.0;
  int threads = 0;
};

/// Reads "x z" or "x,z"; nullopt if the text is neither.
std::optional<MapPoint> read_place(std::string_view text) {
  constexpr std::string_view kBlanks = " \t";
  const auto next_word = [&]() -> std::string_view {
    text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
    const std::string_view word = text.substr(0, text.find_first_of(" \t,"));
    text.remove_prefix(word.size());
    text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
    return word;
  };
  const std::optional<double> x = number_from(next_word());
  if (text.starts_with(',')) text.remove_prefix(1);
  const std::optional<double> z = number_from(next_word());
  if (!x || !z || !text.empty() || !std::isfinite(*x) || !std::isfinite(*z)) return std::nullopt;
  return MapPoint{*x, *z};
}

/// Coordinates, and what they were called on the command line.
using NamedCoordinates = std::pair<std::string, Coordinates>;

Coordinates coordinates_named(const std::string& name, ArchiveReader& archive, std::vector<Warning>& warnings) {
  const bool is_word = name == "world" || name == "lonlat" || name == "crs";
  return coordinates_in(is_word ? name : system_from(name), archive, warnings);
}

/// sun  null without --shadow
std::string line_of_text(const SurfaceSample& sample, const SunSample* sun, WorldPoint place,
                         const std::vector<NamedCoordinates>& with) {
  std::string text = sample.state == SurfaceState::kOutside ? "outside" : "void";
  if (sample.state == SurfaceState::kSurface) {
    text = fmt::format("{:.9g} {:.7f} {:.7f} {:.7f} {} {}", sample.elevation, sample.normal[0], sample.normal[1],
                       sample.normal[2], sample.tile.column, sample.tile.row);
    if (sun != nullptr) text += fmt::format(" {:.9g} {:.7f}", sun->shadow_height, sun->share);
  }
  for (const auto& [name, coordinates] : with) {
    const MapPoint at = coordinates.from_world(place);
    text += fmt::format(" {:.12g} {:.12g}", at.easting, at.northing);
  }
  return text + '\n';
}

std::string line_of_json(const SurfaceSample& sample, const SunSample* sun, WorldPoint place,
                         const std::vector<NamedCoordinates>& with) {
  const auto pair = [](const char* first, double a, const char* second, double b) {
    const auto number = [](double value) { return std::isnan(value) ? ordered_json(nullptr) : ordered_json(value); };
    return ordered_json{{first, number(a)}, {second, number(b)}};
  };
  ordered_json json = pair("x", place.x, "z", place.z);
  for (const auto& [name, coordinates] : with) {
    const MapPoint at = coordinates.from_world(place);
    if (name == "lonlat") {
      json[name] = pair("longitude", at.easting, "latitude", at.northing);
    } else if (name == "crs") {
      json[name] = pair("x", at.easting, "y", at.northing);
    } else if (name != "world") {
      json["with"][name] = pair("x", at.easting, "y", at.northing);
    }
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

/// Collects places and answers them together, in their order.
class Answers {
 public:
  Answers(const ArchiveReader& archive, const SampleOptions& options, const std::vector<NamedCoordinates>& with)
      : options_(options), with_(with), surface_(archive, Job{.memory_bytes = kTileBytes}) {}

  void add(WorldPoint place) {
    places_.push_back(place);
    if (places_.size() == kMostPlaces) answer();
  }

  /// Answers what there is, and hands it to the operating system.
  void flush() {
    answer();
    out_.finish();
  }

 private:
  static constexpr std::size_t kMostPlaces = std::size_t{1} << 18U;
  static constexpr std::size_t kPlacesOfText = 4096;
  static constexpr std::uint64_t kTileBytes = std::uint64_t{256} << 20U;  ///< decoded tiles that are kept

  /// On the threads of the arena around it.
  void answer() {
    std::vector<SurfaceSample> samples(places_.size());
    surface_.sample(places_, std::span(samples));
    std::vector<SunSample> suns(options_.with_shadow ? places_.size() : 0);
    const Sun sun{options_.sun.azimuth_deg, options_.sun.elevation_deg, {}};
    if (options_.with_shadow) surface_.sample(places_, sun, options_.above, suns);
    const auto line_of = options_.common.json ? line_of_json : line_of_text;
    std::vector<std::string> texts((samples.size() + kPlacesOfText - 1) / kPlacesOfText);
    oneapi::tbb::parallel_for(std::size_t{0}, texts.size(), [&](std::size_t part) {
      const std::size_t end = std::min((part + 1) * kPlacesOfText, samples.size());
      for (std::size_t i = part * kPlacesOfText; i < end; ++i) {
        texts[part] += line_of(samples[i], suns.empty() ? nullptr : &suns[i], places_[i], with_);
      }
    });
    for (const std::string& text : texts) out_.write(text);
    places_.clear();
  }

  const SampleOptions& options_;
  const std::vector<NamedCoordinates>& with_;
  Surface surface_;
  StandardOutput out_{options_.common};
  std::vector<WorldPoint> places_;
};

/// Every place on standard input. What came so far is answered when nothing more is there yet, so that a program at the
/// other end of a pipe gets the answers to all that it has sent, and before a bad line is refused.
void read_places(const Common& common, Answers& answers, const std::function<void(MapPoint)>& take) {
  constexpr std::size_t kReadBytes = 1 << 16;
  constexpr std::size_t kLongestLine = 1 << 20;
  std::int64_t number = 0;
  const auto take_line = [&](std::string_view line) {
    ++number;
    if (line.ends_with('\r')) line.remove_suffix(1);
    const std::size_t first = line.find_first_not_of(" \t");
    if (first == std::string_view::npos || line[first] == '#') return;
    if (const std::optional<MapPoint> place = read_place(line)) return take(*place);
    answers.flush();
    throw Error(ErrorCode::kCorrupt, fmt::format("standard input, line {}: found '{}', must be 'x z', two numbers",
                                                 number, line.substr(0, 80)));
  };
  std::string buffer;
  for (bool is_at_end = false; !is_at_end;) {
    pollfd input{common.in, POLLIN, 0};
    if (::poll(&input, 1, 0) == 0) answers.flush();
    const std::size_t old_size = buffer.size();
    buffer.resize(old_size + kReadBytes);
    const ssize_t got = ::read(common.in, buffer.data() + old_size, kReadBytes);
    if (got < 0 && errno != EINTR) throw Error(ErrorCode::kIo, std::string("standard input: ") + std::strerror(errno));
    buffer.resize(old_size + static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    is_at_end = got == 0;
    if (is_at_end && !buffer.empty()) buffer += '\n';  // the last line needs no end
    std::string_view left = buffer;
    for (std::size_t end = 0; (end = left.find('\n')) != std::string_view::npos; left.remove_prefix(end + 1)) {
      take_line(left.substr(0, end));
    }
    buffer.erase(0, buffer.size() - left.size());
    if (buffer.size() > kLongestLine) take_line(buffer);
  }
}

/// How a place that lies outside may have been meant; empty if it cannot be told.
std::string hint(ArchiveReader& archive, const std::string& name, const Coordinates& in, MapPoint typed) {
  std::vector<Warning> ignored;
  const MapBounds asked{typed.easting, typed.northing, typed.easting, typed.northing};
  try {
    const Coordinates crs = coordinates_in("crs", archive, ignored);
    const char* const swapped = name == "world"    ? "z, x"
                                : name == "lonlat" ? "latitude, longitude"
                                                   : "northing, easting";
    const PairReading as_typed{"", swapped, [&](MapPoint at) { return crs.from_world(in.to_world(at)); }};
    if (const auto other = other_reading_of(archive, asked, as_typed)) {
      std::string text = fmt::format("{}: {:.10g},{:.10g} lies outside; read as {} it lies inside", archive.path(),
                                     typed.easting, typed.northing, other->words);
      const bool is_geo = other->words.find("longitude") != std::string::npos;
      if (!is_geo && other->words.find("UTM") != std::string::npos) return text;
      if (other->is_swapped) std::swap(typed.easting, typed.northing);
      return text + fmt::format(": --at {:.10g},{:.10g} --in {}", typed.easting, typed.northing,
                                other->index == 0 ? name
                                : is_geo          ? "lonlat"
                                                  : "crs");
    }
  } catch (const Error&) {  // it does not say where it lies
  }
  return {};
}

/// Whether a place that was typed without --in would also be one as longitude and latitude.
bool may_be_degrees(ArchiveReader& archive, MapPoint typed) {
  const Metadata& metadata = archive.metadata();
  if (metadata.horizontal_unit != "metre" || !metadata.source.ground) return false;
  const GeoExtent& extent = metadata.source.ground->extent;
  return typed.easting >= extent.west && typed.easting <= extent.east && typed.northing >= extent.south &&
         typed.northing <= extent.north;
}

int run(SampleOptions options) {
  const Common& common = options.common;
  ArchiveReader archive = open_archive(options.archive);
  print_warnings(common, archive.warnings());
  std::vector<Warning> warnings;
  const std::string name_in = options.in.empty() ? "world" : options.in;
  const Coordinates in = coordinates_named(name_in, archive, warnings);
  std::vector<NamedCoordinates> with;
  const auto add = [&](const std::string& name) {
    with.emplace_back(name, coordinates_named(name, archive, warnings));
  };
  for (const std::string& name : options.with) add(name);
  for (const char* const name : {"crs", "lonlat"}) {
    try {
      if (common.json) add(name);
    } catch (const Error&) {  // documents have what is known
    }
  }
  print_warnings(common, warnings);
  options.sun = sun_over(archive, options.date, options.sun);
  const WorldBounds& covered = archive.metadata().valid;
  std::optional<MapPoint> outside;  // the first such place, as it was typed
  Arena(Job{.threads = options.threads}).execute([&] {
    Answers answers(archive, options, with);
    const auto take = [&](MapPoint typed) {
      const WorldPoint place = in.to_world(typed);
      const bool is_inside =
          place.x >= covered.x0 && place.x <= covered.x1 && place.z >= covered.z0 && place.z <= covered.z1;
      if (!is_inside && !outside) outside = typed;
      answers.add(place);
    };
    for (const MapPoint place : options.places) take(place);
    if (options.places.empty()) read_places(common, answers, take);
    answers.flush();
  });
  if (options.in.empty() && !options.places.empty() && may_be_degrees(archive, options.places.front()) && !common.quiet)
    print_note(common, "places were read as world units; --in lonlat reads longitude, latitude");
  if (!outside) return kExitDone;
  if (const std::string text = hint(archive, name_in, in, *outside); !text.empty()) print_warning(common, text);
  return kExitDone;
}

}  // namespace

Run add_sample(CLI::App& line, Common& common) {
  const auto kept = std::make_shared<SampleOptions>(SampleOptions{common});
  SampleOptions& options = *kept;
  positional(line, "ARCHIVE", "Archive to sample", options.archive);
  repeated(line, "--at", "X,Z", "Sample this place instead of those on standard input; may be given again",
           [&options](const std::string& text) {
             const std::optional<MapPoint> place = read_place(text);
             if (!place) {
               throw Error(ErrorCode::kInvalidArgument,
                           "found '" + text + "', must be X,Z, two numbers, as in 500,300");
             }
             options.places.push_back(*place);
           });
  option(line, "--in", "world|lonlat|crs|SYSTEM", "Read places in these coordinates [default: world]", options.in);
  repeated(line, "--with", "world|lonlat|crs|SYSTEM", "Print the place too, in these coordinates; may be given again",
           [&options](const std::string& text) { options.with.push_back(text); });
  group(line, "Shadow");
  CLI::Option* const shadow = line.add_flag("--shadow", options.with_shadow,
                                            "Print the shadow's elevation and the visible share of the sun too");
  option(line, "--above", "H", "Look from H above the surface, vertical units [default: 0]",
         [&options](const std::string& text) { options.above = parse_number_in(text, 0.0, 1e9); })
      ->needs(shadow);
  add_sun_options(line, options.sun, options.date);
  for (const char* name : {"--sun", "--date"}) line.get_option(name)->needs(shadow);
  add_threads_option(line, options.threads);
  most_used(line, {"--at", "--in", "--with", "--shadow", "--sun"});
  line.footer(kSampleFooter);
  return [kept] { return run(*kept); };
}

}  // namespace isohf::cli
