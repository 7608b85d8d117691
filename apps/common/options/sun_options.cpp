#include "options/sun_options.h"

#include <fmt/format.h>

#include <algorithm>

#include "isohf/error.h"
#include "isohf/surface.h"
#include "options/command_line.h"
#include "options/option_values.h"

namespace isohf::cli {

void add_sun_options(CLI::App& line, SunPlace& sun, std::optional<SolarTime>& date, const std::string& usual,
                     double least_deg) {
  CLI::Option* const place = option(
      line, "--sun", "AZ,EL", "Degrees clockwise from North, and above the horizon [default: " + usual + "]",
      [&sun, least_deg](const std::string& text) {
        const std::vector<double> numbers = parse_numbers(text);
        const bool is_sun =
            numbers.size() == 2 && std::abs(numbers[0]) <= 360.0 && numbers[1] >= least_deg && numbers[1] <= 90.0;
        if (!is_sun) {
          throw Error(ErrorCode::kInvalidArgument,
                      fmt::format("found '{}', must be AZ,EL: degrees from -360 to 360 and from {} to 90, as in 120,8",
                                  text, least_deg));
        }
        sun = {numbers[0], numbers[1]};
      });
  CLI::Option* const day =
      option(line, "--date", "YYYY-MM-DD", "The sun of that day over the archive's middle (Earth, Mars)",
             [&date](const std::string& text) {
               const auto [year, month, day_of_month] = parse_date(text);
               date = {year, month, day_of_month, date ? date->hours : 12.0};
             });
  option(line, "--time", "HH:MM", "Mean solar time of that day [default: 12:00]", [&date](const std::string& text) {
    const double hours = parse_time(text);
    if (date) date->hours = hours;  // else needs() refuses it
  })->needs(day);
  day->excludes(place);
}

SunPlace sun_over(ArchiveReader& archive, const std::optional<SolarTime>& date, const SunPlace& sun) {
  constexpr double kHighest_deg = 89.9;  // whose shadows are drawn
  if (!date) return sun;
  try {
    understand_source(archive);
  } catch (const Error&) {  // it may have degrees all the same; else DaySky reports it
  }
  const SunPlace then = DaySky(archive).sun(*date);
  if (then.elevation_deg < kLowestSun_deg) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("--time: the sun is {:.2g} degrees below the horizon then",
                                                         std::max(0.0, -then.elevation_deg)));
  }
  return {then.azimuth_deg, std::min(then.elevation_deg, kHighest_deg)};
}

}  // namespace isohf::cli
