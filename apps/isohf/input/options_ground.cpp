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
  line.flag("--wrap-x", "Require that the input goes all the way round, and join its East edge to its West edge",
            [&] { request.wrap = Wrap::kAlways; });
  line.flag("--no-wrap", "Leave an input that goes all the way round open (default: join its edges)",
            [&] { request.wrap = Wrap::kNever; });
  line.exclusive({"--wrap-x", "--no-wrap"});
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
                                       const GroundRequest& ground, bool keeps_samples) {
  return with_geoid(without_repeated_column(std::move(source), ground, keeps_samples), geoid);
}

std::unique_ptr<HeightSource> without_repeated_column(std::unique_ptr<HeightSource> source, GroundRequest ground,
                                                      bool keeps_samples) {
  const SourceInfo& info = source->info();
  if (ground.wrap == Wrap::kNever || (ground.wrap == Wrap::kAuto && keeps_samples)) return source;
  GroundRequest own;
  understand_ground(info, own);
  if (closure_of(info, own.source_map.get()) != Closure::kRepeated) return source;
  if (ground.wrap == Wrap::kAuto) {
    SourceInfo closed = info;
    --closed.width;
    understand_ground(closed, ground);
    if (!make_source_frame(closed, ground).wraps_x) return source;
  }
  return std::make_unique<ClosedSource>(std::move(source));
}

}  // namespace isohf::cli
