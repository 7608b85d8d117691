#include "input/options_ground.h"

#include <algorithm>
#include <vector>

#include "formats/adapters/windowed_source.h"
#include "input/options_source.h"
#include "isohf/convert/frame/source_frame.h"

namespace isohf::cli {

void add_ground_options(CommandLine& line, GroundRequest& request) {
  static const std::vector<std::string> kinds = {
      "auto", "equirectangular", "local", "transverse-mercator", "utm", "lambert-conformal", "polar-stereographic",
      "none"};
  line.group("Ground");
  line.option("--to-crs", "KIND",
              "Project degrees to metres, and maps to truer ones: equirectangular, local, transverse-mercator, utm, "
              "lambert-conformal, polar-stereographic, none, or chosen by extent (default: auto of degrees, none of "
              "maps); parameters may "
              "follow, as in utm:32N; or a reference system: EPSG:3035, WKT, a PROJ string, or a file with one of them",
              [&](const std::string& text) {
                // A file may be called as a kind is.
                const bool is_kind = std::ranges::find(kinds, text.substr(0, text.find(':'))) != kinds.end();
                request.projection = ProjectionRequest::parse(is_kind ? text : system_from(text));
              });
  line.words(kinds);
  line.flag("--wrap-x", "Join the East edge of an input all the way round to its West edge", request.wrap_x);
}

void add_geoid_option(CommandLine& line, GeoidRequest& request) {
  line.option("--geoid", "FILE.pgm[:WAY]",
              "Move elevations by a geoid of GeographicLib's: to-ellipsoidal, from heights above it (default), or "
              "to-orthometric",
              [&](const std::string& text) { request = GeoidRequest::parse(text); });
}

std::unique_ptr<HeightSource> with_geoid(std::unique_ptr<HeightSource> source, const GeoidRequest& request) {
  if (request.path.empty()) return source;
  return std::make_unique<GeoidSource>(std::move(source), request);
}

std::unique_ptr<HeightSource> laid_out(std::unique_ptr<HeightSource> source, const GeoidRequest& geoid,
                                       const GroundRequest& ground) {
  if (ground.wrap_x) source = without_repeated_column(std::move(source));
  return with_geoid(std::move(source), geoid);
}

std::unique_ptr<HeightSource> without_repeated_column(std::unique_ptr<HeightSource> source) {
  GroundRequest own;
  understand_ground(source->info(), own);
  if (closure_of(source->info(), own.source_map.get()) != Closure::kRepeated) return source;
  return std::make_unique<ClosedSource>(std::move(source));
}

}  // namespace isohf::cli
