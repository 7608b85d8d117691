/// isohf sample: elevation and normal at places of an archive's surface.

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "archive_places.h"
#include "command.h"
#include "isohf/archive/reader.h"
#include "isohf/base/error.h"
#include "isohf/lattice/barycentric.h"
#include "isohf/restore/archive_geometry.h"
#include "isohf/surface/normals.h"
#include "json_output.h"
#include "line_reader.h"
#include "open_archive.h"
#include "option_values.h"
#include "options_common.h"
#include "standard_output.h"
#include "tile_cache.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

constexpr const char* kFooter =
    R"(Places are world units from the surface's North-West corner, x eastwards, z southwards: metres where the
source's units are known. Standard input holds one place a line, "x z" or "x,z"; empty lines and lines that
start with # are passed over. For each place one line is printed:

  elevation nx ny nz tile_column tile_row

The elevation is that of the triangle there, as it is drawn; the normal (x, y up, z) is the vertex normals'
blend over it, of length 1. A place without elevation gives 'void', one beyond the tiles 'outside'.

Examples:
  isohf sample dem.isohf --at 1200.5 340
  isohf sample dem.isohf --at-lonlat 6.865 45.833
  isohf sample dem.isohf --at-crs 334000 5077500 --with-lonlat      in metres of the input's own map
  isohf sample dem.isohf < places.txt > elevations.txt)";

struct SampleOptions {
  CommonOptions common;
  std::string archive;
  std::vector<WorldPoint> places;
  std::vector<GeoPoint> geo_places;
  std::vector<MapPoint> source_places;
  bool reads_degrees = false;  ///< standard input holds longitudes and latitudes
  bool reads_source = false;   ///< standard input holds coordinates of the source
  bool with_degrees = false;   ///< answers hold them
  bool with_source = false;
  std::uint64_t memory_bytes = std::uint64_t{256} << 20;
};

