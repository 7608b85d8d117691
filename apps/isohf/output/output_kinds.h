#pragma once

#include <string>
#include <vector>

namespace isohf::cli {

// check_output_file() for what the commands write, each of which replaces only its own kind. --overwrite is not named
// where it would not help.

[[nodiscard]] bool is_archive_name(const std::string& name);

/// An archive, which replaces nothing but archives and empty files.
void check_archive_output(const std::vector<std::string>& inputs, const std::string& output, bool overwrite);
/// A raster, which with the files beside it replaces nothing but such.
void check_raster_output(const std::vector<std::string>& inputs, const std::string& output, bool overwrite);

}  // namespace isohf::cli
