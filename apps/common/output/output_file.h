#pragma once

#include <string>
#include <vector>

namespace isohf::cli {

/// Refuses, before anything is read, an output that is an input (by any name, or as its .part), that exists without
/// `overwrite`, or that output_place() refuses. Throws Error naming it.
void check_output_file(const std::vector<std::string>& inputs, const std::string& output, bool overwrite);

/// The same but for files that exist, which the caller looks at: returns the file behind the name. `also_written`: what
/// else writing the output changes.
[[nodiscard]] std::string check_output_place(const std::vector<std::string>& inputs, const std::string& output,
                                             std::vector<std::string> also_written = {});

}  // namespace isohf::cli
