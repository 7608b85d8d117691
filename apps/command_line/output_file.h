#pragma once

#include <string>
#include <vector>

namespace isohf::cli {

/// Refuses, before anything is read, an output that is the input (by any name, or its .part), that exists without
/// `overwrite`, that is a folder, or that lies in a folder that is missing. Throws Error.
void check_output_file(const std::string& input, const std::string& output, bool overwrite);
/// The same for several inputs.
void check_output_file(const std::vector<std::string>& inputs, const std::string& output, bool overwrite);

}  // namespace isohf::cli
