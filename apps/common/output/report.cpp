#include "output/report.h"

#include <fmt/format.h>

#include "output/json_output.h"
#include "output/standard_output.h"

namespace isohf::cli {

std::string Report::text(bool verbose) const {
  std::string text;
  for (const Line& line : lines_) {
    if (!line.is_detail || verbose) text += fmt::format("{:<12} {}\n", line.label, printable(line.words));
  }
  return text;
}

void Report::print(const Common& common, bool is_one_of_many) const {
  StandardOutput out(common);
  if (common.json) {
    out.write(is_one_of_many ? json_line(json_) : json_text(json_));
  } else if (!common.quiet) {
    out.write(text(common.verbose));
  }
  out.finish();
}

}  // namespace isohf::cli
