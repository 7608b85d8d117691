#pragma once

#include <memory>
#include <string>
#include <vector>

#include "formats/mesh/mesh_sink.h"

namespace isohf {

/// One for each format; errors do not name the path.
[[nodiscard]] std::unique_ptr<MeshSink> create_glb(const std::string& path, const MeshSpec& spec);
[[nodiscard]] std::unique_ptr<MeshSink> create_obj(const std::string& path, const MeshSpec& spec);
[[nodiscard]] std::unique_ptr<MeshSink> create_ply(const std::string& path, const MeshSpec& spec);

/// What a header says of units and origin, a line each.
[[nodiscard]] std::vector<std::string> header_lines(const MeshSpec& spec);

}  // namespace isohf
