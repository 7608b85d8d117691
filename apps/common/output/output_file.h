#pragma once

#include <functional>
#include <string>
#include <vector>

namespace isohf::cli {

/// Refuses, before anything is read, an output that is an input (by any name, or as its .part), that exists without
/// `overwrite`, or that output_place() refuses. Throws Error naming it.
/// check_place   looks at the file behind the name, which may exist; throws without the name
/// also_written  what else writing the output changes
void check_output_file(const std::vector<std::string>& inputs, const std::string& output, bool overwrite,
                       const std::function<void(const std::string& place)>& check_place = {},
                       std::vector<std::string> also_written = {});

}  // namespace isohf::cli
