#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "formats/mesh/mesh_sink.h"

namespace isohf {

/// If a name ends in .glb, .obj or .ply, in any case.
[[nodiscard]] bool is_mesh_name(const std::string& path);

/// If the format of that name also holds pictures: .glb.
[[nodiscard]] bool is_textured_mesh_name(const std::string& path);

/// If a file that begins with `head`, 4 bytes of it, is a mesh of the format that the name states.
[[nodiscard]] bool begins_as_mesh(const std::string& path, std::string_view head);

/// Begins a mesh file whose format follows from the extension of `path`.
///   .glb  glTF 2.0: x East, y up, z South; a mesh for each tile, with texture coordinates and pictures
///   .obj  Wavefront: the same axes; an object for each tile, with texture coordinates, without pictures
///   .ply  binary: x East, y North, z up; one mesh, edges between tiles repeated
/// Throws Error naming the path: kInvalidArgument (no such extension; the file exists and overwrite is not set), kIo.
[[nodiscard]] std::unique_ptr<MeshSink> create_mesh(const std::string& path, const MeshSpec& spec);

}  // namespace isohf
