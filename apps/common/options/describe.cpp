#include "options/describe.h"

#include <fmt/format.h>

#include <cmath>

#include "isohf/base/text/number_text.h"
#include "isohf/projection/projection_wkt.h"

namespace isohf::cli {

std::string describe_bytes(std::uint64_t bytes) {
  return in_bytes(static_cast<double>(bytes));
}

std::string describe_count(std::int64_t count) {
  std::string text = std::to_string(count);
  const std::size_t first = count < 0 ? 1 : 0;
  for (std::size_t end = text.size(); end > first + 3; end -= 3) text.insert(end - 3, 1, ' ');
  return text;
}

std::string describe_seconds(double seconds) {
  if (seconds < 60.0) return fmt::format("{:.{}f} s", seconds, seconds < 10.0 ? 2 : 0);
  const auto whole = static_cast<std::int64_t>(std::llround(std::fmin(seconds, 1e12)));
  if (whole < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
  return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

std::string describe_length(double length, bool metres) {
  if (!metres) return fmt::format("{:.6g} units", length);
  if (std::fabs(length) >= 1e4) return fmt::format("{:.6g} km", length / 1000.0);
  return fmt::format("{:.6g} m", length);
}

std::string describe_projection(const ProjectionRecord& record) {
  const double worst = 100.0 * record.worst_scale_error;
  return fmt::format("{}; lengths err by {} (at longitude {:.6g}, latitude {:.6g}); {}",
                     describe_projection(record.spec),
                     worst < 1000.0 ? fmt::format("up to {:.3g} %", worst) : "any amount",
                     std::remainder(record.worst_place.longitude, 360.0), record.worst_place.latitude, record.why);
}

std::string describe_map_scale(const MapGround& ground) {
  return fmt::format(
      "lengths on the input's map are {:.5g} times those on the ground, {:.5g} to {:.5g}; off by {:.3g} % at longitude "
      "{:.6g}, latitude {:.6g}",
      ground.mean_scale, ground.least_scale, ground.most_scale, 100.0 * ground.worst_error,
      ground.worst_place.longitude, ground.worst_place.latitude);
}

std::string describe_map(const std::optional<ProjectionRecord>& projection, const std::optional<MapGround>& ground,
                         const std::string& why_no_map, bool wraps_x) {
  std::string text = projection            ? describe_projection(*projection)
                     : ground              ? describe_map_scale(*ground)
                     : !why_no_map.empty() ? "scale not known: " + why_no_map
                                           : "";
  if (wraps_x) text += std::string(text.empty() ? "" : "; ") + "the East edge is joined to the West edge";
  return text;
}

std::string describe_textures(const TextureInfo& info) {
  return fmt::format("{0} x {0} texels a tile, {1} levels, {2}{3}, {4}: {5} members, {6}", info.size, info.levels,
                     to_string(info.format),
                     info.format == TextureFormat::kJpeg ? fmt::format(" {}", info.quality) : "",
                     info.channels == 1 ? "grey" : (info.channels == 3 ? "RGB" : "RGBA"), describe_count(info.members),
                     describe_bytes(info.bytes));
}

int raw_bytes(CodeType type) {
  return type == CodeType::kU8 ? 1 : type == CodeType::kU16 ? 2 : 4;
}

}  // namespace isohf::cli
