#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "isohf/parts.h"
#include "isohf/shade.h"
#include "options/sun_options.h"
#include "program.h"
#include "view_state.h"

namespace isohf::view {

/// What the command line asks for; no file has been touched.
struct Options {
  cli::Common common;
  std::string archive;
  std::string screenshot;  ///< PNG to write
  bool verify = false;
  bool overwrite = false;
  bool legend = false;           ///< on pictures
  std::optional<Vec3> position;  ///< world units, y before exaggeration
  std::optional<Vec3> look_at;
  std::optional<SolarTime> date;  ///< the sun of that day and time
  std::optional<ShadePalette> palette;
  std::optional<isohf::TileRange> tiles;  ///< that --verify looks at
  SunPlace sun = cli::kUsualSun;
  std::optional<double> exaggeration;  ///< nullopt: default_exaggeration()
  std::optional<ColourMode> mode;      ///< nullopt: textures where the archive has them
  std::optional<double> far_distance;
  std::uint64_t memory_mib = 512;
  int threads = 0;  ///< workers that decode; 0: one less than the machine's cores
  ViewState view;   ///< size, mode, level, field of view, switches
};

/// Declares all of them. Throws Error{kInvalidArgument} while they are parsed.
void add_options(CLI::App& line, Options& options);
/// After parsing: checks what options cannot check alone. Throws likewise.
void complete(Options& options);

}  // namespace isohf::view
