#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "options/options_common.h"
#include "output/json_output.h"
#include "output/standard_output.h"

namespace isohf::view {

/// Prints an action's result as --json and --quiet ask for; `json` makes the document where it is wanted.
template <typename MakeJson>
void print_result(const cli::CommonOptions& common, const std::string& text, const MakeJson& json) {
  cli::StandardOutput out;
  if (common.json) {
    out.write(cli::json_text(json()));
  } else if (!common.quiet) {
    out.write(text);
  }
  out.finish();
}

}  // namespace isohf::view