std::optional<SampleOptions> parse(const Arguments& arguments) {
  SampleOptions options;
  CommandLine line("sample", "Prints elevation and normal at places read from standard input.");
  line.group("Arguments");
  line.positional("ARCHIVE", "-i,--input", "Archive to sample", options.archive);
  line.repeated_pair("--at", "X Z", "A place, instead of standard input; may be given again",
                     [&](const std::string& x, const std::string& z) {
                       options.places.push_back({parse_number(x), parse_number(z)});
                     });
  line.repeated_pair("--at-lonlat", "LON LAT", "A place in degrees of the input's own datum; may be given again",
                     [&](const std::string& longitude, const std::string& latitude) {
                       options.geo_places.push_back({parse_number(longitude), parse_number(latitude)});
                     });
  line.repeated_pair("--at-crs", "E N", "A place in the input's own coordinates; may be given again",
                     [&](const std::string& easting, const std::string& northing) {
                       options.source_places.push_back({parse_number(easting), parse_number(northing)});
                     });
  line.flag("--lonlat", "Places on standard input are longitude and latitude, degrees", options.reads_degrees);
  line.flag("--crs", "Places on standard input are in the input's own coordinates", options.reads_source);
  line.flag("--with-lonlat", "Add longitude and latitude to each line", options.with_degrees);
  line.flag("--with-crs", "Add the input's own coordinates to each line", options.with_source);
  line.exclusive({"--at", "--at-lonlat", "--at-crs", "--lonlat", "--crs"});
  add_memory_option(line, "Decoded tiles to keep (default 256M)", options.memory_bytes);
  add_common_options(line, options.common);
  line.footer(kFooter);
  if (!line.parse(arguments)) return std::nullopt;
  line.require("ARCHIVE", options.archive);
  return options;
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

struct Sample {
  bool inside = false;
  TileIndex tile{};
  double elevation = 0.0;  ///< NaN where void
  double normal[3] = {0.0, 1.0, 0.0};
};

Sample sample_at(const TileGrid& grid, TileCache& cache, WorldPoint place) {
  Sample sample;
  sample.inside = grid.contains(place);
  if (!sample.inside) return sample;
  const TilePoint at = grid.locate(place);
  sample.tile = at.tile;
  const CachedTile& tile = cache.tile(at.tile);
  const Barycentric where = barycentric(grid.shape(), at.point);
  const std::int64_t columns = grid.shape().columns();
  const std::int64_t rows = grid.shape().rows();
  sample.elevation = interpolate(where, View2D<const double>(tile.elevations.data(), columns, rows));
  if (std::isnan(sample.elevation)) return sample;
  double sum[3] = {0.0, 0.0, 0.0};
  for (std::size_t i = 0; i < 3; ++i) {
    if (where.weights[i] <= 0.0) continue;
    const Normal normal =
        vertex_normal(grid, View2D<const float>(tile.relative.data(), columns, rows), where.vertices[i]);
    sum[0] += where.weights[i] * static_cast<double>(normal.x);
    sum[1] += where.weights[i] * static_cast<double>(normal.y);
    sum[2] += where.weights[i] * static_cast<double>(normal.z);
  }
  // The blend is never 0: every normal points upwards.
  const double length = std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
  // Adding 0 turns -0, which would print as such, into 0.
  for (std::size_t i = 0; i < 3; ++i) sample.normal[i] = sum[i] / length + 0.0;
  return sample;
}

/// What answers say of their places.
struct PlaceOutput {
  const GeoPlaces* geo = nullptr;  ///< nullptr: no longitudes and latitudes
  const GeoPlaces* source = nullptr;
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

std::string text_from(const Sample& sample) {
  if (!sample.inside) return "outside";
  if (std::isnan(sample.elevation)) return "void";
  return fmt::format("{:.9g} {:.7f} {:.7f} {:.7f} {} {}", sample.elevation, sample.normal[0], sample.normal[1],
                     sample.normal[2], sample.tile.column, sample.tile.row);
}

std::string json_from(const Sample& sample, WorldPoint place, const PlaceOutput& output) {
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
  if (!sample.inside) {
    json["state"] = "outside";
  } else {
    const bool is_void = std::isnan(sample.elevation);
    json["state"] = is_void ? "void" : "surface";
    json["tile"] = {{"column", sample.tile.column}, {"row", sample.tile.row}};
    if (!is_void) {
      json["elevation"] = sample.elevation;
      json["normal"] = {sample.normal[0], sample.normal[1], sample.normal[2]};
    }
  }
  return json_line(json);
}

/// The archive's places; its source's map is understood where that is `needed` for them, or `welcome`.
GeoPlaces places_of(ArchiveReader& archive, bool needs_geo, bool needs_source, bool is_welcome) {
  const auto lacks = [](const GeoPlaces& places, bool geo, bool source) {
    return (geo && !places.knows_geo()) || (source && !places.knows_source());
  };
  const GeoPlaces first(archive.metadata());
  const bool is_needed = lacks(first, needs_geo, needs_source);
  if (!is_needed && !(is_welcome && lacks(first, true, true))) return first;
  try {
    understand_source(archive);
  } catch (const Error&) {
    if (is_needed) throw;
  }
  GeoPlaces places(archive.metadata());
  if (!lacks(places, needs_geo, needs_source)) return places;
  throw Error(ErrorCode::kInvalidArgument, archive.path() + ": its source has no place in " +
                                               (needs_geo ? "degrees" : "coordinates") +
                                               "; give places in world units, --at X Z");
}

int run(const SampleOptions& options) {
  ArchiveReader archive = open_archive(options.archive);
  if (!options.common.quiet) {
    for (const std::string& warning : archive.warnings()) print_warning(warning);
  }
  TileCache cache(archive, options.memory_bytes);
  StandardOutput out;
  const bool takes_geo = options.reads_degrees || !options.geo_places.empty();
  const bool takes_source = options.reads_source || !options.source_places.empty();
  const GeoPlaces places =
      places_of(archive, takes_geo || options.with_degrees, takes_source || options.with_source, options.common.json);
  PlaceOutput output;
  if (options.with_degrees || (options.common.json && places.knows_geo())) output.geo = &places;
  if (options.with_source || (options.common.json && places.knows_source())) output.source = &places;
  const auto answer = [&](WorldPoint place) {
    const Sample sample = sample_at(archive.grid(), cache, place);
    out.write(options.common.json ? json_from(sample, place, output) : text_from(sample) + columns_from(output, place));
  };
  for (const WorldPoint place : options.places) answer(place);
  for (const GeoPoint place : options.geo_places) answer(places.world_from_geo(place));
  for (const MapPoint place : options.source_places) answer(places.world_from_source(place));
  if (options.places.empty() && options.geo_places.empty() && options.source_places.empty()) {
    LineReader reader;
    while (const std::optional<std::string> line = reader.next([&] { out.flush(); })) {
      const std::size_t first = line->find_first_not_of(" \t");
      if (first == std::string::npos || (*line)[first] == '#') continue;
      WorldPoint place{};
      if (!read_place(*line, place)) {
        out.flush();
        throw Error(ErrorCode::kCorrupt, fmt::format("standard input, line {}: found '{}', must be 'x z', two numbers",
                                                     reader.line_number(), line->substr(0, 80)));
      }
      if (takes_geo) {
        answer(places.world_from_geo({place.x, place.z}));
      } else {
        answer(takes_source ? places.world_from_source({place.x, place.z}) : place);
      }
    }
  }
  out.finish();
  return kExitDone;
}

}  // namespace

int command_sample(const Arguments& arguments) {
  const std::optional<SampleOptions> options = parse(arguments);
  return options ? run(*options) : static_cast<int>(kExitDone);
}

}  // namespace isohf::cli
