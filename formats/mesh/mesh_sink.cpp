#include "formats/mesh/mesh_sink.h"

#include "isohf/error.h"

namespace isohf {

void MeshSink::write(const MeshPiece& piece, std::span<const std::byte> picture) {
  try {
    add(piece, picture);
  } catch (const Error& error) {
    throw error.within(path_);
  }
  vertices_ += static_cast<std::int64_t>(piece.vertices.size());
  triangles_ += static_cast<std::int64_t>(piece.indices.size() / 3);
}

void MeshSink::finish() {
  try {
    complete();
  } catch (const Error& error) {
    throw error.within(path_);
  }
}

}  // namespace isohf
