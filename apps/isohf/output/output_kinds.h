#pragma once

#include <string>
#include <vector>

namespace isohf::cli {

// check_output_file() for what the commands write. Each replaces only its own kind, and the message names --overwrite
// only if it would help.

[[nodiscard]] bool is_archive_name(const std::string& name);

/// An archive replaces archives and empty files.
void check_archive_output(const std::vector<std::string>& inputs, const std::string& output, bool overwrite);
/// A raster replaces rasters of its format; so do the files beside it.
void check_raster_output(const std::vector<std::string>& inputs, const std::string& output, bool overwrite);
/// A mesh replaces meshes of its format and empty files.
void check_mesh_output(const std::vector<std::string>& inputs, const std::string& output, bool overwrite);

}  // namespace isohf::cli
