#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "actions.h"
#include "isohf/base/output_file.h"
#include "measure/transition_sweep.h"

namespace isohf::view {

using nlohmann::ordered_json;

void sweep(const TileSource& source, const Options& options, const std::function<void()>& poll) {
  Session session(source, options);
  session.poll = poll;
  const SweepResult fading = sweep_levels(session, options.sweep_steps, false);
  const SweepResult plain = sweep_levels(session, options.sweep_steps, true);
  std::string csv = "level,fading_largest_jump,fading_mean_jump,fading_from_start,plain_largest_jump,plain_mean_jump\n";
  for (std::size_t i = 0; i < fading.steps.size(); ++i) {
    const SweepStep& a = fading.steps[i];
    const SweepStep& b = plain.steps[i];
    csv += fmt::format("{:.5f},{},{:.5f},{:.5f},{},{:.5f}\n", a.level, a.largest_jump, a.mean_jump, a.from_start,
                       b.largest_jump, b.mean_jump);
  }
  if (!options.csv.empty()) write_output(options.csv, csv, true);
  const std::string text = fmt::format(
      "steps: {}, levels 0 to {:g}\n"
      "fading:    largest jump of a pixel {} of 255, of the mean {:.4f}, largest retreat {:.4f}\n"
      "switching: largest jump of a pixel {} of 255, of the mean {:.4f}\n",
      options.sweep_steps, fading.steps.back().level, fading.largest_jump, fading.largest_mean_jump,
      fading.largest_retreat, plain.largest_jump, plain.largest_mean_jump);
  print_result(options.common, text, [&] {
    return ordered_json{
        {"archive", options.archives[0]},
        {"steps", options.sweep_steps},
        {"last_level", fading.steps.back().level},
        {"fading",
         {{"largest_jump", fading.largest_jump},
          {"largest_mean_jump", fading.largest_mean_jump},
          {"largest_retreat", fading.largest_retreat}}},
        {"switching", {{"largest_jump", plain.largest_jump}, {"largest_mean_jump", plain.largest_mean_jump}}}};
  });
}

}  // namespace isohf::view
