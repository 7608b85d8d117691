#pragma once

#include <memory>

#include "isohf/convert.h"
#include "isohf/fill/geoid_source.h"
#include "program.h"

namespace isohf::cli {

/// How a source in degrees is laid out on the ground plane: --to-crs, --wrap-x, --no-wrap.
void add_ground_options(CLI::App& line, GroundRequest& request);

/// --geoid FILE.pgm[:to-ellipsoidal|to-orthometric].
CLI::Option* add_geoid_option(CLI::App& line, GeoidRequest& request);

/// The source with its elevations moved, where that was asked for.
[[nodiscard]] std::unique_ptr<HeightSource> with_geoid(std::unique_ptr<HeightSource> source,
                                                       const GeoidRequest& request);

/// The source as the options above have it laid out: moved by the geoid, closed if it will be joined.
/// keeps_samples  all of them are wanted back: no column goes unless the user demands it
[[nodiscard]] std::unique_ptr<HeightSource> laid_out(std::unique_ptr<HeightSource> source, const GeoidRequest& geoid,
                                                     const GroundRequest& ground, bool keeps_samples);

/// The source without a last column that repeats the first one, if it will be joined; any other as it is.
[[nodiscard]] std::unique_ptr<HeightSource> without_repeated_column(std::unique_ptr<HeightSource> source,
                                                                    GroundRequest ground, bool keeps_samples);

}  // namespace isohf::cli
