#include "input/options_ground.h"

#include <algorithm>
#include <vector>

#include "formats/adapters/windowed_source.h"
#include "input/options_source.h"
#include "isohf/convert/frame/source_frame.h"
#include "options/command_line.h"
#include "options/option_values.h"

namespace isohf::cli {

void add_ground_options(CLI::App& line, GroundRequest& request) {
  group(line, "Map");
  option(line, "--to-crs", "SYSTEM",
         "Map of the result: auto, none, equirectangular, local, utm, transverse-mercator, lambert-conformal, "
         "polar-stereographic (parameters follow a colon, as in utm:32N), or a reference system as for --crs [default: "
         "auto for degrees, none for maps]",
         [&request](const std::string& text) {
           static const std::vector<std::string> kKinds = {"auto",
                                                           "none",
                                                           "equirectangular",
                                                           "local",
                                                           "utm",
                                                           "transverse-mercator",
                                                           "lambert-conformal",
                                                           "polar-stereographic"};
           const std::string word = text.substr(0, text.find(':'));
           // A file may be called as a kind is.
           const bool is_kind = std::ranges::find(kKinds, word) != kKinds.end();
           try {
             request.projection = ProjectionRequest::parse(is_kind ? text : system_from(text));
           } catch (const Error& error) {
             throw Error(error.code(), error.what() + did_you_mean(word, kKinds), error.parts());
           }
         });
  line.add_flag_callback(
      "--wrap-x", [&request] { request.wrap = Wrap::kAlways; },
      "Join the East edge to the West edge, or fail [default: if the input goes all the way round]");
  line.add_flag_callback(
      "--no-wrap", [&request] { request.wrap = Wrap::kNever; }, "Do not join them");
  exclusive(line, {"--wrap-x", "--no-wrap"});
}

CLI::Option* add_geoid_option(CLI::App& line, GeoidRequest& request) {
  return option(line, "--geoid", "FILE.pgm[:WAY]",
                "Apply a GeographicLib geoid: to-ellipsoidal or to-orthometric [default: to-ellipsoidal]",
                [&request](const std::string& text) { request = GeoidRequest::parse(text); });
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
