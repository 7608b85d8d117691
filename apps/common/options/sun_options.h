#pragma once

#include <optional>
#include <string>

#include "isohf/archive.h"
#include "isohf/shade.h"
#include "program.h"

namespace isohf::cli {

/// The lowest sun, in degrees above the horizon, that casts shadows on maps.
inline constexpr double kLowestSun_deg = 0.01;

/// Azimuth and elevation of the sun if none is given.
inline constexpr SunPlace kUsualSun{300.0, 35.0};

/// --sun AZ,EL, --date and --time. `usual` is what --help calls the default of --sun, `least_deg` its lowest elevation.
void add_sun_options(CLI::App& line, SunPlace& sun, std::optional<SolarTime>& date, const std::string& usual = "300,35",
                     double least_deg = kLowestSun_deg);

/// The sun of --date over an archive's middle; without a date that of --sun. Throws Error{kInvalidArgument} if the sun
/// is below the horizon.
[[nodiscard]] SunPlace sun_over(ArchiveReader& archive, const std::optional<SolarTime>& date, const SunPlace& sun);

}  // namespace isohf::cli
