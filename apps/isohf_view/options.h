#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "isohf/parts.h"
#include "isohf/shade.h"
#include "options/options_common.h"
#include "view_state.h"

namespace isohf::view {

/// What the command line asks for; no file has been touched.
struct Options {
  enum class Action { kWindow, kScreenshot, kVerify };

  Action action = Action::kWindow;
  cli::CommonOptions common;
  std::string archive;
  std::string screenshot;  ///< PNG to write
  bool overwrite = false;
  bool legend = false;           ///< on pictures
  std::optional<Vec3> position;  ///< world units, y before exaggeration
  std::optional<Vec3> look_at;
  std::optional<SolarTime> date;  ///< the sun of that day and time
  std::optional<ShadePalette> palette;
  std::optional<isohf::TileRange> tiles;  ///< that --verify looks at
  double sun_azimuth_deg = 300.0;
  double sun_elevation_deg = 35.0;
  std::optional<double> exaggeration;  ///< nullopt: default_exaggeration()
  bool mode_given = false;             ///< else textures are shown where the archive has them
  std::optional<double> far_distance;
  std::uint64_t memory_mib = 512;
  int threads = 0;  ///< workers that decode; 0: one less than the machine's cores
  ViewState view;   ///< size, mode, level, field of view, switches
};

/// nullopt: help or the version was asked for and printed. Throws Error{kInvalidArgument}.
[[nodiscard]] std::optional<Options> parse_options(const cli::Arguments& arguments);

}  // namespace isohf::view
